"""A law under the motion of measured runs, as a least-squares problem."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from .least_squares import Optimum, levenberg_marquardt
from .measured_runs import MeasuredRuns
from .parameterisation import Parameterisation
from .sensitivities import Motion, Simulator

_SAFETY = 2
"""Factor on the integration steps that resolve the law: effects and noise ask for more."""
_MOST = 64
"""Largest number of integration steps per sample."""
_RESOLVED_AGAIN = 8
"""Fits with more integration steps, at most, where the last one ended unresolved."""
_UNDEFORMED = 0.1
"""First deformation over its RMS up to which a device without memory may have rested."""
_FORGOTTEN = 2.0
"""Difference of the forces after several starts of a run, over the noise, below which a law has
forgotten how the run began. Convention."""
_MOST_UNSETTLED = 0.25
"""Share of a run that may count for little since its start is unknown, at most. Convention."""
_MOST_OF_A_PART = 0.5
"""The same of a run that is less than a cycle: before it turns it may remember all the time."""
_NOT_STARTED = 3.0
"""Residual until then, over that expected from the noise and the misfit of later samples, from
which no known start is right. Noise alone exceeds 1.5 once in 10,000 runs of 20 samples. Theory."""
_SPRING = 3.0
"""Deviation of a parameter from its expected value, over its size, that weighs as much as one
standard deviation of one sample."""
STEP_ERROR = 2e-4
"""Relative error of the force below which the integration steps resolve a law."""


def coarse_step_error(missed: float, share: float, most: float) -> float:
    """Error of integration for a law that misses data: a share of that, within limits."""
    return max(STEP_ERROR, min(share * missed, most))


@dataclass(frozen=True, eq=False)
class LawModel:
    """A law under the motion of measured runs, as a least-squares problem."""

    data: MeasuredRuns  # The runs
    parameterisation: Parameterisation  # Unknown parameters of the law
    # (n_unknowns,) array or None: Values about which the law's parameters are sought; see
    # ``minimise``
    expected: NDArray | None = None
    # (n_unknowns,) array or None: Values that fit nearly as well, inside the law's bounds, where
    # a parameter of the best ones is at its own
    inside: NDArray | None = None
    # (n_values,) bool or None: Values that a fit leaves as they are
    held: NDArray | None = None
    step_error: float = STEP_ERROR  # Relative error of the force that integration may leave

    @property
    def n_law(self) -> int:
        """Number of the law's unknown parameters."""
        return len(self.parameterisation.scale)

    def bounds(self) -> tuple[NDArray, NDArray]:
        """Lower and upper bounds of all values."""
        return self.parameterisation.lower, self.parameterisation.upper

    def error(self, values: NDArray) -> float:
        """Error on the fitted samples over the RMS of their force."""
        data = self.data
        force = data.bounded(self.forces(values, False)[0])
        return data.relative(force - data.force, data.fitted)

    def simulator(self, motion: Motion | None = None) -> Simulator:
        """Compiled law under the measured motion, or another one."""
        p, data = self.parameterisation, self.data
        motion = motion or data.motion
        return Simulator(p.law, motion, p.n_powers, data.n_steps, data.stiff)

    # trial values far from the data may overflow: their cost is infinite
    @np.errstate(all="ignore")
    def forces(self, values: NDArray, derivatives: bool) -> tuple[NDArray, NDArray]:
        """Force of all samples, (n_samples,), N, and its derivatives, (n_samples, n_values)."""
        force, jacobian = self.simulator().run(
            self.parameterisation.coefficients(values), derivatives
        )
        changes = self.data.record_changes(jacobian @ self.parameterisation.spread)
        return self.data.record(force), changes

    @np.errstate(all="ignore")
    def residuals(self, values: NDArray, derivatives: bool) -> tuple[NDArray, NDArray]:
        """Residuals of the fitted samples over their noise, (n_fitted,), and their derivatives."""
        force, jacobian = self.forces(values, derivatives)
        data = self.data
        residual = (force - data.force) * data.weight
        if data.fitted.all():
            jacobian *= data.weight[: len(jacobian), np.newaxis]
            return residual, jacobian
        fitted = data.fitted
        if derivatives:
            jacobian = jacobian[fitted] * data.weight[fitted, np.newaxis]
        return residual[fitted], jacobian

    def minimise(
        self, start: NDArray, most: int = 20, tolerance: float = 1e-5, valley: float = 0.0,
        secants: bool = False,
    ) -> Optimum:  # fmt: skip
        """Fit all values; cost and derivatives of the result are those of the data alone."""
        # A weak spring holds the law's parameters near ``expected``. Parameters that few runs leave
        # open do not diverge, and the law stays usable for other runs.
        lower, upper = self.bounds()
        if self.held is not None:
            lower, upper = (np.where(self.held, start, bound) for bound in (lower, upper))
        if self.expected is None:
            return levenberg_marquardt(
                self.residuals, start, lower, upper, most, tolerance, valley=valley, secants=secants
            )
        n, expected = self.n_law, self.expected

        def held(values: NDArray, derivatives: bool) -> tuple[NDArray, NDArray]:
            residual, jacobian = self.residuals(values, derivatives)
            away, slopes = self.parameterisation.deviations(values[:n], expected)
            residual = np.concatenate([residual, away / _SPRING])
            if derivatives:
                pull = np.zeros((n, len(start)))
                pull[:, :n] = slopes / _SPRING
                jacobian = np.concatenate([jacobian, pull])
            return residual, jacobian

        result = levenberg_marquardt(
            held, start, lower, upper, most, tolerance, valley=valley, secants=secants
        )
        rows = len(result.residual) - n
        residual = result.residual[:rows]
        cost = float(np.nan_to_num(0.5 * np.vdot(residual, residual), nan=np.inf))
        return replace(result, cost=cost, residual=residual, jacobian=result.jacobian[:rows])

    def resolve_steps(self, values: NDArray, safety: int = _SAFETY) -> Self:
        """Return the model with as many integration steps per sample as the law needs.

        Runs that have Rosenbrock steps keep them.
        """
        coefficients = self.parameterisation.coefficients(values[: self.n_law])
        coarse = LawModel(
            self.data.with_steps(1, self.data.stiff), self.parameterisation
        ).simulator()
        resolved = coarse.resolved(coefficients, self.step_error, most=_MOST)
        # the largest number was not compared with a finer one
        n_steps = resolved.n_steps * np.where(resolved.n_steps < _MOST, safety, _SAFETY)
        return replace(self, data=self.data.with_steps(n_steps, resolved.stiff))

    def minimise_resolved(
        self, start: NDArray, most: int, tolerance: float, valley: float = 0.0
    ) -> tuple[Self, Optimum]:
        """Fit to the fitted runs, again with more steps where they do not resolve the end."""
        model = self
        for _ in range(_RESOLVED_AGAIN):
            data = model.data
            inside = replace(model, data=data.without_held_out())
            result = inside.minimise(start, most, tolerance, valley)
            if not np.isfinite(result.cost):  # a stiff law diverges with too long steps
                model = replace(model, data=data.with_steps(2 * data.n_steps, data.stiff))
                continue
            start, there = result.x, model.resolve_steps(result.x, 1).data
            enough = (data.n_steps >= there.n_steps) & (data.stiff == there.stiff)
            if enough.all():
                break
            more = np.where(enough, data.n_steps, _SAFETY * there.n_steps)
            model = replace(model, data=data.with_steps(more, there.stiff))
        return model, result

    def settle_starts(self, values: NDArray) -> Self:
        """Let each run that may begin in motion or at rest begin where its force is nearer."""
        data = self.data
        unknown = data.return_times.any(axis=1)
        if not unknown.any():
            return self

        def force(begin: NDArray) -> NDArray:
            here = replace(data, periods=np.where(unknown, begin, data.periods))
            return data.bounded(replace(self, data=here).forces(values, False)[0])

        unsettled = None
        if self.parameterisation.law.states:
            begin = np.column_stack([np.zeros_like(data.dt), data.return_times])
            forces = [force(one) for one in begin.T]
            # all samples of a run alike
            weight = replace(data, unsettled=None).weight
            squares = [((one - data.force) * weight) ** 2 for one in forces]
            least = np.argmin(np.add.reduceat(squares, data.starts[:-1], axis=1), axis=0)
            chosen = begin[np.arange(len(least)), least]
            unsettled = _unsettled(data, begin, np.array(forces), least)
        else:  # a device that has rested is not deformed
            sizes = np.array([np.std(data.x[run]) for run in data.runs])
            deformed = np.abs(data.x[data.starts[:-1]]) > _UNDEFORMED * sizes
            chosen = np.where(deformed, data.return_times[:, 0], 0.0)
        periods = np.where(unknown, chosen, data.periods)
        same = np.array_equal(periods, data.periods)
        if same and _same_samples(unsettled, data.unsettled):
            return self
        return replace(self, data=replace(data, periods=periods, unsettled=unsettled))

    def weigh(self, values: NDArray) -> Self:
        """Return the model with its runs weighed by noise and by the misfit at these values."""
        return replace(self, data=self.data.weigh(self.forces(values, False)[0]))


def _unsettled(
    data: MeasuredRuns, begin: NDArray, forces: NDArray, chosen: NDArray
) -> NDArray | None:
    """Samples at whose forces a law has not forgotten how its run began, where no start is right.

    ``forces``, (n_starts, n_samples), follow the starts ``begin``, (n_runs, n_starts).
    """
    result = np.zeros(len(data.force), bool)
    for k, run in enumerate(data.runs):
        starts = np.unique(begin[k], return_index=True)[1]
        if len(starts) < 2:
            continue
        noise = float(data.assumed_noise[k])
        remembers = np.flatnonzero(np.ptp(forces[starts, run], axis=0) > _FORGOTTEN * noise)
        if not remembers.size:
            continue
        length = run.stop - run.start
        never_returns = np.max(begin[k]) > (length - 1.5) * data.dt[k]
        residual = np.square(data.force[run] - forces[chosen[k], run])
        shares = (_MOST_OF_A_PART, _MOST_UNSETTLED) if never_returns else (_MOST_UNSETTLED,)
        for most in shares:
            n = min(int(remembers[-1]) + 1, int(most * length))
            first, later, strong, weak = (
                float(np.mean(part))
                for squares in (residual, np.square(data.force[run]))
                for part in (squares[:n], squares[n:])
            )
            # noise, and a misfit of the same share of the force as later
            expected = noise**2 + max(later - noise**2, 0.0) * strong / weak
            if first > _NOT_STARTED**2 * expected:
                result[run.start : run.start + n] = True
                break
    return result if result.any() else None


def _same_samples(some: NDArray | None, others: NDArray | None) -> bool:
    return some is others or (
        some is not None and others is not None and np.array_equal(some, others)
    )
