"""A law with effects around it, fitted to measured runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ...effects import Effect, EffectParameter
from ...identification.characteristic_scales import characteristic_scale
from ...identification.law_model import LawModel
from ...identification.least_squares import DETERMINED, Optimum, orthonormal, unit_columns
from ...identification.measured_runs import MeasuredRuns
from ..decisions import FARTHEST, RUNS_AWAY, SEARCH_STEPS
from .acting_order import acting_order
from .carried_history import has_unknown_starts
from .effect_evaluation import differentiate, evaluate, time_scales

# A load cell that is set to zero before every run: no run tells the offset of another. This form
# needs the measured force itself, so that it cannot be an effect of the catalogue: the mean of each
# run's residual is taken out, in held-out runs as well.
EACH_RUN = Effect(
    cause="force_offset",
    form="each_run",
    title="Force offset, another in each run",
    parameters=(
        EffectParameter("spread", "N", "RMS of the offsets", magnitude=True, starts=(0.01,)),
    ),
    of_device=False,
    source="zero of the load cell",
)
"""Its parameter is not fitted; it is found from the runs."""


_LEAST_FACTOR = 0.1
"""Share of a force from which it is divided by the factor of an effect."""


def run_means(data: MeasuredRuns, values: NDArray) -> NDArray:
    """Mean of each run in place of its samples."""
    sums = np.add.reduceat(values, data.starts[:-1], axis=0)
    lengths = data.lengths.reshape(-1, *[1] * (values.ndim - 1))
    return np.repeat(sums / lengths, data.lengths, axis=0)


@dataclass(frozen=True, eq=False)
class Model(LawModel):
    """A law and effects, on measured runs.

    Attributes
    ----------
    effects : tuple of Effect
        In the order in which they act, but for those that act first; their parameters follow the
        law's among the values.
    """

    effects: tuple[Effect, ...] = ()

    def with_effects(self, *effects: Effect) -> Self:
        """Return the model with more effects, which act after those already there."""
        return replace(self, effects=(*self.effects, *effects))

    def without(self, place: int) -> Self:
        """Return the model with one effect less."""
        return replace(self, effects=self.effects[:place] + self.effects[place + 1 :])

    def without_instruments(self, values: NDArray) -> tuple[Self, NDArray]:
        """Return the model without the effects of instruments, and its part of the values."""
        return self._without(values, lambda effect: not effect.of_device)

    def without_springs(self, values: NDArray) -> tuple[Self, NDArray]:
        """Return the model without added forces that have a potential, and its part of the values.

        Such a force follows the deformation alone, as that of an end stop.
        """
        return self._without(values, lambda one: one.stored_energy is not None and not one.states)

    def _without(self, values: NDArray, chosen: Callable[[Effect], bool]) -> tuple[Self, NDArray]:
        model = self
        for place in reversed(range(len(self.effects))):
            if chosen(self.effects[place]):
                values = np.delete(values, model.slices()[place])
                model = model.without(place)
        return model, values

    @property
    def causes(self) -> tuple[str, ...]:
        """Causes of the effects."""
        return tuple(effect.cause for effect in self.effects)

    @property
    def needs_differences(self) -> bool:
        """Whether derivatives need further simulations of the law."""
        return any(effect.is_before_law for effect in self.effects)

    def slices(self) -> list[slice]:
        """Place of each effect's parameters among the values."""
        result, at = [], self.n_law
        for effect in self.effects:
            result.append(slice(at, at + len(effect.parameters)))
            at = result[-1].stop
        return result

    def parameters_of(self, values: NDArray) -> list[dict[str, float]]:
        """Parameters of each effect by name, SI."""
        return [
            dict(zip(effect.parameter_names, values[place].tolist(), strict=True))
            for effect, place in zip(self.effects, self.slices(), strict=True)
        ]

    def bounds(self) -> tuple[NDArray, NDArray]:
        """Lower and upper bounds of all values."""
        quantities = [q for effect in self.effects for q in effect.parameters]
        lower, upper = super().bounds()
        return (
            np.concatenate([lower, [self.lower(q) for q in quantities]]),
            np.concatenate([upper, [self.upper(q) for q in quantities]]),
        )

    def lower(self, quantity: EffectParameter) -> float:
        """Lower bound of a parameter on these data."""
        least = quantity.least * self.size(quantity) if quantity.least else quantity.lower
        return max(quantity.lower, least, -self._most(quantity))

    def upper(self, quantity: EffectParameter) -> float:
        """Upper bound of a parameter on these data."""
        return min(quantity.upper, self._most(quantity))

    def _most(self, quantity: EffectParameter) -> float:
        most = quantity.most
        return most if most == float("inf") else most * self.size(quantity)

    def size(self, quantity: EffectParameter) -> float:
        """Scale of a parameter, in its unit, of which ``starts`` are multiples."""
        if quantity.unit in ("s", "1", "-"):
            return 1.0
        return characteristic_scale(quantity.unit, *self.data.sizes)

    # trial values far from the data may overflow: their cost is infinite
    @np.errstate(all="ignore")
    def forces(
        self, values: NDArray, derivatives: bool, inner: NDArray | None = None
    ) -> tuple[NDArray, NDArray]:
        """Force of all samples, (n_samples,), N, and its derivatives, (n_samples, n_values)."""
        # Derivatives are exact by the law's parameters, and by those of effects that follow the
        # force; by those of other effects they are differences. ``inner`` is the law's force before
        # any effect, if it is known and no derivatives are wanted.
        law, own = values[: self.n_law], [values[s] for s in self.slices()]
        seen = self._seen_motions(own)
        if inner is None or derivatives:
            inner, jacobian = self._law_force(law, own, seen, derivatives)
        if not derivatives:
            evaluated = self._evaluate_all(inner, own, seen)
            force = self._with_offsets(self.data.record(_combined(inner, evaluated)))
            return force, np.empty((0, len(values)))
        by_inner = np.zeros((len(inner), len(values)))
        np.matmul(jacobian, self.parameterisation.spread, out=by_inner[:, : self.n_law])
        moves = [move for move in self._moves(own) if self.effects[move[0]].is_before_law]
        for _, k, step, moved in moves:
            other = self._seen_motions(moved)
            by_inner[:, k] = (self._law_force(law, moved, other, False)[0] - inner) / step
        force, columns = self._behind_effects(inner, by_inner, own, seen)
        for place, k, step, moved in moves:
            if self.effects[place].motion is not None and len(self.effects) > 1:
                # what the others do along the changed motion
                beside = self._evaluate_all(inner, own, self._seen_motions(moved))
                columns[:, k] += (_combined(inner, beside) - force) / step
        return self._with_offsets(self.data.record(force)), self.recorded(columns)

    def recorded(self, columns: NDArray) -> NDArray:
        """Changes of the force, (n_samples, n), as channel and offset of each run show them."""
        columns = self.data.record_changes(columns)
        return columns - run_means(self.data, columns) if EACH_RUN in self.effects else columns

    def _moves(self, own: list) -> Iterator[tuple[int, int, float, list]]:
        """Differences: an effect's place, the value's, the step and all parameters after it."""
        for place, effect in enumerate(self.effects):
            for k, quantity in enumerate(effect.parameters):
                moved = [p.copy() for p in own]
                step = quantity.difference * max(abs(moved[place][k]), 0.01 * self.size(quantity))
                if moved[place][k] + step > self.upper(quantity):
                    step = -step
                moved[place][k] += step
                yield place, self.slices()[place].start + k, step, moved

    def _behind_effects(
        self, inner: NDArray, by_inner: NDArray, own: list, seen: list
    ) -> tuple[NDArray, NDArray]:
        """The law's force and its derivatives by all values as they come out behind effects."""
        evaluated = self._evaluate_all(inner, own, seen)
        slopes: list[tuple[slice, dict[str, NDArray]]] = []
        for k, (effect, place) in enumerate(zip(self.effects, self.slices(), strict=True)):
            if effect.records_force:
                slopes.append((place, {}))
            elif "force" in effect.needs:
                data = self._beside(k, evaluated)
                evaluated[k], by = differentiate(
                    effect, data, inner, own[k], by_inner, place.start, seen[k]
                )
                slopes.append((slice(0, by_inner.shape[1]), by))
            else:
                shape = len(inner), len(own[k])
                slopes.append((place, {name: np.empty(shape) for name in evaluated[k]}))
        for at, k, step, moved in self._moves(own):
            columns, by = slopes[at]
            effect = self.effects[at]
            if by and "force" not in effect.needs:
                other = self._evaluate(effect, inner, moved[at], seen[at])
                for name, values in by.items():
                    values[:, k - columns.start] = (other[name] - evaluated[at][name]) / step
        factors = [one.get("factor") for one in evaluated]
        for factor in factors:
            if factor is not None:
                by_inner *= factor[:, np.newaxis]
        for at, (columns, by) in enumerate(slopes):
            if "factor" in by:
                others = inner
                for factor in (*factors[:at], *factors[at + 1 :]):
                    others = others if factor is None else others * factor
                by["factor"] *= others[:, np.newaxis]
                by_inner[:, columns] += by["factor"]
            if "force" in by:
                by_inner[:, columns] += by["force"]
        force = _combined(inner, self._of_device(evaluated))
        for k, (effect, place) in enumerate(zip(self.effects, self.slices(), strict=True)):
            if effect.records_force:
                late, by = differentiate(
                    effect, self.data, force, own[k], by_inner, place.start, seen[k]
                )
                force = force + late["force"]
                by_inner += by["force"]
        return force, by_inner

    def _of_device(self, evaluated: list) -> list[dict[str, Any]]:
        """What effects do to the force before it is recorded."""
        pairs = zip(self.effects, evaluated, strict=True)
        return [one for effect, one in pairs if not effect.records_force]

    def _with_offsets(self, force: NDArray) -> NDArray:
        """The force with each run's own load-cell offset, if that effect is there."""
        if EACH_RUN not in self.effects:
            return force
        return force + run_means(self.data, self.data.force - force)

    def law_force(self, values: NDArray) -> NDArray:
        """Force of the law before any effect, N, on the motion and current that effects leave."""
        own = [values[s] for s in self.slices()]
        return self._law_force(values[: self.n_law], own, self._seen_motions(own), False)[0]

    def _seen_motions(self, own: list) -> list[tuple[NDArray, NDArray]]:
        """Deformation and velocity that each effect sees, and last those that the law sees.

        What stands behind a linkage, or a late channel, is the whole device with its effects. One
        that changes the motion itself sees it as those before it leave it.
        """
        motion = self.data.x, self.data.v
        nothing = np.zeros(len(self.data.x))
        reaching = {}
        for place, (effect, parameters) in enumerate(zip(self.effects, own, strict=True)):
            if effect.motion is not None:
                reaching[place] = motion
                motion = tuple(evaluate(effect, self.data, nothing, parameters, motion)["motion"])
        return [*(reaching.get(k, motion) for k in range(len(self.effects))), motion]

    def _law_force(
        self, law: NDArray, own: list, seen: list, derivatives: bool
    ) -> tuple[NDArray, NDArray]:
        motion = self.data.motion
        nothing = np.zeros(len(self.data.x))
        if seen[-1][0] is not self.data.x:
            motion = replace(motion, displacement=seen[-1][0], velocity=seen[-1][1])
        for place in acting_order(self.effects):
            effect = self.effects[place]
            if effect.current is not None:
                changed = evaluate(
                    effect, self.data, nothing, own[place], seen[place], motion.current
                )
                motion = motion.with_current(changed["current"])
        for effect, parameters in zip(self.effects, own, strict=True):
            if effect.time_scale is not None:
                motion = motion.slower(time_scales(effect, self.data, parameters))
        return self.simulator(motion).run(self.parameterisation.coefficients(law), derivatives)

    def _evaluate(
        self, effect: Effect, inner: NDArray, parameters: NDArray,
        seen: tuple[NDArray, NDArray], data: MeasuredRuns | None = None,
    ) -> dict[str, Any]:  # fmt: skip
        """Factor and added force of an effect; empty if it has neither."""
        if effect.factor is None and effect.force is None:
            return {}
        every = evaluate(effect, data or self.data, inner, parameters, seen)
        return {name: every[name] for name in ("factor", "force") if name in every}

    def _evaluate_all(self, inner: NDArray, own: list, seen: list) -> list[dict[str, Any]]:
        """Factors and added forces of all effects.

        Behind the others come those that begin as the forces tell; a recorder follows all of them.
        """
        evaluated: list[dict[str, Any]] = [{} for _ in self.effects]

        def go_on(chosen: Callable[[Effect], bool]) -> None:
            for place, effect in enumerate(self.effects):
                if chosen(effect):
                    data, force = self._beside(place, evaluated), inner
                    if effect.records_force:
                        force = _combined(inner, self._of_device(evaluated))
                    one = self._evaluate(effect, force, own[place], seen[place], data)
                    evaluated[place] = one

        go_on(lambda effect: not (has_unknown_starts(effect) or effect.records_force))
        go_on(lambda effect: effect.records_force)
        if any(map(has_unknown_starts, self.effects)):
            go_on(has_unknown_starts)
            go_on(lambda effect: effect.records_force)
        return evaluated

    def _beside(self, place: int, evaluated: list) -> MeasuredRuns:
        """The data of an effect that begins as the forces tell: without what the others do."""
        if not has_unknown_starts(self.effects[place]):
            return self.data
        force = self.data.force
        others = [*evaluated[:place], *evaluated[place + 1 :]]
        for one in others:
            force = force - one.get("force", 0.0)
        for one in others:
            # what is nearly gone tells nothing
            force = force / np.maximum(one.get("factor", 1.0), _LEAST_FACTOR)
        return self.data if force is self.data.force else replace(self.data, force=force)


def _combined(inner: NDArray, evaluated: list) -> NDArray:
    force = inner
    for one in evaluated:
        if "factor" in one:
            force = force * one["factor"]
    for one in evaluated:
        if "force" in one:
            force = force + one["force"]
    return force


@dataclass(frozen=True, eq=False)
class FittedModel:
    """A model with the values that fit it best."""

    model: Model  # The model
    values: NDArray  # (n_values,): The law's parameters, then each effect's parameters
    cost: float  # Sum of squared residuals of the fitted samples over their noise
    residual: NDArray  # (n_fitted,): These residuals
    jacobian: NDArray  # (n_fitted, n_values): Their derivatives by the values

    @classmethod
    def of(cls, model: Model, optimum: Optimum) -> FittedModel:
        """Put a model and the end of its fit together."""
        return cls(model, optimum.x, 2 * optimum.cost, optimum.residual, optimum.jacobian)

    @classmethod
    def at(cls, model: Model, values: NDArray) -> FittedModel:
        """Take a model with given values."""
        residual, jacobian = model.residuals(values, True)
        return cls(model, values, float(np.vdot(residual, residual)), residual, jacobian)

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Effects of the model."""
        return self.model.effects

    @property
    def causes(self) -> tuple[str, ...]:
        """Causes of the effects."""
        return self.model.causes

    @property
    def n_parameters(self) -> int:
        """Number of values, and of those that each run has of its own."""
        by_run = [e for e in self.effects if e is EACH_RUN or has_unknown_starts(e)]
        return len(self.values) + len(by_run) * (len(self.model.data.dt) - 1)

    @property
    def penalty(self) -> float:
        """Cost of its parameters (Schwarz's criterion)."""
        return self.n_parameters * float(np.log(len(self.residual)))

    @property
    def criterion(self) -> float:
        """Schwarz's criterion; the less the better."""
        return self.cost + self.penalty

    def values_without(self, place: int) -> NDArray:
        """Values of the model with one effect less, not fitted again."""
        gone = self.model.slices()[place]
        return np.delete(self.values, np.arange(gone.start, gone.stop))

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
        """Orthonormal directions in which values inside their bounds move the residuals."""
        # one at a bound does not follow what would lead it out
        lower, upper = self.model.bounds()
        inside = np.flatnonzero((self.values > lower) & (self.values < upper))
        basis = orthonormal(self.jacobian[:, inside])
        along = basis.T @ self.residual
        if not float(along @ along) > RUNS_AWAY * self.cost:
            return basis
        # an element that has become rigid promises at first order what no value of it keeps
        scaled, length = unit_columns(self.jacobian[:, inside])
        step = np.linalg.lstsq(scaled, -self.residual)[0] / length
        values = self.values[inside]
        rigid = (values > 0) & (step > FARTHEST * values) & np.isinf(upper[inside])
        return orthonormal(self.jacobian[:, inside[~rigid]])

    @cached_property
    def covariance(self) -> tuple[NDArray, NDArray]:
        """Covariance of the values times lengths, under residuals of one noise; the lengths."""
        scaled, length = unit_columns(self.jacobian)
        return np.linalg.pinv(scaled.T @ scaled, DETERMINED**2, hermitian=True), length

    def significance(self, places: NDArray) -> float:
        """Square of some values over their covariance under residuals of one noise each."""
        covariance, length = self.covariance
        one = (self.values * length)[places]
        return float(one @ np.linalg.pinv(covariance[np.ix_(places, places)], hermitian=True) @ one)

    def across(self, change: NDArray) -> NDArray:
        """Component of a change of the residuals that the values cannot follow, to first order."""
        return change - self.basis @ (self.basis.T @ change)

    @cached_property
    def without_offsets(self) -> FittedModel:
        """The model without a load-cell offset of each run's own."""
        # These offsets leave constant forces of the law open. Of all values that fit alike, those
        # are taken for which the offsets are least.
        if EACH_RUN not in self.effects:
            return self
        place = self.effects.index(EACH_RUN)
        gone = np.arange(len(self.values))[self.model.slices()[place]]
        model, values = self.model.without(place), np.delete(self.values, gone)
        residual, jacobian = model.residuals(values, True)
        own = np.delete(self.jacobian, gone, axis=1)
        scaled, length = unit_columns(jacobian)
        _, s, directions = np.linalg.svd(np.nan_to_num(own / length), full_matrices=False)
        open_ = directions[s <= DETERMINED * max(float(s[0]), 1e-300)] if len(s) else directions
        step = np.linalg.lstsq(scaled @ open_.T, -residual)[0] @ open_ / length
        return FittedModel.at(model, np.clip(values + step, *model.bounds()))

    def parameters(self, place: int) -> dict[str, float]:
        """Parameters of one effect by name, SI."""
        return self.model.parameters_of(self.values)[place]

    def cost_of(self, chosen: NDArray) -> float:
        """Sum of squared residuals over their noise, of the chosen samples."""
        return self.model.data.cost(self.force, chosen)

    def on(self, model: Model) -> FittedModel:
        """Fit the same effects further, on the data of a model without effects."""
        return fit_model(model.with_effects(*self.effects), self.values, 30, 1e-7)


def fit_model(model: Model, start: NDArray, most: int = 20, tolerance: float = 1e-5) -> FittedModel:
    """Fit a model from given values, with ``most`` steps at most."""
    return FittedModel.of(model, model.minimise(start, most, tolerance))


def fit_roughly(model: Model, start: NDArray) -> FittedModel:
    """Fit a model during the search."""
    # secants need more steps near the end, which a rough fit does not reach
    secants = model.needs_differences
    return FittedModel.of(model, model.minimise(start, SEARCH_STEPS, 1e-4, secants=secants))
