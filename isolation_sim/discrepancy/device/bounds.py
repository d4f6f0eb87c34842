"""Whether data ask for a value at the bound of its range, or only do not determine it."""

from __future__ import annotations

import numpy as np

from ...identification.least_squares import DETERMINED, unit_columns
from ..decisions import BOUND_NEEDED, OFF_BOUND
from ..inference import at_bound
from .model import FittedModel

_STEPS = 6
"""Steps in which the other values follow."""


def needs_bound(searched: FittedModel, place: int, gain: float) -> bool:
    """Whether an effect loses its gain if its values leave their bounds, the others following."""
    effect, model = searched.effects[place], searched.model
    for k, quantity in enumerate(effect.parameters, model.slices()[place].start):
        lower, upper = model.lower(quantity), quantity.upper
        value = float(searched.values[k])
        if not at_bound(value, lower, upper) or _nearest(value, lower, upper) in quantity.plain:
            continue
        value = _inside(value, lower, upper)
        if _cost_at(searched, k, value) - searched.cost > BOUND_NEEDED * gain:
            return True
    return False


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


def _cost_at(searched: FittedModel, k: int, value: float) -> float:
    """Least cost found with one value given."""
    model, values = searched.model, searched.values.copy()
    values[k] = value
    free = np.arange(len(values)) != k
    lower, upper = model.bounds()
    least = np.inf
    for _ in range(_STEPS):
        residual, jacobian = model.residuals(values, True)
        cost = float(np.vdot(residual, residual))
        if not cost < least:
            break
        least = cost
        scaled, length = unit_columns(jacobian[:, free])
        step = np.linalg.lstsq(scaled, -residual, rcond=DETERMINED)[0] / length
        values[free] = np.clip(values[free] + step, lower[free], upper[free])
    return least
