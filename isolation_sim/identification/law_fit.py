"""Fit a law alone to measured runs: the one implementation behind ``fit`` and ``diagnose``."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..laws import Device
from ..laws.law import Law, StateScaling
from ..laws.trace_check import check_differentiable
from .campaign import Campaign
from .current_basis import currents_of, group_currents
from .least_squares import Optimum, levenberg_marquardt
from .measured_runs import MeasuredRuns
from .parameterisation import Parameterisation
from .sensitivities import Motion, Simulator

STARTS = 20
SEARCHED = 24_000
"""Samples, about, on which the best starts are compared; the outcome is fitted to all."""
SCREENING_STEPS = 25
"""Steps of the search from each start with parameters that do not depend on the current."""
_ROUGH = 5000
"""Least number of samples on which poor starts are discarded."""
_LAST = 3
"""Starts that are fitted to ``SEARCHED`` samples."""
_SAFETY = 2
"""Factor on the integration steps that resolve the law: effects and noise ask for more."""
_MOST = 64
"""Largest number of integration steps per sample."""
_NOTHING_GAINED = 1e-3
"""Share of one sample's cost; a step that gains less ends a fit."""
_RESOLVED_AGAIN = 3
"""Fits with more integration steps, at most, where the last one ended unresolved."""
_MOST_ITERATIONS = 300
_VALLEY = 1e-4
"""Share of the cost; ten steps that gain less together end a fit. The cost of a law that lacks an
effect may have a long flat valley, along which the error hardly changes."""
_AS_GOOD = 1.001
"""Factor on the error of the starts' best end up to which a parameter is held, as usual, and no
state is scaled."""
_STEADY = 0.02
"""Range of a run's current, A or relative, below which it is one current."""
_NEARLY_OFF = 0.02
"""Lowest current of the data over the highest up to which a law is for no current, too."""
_UNDEFORMED = 0.1
"""First deformation over its RMS up to which a device without memory may have rested."""
_FORGOTTEN = 2.0
"""Difference of the forces after several starts of a run, over the noise, below which a law has
forgotten how the run began. Convention."""
_MOST_UNSETTLED = 0.25
"""Share of a run that may count for little since its start is unknown, at most. Convention."""
_NOT_STARTED = 3.0
"""Residual until then, over that expected from the noise and the misfit of later samples, from
which no known start is right. Noise alone exceeds 1.5 once in 10,000 runs of 20 samples. Theory."""
_SETTLED_AGAIN = 4
"""Fits with other starts, or with other samples that depend on them. Effort."""
LARGEST_DERIVATIVE = 1e100
"""A derivative of a residual beyond it has diverged, though its force has not."""
NOT_AVERAGED = 0.8
"""Factor on the error of a law behind a moving average below which the law without one shows that
the force channel has none: the harmonics of some laws look like it."""
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
        return self.data.record(force), self.data.record(jacobian @ self.parameterisation.spread)

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
        n = min(int(remembers[-1]) + 1, int(_MOST_UNSETTLED * (run.stop - run.start)))
        residual = np.square(data.force[run] - forces[chosen[k], run])
        first, later, strong, weak = (
            float(np.mean(part))
            for squares in (residual, np.square(data.force[run]))
            for part in (squares[:n], squares[n:])
        )
        # noise, and a misfit of the same share of the force as later
        expected = noise**2 + max(later - noise**2, 0.0) * strong / weak
        if first > _NOT_STARTED**2 * expected:
            result[run.start : run.start + n] = True
    return result if result.any() else None


def _same_samples(some: NDArray | None, others: NDArray | None) -> bool:
    return some is others or (
        some is not None and others is not None and np.array_equal(some, others)
    )


M = TypeVar("M", bound=LawModel)


def search_roughly(model: LawModel, start: NDArray, most: int, tolerance: float) -> Optimum:
    """Fit with few integration steps, and with more only if the forces are not finite."""
    for n_steps in (2, 8, 64):
        result = replace(model, data=model.data.with_steps(n_steps)).minimise(
            start, most, tolerance
        )
        if np.isfinite(result.cost):
            break
    return result


def parameterise(
    campaign: Campaign,
    law: Law,
    data: MeasuredRuns,
    degree: int | None = None,
    fixed: Mapping[str, float] | None = None,
    prescribed: Device | None = None,
) -> Parameterisation:
    """Choose the unknown parameters of a law for measured runs, with scales from the fitted ones.

    Where every run has one current, a scale of a state is redundant. If the parameters follow the
    current, the state is scaled to 1 at most; else the law's own redundant parameter is held. Of a
    ``prescribed`` device the one is held that it does not change with the current, at its value
    there. A current that changes within a run determines the scale.

    Raises InputError if the data cannot excite the law or do not determine the degree.
    """
    chosen = data.fitted
    x, v, force = (float(np.sqrt(np.mean(y[chosen] ** 2))) for y in (data.x, data.v, data.force))
    if not (x > 0 and v > 0 and force > 0):
        raise InputError(
            f"{campaign.name}: displacement, velocity or force is zero throughout: the data cannot "
            f"excite {law.name}"
        )
    currents = currents_of(campaign, campaign.fitted, degree)
    # the law is evaluated at the currents of held-out runs, too, and without current
    least, most = float(data.current.min()), float(data.current.max())
    span = from_off(least, most), most
    numbers: dict[str, NDArray] = {}
    held: dict[str, float | NDArray] = {**law.smoothing}
    if prescribed is not None:
        numbers = dict(zip(law.parameter_names, prescribed.current.at(currents), strict=True))
        held |= {name: _powers(currents, numbers[name]) for name in law.smoothing}
    held |= fixed or {}
    redundancy = law.redundancy
    steady = all(
        np.ptp(run.current) < _STEADY * np.max(np.abs(run.current)) + _STEADY
        for run in campaign.fitted
    )
    scaling = None
    if steady and redundancy is not None and not held.keys() & set(redundancy.among):
        name = redundancy.held
        if prescribed is None:
            if len(currents) > 1 and redundancy.scaling is not None:
                scaling = redundancy.scaling
            else:
                held[name] = redundancy.value * (force if redundancy.of_data else 1.0)
        else:
            if redundancy.scaling is not None and _is_scaled(redundancy.scaling, numbers):
                scaling = redundancy.scaling
            else:
                constant = (n for n in (name, *redundancy.among) if _is_constant(numbers[n]))
                name = next(constant, name)
                held[name] = _powers(currents, numbers[name])
    return Parameterisation(law, currents, (force, x, x / v), held, span, scaling)


def _powers(currents: NDArray, values: NDArray) -> NDArray:
    """Ascending powers of the current of a parameter with these values at the currents."""
    return np.linalg.solve(np.vander(currents, increasing=True), values)


def from_off(least: float, most: float) -> float:
    """Lowest current of a law's range, A: 0 where the lowest of the data is nearly 0."""
    return 0.0 if abs(least) < _NEARLY_OFF * most else least


def _is_scaled(scaling: StateScaling, values: Mapping[str, NDArray]) -> bool:
    """Whether a state is scaled to 1 at all currents."""
    terms = np.array([factor * values[name] for name, factor in scaling.terms.items()])
    total, size = terms.sum(axis=0), np.abs(terms).max(axis=0)
    return bool(np.all(np.abs(total - values[scaling.tied]) <= 1e-9 * size))


def _is_constant(values: NDArray) -> bool:
    """Whether a parameter, not zero, is the same at all currents."""
    return bool(np.ptp(values) <= 1e-9 * np.abs(values).max() != 0)


def fit_law(
    model: M,
    pool: ThreadPoolExecutor,
    *,
    starts: int = STARTS,
    seed: int = 0,
    start: NDArray | None = None,
    advance: Callable[[], None] = lambda: None,
) -> tuple[M, Optimum]:
    """Fit a law from many starts, and from one that is known to be good if there is one."""
    # Poor starts are discarded on thinned samples with parameters that do not depend on the
    # current. The best few then get their dependence on the current, the best three of these more
    # samples, and the best one all samples. No residual of a held-out sample is used, but a law
    # that diverges in the motion of held-out runs comes last. ``advance`` is called after each
    # start. Where there are more currents than coefficients, the costs on these more samples
    # choose between a state that is scaled and a parameter that is held.
    # Raises InputError if the law has no derivatives at rest, no start gives finite forces, or the
    # best end does not.
    p = model.parameterisation
    data = model.data
    # a motion that is never at rest needs no derivatives there
    check_differentiable(p.law, *(float(np.abs(of).min()) for of in (data.x, data.v)))
    rough = data.thinned(max(_ROUGH, len(data.x) // 6)).without_held_out()

    def search_constant(p: Parameterisation, start: NDArray) -> Optimum:
        result = search_roughly(LawModel(rough, p), start, SCREENING_STEPS, 1e-4)
        advance()
        return result

    def compare(
        p: Parameterisation, begin: Sequence[NDArray], further: Sequence[NDArray]
    ) -> list[tuple[bool, float, M, NDArray]]:
        """Ends on more samples, best first: whether it diverges, its cost, model and values."""
        near = LawModel(rough, p, begin[0])

        def search(start: NDArray) -> Optimum:
            result = search_roughly(near, start, 40, 1e-4)
            again = p.switched_on(start, result.x)
            if again is None:
                return result
            other = search_roughly(near, again, 40, 1e-4)
            return other if other.cost < result.cost else result

        tried = pool.map(search, begin)
        last = distinct(sorted(tried, key=lambda o: o.cost)[:_LAST])
        if not last:
            raise InputError(f"no start gives {p.law.name} finite forces under the measured motion")
        own = replace(model, parameterisation=p, expected=begin[0])
        thin = replace(own, data=data.thinned(SEARCHED))

        def end(start: NDArray) -> tuple[bool, float, M, NDArray]:
            here, result = thin.resolve_steps(start, 1).minimise_resolved(start, 100, 1e-4)
            force = here.forces(result.x, False)[0]
            diverges = not np.array_equal(force, thin.data.bounded(force)) or not np.all(
                np.abs(result.jacobian) < LARGEST_DERIVATIVE
            )
            return diverges or not np.isfinite(result.cost), result.cost, own, result.x

        ends = pool.map(end, [*(o.x for o in last), *further])
        return sorted(ends, key=lambda one: one[:2])

    begin = screen_starts(p, search_constant, starts, seed, pool.map)
    best = compare(p, begin, [] if start is None else [start])
    holding = p.holding()
    if holding is not None and _n_currents(data) > len(p.currents):
        held = compare(holding, [holding.convert(x, p) for x in begin], [])
        if held[0][:2] <= (best[0][0], _AS_GOOD**2 * best[0][1]):
            best = held
    for _, _, own, values in best:
        model, result = refine_law(own, values)
        # what follows these samples may still diverge on all of them
        if np.isfinite(result.cost):
            return model, result
    raise InputError(
        f"{p.law.name} diverges in {', '.join(_diverging(model, result.x))}; expected: data "
        "that the law can follow, or another law"
    )


def _diverging(model: LawModel, values: NDArray) -> list[str]:
    """Names of the fitted runs in which a law's force is not finite."""
    data = model.data
    lost = ~np.isfinite(model.forces(values, False)[0]) & data.fitted
    return [name for name, run in zip(data.names, data.runs, strict=True) if lost[run].any()]


def _n_currents(data: MeasuredRuns) -> int:
    """Number of currents of the fitted runs."""
    means = [float(np.mean(data.current[r])) for r in data.runs if data.fitted[r].any()]
    return len(group_currents(means, _STEADY * max(map(abs, means))))


def refine_law(model: M, start: NDArray, valley: float = _VALLEY) -> tuple[M, Optimum]:
    """Fit a law to all samples from near values, with runs weighted by their misfit there."""
    model, result = _refined(model, start, valley)
    if not model.data.averaging.any():
        return model, result
    without = replace(model.data, averaging=np.zeros_like(model.data.averaging))
    other, end = _refined(replace(model, data=without), result.x, valley)
    nearer = other.error(end.x) < NOT_AVERAGED * model.error(result.x)
    return (other, end) if nearer else (model, result)


def _refined(model: M, start: NDArray, valley: float) -> tuple[M, Optimum]:
    """Fit a law with the start of each run that suits it."""

    def fit(model: M, start: NDArray) -> tuple[M, Optimum]:
        model = model.resolve_steps(start).weigh(start)
        tolerance = _NOTHING_GAINED / np.sum(model.data.fitted)
        return model.minimise_resolved(start, _MOST_ITERATIONS, tolerance, valley)

    model, result = fit(model.settle_starts(start), start)
    for _ in range(_SETTLED_AGAIN):
        with_starts = model.settle_starts(result.x)
        if with_starts is model:
            break
        model, result = fit(with_starts, result.x)
    return model, result


SCREENED = 4
"""Starts that get their dependence on the current."""


def screen_starts(
    parameterisation: Parameterisation,
    minimise: Callable[[Parameterisation, NDArray], Optimum],
    number: int,
    seed: int,
    apply: Callable[..., Iterable[Any]] = map,
) -> list[NDArray]:
    """Search from many starts with parameters that do not depend on the current."""
    # These have a third of the unknowns, or half, and far fewer local minima. Returned are the ends
    # of the best few different searches, the best first, then the published numbers with their
    # dependence on the current, or random ones. ``apply``: ``map``, or that of a pool.
    steady, law = parameterisation.steady(), parameterisation.law
    result = apply(lambda start: minimise(steady, start), steady.starts(number, seed))
    keep = distinct(result)[:SCREENED]
    begin = [parameterisation.of(Device(law, steady.dependence(o.x))) for o in keep]
    return begin + parameterisation.starts(1, seed)


def distinct(result: Iterable[Optimum]) -> list[Optimum]:
    """Leave out searches without a finite cost and repeated ends; costs differ by a thousandth."""
    keep: list[Optimum] = []
    for one in sorted(result, key=lambda o: o.cost):
        if np.isfinite(one.cost) and not any(one.cost < 1.001 * o.cost for o in keep):
            keep.append(one)
    return keep
