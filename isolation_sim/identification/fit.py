"""Fit a law to measured runs: multi-start least squares with exact derivatives."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, unknown_name
from ..laws import CurrentDependence, Device
from ..laws import law as published
from ..laws.law import Law, Quantity
from ..laws.registry import LAWS
from .campaign import Campaign, read_campaign
from .current_basis import bernstein, currents_of
from .fitted import Estimate, Fit, RunError
from .least_squares import Optimum, levenberg_marquardt
from .magnitudes import magnitude
from .run_table import TestRun
from .sensitivities import Motion, Simulator


def fit(
    campaign: Campaign | str | Path,
    law: str | Law,
    *,
    current_degree: int | None = None,
    fixed: Mapping[str, float] | None = None,
    starts: int = 32,
    seed: int = 0,
    threads: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> Fit:
    """Fit a law's parameters, polynomials of the current, to a campaign.

    The sum of squared force residuals of all runs that are not held out is minimised by
    Levenberg-Marquardt steps within the law's bounds, from published numbers and from seeded random
    starts whose sizes follow from the data by each parameter's unit; the best few are refined. The
    polynomials are handled in Bernstein's form, whose coefficients' bounds hold for the polynomial
    at every current in the range.

    Parameters
    ----------
    campaign : Campaign, str or pathlib.Path
        The campaign, or its folder.
    law : str or Law
        The law, or its registry name.
    current_degree : int, optional
        Degree of the polynomials of the current; by default the highest that the currents of the
        fitted runs determine, 2 at most.
    fixed : mapping of str to float, optional
        Parameters that are not fitted, in SI units.
    starts : int, default 32
        Number of starts.
    seed : int, default 0
        Seed of the random ones.
    threads : int, optional
        Number of threads; as many as there are processors by default.
    progress : callable, optional
        Called with 1 after each start.

    Returns
    -------
    Fit
        The fitted device, its parameters with intervals, and the errors run by run.

    Raises
    ------
    InputError
        If the campaign cannot be read, a name is unknown, the currents do not determine the
        polynomials, or no start leads to finite forces.
    """
    if not isinstance(campaign, Campaign):
        campaign = read_campaign(campaign)
    if isinstance(law, str):
        if law not in LAWS:
            raise unknown_name("law", law, LAWS)
        law = LAWS[law]
    given = dict(fixed or {})
    problem = _Problem(law, campaign, campaign.fitted, current_degree, given)
    # starts are sorted out on thinned data
    rough = _Problem(law, campaign, [thinned(r) for r in campaign.fitted], current_degree, given)
    begin = rough.starts(starts, seed)

    def search(start: NDArray) -> Optimum:
        # a fast state may need more steps a sample to stay finite
        for n_steps in (2, 8, 32):
            found = rough.stepped(n_steps).minimise(start, most=30, tolerance=1e-5)
            if np.isfinite(found.cost) or not law.states:
                break
        if progress is not None:
            progress(1)
        return found

    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        found = [o for o in pool.map(search, begin) if np.isfinite(o.cost)]
    if not found:
        raise InputError(
            f"{campaign.name}: no start gives {law.name} finite forces under the measured motion"
        )
    found.sort(key=lambda o: o.cost)
    problem.resolve(found[0].x)
    best = min(
        (problem.minimise(o.x, most=300, tolerance=1e-10) for o in found[:3]), key=lambda o: o.cost
    )
    return problem.result(best)


class _Problem:
    """Least squares over the Bernstein coefficients of the parameters, over the current."""

    def __init__(
        self,
        law: Law,
        campaign: Campaign,
        runs: Sequence[TestRun],
        degree: int | None,
        fixed: dict[str, float],
    ):
        self.law, self.campaign = law, campaign
        for name in fixed:
            if name not in law.parameter_names:
                raise unknown_name(f"parameter of {law.name}", name, law.parameter_names)
        self.fixed = fixed
        self.currents = currents_of(campaign, runs, degree)
        self.free = [q for q in law.parameters if q.name not in fixed]
        # Bernstein coefficients to values at the currents, and to ascending powers
        self.basis = bernstein(self.currents)
        self.to_powers = np.linalg.solve(np.vander(self.currents, increasing=True), self.basis)
        self.motion = motion_of(runs)
        self.force = np.concatenate([run.force for run in runs])
        self.scale = self._scales(runs)
        n_powers = len(self.currents)
        names = law.parameter_names
        owner = np.repeat(np.arange(len(names)), n_powers)
        power = np.tile(np.arange(n_powers), len(names))
        self.simulator = Simulator(law, self.motion, owner, power, n_steps=2)
        self.spread = self._spread()
        self.lower = np.repeat([q.lower for q in self.free], n_powers)
        self.upper = np.repeat([q.upper for q in self.free], n_powers)
        # a parameter that the law divides by stays clear of zero
        guarded = np.repeat([q.divides for q in self.free], n_powers) & (self.lower == 0)
        self.lower[guarded] = 1e-9 * self.scale[guarded]

    def _scales(self, runs: Sequence[TestRun]) -> NDArray:
        x = np.sqrt(np.mean(np.concatenate([run.displacement for run in runs]) ** 2))
        v = np.sqrt(np.mean(np.concatenate([run.velocity for run in runs]) ** 2))
        force = np.sqrt(np.mean(self.force**2))
        if not (x > 0 and v > 0 and force > 0):
            raise InputError(
                f"{self.campaign.name}: displacement, velocity or force is zero throughout: the "
                f"data cannot excite {self.law.name}"
            )
        sizes = [magnitude(q.unit, force, x, x / v) for q in self.free]
        return np.repeat(sizes, len(self.currents))

    def _spread(self) -> NDArray:
        """(n_coefficients, n_unknowns): coefficients from the unknowns; the fixed ones apart."""
        n, names = len(self.currents), list(self.law.parameter_names)
        spread = np.zeros((len(names) * n, len(self.free) * n))
        for k, quantity in enumerate(self.free):
            at = names.index(quantity.name) * n
            spread[at : at + n, k * n : (k + 1) * n] = self.to_powers
        self.offset = np.zeros(len(names) * n)
        for name, value in self.fixed.items():
            self.offset[names.index(name) * n] = value
        return spread

    def coefficients(self, unknowns: NDArray) -> NDArray:
        """Coefficients of all parameters from the unknowns."""
        return self.spread @ unknowns + self.offset

    def residuals(self, unknowns: NDArray, derivatives: bool) -> tuple[NDArray, NDArray]:
        """Force residuals (N) of the fitted runs and their derivatives by the unknowns."""
        simulator = self.simulator.copy()
        with np.errstate(all="ignore"):
            force, jacobian = simulator.run(self.coefficients(unknowns), derivatives)
            return force - self.force, jacobian @ self.spread

    def starts(self, number: int, seed: int) -> list[NDArray]:
        """Published numbers, if there are any, then random ones of the data's magnitude."""
        random = np.random.default_rng(seed)
        begin = []
        try:
            device = published(self.law.name)
        except InputError:
            pass
        else:
            values = device.current.at(self.currents)
            chosen = [values[self.law.parameter_names.index(q.name)] for q in self.free]
            begin.append(np.concatenate(chosen) if chosen else np.zeros(0))
        while len(begin) < number:
            begin.append(np.concatenate([self._random(q, random) for q in self.free]))
        return [np.clip(start, self.lower, self.upper) for start in begin]

    def _random(self, quantity: Quantity, random: np.random.Generator) -> NDArray:
        n = len(self.currents)
        k = self.free.index(quantity)
        if np.isfinite(quantity.lower) and np.isfinite(quantity.upper):
            return np.full(n, random.uniform(quantity.lower, quantity.upper))
        size = self.scale[k * n] * 10 ** random.uniform(-1.5, 1.5)
        if quantity.lower < 0:
            size *= random.uniform(-1, 1)
        return np.full(n, max(size, quantity.lower))

    def minimise(self, start: NDArray, most: int, tolerance: float) -> Optimum:
        """Search from one start."""
        return levenberg_marquardt(self.residuals, start, self.lower, self.upper, most, tolerance)

    def stepped(self, n_steps: int) -> _Problem:
        """Return the same problem with a number of integration steps a sample."""
        other, s = copy(self), self.simulator
        other.simulator = Simulator(s.law, s.motion, s.owner, s.power, n_steps)
        return other

    def resolve(self, unknowns: NDArray) -> None:
        """Take as many integration steps a sample as the law needs at these unknowns."""
        self.simulator = self.simulator.resolved(self.coefficients(unknowns), 1e-5, most=16)

    def result(self, best: Optimum) -> Fit:
        """Put the outcome together."""
        n, names = len(self.currents), self.law.parameter_names
        rows = self.coefficients(best.x).reshape(len(names), n)
        runs = self.campaign.fitted
        low = min(float(run.current.min()) for run in runs)
        high = max(float(run.current.max()) for run in runs)
        device = Device(
            law=self.law,
            current=CurrentDependence.polynomial(dict(zip(names, rows.tolist(), strict=True))),
            current_range=(low, high) if n > 1 else (-np.inf, np.inf),
            tested_deformation=max(float(np.abs(run.displacement).max()) for run in runs),
            source=f"fitted to {self.campaign.name}",
            name=f"{self.law.name}, fitted",
        )
        estimates, notes = self._estimates(best)
        return Fit(
            device=device,
            campaign=self.campaign,
            estimates=estimates,
            errors=self._errors(self.campaign.runs, self.coefficients(best.x)),
            notes=notes,
            converged=best.converged,
        )

    def _errors(self, runs: Sequence[TestRun], theta: NDArray) -> tuple[RunError, ...]:
        motion = motion_of(runs)
        simulator = Simulator(
            self.law, motion, self.simulator.owner, self.simulator.power, self.simulator.n_steps
        )
        force = simulator.run(theta, derivatives=False)[0]
        parts = np.split(force, motion.starts[1:-1])
        return tuple(RunError(run, part) for run, part in zip(runs, parts, strict=True))

    def _estimates(self, best: Optimum) -> tuple[tuple[Estimate, ...], tuple[str, ...]]:
        """Values with 95 % intervals from the curvature; what the data leave open."""
        residual = self.residuals(best.x, False)[0]
        size = np.maximum(np.abs(best.x), 1e-12 * self.scale)
        scaled = best.jacobian * size
        n = len(self.currents)
        at_currents = np.kron(np.eye(len(self.free)), self.basis)
        n_unknowns = len(best.x)
        variance = float(residual @ residual) / max(len(residual) - n_unknowns, 1)
        variance *= _correlation_length(residual, self.motion.starts)
        _, s, vt = np.linalg.svd(scaled.T @ scaled)
        kept = s > s[0] * 1e-13
        covariance = (vt[kept].T / s[kept]) @ vt[kept] * variance
        to_values = at_currents * size
        covariance = to_values @ covariance @ to_values.T
        values = at_currents @ best.x
        half = 1.96 * np.sqrt(np.diag(covariance))
        # whatever basis of the open directions the decomposition has chosen
        undirected = np.linalg.norm(vt[~kept], axis=0) > 0.3
        at_bound = (best.x <= self.lower) | (best.x >= self.upper)
        loose = (np.abs(at_currents) > 1e-9) @ (undirected | at_bound)
        estimates = []
        for k, quantity in enumerate(self.free):
            for j, current in enumerate(self.currents):
                i = k * n + j
                estimates.append(
                    Estimate(
                        name=quantity.name,
                        unit=quantity.unit,
                        current=float(current) if n > 1 else None,
                        value=float(values[i]),
                        low=float(max(values[i] - half[i], quantity.lower)),
                        high=float(min(values[i] + half[i], quantity.upper)),
                        determined=bool(half[i] < abs(values[i]) and not loose[i]),
                    )
                )
        return tuple(estimates), self._notes(estimates, covariance, best)

    def _notes(
        self, estimates: Sequence[Estimate], covariance: NDArray, best: Optimum
    ) -> tuple[str, ...]:
        notes = []
        left = [e.label for e in estimates if not e.determined]
        if left:
            notes.append("the data do not determine " + ", ".join(left))
        spread = np.sqrt(np.diag(covariance)) + 1e-150
        correlation = covariance / np.outer(spread, spread)
        for i in range(len(estimates)):
            for j in range(i):
                a, b = estimates[j], estimates[i]
                if abs(correlation[i, j]) > 0.99 and a.determined and b.determined:
                    notes.append(
                        f"{a.label} and {b.label} can hardly be told apart (correlation "
                        f"{correlation[i, j]:.3f})"
                    )
        if not best.converged:
            notes.append("the search ended before it converged")
        return tuple(notes)


def thinned(run: TestRun, most: int = 600) -> TestRun:
    """Leave samples of a run out, evenly, so that no more than about ``most`` remain.

    Parameters
    ----------
    run : TestRun
        A run.
    most : int
        Wanted number of samples.

    Returns
    -------
    TestRun
    """
    every = slice(None, None, max(len(run.time) // most, 1))
    return replace(
        run,
        time=run.time[every],
        displacement=run.displacement[every],
        velocity=run.velocity[every],
        force=run.force[every],
        current=run.current[every],
        acceleration=None,
        temperature=None,
    )


def motion_of(runs: Sequence[TestRun]) -> Motion:
    """Measured motion of several runs, one after another.

    Parameters
    ----------
    runs : sequence of TestRun
        The runs.

    Returns
    -------
    Motion
    """
    lengths = [len(run.time) for run in runs]
    return Motion(
        starts=np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64),
        displacement=np.concatenate([run.displacement for run in runs]),
        velocity=np.concatenate([run.velocity for run in runs]),
        current=np.concatenate([run.current for run in runs]),
        dt=np.array([(run.time[-1] - run.time[0]) / (len(run.time) - 1) for run in runs]),
    )




def _correlation_length(residual: NDArray, starts: NDArray) -> float:
    """Factor by which correlated residuals carry less information than as many free ones."""
    total, lags = 0.0, 64
    spectrum = np.zeros(lags)
    for start, stop in pairwise(starts):
        part = residual[start:stop]
        part = part - part.mean()
        for lag in range(min(lags, len(part))):
            spectrum[lag] += part[: len(part) - lag] @ part[lag:]
    if spectrum[0] <= 0:
        return 1.0
    for lag in range(1, lags):
        if spectrum[lag] <= 0.05 * spectrum[0]:
            break
        total += spectrum[lag] / spectrum[0]
    return 1.0 + 2.0 * total
