"""Fit a law to measured runs: multi-start least squares with exact derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..laws import Device
from ..laws.law import Law
from ..laws.registry import LAWS
from ..laws.trace_check import check_traceable
from .campaign import Campaign, read_campaign
from .current_basis import currents_of
from .fitted import Estimate, Fit, RunError, labels, noise_of
from .least_squares import Optimum, levenberg_marquardt
from .multistart import different, promising
from .noise import correlation_time
from .run_table import TestRun
from .sensitivities import Motion, Simulator
from .unknowns import Unknowns
from .velocity import smooth
from .workers import workers

_FAR_ABOVE = 3.0
"""Residual over the forces' noise that a law is noted for: the motion's noise makes up to two."""
_LEAST_NOISE = 2e-3
"""Of the force's RMS: numerical errors and a load cell's bits are no lack of the law."""
_NOTHING_GAINED = 1e-3
"""Part of what one sample's noise costs; a step that gains less ends a fit."""


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
    Levenberg-Marquardt steps within the law's bounds. The displacement is smoothed within its noise
    first. The search begins from published numbers and from seeded random starts whose sizes follow
    from the data by each parameter's unit. They are sorted out with parameters that do not depend
    on the current; the best few then get their dependence, and the best two of these all samples.
    The polynomials are handled in Bernstein's form, whose coefficients' bounds hold for the
    polynomial at every current in the range.

    Parameters
    ----------
    campaign : Campaign, str or pathlib.Path
        The campaign, or its folder.
    law : str or Law
        The law, its registry name, or a place such as ``"my_laws.py:CUBIC"``.
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
        law = LAWS[law]
    check_traceable(law)
    if starts < 1:
        raise InputError(f"starts is {starts}; accepted: 1 or more")
    given = dict(fixed or {})
    runs = [smoothed(run) for run in campaign.fitted]
    problem = _Problem(law, campaign, runs, current_degree, given)
    # starts are sorted out on thinned data
    rough = _Problem(law, campaign, [thinned(run) for run in runs], current_degree, given)

    def search(unknowns: Unknowns, start: NDArray) -> Optimum:
        # a fast state may need more steps a sample to stay finite
        for n_steps in (2, 8, 32):
            found = rough.over(unknowns, n_steps).minimise(start, most=30, tolerance=1e-4)
            if np.isfinite(found.cost) or not law.states:
                break
        return found

    def search_steady(unknowns: Unknowns, start: NDArray) -> Optimum:
        found = search(unknowns, start)
        if progress is not None:
            progress(1)
        return found

    unknowns = rough.unknowns
    with workers(threads) as pool:
        begin = promising(unknowns, search_steady, pool, starts, seed)
        found = different(pool.map(lambda start: search(unknowns, start), begin))
    if not found:
        raise InputError(
            f"{campaign.name}: no start gives {law.name} finite forces under the measured motion"
        )
    best = min(
        (problem.minimise(o.x, most=60, tolerance=1e-6) for o in found[:2]), key=lambda o: o.cost
    )
    problem.resolve(best.x)
    tolerance = _NOTHING_GAINED / len(problem.force)
    return problem.result(problem.minimise(best.x, most=300, tolerance=tolerance))


class _Problem:
    """Least squares over the unknown parameters of a law."""

    def __init__(
        self,
        law: Law,
        campaign: Campaign,
        runs: Sequence[TestRun],
        degree: int | None,
        fixed: dict[str, float],
    ):
        self.law, self.campaign = law, campaign
        self.motion = motion_of(runs)
        self.force = np.concatenate([run.force for run in runs])
        currents = currents_of(campaign, runs, degree)
        self.unknowns = Unknowns(law, currents, self._sizes(runs), fixed)
        owner, power = self.unknowns.owner, self.unknowns.power
        self.simulator = Simulator(law, self.motion, owner, power, n_steps=2)

    def _sizes(self, runs: Sequence[TestRun]) -> tuple[float, float, float]:
        x = np.sqrt(np.mean(np.concatenate([run.displacement for run in runs]) ** 2))
        v = np.sqrt(np.mean(np.concatenate([run.velocity for run in runs]) ** 2))
        force = np.sqrt(np.mean(self.force**2))
        if not (x > 0 and v > 0 and force > 0):
            raise InputError(
                f"{self.campaign.name}: displacement, velocity or force is zero throughout: the "
                f"data cannot excite {self.law.name}"
            )
        return float(force), float(x), float(x / v)

    def residuals(self, values: NDArray, derivatives: bool) -> tuple[NDArray, NDArray]:
        """Force residuals (N) of the fitted runs and their derivatives by the unknowns."""
        simulator = self.simulator.copy()
        with np.errstate(all="ignore"):
            force, jacobian = simulator.run(self.unknowns.coefficients(values), derivatives)
            return force - self.force, jacobian @ self.unknowns.spread

    def minimise(self, start: NDArray, most: int, tolerance: float) -> Optimum:
        """Search from one start."""
        unknowns = self.unknowns
        return levenberg_marquardt(
            self.residuals, start, unknowns.lower, unknowns.upper, most, tolerance
        )

    def over(self, unknowns: Unknowns, n_steps: int) -> _Problem:
        """Return the same problem over other unknowns, with so many integration steps a sample."""
        other = copy(self)
        other.unknowns = unknowns
        other.simulator = Simulator(self.law, self.motion, unknowns.owner, unknowns.power, n_steps)
        return other

    def resolve(self, values: NDArray) -> None:
        """Take as many integration steps a sample as the law needs at these unknowns."""
        coefficients = self.unknowns.coefficients(values)
        self.simulator = self.simulator.resolved(coefficients, 1e-5, most=16)

    def result(self, best: Optimum) -> Fit:
        """Put the outcome together."""
        runs = self.campaign.fitted
        low = min(float(run.current.min()) for run in runs)
        high = max(float(run.current.max()) for run in runs)
        device = Device(
            law=self.law,
            current=self.unknowns.dependence(best.x),
            current_range=(low, high) if len(self.unknowns.currents) > 1 else (-np.inf, np.inf),
            tested_deformation=max(float(np.abs(run.displacement).max()) for run in runs),
            tested_current=high,
            source=f"fitted to {self.campaign.name}",
            name=f"{self.law.name}, fitted",
        )
        estimates, notes = self._estimates(best)
        return Fit(
            device=device,
            campaign=self.campaign,
            estimates=estimates,
            errors=self._errors(self.campaign.runs, self.unknowns.coefficients(best.x)),
            notes=notes,
            converged=best.converged,
        )

    def _errors(self, runs: Sequence[TestRun], theta: NDArray) -> tuple[RunError, ...]:
        motion = motion_of([smoothed(run) for run in runs])
        simulator = Simulator(
            self.law, motion, self.simulator.owner, self.simulator.power, self.simulator.n_steps
        )
        force = simulator.run(theta, derivatives=False)[0]
        parts = np.split(force, motion.starts[1:-1])
        return tuple(RunError(run, part) for run, part in zip(runs, parts, strict=True))

    def _estimates(self, best: Optimum) -> tuple[tuple[Estimate, ...], tuple[str, ...]]:
        """Values with 95 % intervals from the curvature; what the data leave open."""
        unknowns = self.unknowns
        residual = self.residuals(best.x, False)[0]
        size = np.maximum(np.abs(best.x), 1e-12 * unknowns.scale)
        scaled = best.jacobian * size
        n = len(unknowns.currents)
        at_currents = np.kron(np.eye(len(unknowns.free)), unknowns.basis)
        n_unknowns = len(best.x)
        variance = float(residual @ residual) / max(len(residual) - n_unknowns, 1)
        variance *= correlation_time(residual, self.motion.starts)
        _, s, vt = np.linalg.svd(scaled.T @ scaled)
        kept = s > s[0] * 1e-13
        covariance = (vt[kept].T / s[kept]) @ vt[kept] * variance
        to_values = at_currents * size
        covariance = to_values @ covariance @ to_values.T
        values = at_currents @ best.x
        half = 1.96 * np.sqrt(np.diag(covariance))
        # whatever basis of the open directions the decomposition has chosen
        undirected = np.linalg.norm(vt[~kept], axis=0) > 0.3
        at_bound = (best.x <= unknowns.lower) | (best.x >= unknowns.upper)
        loose = (np.abs(at_currents) > 1e-9) @ (undirected | at_bound)
        estimates = []
        for k, quantity in enumerate(unknowns.free):
            for j, current in enumerate(unknowns.currents):
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
        left = labels([e for e in estimates if not e.determined])
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
        error = float(np.sqrt(2 * best.cost / np.sum(self.force**2)))
        noise = noise_of(self.campaign.fitted)
        if error > _FAR_ABOVE * max(noise, _LEAST_NOISE):
            ratio = error / max(noise, 1e-6)
            notes.append(
                f"the residual ({100 * error:.1f} %) is {ratio:.0f} times the data's own "
                f"noise ({100 * noise:.2g} %): the law lacks something; isolation-sim diagnose "
                "says what"
            )
        return tuple(notes)


def smoothed(run: TestRun) -> TestRun:
    """Smooth the displacement of a run within its noise, which would bend the parameters.

    Parameters
    ----------
    run : TestRun
        A run.

    Returns
    -------
    TestRun
    """
    return replace(run, displacement=smooth(run.displacement, run.step)[0])


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
