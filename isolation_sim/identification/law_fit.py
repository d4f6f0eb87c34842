"""Fit a law alone to measured runs: the one implementation behind ``fit`` and ``diagnose``."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..laws import Device
from ..laws.law import Law, StateScaling
from ..laws.trace_check import check_differentiable
from .campaign import Campaign
from .current_basis import currents_of, group_currents
from .law_model import LawModel
from .least_squares import Optimum
from .measured_runs import MeasuredRuns
from .parameterisation import Parameterisation
from .sensitivities import has_stiff_steps

STARTS = 20
SEARCHED = 24_000
"""Samples, about, on which the best starts are compared; the outcome is fitted to all."""
SCREENING_STEPS = 25
"""Steps of the search from each start with parameters that do not depend on the current."""
_ROUGH = 5000
"""Least number of samples on which poor starts are discarded."""
_LAST = 3
"""Starts that are fitted to ``SEARCHED`` samples."""
_NOTHING_GAINED = 1e-3
"""Share of one sample's cost; a step that gains less ends a fit."""
_MOST_ITERATIONS = 300
_VALLEY = 1e-4
"""Share of the cost; ten steps that gain less together end a fit. The cost of a law that lacks an
effect may have a long flat valley, along which the error hardly changes."""
_AS_GOOD = 1.001
"""Factor on the error of the starts' best end up to which a parameter is held, as usual, and no
state is scaled."""
_NEARLY_AS_GOOD = 1.25
"""Factor on the best end's cost up to which another end may be the right one, beside an effect that
the law lacks. Convention."""
_STEADY = 0.02
"""Range of a run's current, A or relative, below which it is one current."""
_NEARLY_OFF = 0.02
"""Lowest current of the data over the highest up to which a law is for no current, too."""
_SETTLED_AGAIN = 4
"""Fits with other starts, or with other samples that depend on them. Effort."""
LARGEST_DERIVATIVE = 1e100
"""A derivative of a residual beyond it has diverged, though its force has not."""
NOT_AVERAGED = 0.8
"""Factor on the error of a law behind a moving average below which the law without one shows that
the force channel has none: the harmonics of some laws look like it."""


M = TypeVar("M", bound=LawModel)


def search_roughly(model: LawModel, start: NDArray, most: int, tolerance: float) -> Optimum:
    """Fit with few integration steps, and with others only if the forces are not finite."""
    for n_steps, stiff in ((2, False), (8, False), (64, False), (8, True)):
        if stiff and not has_stiff_steps(model.parameterisation.law):
            break
        data = model.data.with_steps(n_steps, stiff)
        result = replace(model, data=data).minimise(start, most, tolerance)
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

        tried = sorted(pool.map(search, begin), key=lambda o: o.cost)
        last = distinct(tried[:_LAST])
        if not last:
            raise InputError(f"no start gives {p.law.name} finite forces under the measured motion")
        own = replace(model, parameterisation=p, expected=begin[0], inside=_inside(p, tried))
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


def _inside(p: Parameterisation, tried: Sequence[Optimum]) -> NDArray | None:
    """Of ends, the best first, one inside the bounds that is nearly as good as one at a bound."""
    best = tried[0]
    if not p.ends_at_bound(best.x):
        return None
    near = (one.x for one in tried if one.cost < _NEARLY_AS_GOOD * best.cost)
    return next((x for x in near if not p.ends_at_bound(x)), None)


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
