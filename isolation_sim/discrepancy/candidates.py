"""Try effects on a fitted model: first with the law's answer linearised, then fitted with it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ..effects import Effect
from ..identification.least_squares import DETERMINED, levenberg_marquardt, unit_columns
from .model import Model

MOST_STARTS = 12
"""Most shapes of an effect to look at before one is fitted."""
SHAPED = 6
"""Most steps of fitting an effect's shape alone."""
FRESH = 3
"""Best candidates that are fitted anew from the law's first values."""
IN_REACH = 0.5
"""Part of the best candidate's gain from which another one is still worth work."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """A model with the values that fit it best.

    Attributes
    ----------
    model : Model
        The model.
    values : (n_values,) array
        The law's unknowns, then each effect's parameters.
    cost : float
        Sum of squared residuals of the fitted samples over their noise.
    residual : (n_fitted,) array
        These residuals.
    jacobian : (n_fitted, n_values) array
        Their derivatives by the values.
    """

    model: Model
    values: NDArray
    cost: float
    residual: NDArray
    jacobian: NDArray

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Effects that the model has."""
        return tuple(stage.effect for stage in self.model.stages)

    @property
    def causes(self) -> tuple[str, ...]:
        """Their causes."""
        return tuple(effect.cause for effect in self.effects)

    @cached_property
    def force(self) -> NDArray:
        """Modelled force of all samples, (n_samples,), N."""
        return self.model.forces(self.values, False)[0]

    @cached_property
    def inner(self) -> NDArray:
        """Force of the law before any effect, (n_samples,), N."""
        return self.model.law_force(self.values)

    @cached_property
    def basis(self) -> NDArray:
        """Orthonormal directions in which the values move the residuals, (n_fitted, n)."""
        u, s, _ = np.linalg.svd(unit_columns(self.jacobian)[0], full_matrices=False)
        return u[:, s > DETERMINED * max(float(s[0]), 1e-300)] if len(s) else u

    def across(self, change: NDArray) -> NDArray:
        """Part of a change of the residuals that the values cannot follow, to first order.

        Parameters
        ----------
        change : (n_fitted,) array
            The change.

        Returns
        -------
        (n_fitted,) array
        """
        return change - self.basis @ (self.basis.T @ change)

    def parameters(self, place: int) -> dict[str, float]:
        """Values of one effect's parameters.

        Parameters
        ----------
        place : int
            Of the effect.

        Returns
        -------
        dict of str to float
            SI.
        """
        names = self.model.stages[place].effect.parameter_names
        numbers = self.values[self.model.slices()[place]].tolist()
        return dict(zip(names, numbers, strict=True))

    def cost_of(self, chosen: NDArray) -> float:
        """Sum of squared residuals over their noise, over some samples.

        Parameters
        ----------
        chosen : (n_samples,) bool array
            Which.

        Returns
        -------
        float
        """
        return self.model.data.cost(self.force, chosen)

    def on(self, data_model: Model) -> Fitted:
        """Return the same values on other data, fitted further there.

        Parameters
        ----------
        data_model : Model
            The model on the other data, without effects.

        Returns
        -------
        Fitted
        """
        model = data_model.with_effects(*self.effects)
        return fitted(model, self.values, most=30, tolerance=1e-7)


def fitted(model: Model, start: NDArray, most: int = 20, tolerance: float = 1e-5) -> Fitted:
    """Fit a model.

    Parameters
    ----------
    model : Model
        The model.
    start : (n_values,) array
        Values to start from.
    most : int
        Most steps to try.
    tolerance : float
        Relative decrease of the cost below which the search ends.

    Returns
    -------
    Fitted
    """
    best = model.minimised(start, most, tolerance)
    return Fitted(model, best.x, 2 * best.cost, best.residual, best.jacobian)


def noise_gain(step: NDArray, noise: NDArray) -> float:
    """Decrease of the cost that noise alone brings along a change of the residual, on average.

    Parameters
    ----------
    step : (n_fitted,) array
        The change.
    noise : (n_fitted, n_examples) array
        Residuals that noise alone leaves.

    Returns
    -------
    float
        1 where the noise is white; 1 also for no change.
    """
    length = float(step @ step)
    return float(np.mean((step @ noise) ** 2)) / length if length > 0 else 1.0


@dataclass(frozen=True, eq=False)
class Direction:
    """What an effect would do for a fitted model, if the law answered it linearly.

    Attributes
    ----------
    effect : Effect
        The effect.
    gain : float
        Expected decrease of the cost.
    noise_gain : float
        Decrease that noise alone would bring in this direction, on average.
    start : (n_parameters,) array
        Its parameters, to start a fit from.
    """

    effect: Effect
    gain: float
    noise_gain: float
    start: NDArray


class _Probe:
    """An effect beside a fitted model whose other values follow to first order."""

    def __init__(self, base: Fitted, effect: Effect):
        self.base, self.effect = base, effect
        self.model = base.model.with_effects(effect)
        outside = effect.motion is None and effect.current is None
        self.inner = base.inner if outside else None
        self.before = base.across(base.residual)
        self.lower = np.array([q.lower for q in effect.parameters])
        self.upper = np.array([q.upper for q in effect.parameters])
        self.sizes = [self.model.size(q) for q in effect.parameters]

    def moved(self, parameters: NDArray) -> NDArray:
        """Change of the residuals by the effect alone."""
        data = self.model.data
        values = np.concatenate([self.base.values, parameters])
        force = self.model.forces(values, False, self.inner)[0]
        return ((force - data.force) * data.weight)[data.fitted] - self.base.residual

    def starts(self) -> list[NDArray]:
        """Parameters to look at: one strength, and some of each other's first values."""
        choices = []
        for q, size in zip(self.effect.parameters, self.sizes, strict=True):
            found = [min(max(s * size, q.lower), q.upper) for s in q.starts]
            choices.append(found[:1] if q.strength else found)
        return [np.array(numbers) for numbers in product(*choices)][:MOST_STARTS]

    def problem(self, parameters: NDArray, derivatives: bool) -> tuple[NDArray, NDArray]:
        """Residuals with the effect, and their differences by its parameters."""
        residual = self.base.across(self.base.residual + self.moved(parameters))
        columns = np.empty((len(residual) if derivatives else 0, len(parameters)))
        if derivatives:
            for k, size in enumerate(self.sizes):
                step = 1e-4 * max(abs(parameters[k]), 0.01 * size)
                other = parameters.copy()
                other[k] += step if other[k] + step <= self.upper[k] else -step
                changed = self.base.across(self.base.residual + self.moved(other))
                columns[:, k] = (changed - residual) / (other[k] - parameters[k])
        return residual, columns


def direction(base: Fitted, effect: Effect, noise: NDArray) -> Direction | None:
    """Look in which shape an effect would help a fitted model most.

    Parameters
    ----------
    base : Fitted
        The model without it.
    effect : Effect
        The effect.
    noise : (n_fitted, n_samples) array
        Examples of the residuals that noise alone would leave.

    Returns
    -------
    Direction or None
        None where the data do not excite the effect.
    """
    probe = _Probe(base, effect)
    place = effect.strength
    best: Direction | None = None
    for start in probe.starts():
        moved = probe.moved(start)
        across = base.across(moved)
        with np.errstate(over="ignore"):
            length, whole = float(across @ across), float(moved @ moved)
        # what the law follows all the way leaves rounding; what overflows is not a number
        if not length > 1e-8 * whole or not np.isfinite(length):
            continue
        amount = -float(across @ probe.before) / length
        if amount <= 0 and effect.parameters[place].lower >= 0:
            continue
        gain = amount**2 * length
        if best is None or gain > best.gain:
            start[place] *= np.sign(amount) * min(max(abs(amount), 0.02), 5.0)
            start = np.clip(start, probe.lower, probe.upper)
            best = Direction(effect, gain, noise_gain(across, noise), start)
    return best


def shaped(base: Fitted, given: Direction, noise: NDArray) -> Direction:
    """Fit an effect's own parameters while the model's other values follow to first order.

    Parameters
    ----------
    base : Fitted
        The model without the effect.
    given : Direction
        Where to start from.
    noise : (n_fitted, n_samples) array
        Examples of the residuals that noise alone would leave.

    Returns
    -------
    Direction
        The one given where that is no worse.
    """
    probe = _Probe(base, given.effect)
    found = levenberg_marquardt(
        probe.problem, given.start, probe.lower, probe.upper, SHAPED, 1e-3, eager=False
    )
    gain = float(probe.before @ probe.before) - 2 * found.cost
    if not gain > given.gain:
        return given
    step = found.residual - probe.before
    return Direction(given.effect, gain, noise_gain(step, noise), found.x)


def directions(
    base: Fitted, effects: Sequence[Effect], noise: NDArray, pool: ThreadPoolExecutor
) -> list[Direction]:
    """Look at several effects, the most helpful first.

    Parameters
    ----------
    base : Fitted
        The model without them.
    effects : sequence of Effect
        The effects.
    noise : (n_fitted, n_samples) array
        Examples of the residuals that noise alone would leave.
    pool : concurrent.futures.ThreadPoolExecutor
        Who looks.

    Returns
    -------
    list of Direction
    """
    found = pool.map(lambda effect: direction(base, effect, noise), effects)
    return sorted((d for d in found if d is not None), key=lambda d: -d.gain)


def try_all(
    base: Fitted,
    found: Sequence[Direction],
    pool: ThreadPoolExecutor,
    advance: Callable[[], None],
    most: int = 12,
) -> list[Fitted]:
    """Fit each effect together with the model it is added to, the best first.

    Parameters
    ----------
    base : Fitted
        The model without them.
    found : sequence of Direction
        Where to start from.
    pool : concurrent.futures.ThreadPoolExecutor
        Who fits.
    advance : callable
        Called after each.
    most : int
        Most steps of each fit.

    Returns
    -------
    list of Fitted
    """

    def tried(one: Direction) -> Fitted:
        model = base.model.with_effects(one.effect)
        result = fitted(model, np.concatenate([base.values, one.start]), most, 1e-4)
        advance()
        return result

    first = sorted(pool.map(tried, found), key=lambda f: f.cost)
    gains = [base.cost - f.cost for f in first[:FRESH]]
    # so written that a gain which is not a number counts
    count = sum(not gain < IN_REACH * gains[0] for gain in gains)
    again = pool.map(afresh, first[:count])
    return sorted([*again, *first[count:]], key=lambda f: f.cost)


def afresh(given: Fitted) -> Fitted:
    """Fit a model anew with the law's first values: its last ones may have been bent by the lack.

    Parameters
    ----------
    given : Fitted
        A fitted model.

    Returns
    -------
    Fitted
        The better of the two.
    """
    model = given.model
    if model.expected is None:
        return given
    start = np.concatenate([model.expected, given.values[model.n_law :]])
    other = fitted(model, start, most=30, tolerance=1e-4)
    better = given if given.cost <= other.cost else other
    return fitted(model, better.values, most=20, tolerance=1e-5)
