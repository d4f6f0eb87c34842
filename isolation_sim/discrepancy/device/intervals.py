"""How well a diagnosis knows its numbers, the noise of the measured motion included."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from ...effects.effect import EffectParameter
from ...identification.least_squares import levenberg_marquardt
from ...identification.measured.noise import correlation_time
from ...identification.motion_noise import (
    INTERVAL_EXAMPLES,
    errors_by_motion,
    interval_of,
    motion_noise,
)
from ..decisions import BOUND_NEEDED, OFF_BOUND, VANISHES
from ..inference import at_bound, half_widths
from ..interval import Interval
from .model import FittedModel, Model


def intervals(final: FittedModel, shifts: NDArray, seed: int = 0) -> list[dict[str, Interval]]:
    """95 % intervals of each effect's parameters, fitted together with everything else."""
    # Noise of the force spreads the numbers, noise of the displacement also shifts them: smoothing
    # takes a part of the motion away, and what is left of the noise looks like motion. The interval
    # lies about what is left after the shift; the value remains the fitted one, which is the best
    # under motion measured like this.
    half = _by_force_noise(final)
    if not np.any(final.model.data.displacement_noise > 0):
        return _intervals(final.model, final.values, final.values, half)
    more = motion_noise(final.model.data, INTERVAL_EXAMPLES - len(shifts), seed + 1)
    shift, by_motion = interval_of(errors_by_motion(final.model, final.values, [*shifts, *more]))
    return _intervals(final.model, final.values, final.values - shift, np.hypot(half, by_motion))


def may_be_zero(final: FittedModel, place: int, numbers: Mapping[str, Interval]) -> bool:
    """Whether the interval of an effect's size is finite and holds zero, where little is left."""
    effect, at = final.effects[place], final.model.slices()[place]
    size = numbers[effect.parameters[effect.magnitude].name]
    if not (size.low <= 0.0 <= size.high and np.isfinite(size.high - size.low)):
        return False
    # the search has found that the force's noise does not stand for the effect: where it hides the
    # size alone, another number makes up for that, such as the path over which a loss is reached
    its_size = at.start + effect.magnitude
    if final.values[its_size] < _by_force_noise(final)[its_size]:
        return False
    # other numbers may keep an effect up: the slow part of a lag without its quick one
    nothing = final.values.copy()
    nothing[its_size] = 0.0
    others = final.values_without(place)
    without = final.model.without(place).forces(others, False)[0]
    left = np.linalg.norm(final.model.forces(nothing, False)[0] - without)
    return bool(left < VANISHES * np.linalg.norm(final.force - without))


def linear_intervals(
    model: Model, values: NDArray, residual: NDArray, jacobian: NDArray, memory: float = 1.0
) -> list[dict[str, Interval]]:
    """95 % intervals of each effect's parameters by the residuals' derivatives."""
    return _intervals(model, values, values, _half_widths(residual, jacobian, memory))


def _by_force_noise(final: FittedModel) -> NDArray:
    """Half of the 95 % intervals of all values by the noise of the force alone."""
    memory = correlation_time(final.residual, _starts_of_fitted(final))
    return _half_widths(final.residual, final.jacobian, memory)


def _half_widths(residual: NDArray, jacobian: NDArray, memory: float) -> NDArray:
    """A residual resembles its neighbours over ``memory`` samples."""
    n, n_values = jacobian.shape
    return half_widths(jacobian, memory * float(residual @ residual) / max(n - n_values, 1))


def _intervals(
    model: Model, values: NDArray, middle: NDArray, half: NDArray
) -> list[dict[str, Interval]]:
    """Intervals about a middle, which hold the values and end at the bounds."""
    low, high = np.minimum(values, middle - half), np.maximum(values, middle + half)
    return [
        {
            quantity.name: _interval(
                model, quantity, float(values[k]), float(low[k]), float(high[k]),
                is_size=k == place.start + effect.magnitude,
            )
            for k, quantity in enumerate(effect.parameters, place.start)
        }
        for effect, place in zip(model.effects, model.slices(), strict=True)
    ]  # fmt: skip


_NO_END = 1e9
"""An upper end so many times the value is none."""


def _interval(
    model: Model, quantity: EffectParameter, value: float, low: float, high: float, is_size: bool
) -> Interval:
    """One interval within the bounds; one that holds all allowed values determines none."""
    least, most = model.lower(quantity), model.upper(quantity)
    bound = at_bound(value, least, most)
    if np.isinf(most) and high > _NO_END * max(abs(value), least):
        high = np.inf
    # an effect's size is compared with zero, its lower bound
    if low <= least and high >= most and not is_size:
        return Interval(value, -np.inf, np.inf, quantity.unit, bound)
    return Interval(value, max(low, least), min(high, most), quantity.unit, bound)


def _starts_of_fitted(final: FittedModel) -> NDArray:
    data = final.model.data
    counts = [int(np.sum(data.fitted[run])) for run in data.runs]
    return np.concatenate([[0], np.cumsum([c for c in counts if c])])


_STEPS = 6
"""Steps in which the other values follow."""


def needs_bound(searched: FittedModel, place: int, gain: float) -> bool:
    """Whether an effect loses its gain if its values leave their bounds, the others following."""
    return any(
        _cost_at(searched, {k: inside}) - searched.cost > BOUND_NEEDED * gain
        for k, inside in values_at_bounds(searched, place)
    )


def acts_as_another(searched: FittedModel, place: int, gain: float) -> list[str]:
    """Values of an effect at a bound where it is another effect, or all that keep its gain there.

    Of two arms of relaxation one may be a spring.
    """
    model = searched.model
    parameters = searched.effects[place].parameters
    bounds = {
        k: other if np.isfinite(other) else model.upper(quantity)
        for k, quantity in enumerate(parameters, model.slices()[place].start)
        for other in quantity.other
    }
    if not bounds:
        return []
    there = [k for k, bound in bounds.items() if searched.values[k] == bound]
    if _cost_at(searched, bounds) - searched.cost <= BOUND_NEEDED * gain:
        there = list(bounds)
    return [parameters[k - model.slices()[place].start].name for k in there]


def values_at_bounds(searched: FittedModel, place: int) -> Iterator[tuple[int, float]]:
    """Places of an effect's values at bounds that make no plainer one, and values inside these."""
    effect, model = searched.effects[place], searched.model
    for k, quantity in enumerate(effect.parameters, model.slices()[place].start):
        lower, upper = model.lower(quantity), model.upper(quantity)
        value = float(searched.values[k])
        if at_bound(value, lower, upper) and _nearest(value, lower, upper) not in quantity.plain:
            yield k, _inside(value, lower, upper)


def _nearest(value: float, lower: float, upper: float) -> float:
    """The bound nearest to a value."""
    return lower if value - lower < upper - value else upper


def _inside(value: float, lower: float, upper: float) -> float:
    """A value a share of the range away from the bound at which it lies."""
    from_below = _nearest(value, lower, upper) == lower
    if lower > 0 and upper > 100 * lower:
        return value * (1 + OFF_BOUND) if from_below else value / (1 + OFF_BOUND)
    if not np.isfinite(upper - lower):
        return value + OFF_BOUND * (1 if from_below else -1) * max(abs(value), 1e-12)
    return value + OFF_BOUND * (upper - lower) * (1 if from_below else -1)


def _cost_at(searched: FittedModel, given: Mapping[int, float]) -> float:
    """Least cost found with some values given."""
    # a whole step of the others may lead far off
    values = searched.values.copy()
    lower, upper = (bound.copy() for bound in searched.model.bounds())
    for k, value in given.items():
        values[k] = lower[k] = upper[k] = value
    problem = searched.model.residuals
    return 2 * levenberg_marquardt(problem, values, lower, upper, _STEPS, 1e-3).cost
