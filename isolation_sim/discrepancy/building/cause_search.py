"""The search for causes in a building: which are tried, which is taken, which are dropped again.

A cause is taken if three independent views agree: the likelihood-ratio test, its level divided by
the number of causes asked; Schwarz's criterion; and the data that were not fitted, all of their
time. No model of a real building comes down to the noise of its sensors: what the best model leaves
on data not fitted is then the floor, and the search is repeated with weights that expect so much.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from itertools import combinations
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ...identification.least_squares import orthonormal
from ..decisions import (
    BEGUN_WELL,
    BUILDING_EXPLAINED,
    COMPLETES,
    FALSE_ALARM,
    FOLLOWS,
    FORMS_TRIED,
    INSTEAD,
    LATE_SIMULATED,
    LEAST_BUILDING_SHARE,
    LEAST_SENSOR_ERROR,
    MANY_NUMBERS,
    MINOR_IN_BUILDING,
    MISFIT_LEVEL,
    MOST_BUILDING_CAUSES,
    MOST_REFINED,
    NEARLY_RIGHT,
    NOT_WORSE,
    REFINED,
    REMAINS,
    RIVALS_TRIED,
    SCREENING_STEPS,
    SEVERAL_TIMES,
    SIMULATED,
    STARTS_FITTED,
    STRONG_EVIDENCE,
    TO_BLAME,
    UNRESOLVED,
    WORTH_REFITTING,
)
from ..inference import rivals
from ..search import Round, SearchResult, search
from .candidate import Candidate, Values
from .comparison import BuildingComparison, CauseValues, FittedBuilding, squared, with_causes
from .errors import excess_error, largest_excess, mean_error, relative_errors, relative_noise
from .goodness_of_fit import adequacy, is_quiet, noise_chance, p_value
from .isolator_causes import CURRENT_CAUSES, LAYER_NUMBERS, current_causes, layer_causes
from .isolator_effects import HISTORIES, ISOLATOR_EFFECTS, LAYER_CAUSES
from .layer_effects import helpful_effects, proposed_effects
from .localisation import is_elsewhere, unknown_force
from .model import BuildingModel
from .record import BuildingRecord
from .sensor_causes import sensor_causes
from .structure_causes import structure_causes

_ALIKE = 1e-3
"""Squared sine of the angle between changes that are one to first order."""
T = TypeVar("T")


class CauseSearch:
    """The search space of building records; see ``search.SearchSpace``."""

    # ``comparison`` holds the noise as it is seen with the causes taken so far in the model,
    # ``before`` the nominal model under that noise, and ``rivals`` the models that the data do not
    # tell from each cause when it was taken, by its label.

    def __init__(
        self,
        comparison: BuildingComparison,
        most_causes: int = MOST_BUILDING_CAUSES,
        progress: Callable[[str], None] = lambda text: None,
        choices: Sequence[Candidate] | None = None,  # Causes that are tried; all by default
    ):
        self.comparison, self.most_causes, self.progress = comparison, most_causes, progress
        # what each cause changes alone is simulated once, whatever is assumed later
        self._alone = comparison
        self.before = comparison.evaluate(())
        self.rivals: dict[str, list[FittedBuilding]] = {}
        # chance of each model tried, by the noise of its round: its residuals' number may differ
        self.chances: dict[FittedBuilding, float] = {}
        # for each cause taken, the others that came next to it, with their numbers; and the last
        # ones that were fitted in the present round
        self._others: dict[str, list[tuple[Candidate, Values]]] = {}
        self._last: list[FittedBuilding] = []
        # for each cause that was proposed, its forms of fewer numbers
        self._simpler: dict[tuple[str, str], list[Candidate]] = {}
        self._choices = (
            candidates(comparison.model, comparison.records) if choices is None else choices
        )
        keys = {choice.key for choice in self._choices} | {(name, "") for name in LAYER_CAUSES}
        self._n_tests = len(keys)

    def is_explained(self, current: FittedBuilding) -> bool:
        """Whether the residuals are as likely as those of noise alone."""
        return is_quiet(self.comparison, current)

    def candidates(self, current: FittedBuilding) -> list[FittedBuilding]:
        """Fit all causes; late and last ones only where no other explains the records.

        Last ones are ranked below the others unless they leave far less, or noise alone.
        """
        self.progress(f"looking for a cause{' beside ' * bool(current.cause_values)}"
                      f"{', '.join(current.causes)}")  # fmt: skip
        self._last = []
        plain = [cause for cause in self._choices if not (cause.late or cause.instead)]
        first = self._helpful(current, plain)
        best = self._refined(current, self._fits(current, first, SIMULATED))
        if best and self.is_explained(best[0]) and not best[0].at_bound:
            return best
        if best:
            forms = [one for one in self._choices
                     if one.instead and one.key == best[0].cause_values[-1][0].key]  # fmt: skip
            best = _rank(best + self._refined(current, self._fits(current, forms, SIMULATED)))
        if self._is_little(current):
            return best
        late = [cause for cause in self._choices if cause.late]
        gain = current.cost - best[0].cost if best else 0.0
        fits = self._fits(current, late, LATE_SIMULATED, gain)
        rough = _near_the_best(current, fits, best)
        best = _rank(best + self._refined(current, rough))
        if best and is_elsewhere(self.comparison, current.cause_values, best[0].cause_values):
            return best
        proposed = []
        for nearest, *simpler in proposed_effects(self.comparison, current.cause_values):
            proposed.append(nearest)
            self._simpler[nearest.key] = simpler
        last = self._last = self._fits(current, proposed, LATE_SIMULATED)
        if best:  # flexible causes imitate simple ones
            last = [one for one in last if _may_be_nearer(one, best[0])]
        last = self._refined(current, last)
        if best and last:
            stands = self._stands_for(last[0], best[0])
            return [last[0], *_rank(best + last[1:])] if stands else best + last
        return best or last

    def _is_little(self, current: FittedBuilding) -> bool:
        """Whether causes leave so little of the misfit that no late one would be named for it."""
        left, misfit = (self.comparison.above_noise(one) for one in (current, self.before))
        return bool(current.cause_values) and all(
            one < LEAST_BUILDING_SHARE * other for one, other in zip(left, misfit, strict=True)
        )

    def _helpful(
        self, current: FittedBuilding, choices: Sequence[Candidate]
    ) -> Sequence[Candidate]:
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

    def _stands_for(self, last: FittedBuilding, best: FittedBuilding) -> bool:
        """Whether a flexible cause leaves far less than the best other, or noise alone.

        Beside noise alone both leave an error of nearly zero. Then the likelihood tells them apart,
        that of the held-out data too, which both predict.
        """
        left_by_last, left = (largest_excess(self.comparison, one) for one in (last, best))
        if left_by_last < INSTEAD * left:
            return True
        # weighted, the channels that show it count more than in the mean
        squares = zip(*map(self.comparison.above_noise, (last, best)), strict=True)
        if not self.is_explained(best) and all(
            max(by_last, 0.0) <= INSTEAD**2 * max(others, 0.0) for by_last, others in squares
        ):
            return True
        return self.is_explained(last) and _evidence(last, best) > STRONG_EVIDENCE

    def _fits(
        self, current: FittedBuilding, choices: Sequence[Candidate], most: int, gained: float = 0.0
    ) -> list[FittedBuilding]:
        """Each cause's own numbers fitted roughly, by one step where others fit better by it.

        ``gained`` is what other causes gain.
        """
        screened = self._screened(current, choices, most)

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
        one_step = _rank(one_step)
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
        return _rank(rough + one_step[MOST_REFINED:])

    def _refined(
        self, current: FittedBuilding, rough: Sequence[FittedBuilding]
    ) -> list[FittedBuilding]:
        """The best causes fitted with all numbers; best first."""
        first = _few_of_each(rough, lambda one: one.cause_values[-1][0].key)[:REFINED]
        freed = _freed(current)
        if freed is not None:
            ranked = sorted(rough, key=lambda one: _left_along(current.fitted, one.fitted, freed))
            first += [one for one in ranked[:REFINED] if one not in first]
        refined = [self.comparison.fit((), one.cause_values) for one in first]
        return _rank([*refined, *(one for one in rough if one not in first)])

    def _screened(
        self, current: FittedBuilding, choices: Sequence[Candidate], most: int
    ) -> list[tuple[float, Candidate, Sequence[Values]]]:
        """Causes that follow the residual best to first order, each with gain and best starts."""
        screened: list[tuple[float, Candidate, Sequence[Values]]] = []
        freed = _freed(current)
        for cause in choices:
            if cause.label in current.causes:
                continue
            trials = [
                self.comparison.beside(current, cause, start, self._alone) for start in cause.starts
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

    def choose(
        self, current: FittedBuilding, tried: Sequence[FittedBuilding]
    ) -> FittedBuilding | None:
        """Select the best cause on which all three views agree."""
        accepted = [one for one in tried if self._is_significant(current, one)]
        # last ones that are ranked below others are only rivals
        eligible = [one for one in tried if _is_last(tried[0]) or not _is_last(one)]
        accepted_first = [one for one in accepted if one in eligible]
        best = _simplest_form(accepted_first)
        if best is None:
            return None
        if not _is_last(best):  # it already stands for all others
            best = _likelier_on_all(best, accepted_first)
        self.rivals[best.causes[-1]] = _near(current, best, accepted)
        taken = best.cause_values[-1][0]
        others = _best_of_each([one for one in eligible if not _is_last(one)], taken)
        self._others[best.causes[-1]] = others + _best_of_each(self._last, taken)
        return best

    def revise(self, taken: FittedBuilding) -> FittedBuilding:
        """Estimate the noise again with the cause in the model, and drop needless causes."""
        current = self._compared_beside(taken.cause_values)
        if not self.is_explained(current):
            exchanged = self._exchange_causes(current)
            if exchanged is not current:
                current = self._compared_beside(exchanged.cause_values)
        while len(current.cause_values) > 1:
            best = min(self._without_each(current), key=lambda outcome: outcome.cost)
            if p_value(self.comparison, best, current) * self._n_tests < FALSE_ALARM:
                break
            current = best
        return current

    def _compared_beside(self, causes: CauseValues) -> FittedBuilding:
        """Fit causes under the noise and the assumption between samples that are best with them."""
        again, causes = self.comparison.with_best_sampling(causes)
        if again is self.comparison:  # else it has the noise beside the causes
            again = again.with_noise_beside(causes)
        return self._fit_under(again, causes)

    def _with_best_sampling(self, best: FittedBuilding) -> FittedBuilding:
        """Fit causes again if another assumption between samples is nearer with their last form."""
        comparison, causes = self.comparison.with_best_sampling(best.cause_values)
        return best if comparison is self.comparison else self._fit_under(comparison, causes)

    def _fit_under(self, comparison: BuildingComparison, causes: CauseValues) -> FittedBuilding:
        """Fit causes under another comparison, which is the search's from then on."""
        self.comparison, self.before = comparison, comparison.evaluate(())
        return comparison.fit((), causes)

    def pairs(self, first: Collection[Candidate]) -> list[FittedBuilding]:
        """Roughly fit causes of some beside one more, best first; what both change is screened."""
        trials: list[tuple[float, Candidate, Values, NDArray]] = []
        residual = _joined(self.before.fitted)
        for cause in self._choices:
            if cause.instead or (cause.late and cause not in first):
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
            if one.key == other.key or apart < _ALIKE or not (one in first or other in first):
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
        for pair in fits:
            self.chances[pair] = p_value(self.comparison, self.before, pair)
        return sorted(fits, key=lambda pair: pair.cost)

    def beginning_with(self, causes: CauseValues) -> FittedBuilding:
        """Fit causes from which a search goes on, without those that are needless."""
        for cause, _ in causes:
            self.rivals[cause.label], self._others[cause.label] = [], []
        return self.revise(self.comparison.fit((), causes))

    def finish(self, best: FittedBuilding) -> FittedBuilding:
        """Replace each cause by a better variant; name none if together they remove too little."""
        best = self._exchange_for_one(self._exchange_for_simpler(best))
        best = self._exchange_histories(best)
        if self._is_calibration(best, self.before):
            return self.before
        best = self._with_best_sampling(self._exchange_variants(best))
        if len(best.cause_values) > 1:
            best = self._of_one_sensor(self._without_negligible(best))
        # weights may count a little gain that the error itself does not show
        nominal, error = (mean_error(self.comparison, one, True) for one in (self.before, best))
        helps = self.removed_share(best) >= TO_BLAME and not error > nominal
        return best if helps else self.before

    def without_each(self, best: FittedBuilding) -> list[FittedBuilding]:
        """Fits that lack one of the causes found."""
        return [self.before] if len(best.cause_values) == 1 else self._without_each(best)

    def removed_share(self, after: FittedBuilding) -> float:
        """Share of the misfit above the noise that a model removes, 0 to 1.

        That of the held-out data, or of the fitted data where the held-out ones show none.
        """
        segments, before = self.comparison.held_out, self.before.held_out
        costs = self.before.held_out_cost, after.held_out_cost
        if adequacy(segments, before) >= MISFIT_LEVEL:
            segments, costs = self.comparison.fitted, (self.before.cost, after.cost)
        noise = sum(segment.noise_cost for segment in segments)
        misfit, left = (max(cost - noise, 0.0) for cost in costs)
        return float(np.clip(1 - left / misfit, 0.0, 1.0)) if misfit > 0 else 0.0

    def explains(self, after: FittedBuilding, chance: float) -> bool:
        """Whether a model leaves noise, or nearly nothing of the misfit and of the signal.

        Nearly nothing is not several times the noise of good sensors.
        """
        if chance >= MISFIT_LEVEL:
            return True
        for held_out in (False, True):
            noise = np.hypot(relative_noise(self.comparison, held_out), LEAST_SENSOR_ERROR)
            left = excess_error(self.comparison, after, held_out)
            if left > min(REMAINS, SEVERAL_TIMES * noise):
                return False
        return self.removed_share(after) >= BUILDING_EXPLAINED

    def shows_where_fitted(self, one: FittedBuilding) -> bool:
        """Whether a model leaves less than half the error where it was fitted, beyond chance."""
        nominal, left = (
            excess_error(self.comparison, model, held_out=False) for model in (self.before, one)
        )
        return left < INSTEAD * nominal and self.chances[one] * self._n_tests < FALSE_ALARM

    def _is_significant(self, current: FittedBuilding, one: FittedBuilding) -> bool:
        n = one.n_independent
        self.chances[one] = p_value(self.comparison, current, one)
        stands_out = self.chances[one] * self._n_tests < FALSE_ALARM
        if not (stands_out and one.criterion(n) < current.criterion(n)):
            return False
        gain, gain_held_out = current.cost - one.cost, current.held_out_cost - one.held_out_cost
        left, left_held_out = self.comparison.above_noise(current)
        completes = min(gain - COMPLETES * left, gain_held_out - COMPLETES * left_held_out) > 0
        # what grows shows little of itself in the fitted data
        misfit, misfit_held_out = self.comparison.above_noise(self.before)
        share = max(
            gain - LEAST_BUILDING_SHARE * misfit,
            gain_held_out - LEAST_BUILDING_SHARE * misfit_held_out,
        )
        return (
            gain_held_out > 0
            and (completes or share > 0)
            and all(
                np.all(segment.halves(after) < NOT_WORSE * segment.halves(without))
                for segment, after, without in zip(
                    self.comparison.held_out, one.held_out, current.held_out, strict=True
                )
            )
        )

    def _without_each(self, current: FittedBuilding) -> list[FittedBuilding]:
        result = current.cause_values
        return [self.comparison.fit((), result[:k] + result[k + 1 :]) for k in range(len(result))]

    def _without_negligible(self, best: FittedBuilding) -> FittedBuilding:
        """Drop causes that correct too little of the signal, the least one first."""

        def left(outcomes: Sequence[FittedBuilding]) -> NDArray:
            errors = [
                [mean_error(self.comparison, one, held_out) for held_out in (False, True)]
                for one in outcomes
            ]
            # a model that diverges without a cause needs it
            return np.nan_to_num(errors, nan=np.inf) ** 2

        while len(best.cause_values) > 1:
            trials = self._without_each(best)
            unresolved = self._between_samples(best, trials)
            if unresolved is not None:
                best = trials[unresolved]
                continue
            nominal, after, *without = left([self.before, best, *trials])
            # on fitted or held-out data: what acts in strong motion alone shows in one of them
            corrected = np.maximum(without - after, 0.0)
            least = int(np.argmin(corrected.max(axis=1)))
            small = corrected[least] < np.minimum(
                MINOR_IN_BUILDING**2, LEAST_BUILDING_SHARE * (nominal - after)
            )
            completes = self.is_explained(best) and not self.is_explained(trials[least])
            enough = corrected[least].max() > LEAST_SENSOR_ERROR**2
            if enough and (completes or not small.all()):
                break
            best = trials[least]
        return best

    def _is_calibration(self, best: FittedBuilding, other: FittedBuilding) -> bool:
        """Whether a model corrects no more of another than the calibration of good sensors."""
        of_sensors = all(cause.of_sensor for cause, _ in best.cause_values)
        for held_out in (False, True):
            before, after = (
                relative_errors(self.comparison, one, held_out)[self.comparison.seen] ** 2
                for one in (other, best)
            )
            corrected = (before - after).max() if of_sensors else (before - after).mean()
            if not corrected <= LEAST_SENSOR_ERROR**2:
                return False
        return True

    def _of_one_sensor(self, best: FittedBuilding) -> FittedBuilding:
        """Leave a sensor's error alone where all other channels show noise without other causes."""
        # causes beside an error of a sensor also follow what its form does not
        for one in best.cause_values if len(best.cause_values) > 1 else ():
            if one[0].of_sensor and one[0].place in self.comparison.records[0].channels:
                others = self.comparison.without_channel(one[0].place)
                if is_quiet(others, others.evaluate((one,))):
                    return self.comparison.fit((), (one,))
        return best

    def _between_samples(
        self, best: FittedBuilding, without: Sequence[FittedBuilding]
    ) -> int | None:
        """A cause that changes the current less than the record tells of it; None without one.

        ``without`` are the models fitted without each cause, whose others may take its share.
        """
        of_current = [
            k for k, (cause, _) in enumerate(best.cause_values) if cause.name in CURRENT_CAUSES
        ]
        if not of_current:
            return None
        records = self.comparison.records
        recorded = [record.current for record in records if record.current is not None]

        def currents(causes: CauseValues) -> list[NDArray]:
            model = with_causes(self.comparison.model, causes)
            return [model.run(record).current[:, 0] for record in records]

        with_all, changes = currents(best.cause_values), {}
        for k in of_current:
            pairs = zip(with_all, currents(without[k].cause_values), strict=True)
            changes[k] = sum(float(np.sum((one - other) ** 2)) for one, other in pairs)
        # by how much the current differs from itself a part of a sample before
        resolved = sum(float(np.sum((UNRESOLVED * np.diff(one)) ** 2)) for one in recorded)
        least = min(changes, key=lambda k: changes[k])
        return least if changes[least] < resolved else None

    def _fit_instead(self, causes: CauseValues, current: FittedBuilding) -> FittedBuilding:
        """Fit causes in the place of others, to the end only if they come near to those."""
        rough = self.comparison.fit((), causes, SCREENING_STEPS)
        far = INSTEAD**2 * rough.cost > current.cost
        return rough if far else self.comparison.fit((), rough.cause_values)

    def _fit_effect_instead(
        self, rest: CauseValues, k: int, effect: Candidate, current: FittedBuilding
    ) -> FittedBuilding:
        """Fit an effect, before the k-th of other causes, in the place of the causes of a model."""
        fits = [
            self._fit_instead((*rest[:k], (effect, start), *rest[k:]), current)
            for start in effect.starts
        ]
        return min(fits, key=lambda one: one.cost)

    def _exchange_causes(self, current: FittedBuilding) -> FittedBuilding:
        """Put others that were tried in the place of earlier causes, if they are nearer now."""
        for k in range(len(current.cause_values) - 1):
            before, (cause, _), after = _around(current, k)
            for other in self._others[cause.label]:
                if other[0].label in current.causes:
                    continue
                trial = self._fit_instead((*before, other, *after), current)
                if (
                    self._stands_for(trial, current) if other[0].last
                    else _evidence(trial, current) > STRONG_EVIDENCE
                ):  # fmt: skip
                    current = trial
                    self.rivals.setdefault(other[0].label, [])
                    self._others.setdefault(other[0].label, [])
        return current

    def _exchange_for_simpler(self, current: FittedBuilding) -> FittedBuilding:
        """Put causes of fewer numbers in the place of those of many, if they are nearer."""
        # at the ends of their ranges many numbers imitate a single one
        for k in range(len(current.cause_values)):
            before, (many, _), after = _around(current, k)
            if len(many.parameters) < MANY_NUMBERS:
                continue
            fewer = [
                cause for cause in self._choices
                if len(cause.parameters) < len(many.parameters)
                and not (cause.of_sensor or cause.late or cause.instead)
            ]  # fmt: skip
            without = self.comparison.fit((), (*before, *after))
            for _, other, starts in self._screened(without, fewer, RIVALS_TRIED):
                trial = self._fit_instead((*before, (other, starts[0]), *after), current)
                still = current.cause_values[k][0] is many
                alike = still and self._is_calibration(current, trial)
                if _is_nearer(trial, current) or self._is_enough(trial, current) or alike:
                    current = trial
                    self.rivals.setdefault(other.label, [])
        return current

    def _exchange_for_one(self, current: FittedBuilding) -> FittedBuilding:
        """Put one effect of the isolators in the place of several causes, if it is far nearer."""
        # a force, a stiffness or a damping of another size mends the form of an effect
        several = [one for one in current.cause_values if _is_of_layer(one[0])]
        if len(several) < 2 or not any(cause.name in LAYER_NUMBERS for cause, _ in several):
            return current
        rest = tuple(one for one in current.cause_values if one not in several)
        rest = self.comparison.fit((), rest).cause_values
        for nearest, *simpler in proposed_effects(self.comparison, rest):
            trial = self._fit_effect_instead(rest, len(rest), nearest, current)
            no_worse = trial.held_out_cost <= current.held_out_cost
            if no_worse and _is_nearer(trial, current, STRONG_EVIDENCE):
                current = trial
                self._simpler[nearest.key] = simpler
                self.rivals.setdefault(nearest.label, [])
        return current

    def _exchange_histories(self, current: FittedBuilding) -> FittedBuilding:
        """Compare what softens with its history in all forms: one motion hardly tells which."""
        for k in range(len(current.cause_values)):
            if current.cause_values[k][0].name not in HISTORIES:
                continue
            found, compared = current, (self.comparison, self.before)
            more = self.comparison.fitting_more()
            if more is not None:  # how fast something cools shows late
                current = self._fit_under(more, current.cause_values)
            before, (cause, _), after = _around(current, k)
            rest = self.comparison.fit((), (*before, *after)).cause_values
            fits = [
                self._fit_effect_instead(rest, k, one, current)
                for one, *_ in proposed_effects(self.comparison, rest, HISTORIES, 0.0, True)
                if (one.key, one.form) != (cause.key, cause.form)
            ]
            fits = sorted([current, *fits], key=lambda one: _evidence(current, one))
            nearest = {one.causes[k]: one for one in reversed(fits)}
            current, listed = fits[0], self.rivals.setdefault(fits[0].causes[k], [])
            known = {one.causes[-1] for one in listed}
            # none need have the exact form
            share = NEARLY_RIGHT**2 * self.before.cost / current.cost
            most = STRONG_EVIDENCE + current.n_independent * np.log1p(share)
            listed += [
                replace(one, cause_values=(*before, *after, one.cause_values[k]))
                for name, one in nearest.items()
                if name not in (current.causes[k], *known) and _evidence(current, one) < most
            ]
            if current.cause_values[k][0] is cause:
                current, (self.comparison, self.before) = found, compared
        return current

    def _is_enough(self, trial: FittedBuilding, current: FittedBuilding) -> bool:
        """Whether a model of fewer numbers leaves noise alone, no more of it where held out.

        Many numbers follow errors of the simulation that are smaller than the noise.
        """
        return trial.held_out_cost <= current.held_out_cost and self.is_explained(trial)

    def _exchange_variants(self, current: FittedBuilding) -> FittedBuilding:
        """Put other forms of the causes in their place, from the numbers found as well."""
        for k in range(len(current.cause_values)):
            before, (cause, values), after = _around(current, k)
            for other in (*self._choices, *self._simpler.get(cause.key, ())):
                if other.key == cause.key and other.form != cause.form:
                    choices = (*other.starts, _carried_over(other, cause, values))
                    starts = [(*before, (other, start), *after) for start in choices]
                    costs = [squared(self.comparison.fitted_residuals(one)) for one in starts]
                    trial = self._fit_instead(starts[int(np.argmin(costs))], current)
                    more = len(other.parameters) > len(cause.parameters)
                    if _is_nearer(trial, current, STRONG_EVIDENCE if more else 0.0):
                        current = trial
        return current


def search_causes(
    comparison: BuildingComparison,
    most_causes: int = MOST_BUILDING_CAUSES,
    progress: Callable[[str], None] = lambda text: None,
) -> tuple[CauseSearch, SearchResult[FittedBuilding]]:
    """Search for causes, again with more of the last record fitted where only that shows them."""
    choices = candidates(comparison.model, comparison.records)
    before, late = comparison.evaluate(()), None
    missed, missed_fitted = (excess_error(comparison, before, part) for part in (True, False))
    if missed_fitted < NEARLY_RIGHT * missed:
        # what grows or comes late is seen in the held-out data alone
        late = _reopened(comparison, before)
        if late is not None:
            again = _search_as_expected(late, most_causes, progress, choices)
            if again[1].best.cause_values:
                return again
    space, result = _search_as_expected(comparison, most_causes, progress, choices)
    best, comes_late = result.best, False
    if not space.explains(best, noise_chance(space.comparison, best)):
        # a cause that imitates two others, taken first, may keep both out
        least = INSTEAD * largest_excess(space.comparison, best)
        of_pair = _search_from_pair(comparison, most_causes, progress, choices, choices, least)
        if of_pair is not None:
            return of_pair
        unknown = unknown_force(space.comparison, space.before, best.cause_values)
        if unknown is not None and unknown.is_in_structure:
            return space, result  # other causes only imitate it, too
        left, left_fitted = (excess_error(space.comparison, best, part) for part in (True, False))
        comes_late = left_fitted < INSTEAD * left
    if late is not None or (best.cause_values and not comes_late):
        return space, result
    reopened = _reopened(space.comparison, best)
    if reopened is None:
        return space, result
    again = _search_as_expected(reopened, most_causes, progress, choices, begin=best.cause_values)
    if best.cause_values:
        remains = largest_excess(again[0].comparison, again[1].best)
        nearer = remains < INSTEAD * largest_excess(space.comparison, best)
        return again if nearer else (space, result)
    found = again if again[1].best.cause_values else (space, result)
    remains = largest_excess(found[0].comparison, found[1].best)
    if remains > REMAINS:
        beside = _search_beside(space, result, reopened, choices, INSTEAD * remains)
        return found if beside is None else beside
    return found


def _search_beside(
    space: CauseSearch,
    result: SearchResult[FittedBuilding],
    comparison: BuildingComparison,
    choices: Sequence[Candidate],
    least: float,
) -> tuple[CauseSearch, SearchResult[FittedBuilding]] | None:
    """Search with more data fitted, from the cause that less of them showed; None without one.

    Beside another that acts in strong motion alone, it may help nothing where that is held out.
    All of them must leave less than an error.
    """
    tried = result.rounds[-1].tried if result.rounds else []
    if not tried or not space.shows_where_fitted(tried[0]):
        return None
    again = _search_as_expected(
        comparison, space.most_causes, space.progress, choices, begin=tried[0].cause_values
    )
    best = again[1].best
    found = len(best.cause_values) > 1 and largest_excess(again[0].comparison, best) < least
    return again if found else None


def search_at(
    space: CauseSearch,
    best: FittedBuilding,
    comparison: BuildingComparison,
    places: Collection[str],
    others: Collection[str],
) -> tuple[CauseSearch, SearchResult[FittedBuilding]] | None:
    """Search from the best pair of a cause at some places and one more; None without one.

    One that is known to be at a place may stand out only beside another, which a third cause
    imitates together with it. The pair must leave far less than the causes that a search found.
    """
    choices = [
        cause for cause in candidates(comparison.model, comparison.records)
        if cause.place in (*places, *others)
    ]  # fmt: skip
    first = [cause for cause in choices if cause.place in places]
    least = INSTEAD * largest_excess(space.comparison, best)
    return _search_from_pair(comparison, space.most_causes, space.progress, choices, first, least)


def _search_from_pair(
    comparison: BuildingComparison,
    most_causes: int,
    progress: Callable[[str], None],
    choices: Sequence[Candidate],
    first: Collection[Candidate],
    least: float,
) -> tuple[CauseSearch, SearchResult[FittedBuilding]] | None:
    """Search from the best pair, one of which is among some; None unless it leaves less."""
    expected = NEARLY_RIGHT * excess_error(comparison, comparison.evaluate(()))
    begun = CauseSearch(comparison.expecting(expected), most_causes, progress, choices)
    pairs = begun.pairs(first)
    if not pairs or not largest_excess(begun.comparison, pairs[0]) < least:
        return None
    space, result = _search_as_expected(
        comparison, most_causes, progress, choices, begin=pairs[0].cause_values
    )
    if not largest_excess(space.comparison, result.best) < least:
        return None
    space.chances.update(begun.chances)
    taken = Round(begun.before, pairs, pairs[0])
    return space, replace(result, rounds=[taken, *result.rounds])


def _reopened(comparison: BuildingComparison, best: FittedBuilding) -> BuildingComparison | None:
    """More of the last record fitted where a model misses its held-out part; None where not."""
    missed = adequacy(comparison.held_out, best.held_out) < MISFIT_LEVEL
    return comparison.fitting_more() if missed else None


def _search_as_expected(
    comparison: BuildingComparison,
    most_causes: int,
    progress: Callable[[str], None],
    choices: Sequence[Candidate],
    begin: CauseValues = (),
) -> tuple[CauseSearch, SearchResult[FittedBuilding]]:
    """Repeat the search until the best model leaves no more than the expected model error.

    It begins with some causes in the model.
    """
    expected = NEARLY_RIGHT * excess_error(comparison, comparison.evaluate(()))
    while True:
        space = CauseSearch(comparison.expecting(expected), most_causes, progress, choices)
        result = search(space, space.beginning_with(begin) if begin else space.before)
        left = excess_error(space.comparison, result.best)
        enough = max(2 * expected, relative_noise(space.comparison, True))
        if left < enough:
            return space, result
        expected = left


def _around(
    fitted: FittedBuilding, place: int
) -> tuple[CauseValues, tuple[Candidate, Values], CauseValues]:
    """The causes before one, it with its numbers, and those after it."""
    causes = fitted.cause_values
    return causes[:place], causes[place], causes[place + 1 :]


def _carried_over(other: Candidate, cause: Candidate, values: Values) -> Values:
    """Numbers of a form that start from those of the same name in another one."""
    found = dict(zip((p.name for p in cause.parameters), values, strict=True))
    own = zip(other.parameters, other.starts[0], strict=True)
    return tuple(float(np.clip(found.get(p.name, v), p.lower, p.upper)) for p, v in own)


def _few_of_each(ranked: Sequence[T], key: Callable[[T], tuple[str, str]]) -> list[T]:
    """Leave out what is ranked below several forms of the same cause: there are other causes."""
    seen: dict[tuple[str, str], int] = {}
    shortlist = []
    for one in ranked:
        seen[key(one)] = seen.get(key(one), 0) + 1
        if seen[key(one)] <= FORMS_TRIED:
            shortlist.append(one)
    return shortlist


def _near_the_best(
    current: FittedBuilding, rough: Sequence[FittedBuilding], best: Sequence[FittedBuilding]
) -> list[FittedBuilding]:
    """Those of some fits that may come near to the best of others."""
    least = WORTH_REFITTING * (current.cost - best[0].cost) if best else 0.0
    return [one for one in rough if current.cost - one.cost >= least]


def _is_of_layer(cause: Candidate) -> bool:
    """Whether a cause changes the force of the isolators along their motion."""
    return cause.name in (*LAYER_NUMBERS, *ISOLATOR_EFFECTS, *LAYER_CAUSES)


def _is_last(outcome: FittedBuilding) -> bool:
    """Whether the newest cause is one that must leave far less than others."""
    return outcome.cause_values[-1][0].last


def _rank(outcomes: Sequence[FittedBuilding]) -> list[FittedBuilding]:
    if not outcomes:
        return []
    n = min(outcomes, key=lambda outcome: outcome.cost).n_independent
    return sorted(outcomes, key=lambda outcome: outcome.criterion(n))


def _is_nearer(trial: FittedBuilding, current: FittedBuilding, least: float = 0.0) -> bool:
    """Whether a model is nearer to the data than another, by Schwarz's criterion."""
    n = min((trial, current), key=lambda outcome: outcome.cost).n_independent
    return trial.criterion(n) < current.criterion(n) - least


def _may_be_nearer(trial: FittedBuilding, current: FittedBuilding) -> bool:
    """Whether a model is about as near to the fitted data as another, or clearly nearer to all."""
    return (
        _is_nearer(trial, current, -STRONG_EVIDENCE)
        or _evidence(trial, current) > STRONG_EVIDENCE
    )  # fmt: skip


def _freed(current: FittedBuilding) -> NDArray | None:
    """Orthonormal changes of the fitted residual by the numbers of the causes in a model."""
    # earlier causes have taken what is in part the share of the next one
    return None if current.optimum is None else orthonormal(current.optimum.jacobian)


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


def _joined(parts: Sequence[NDArray]) -> NDArray:
    """Weighted residuals of all parts, one after another."""
    return np.concatenate([part.ravel() for part in parts])


def _simplest_form(accepted: Sequence[FittedBuilding]) -> FittedBuilding | None:
    """The best cause, in a form of fewer numbers if the data do not tell it from the best form."""
    if not accepted:
        return None
    best = accepted[0]
    n, cause = best.n_independent, best.cause_values[-1][0]
    alike = [
        one for one in accepted
        if one.cause_values[-1][0].key == cause.key
        and one.criterion(n) - best.criterion(n) < STRONG_EVIDENCE
    ]  # fmt: skip
    # what shows on one side alone need not be there alone
    return min(
        alike,
        key=lambda one: (one.n_parameters, one.cause_values[-1][0].form.startswith("one_side")),
    )


def _evidence(one: FittedBuilding, other: FittedBuilding) -> float:
    """Logarithm of the odds of a model against another, twice, by what both predict, too."""
    n = one.n_independent
    predicted = n * sum(part.size for part in one.held_out) / one.n
    return float(
        other.criterion(n) - one.criterion(n)
        + predicted * np.log(other.held_out_cost / one.held_out_cost)
    )  # fmt: skip


def _likelier_on_all(best: FittedBuilding, accepted: Sequence[FittedBuilding]) -> FittedBuilding:
    """One of no more numbers than the best cause, if what it predicts makes it clearly likelier."""
    likelier = [
        one for one in accepted
        if one.n_parameters <= best.n_parameters and _evidence(one, best) > STRONG_EVIDENCE
    ]  # fmt: skip
    return max(likelier, key=lambda one: _evidence(one, best), default=best)


def _best_of_each(
    tried: Sequence[FittedBuilding], taken: Candidate
) -> list[tuple[Candidate, Values]]:
    """The best causes beside the one taken, each in its best form."""
    best: dict[tuple[str, str], tuple[Candidate, Values]] = {}
    for one in tried:
        cause, values = one.cause_values[-1]
        if cause.key != taken.key:
            best.setdefault(cause.key, (cause, values))
    return list(best.values())[:RIVALS_TRIED]


def _near(
    current: FittedBuilding, best: FittedBuilding, others: Sequence[FittedBuilding]
) -> list[FittedBuilding]:
    """Models that the data do not tell from the best, one for each other cause."""
    n, allowance = best.n_independent, STRONG_EVIDENCE
    if best.at_bound:  # it only acts like the right one, and none need have the exact form
        allowance += n * np.log1p(NEARLY_RIGHT**2 * current.cost / best.cost)
    worse = [(one.causes[-1], one.criterion(n) - best.criterion(n)) for one in others]
    near = rivals(best.causes[-1], worse, allowance)
    return [next(one for one in others if one.causes[-1] == name) for name in near]


def candidates(model: BuildingModel, records: Sequence[BuildingRecord]) -> tuple[Candidate, ...]:
    """All candidate causes for the records of a building."""
    return (
        *structure_causes(model, records), *layer_causes(model, records),
        *current_causes(model, records), *sensor_causes(records),
    )  # fmt: skip
