"""Try effects on a fitted model: first by their direction alone, then fitted together with it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ..effects import Effect
from ..identification.least_squares import Optimum
from .model import Model

MOST_STARTS = 12
"""Most shapes of an effect to look at before it is fitted."""
FRESH = 3
"""Best candidates that are fitted anew from the law's first values."""


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
    basis : (n_fitted, n_values) array
        Orthonormal directions in which the values can move the residuals.
    """

    model: Model
    values: NDArray
    cost: float
    residual: NDArray
    basis: NDArray

    @property
    def causes(self) -> tuple[str, ...]:
        """Causes that the model has."""
        return tuple(stage.effect.cause for stage in self.model.stages)

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
        return self.model.data.cost(self.model.forces(self.values, False)[0], chosen)

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
        model = data_model.with_effects(*(stage.effect for stage in self.model.stages))
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
    best: Optimum = model.minimised(start, most, tolerance)
    residual = model.residuals(best.x, False)[0]
    jacobian = best.jacobian
    norm = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    norm[~(norm > 0)] = 1.0
    # directions that the data do not determine are left out
    u, s, _ = np.linalg.svd(np.nan_to_num(jacobian / norm), full_matrices=False)
    basis = u[:, s > 1e-6 * max(float(s[0]), 1e-300)] if len(s) else u
    return Fitted(model, best.x, 2 * best.cost, residual, basis)


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
    """What a little of an effect would do for a fitted model.

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
    model = base.model.with_effects(effect)
    data, kept = base.model.data, base.model.data.fitted
    before = base.residual
    sizes = [model.size(q) for q in effect.parameters]
    choices = []
    for q, size in zip(effect.parameters, sizes, strict=True):
        found = [min(max(s * size, q.lower), q.upper) for s in q.starts]
        choices.append(found[:1] if q.strength else found)
    best: Direction | None = None
    for numbers in list(product(*choices))[:MOST_STARTS]:
        start = np.array(numbers)
        force = model.forces(np.concatenate([base.values, start]), False)[0]
        moved = ((force - data.force) * data.weight)[kept] - before
        if not np.all(np.isfinite(moved)):
            continue
        size = float(moved @ moved)
        across = moved - base.basis @ (base.basis.T @ moved)
        length = float(across @ across)
        if length < 1e-8 * size or length == 0.0:
            continue
        amount = -float(across @ before) / length
        strength = effect.parameters[effect.strength]
        if amount <= 0 and strength.lower >= 0:
            continue
        gain = amount**2 * length
        if best is None or gain > best.gain:
            from_noise = noise_gain(across, noise)
            start[effect.strength] *= np.sign(amount) * min(max(abs(amount), 0.02), 5.0)
            start = np.clip(start, [q.lower for q in effect.parameters],
                            [q.upper for q in effect.parameters])  # fmt: skip
            best = Direction(effect, gain, from_noise, start)
    return best


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
    again = pool.map(afresh, first[:FRESH])
    return sorted([*again, *first[FRESH:]], key=lambda f: f.cost)


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
