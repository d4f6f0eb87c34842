"""Fits of causes to a building's records: screened to first order, by a few steps, to the end."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ....identification.least_squares import orthonormal
from ...decisions import (
    BEGUN_WELL,
    FOLLOWS,
    FORMS_TRIED,
    MOST_REFINED,
    REFINED,
    SCREENING_STEPS,
    SIMULATED,
    STARTS_FITTED,
    WORTH_REFITTING,
)
from ..causes.candidate import Candidate, Values
from ..comparison import BuildingComparison, CauseValues, FittedBuilding, squared, with_causes
from ..isolator_effects import ISOLATOR_EFFECTS
from .layer_effects import helpful_effects
from .ranking import rank

_ALIKE = 1e-3
"""Squared sine of the angle between changes that are one to first order."""
T = TypeVar("T")


@dataclass(frozen=True)
class CauseFits:
    """Fits of causes, each beside those that are in a model."""

    comparison: BuildingComparison  # Whose data are fitted
    alone: BuildingComparison  # Has simulated what each cause changes alone

    def rough(
        self, current: FittedBuilding, choices: Sequence[Candidate], most: int, gained: float = 0.0
    ) -> list[FittedBuilding]:
        """Each cause's own numbers fitted roughly, by one step where others fit better by it.

        ``gained`` is what other causes gain.
        """
        screened = self.screened(current, choices, most)

        def fit(cause: Candidate, start: Values, steps: int) -> FittedBuilding:
            return self.comparison.fit(current.cause_values, ((cause, start),), steps)

        one_step, best = [], gained
        # the error of a sensor is fitted without a simulation
        for gain, cause, starts in sorted(
            screened, key=lambda one: (not one[1].of_sensor, -one[0])
        ):
            if cause.of_sensor or gain >= FOLLOWS * best:
                one_step.append(fit(cause, starts[0], 1))
                best = max(best, current.cost - one_step[-1].cost)
        one_step = rank(one_step)
        all_starts = {cause: starts for _, cause, starts in screened}
        rough = []
        for one in one_step[:MOST_REFINED]:
            cause, values = one.cause_values[-1]
            # one step says little of what is far from linear, and does not tell forms of one cause
            other = not cause.late and cause.key != one_step[0].cause_values[-1][0].key
            if other and current.cost - one.cost < BEGUN_WELL * best:
                rough.append(one)
                continue
            fits = [fit(cause, start, SCREENING_STEPS) for start in all_starts[cause][1:]]
            fits.append(fit(cause, values, SCREENING_STEPS - 1))
            rough.append(min(fits, key=lambda outcome: outcome.cost))
        return rank(rough + one_step[MOST_REFINED:])

    def refined(
        self, current: FittedBuilding, rough: Sequence[FittedBuilding]
    ) -> list[FittedBuilding]:
        """The best causes fitted with all numbers; best first."""
        first = _few_of_each(rough, lambda one: one.cause_values[-1][0].key)[:REFINED]
        freed = _freed(current)
        if freed is not None:
            ranked = sorted(rough, key=lambda one: _left_along(current.fitted, one.fitted, freed))
            first += [one for one in ranked[:REFINED] if one not in first]
        refined = [self.comparison.fit((), one.cause_values) for one in first]
        return rank([*refined, *(one for one in rough if one not in first)])

    def screened(
        self, current: FittedBuilding, choices: Sequence[Candidate], most: int
    ) -> list[tuple[float, Candidate, Sequence[Values]]]:
        """Causes that follow the residual best to first order, each with gain and best starts."""
        screened: list[tuple[float, Candidate, Sequence[Values]]] = []
        freed = _freed(current)
        for cause in choices:
            if cause.label in current.causes:
                continue
            trials = [
                self.comparison.beside(current, cause, start, self.alone) for start in cause.starts
            ]
            order = np.argsort([squared(trial) for trial in trials], kind="stable")
            left = min(_left_along(current.fitted, trial, freed) for trial in trials)
            gain = current.cost - left
            screened.append((gain, cause, [cause.starts[k] for k in order[:STARTS_FITTED]]))
        of_sensors = [one for one in screened if one[1].of_sensor]
        simulated = sorted(
            (one for one in screened if not one[1].of_sensor), key=lambda one: -one[0]
        )
        return of_sensors + _few_of_each(simulated, lambda one: one[1].key)[:most]

    def helpful(self, current: FittedBuilding, choices: Sequence[Candidate]) -> Sequence[Candidate]:
        """Leave out effects beside one that is tried last if they do not help along the motion.

        Each would be compiled with it, which takes longer than all its simulations.
        """
        model = with_causes(self.comparison.model, current.cause_values)
        if all(one in ISOLATOR_EFFECTS.values() for one in model.effects):
            return choices
        added = {
            cause: [one for one in cause.apply(model, cause.starts[0]).effects
                    if one not in model.effects]
            for cause in choices
        }  # fmt: skip
        effects = dict.fromkeys(one for some in added.values() for one in some)
        helpful = helpful_effects(self.comparison, current.cause_values, effects)
        return [cause for cause in choices if all(one in helpful for one in added[cause])]

    def pairs(self, choices: Sequence[Candidate]) -> list[FittedBuilding]:
        """Roughly fit pairs of causes, best first; what both change is screened."""
        trials: list[tuple[float, Candidate, Values, NDArray]] = []
        residual = _joined(self.comparison.fitted_residuals(()))
        for cause in choices:
            if cause.instead:
                continue
            own = []
            for start in cause.starts:
                change = _joined(self.comparison.fitted_residuals(((cause, start),))) - residual
                length = float(np.linalg.norm(change))
                if 0 < length < np.inf:
                    own.append((-abs(float(change @ residual)) / length, cause, start, change))
            trials += [min(own, key=lambda one: one[0])] if own else []
        along = np.array([change / np.linalg.norm(change) for *_, change in trials])
        gains, alike = along @ residual, along @ along.T
        pairs = []
        for i, j in combinations(range(len(trials)), 2):
            one, other = trials[i][1], trials[j][1]
            apart = 1 - alike[i, j] ** 2
            if one.key == other.key or apart < _ALIKE:
                continue
            both = gains[i] ** 2 + gains[j] ** 2 - 2 * alike[i, j] * gains[i] * gains[j]
            pairs.append((-both / apart, i, j))

        def fit(causes: CauseValues, steps: int) -> FittedBuilding:
            return self.comparison.fit((), causes, steps)

        starts = [
            tuple((trials[k][1], trials[k][2]) for k in two) for _, *two in sorted(pairs)
        ]  # fmt: skip
        rough = [fit(two, 1) for two in starts[:SIMULATED]]
        rough = sorted((one for one in rough if np.isfinite(one.cost)), key=lambda one: one.cost)
        fits = [fit(one.cause_values, SCREENING_STEPS) for one in rough[:MOST_REFINED]]
        return sorted(fits, key=lambda pair: pair.cost)


def _few_of_each(ranked: Sequence[T], key: Callable[[T], tuple[str, str]]) -> list[T]:
    """Leave out what is ranked below several forms of the same cause: there are other causes."""
    seen: dict[tuple[str, str], int] = {}
    shortlist = []
    for one in ranked:
        seen[key(one)] = seen.get(key(one), 0) + 1
        if seen[key(one)] <= FORMS_TRIED:
            shortlist.append(one)
    return shortlist


def _left_along(
    residual: Sequence[NDArray], trial: Sequence[NDArray], freed: NDArray | None
) -> float:
    """Least squared residual on the line from a residual to that of a trial."""
    before, after = (
        np.concatenate([part.ravel() for part in parts]) for parts in (residual, trial)
    )
    change = after - before
    if freed is not None:
        change -= freed @ (freed.T @ change)
    length = float(change @ change)
    if not 0 < length < np.inf:
        return np.inf
    return float(before @ before) - float(before @ change) ** 2 / length


def _freed(current: FittedBuilding) -> NDArray | None:
    """Orthonormal changes of the fitted residual by the numbers of the causes in a model."""
    # earlier causes have taken what is in part the share of the next one
    return None if current.optimum is None else orthonormal(current.optimum.jacobian)


def _joined(parts: Sequence[NDArray]) -> NDArray:
    """Weighted residuals of all parts, one after another."""
    return np.concatenate([part.ravel() for part in parts])


def near_the_best(
    current: FittedBuilding, rough: Sequence[FittedBuilding], best: Sequence[FittedBuilding]
) -> list[FittedBuilding]:
    """Those of some fits that may come near to the best of others."""
    least = WORTH_REFITTING * (current.cost - best[0].cost) if best else 0.0
    return [one for one in rough if current.cost - one.cost >= least]
