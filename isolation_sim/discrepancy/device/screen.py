"""Screen effects around a fitted model: first with the law's answer linearised, then fitted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ...effects import Effect
from ...identification.least_squares import DETERMINED, levenberg_marquardt, unit_columns
from ..decisions import (
    MUCH_EXPLAINED,
    REFINE_STEPS,
    REFITTED,
    SCREEN_STARTS,
    WORTH_FITTING,
    WORTH_REFITTING,
)
from .model import FittedModel, Model, fit_model, fit_roughly

_LITTLE = 0.05
"""Share of an effect's first magnitude from which it is fitted if the whole of it does not help."""

_FAILED, _MUCH = 0.1, 4.0
"""Share of the expected gain below which a fit has failed, and factor on the magnitude from which
it is made again."""


def noise_gain(step: NDArray, noise: NDArray) -> float:
    """Mean decrease of the cost that noise alone brings along a change of the residual."""
    # ``noise`` holds examples of residuals of noise alone, (n_fitted, n_examples). The result is 1
    # for white noise, and for no change.
    length = float(step @ step)
    return float(np.mean((step @ noise) ** 2)) / length if length > 0 else 1.0


@dataclass(frozen=True, eq=False)
class Direction:
    """Expected gain of an effect for a fitted model, if the law responds linearly."""

    effect: Effect  # The effect
    gain: float  # Expected decrease of the cost
    noise_gain: float  # Decrease that noise alone would bring in this direction, on average
    start: NDArray  # (n_parameters,): Its parameters, to start a fit from


class _Probe:
    """An effect beside a fitted model whose other values follow to first order."""

    def __init__(self, base: FittedModel, effect: Effect):
        self.base, self.effect = base, effect
        self.model = base.model.with_effects(effect)
        self.inner = None if effect.is_before_law else base.inner
        self.before = base.across(base.residual)
        self.lower = np.array([self.model.lower(q) for q in effect.parameters])
        self.upper = np.array([self.model.upper(q) for q in effect.parameters])
        self.sizes = [self.model.size(q) for q in effect.parameters]

    def moved(self, parameters: NDArray) -> NDArray:
        """Change of the residuals by the effect alone."""
        data = self.model.data
        values = np.concatenate([self.base.values, parameters])
        force = self.model.forces(values, False, self.inner)[0]
        with np.errstate(over="ignore"):  # where a trial of the effect diverges
            return ((force - data.force) * data.weight)[data.fitted] - self.base.residual

    def starts(self) -> list[NDArray]:
        """Parameters to look at: a magnitude or several, and some of each other's first values."""
        # What changes the motion or the current does not act in proportion to its magnitude: a slow
        # field does not follow from a quick one, nor a wide gap from a narrow one.
        in_proportion = not self.effect.is_before_law
        choices = []
        for q, size in zip(self.effect.parameters, self.sizes, strict=True):
            result = [min(max(s * size, q.lower), q.upper) for s in q.starts]
            choices.append(result[:1] if q.magnitude and in_proportion else result)
        return [np.array(numbers) for numbers in product(*choices)][:SCREEN_STARTS]

    def problem(self, parameters: NDArray, derivatives: bool) -> tuple[NDArray, NDArray]:
        """Residuals with the effect, and their differences by its parameters."""
        residual = self.base.across(self.base.residual + self.moved(parameters))
        columns = np.empty((len(residual) if derivatives else 0, len(parameters)))
        if derivatives:
            for k, (quantity, size) in enumerate(
                zip(self.effect.parameters, self.sizes, strict=True)
            ):
                step = quantity.difference * max(abs(parameters[k]), 0.01 * size)
                other = parameters.copy()
                other[k] += step if other[k] + step <= self.upper[k] else -step
                changed = self.base.across(self.base.residual + self.moved(other))
                columns[:, k] = (changed - residual) / (other[k] - parameters[k])
        return residual, columns


def screen_effect(base: FittedModel, effect: Effect, noise: NDArray) -> Direction | None:
    """Find the shape in which an effect helps a fitted model most; None if it is not excited."""
    probe = _Probe(base, effect)
    place = effect.magnitude
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


def refine(base: FittedModel, direction: Direction, noise: NDArray) -> Direction:
    """Fit an effect's own parameters while the model's other values follow to first order."""
    probe = _Probe(base, direction.effect)
    result = levenberg_marquardt(
        probe.problem, direction.start, probe.lower, probe.upper, REFINE_STEPS, 1e-3, eager=False
    )
    gain = float(probe.before @ probe.before) - 2 * result.cost
    if not gain > direction.gain:
        return direction
    step = result.residual - probe.before
    return Direction(direction.effect, gain, noise_gain(step, noise), result.x)


def screen(
    base: FittedModel, effects: Sequence[Effect], noise: NDArray, pool: ThreadPoolExecutor
) -> list[Direction]:
    """Look at several effects, the most helpful first."""
    result = pool.map(lambda effect: screen_effect(base, effect, noise), effects)
    return sorted((d for d in result if d is not None), key=lambda d: -d.gain)


def fit_direction(base: FittedModel, one: Direction) -> FittedModel:
    """Fit an effect together with the model it is added to."""
    model = base.model.with_effects(one.effect)
    fitted = fit_roughly(model, first_values(base, model, one))
    if base.cost - fitted.cost > _FAILED * one.gain:
        return fitted
    # the law that lacks the effect imitates it, so that little of it helps less than none
    strong = np.concatenate([base.values, one.start])
    strong[len(base.values) + one.effect.magnitude] *= _MUCH
    strong = np.clip(strong, *model.bounds())
    other = fit_roughly(model, strong)
    return other if other.cost < fitted.cost else fitted


def first_values(base: FittedModel, model: Model, one: Direction) -> NDArray:
    """Values from which an effect is fitted: the best of some."""
    # The model's own values follow the effect to first order, as they did while it was refined. A
    # fit from values that do not follow begins far from the data, and may end there.
    n = len(base.values)
    stay = np.concatenate([base.values, one.start])
    residual = model.residuals(stay, False)[0]
    starts = {_cost(residual): stay}
    if np.isfinite(residual).all():
        scaled, length = unit_columns(base.jacobian)
        inverse = np.linalg.pinv(scaled.T @ scaled, DETERMINED**2, hermitian=True)
        follow = base.values - inverse @ (scaled.T @ residual) / length
        lower, upper = (bound[:n] for bound in model.bounds())
        follow = np.concatenate([np.clip(follow, lower, upper), one.start])
        starts[_cost(model.residuals(follow, False)[0])] = follow
    if min(starts) > base.cost:  # neither helps: the effect grows from little
        little = stay.copy()
        little[n:][one.effect.magnitude] *= _LITTLE
        starts[_cost(model.residuals(little, False)[0])] = little
    return starts[min(starts)]


def _cost(residual: NDArray) -> float:
    result = float(np.vdot(residual, residual))
    return result if np.isfinite(result) else np.inf


def fit_directions(
    base: FittedModel,
    matches: Sequence[Direction],
    pool: ThreadPoolExecutor,
    advance: Callable[[], None],
) -> list[FittedModel]:
    """Fit each effect together with the model it is added to, the best first."""

    def fit(one: Direction) -> FittedModel:
        result = fit_direction(base, one)
        advance()
        return result

    fitted = list(pool.map(fit, matches[:REFITTED]))
    best = max((base.cost - one.cost for one in fitted), default=0.0)
    fitted += pool.map(fit, [one for one in matches[REFITTED:] if _may_compete(one, best, base)])
    fitted.sort(key=lambda one: one.cost)
    gains = [base.cost - one.cost for one in fitted[:REFITTED]]
    again: dict[str, FittedModel] = {}
    for one, gain in zip(fitted, gains, strict=False):
        # a gain that is not a number counts; other forms are compared once a cause is taken
        if not gain < WORTH_REFITTING * gains[0]:
            again.setdefault(one.causes[-1], one)
    others = [one for one in fitted if one not in again.values()]
    return sorted([*pool.map(refit, again.values()), *others], key=lambda one: one.cost)


def _may_compete(one: Direction, best_gain: float, base: FittedModel) -> bool:
    """Whether an effect may explain about as much as the best of those fitted before."""
    # the expected gain of what changes the motion or the current is often too small
    if one.effect.is_before_law:
        return True
    return one.gain > WORTH_FITTING * best_gain or best_gain < MUCH_EXPLAINED * base.cost


def refit(one: FittedModel) -> FittedModel:
    """Refit from the law's expected values, since a lacking effect may bend the last ones."""
    model = one.model
    if model.expected is None:
        return one
    begin = [model.expected, model.parameterisation.with_every_element(model.expected)]
    others = [
        fit_model(model, np.concatenate([law, one.values[model.n_law :]]), 30, 1e-4)
        for law in begin
        if law is not None
    ]
    better = min([one, *others], key=lambda f: f.cost)
    return fit_model(model, better.values)
