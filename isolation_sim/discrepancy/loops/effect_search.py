"""The search for effects that explain a loop table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ...effects import EFFECTS, Effect
from ...effects.extend import check_effect
from ...identification.law_fit import distinct
from ...identification.least_squares import Optimum
from ...identification.parameterisation import Parameterisation
from ...laws import Device
from ...laws.law import Law
from ..decisions import (
    LARGE_LOOP_FOLDS,
    LARGE_LOOP_LAWS,
    LOOP_ACCURACY,
    LOOP_COMPARED,
    LOOP_CYCLES,
    LOOP_FITTED,
    LOOP_FOLDS,
    LOOP_GAIN,
    LOOP_LAWS,
    LOOP_ROWS,
    LOOP_WHOLE,
    MOST_LOOP_EFFECTS,
)
from .model import CYCLES, STEPS, FittedLoops, LoopModel, loop_motion, rms
from .table import LoopTable

_SAMPLES, _N_STEPS = 64, 2
"""Samples a cycle, and integration steps a sample, with which a law is sought."""
_LAW_STARTS, _SHAPE_STARTS = 16, 4
_FIRST_STEPS = 8
"""Steps from each start of an effect that choose among forms."""
_UNOBSERVABLE = (
    "force_offset", "sensor_delay", "stress_softening", "self_heating", "ambient_temperature",
    "cyclic_degradation", "current_lag", "tension_compression_asymmetry",
)  # fmt: skip
"""Effects that a steady loop cannot show."""


@dataclass(frozen=True, eq=False)
class LoopSearch:
    """The search space of loop tables; see ``search.SearchSpace``.

    A large table is searched on some of its rows; the others validate.
    """

    whole: LoopTable  # Measured loops
    pool: ThreadPoolExecutor  # Threads that share out the fits
    seed: int  # Of random starts and of the rows left out together
    advance: Callable[[], None]  # Called before each fit
    most_causes: int = MOST_LOOP_EFFECTS  # Number of effects at which the search stops

    @cached_property
    def is_large(self) -> bool:
        """Whether only some rows are searched."""
        return int(np.sum(~self.whole.held_out)) > LOOP_WHOLE

    @cached_property
    def table(self) -> LoopTable:
        """The rows that are searched."""
        return self.whole.rows(self.whole.spread(LOOP_ROWS)) if self.is_large else self.whole

    @cached_property
    def judging(self) -> LoopTable | None:
        """Validation rows of a search on some rows: those held out, or all others."""
        if not self.is_large:
            return None
        held_out = self.whole.held_out
        if held_out.any():
            return self.whole.rows(held_out)
        left = np.delete(np.arange(len(held_out)), self.whole.spread(LOOP_ROWS))
        return self.whole.rows(left)

    def on_all(self, *models: FittedLoops) -> list[FittedLoops]:
        """Fit models that were found on some rows to all of them."""

        def fit(one: FittedLoops) -> FittedLoops:
            model = one.model.on(self.whole, CYCLES)
            model = replace(model, expected=one.optimum.x[: model.n_law])
            return self._leave_out(model, self._fit(model, one.optimum.x))

        return list(self.pool.map(fit, models)) if self.is_large else list(models)

    def fit_law(self, law: Law, device: Device | None, degree: int) -> FittedLoops:
        """Fit the law alone, its parameters polynomials of a degree in the current."""
        table = self.table
        currents = np.unique(table.current[~table.held_out])
        at = np.linspace(currents[0], currents[-1], degree + 1) if degree else currents[:1]
        span = float(self.whole.current.min()), float(self.whole.current.max())
        force = float(np.median(table.stiffness * table.amplitude))
        x = float(np.median(table.amplitude))
        time = 1 / (2 * np.pi * float(np.median(table.frequency)))
        parameterisation = Parameterisation(law, at, (force, x, time), span=span)
        cycles = LOOP_CYCLES if self.is_large else CYCLES
        data = loop_motion(table, _SAMPLES, _N_STEPS, cycles)
        model = LoopModel(data, parameterisation, table=table, cycles=cycles)
        starts = parameterisation.starts(_LAW_STARTS, self.seed)
        if device is not None:
            starts.insert(0, parameterisation.of(device))
        result = sorted(self.pool.map(lambda s: self._fit(model, s), starts), key=lambda o: o.cost)
        model, best = model.fit_further(result[0].x)
        # the same law is sought when rows are left out or effects are added
        evaluated = self._leave_out(replace(model, expected=best.x), best)
        most = LARGE_LOOP_LAWS if self.is_large else LOOP_LAWS
        return replace(evaluated, others=tuple(o.x for o in distinct(result)[1:most]))

    def is_explained(self, current: FittedLoops) -> bool:
        """Whether the table is reproduced."""
        return current.left_out <= LOOP_ACCURACY

    def candidates(self, current: FittedLoops) -> list[FittedLoops]:
        """Fit effects together with the model; the best few are evaluated on rows left out."""
        left = [
            effect
            for cause, forms in EFFECTS.items()
            if cause not in (*current.causes, *_UNOBSERVABLE)
            for effect in forms
            if np.ptp(self.table.current) > 0 or effect.current is None
        ]
        for effect in left:
            check_effect(effect)
        begun = list(self.pool.map(lambda e: self._begin_effect(current, e), left))
        begun.sort(key=lambda pair: pair[1].cost)
        fitted = self.pool.map(
            lambda pair: (pair[0], self._fit(pair[0], pair[1].x, 60)), begun[:LOOP_FITTED]
        )
        result = sorted(fitted, key=lambda pair: pair[1].cost)
        evaluated = self.pool.map(lambda pair: self._settle(current, *pair), result[:LOOP_COMPARED])
        return sorted(evaluated, key=lambda f: f.left_out)

    def choose(self, current: FittedLoops, tried: Sequence[FittedLoops]) -> FittedLoops | None:
        """Select the best effect if it lowers the error on rows left out enough."""
        enough = tried and not tried[0].left_out > LOOP_GAIN * current.left_out
        return tried[0] if enough else None

    def revise(self, taken: FittedLoops) -> FittedLoops:
        """Return the model; a table has too few rows to revise earlier effects."""
        return taken

    def finish(self, best: FittedLoops) -> FittedLoops:
        """Return the model; see ``revise``."""
        return best

    def _fit(self, model: LoopModel, start: NDArray, most: int = STEPS) -> Optimum:
        self.advance()
        return model.fit(start, most)

    def _leave_out(self, model: LoopModel, optimum: Optimum) -> FittedLoops:
        """Evaluate a fit on the rows held out, or on groups of rows left out in turn."""
        table = model.table
        if self.judging is not None and table is self.table:
            others = model.on(self.judging, model.cycles)
            return FittedLoops(model, optimum, rms(others.loops(optimum.x)[0] - 1))
        if table.held_out.any():
            ratios = model.loops(optimum.x)[0]
            return FittedLoops(model, optimum, rms((ratios - 1)[np.tile(table.held_out, 2)]))
        n, squares = len(table.amplitude), 0.0
        folds = min(LARGE_LOOP_FOLDS if self.is_large else LOOP_FOLDS, n)
        group = np.random.default_rng(self.seed).permutation(n) % folds
        for fold in range(folds):
            part = replace(model, table=replace(table, held_out=group == fold))
            ratios = part.loops(self._fit(part, optimum.x).x)[0]
            squares += float(np.sum((ratios - 1)[np.tile(group == fold, 2)] ** 2))
        left_out = float(np.sqrt(squares / (2 * n))) if np.isfinite(squares) else np.inf
        return FittedLoops(model, optimum, left_out)

    def _settle(self, current: FittedLoops, model: LoopModel, optimum: Optimum) -> FittedLoops:
        """Fit an effect around several laws that were nearly as good without it."""
        result = [optimum]
        for law in current.others:
            start = np.concatenate([law, optimum.x[model.n_law :]])
            result.append(self._fit(replace(model, expected=law), start, 60))
        best = min(result, key=lambda o: o.cost)
        evaluated = self._leave_out(replace(model, expected=best.x[: model.n_law]), best)
        return replace(evaluated, others=current.others)

    def _begin_effect(self, current: FittedLoops, effect: Effect) -> tuple[LoopModel, Optimum]:
        """Add an effect and take a few steps from each of its starts; the best of their ends."""
        model = current.model.with_effects(effect)
        choices = [
            [min(max(s * model.size(q), q.lower), q.upper) for s in q.starts]
            for q in effect.parameters
        ]
        result = [
            self._fit(model, np.concatenate([current.optimum.x, np.array(shape)]), _FIRST_STEPS)
            for shape in list(product(*choices))[:_SHAPE_STARTS]
        ]
        return model, min(result, key=lambda o: o.cost)
