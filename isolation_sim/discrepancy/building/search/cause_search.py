"""The search for causes in a building: which are tried, which is taken, which are dropped again.

A cause is taken if three independent views agree: the likelihood-ratio test, its level divided by
the number of causes asked; Schwarz's criterion; and the data that were not fitted, all of their
time. No model of a real building comes down to the noise of its sensors: what the best model leaves
on data not fitted is then the floor, and the search is repeated with weights that expect so much.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from ...decisions import (
    BUILDING_EXPLAINED,
    COMPLETES,
    FALSE_ALARM,
    INSTEAD,
    LATE_SIMULATED,
    LEAST_BUILDING_SHARE,
    LEAST_SENSOR_ERROR,
    MISFIT_LEVEL,
    MOST_BUILDING_CAUSES,
    NOT_WORSE,
    REMAINS,
    SEVERAL_TIMES,
    SIMULATED,
    STRONG_EVIDENCE,
    TO_BLAME,
)
from ..causes.candidate import Candidate, Values
from ..causes.isolator_causes import current_causes, layer_causes
from ..causes.sensor_causes import sensor_causes
from ..causes.structure_causes import structure_causes
from ..comparison import BuildingComparison, CauseValues, FittedBuilding
from ..errors import excess_error, largest_excess, least_noise, mean_error
from ..goodness_of_fit import adequacy, p_value
from ..isolator_effects import LAYER_CAUSES
from ..localisation import is_elsewhere
from ..model import BuildingModel
from ..record import BuildingRecord
from .cause_exchange import (
    around,
    exchange_for_one,
    exchange_for_simpler,
    exchange_histories,
    exchange_variants,
    of_one_sensor,
    without_negligible,
)
from .cause_fits import near_the_best
from .layer_effects import proposed_effects
from .ranking import (
    best_of_each,
    likelier_on_all,
    may_be_nearer,
    rank,
    rivals_of,
    simplest_form,
    twice_log_odds,
)
from .search_state import SearchState


class CauseSearch(SearchState):
    """The search space of building records; see ``SearchSpace`` in ``discrepancy/search.py``."""

    def __init__(
        self,
        comparison: BuildingComparison,
        most_causes: int = MOST_BUILDING_CAUSES,
        progress: Callable[[str], None] = lambda text: None,
        choices: Sequence[Candidate] | None = None,  # Causes that are tried; all by default
    ):
        if choices is None:
            choices = candidates(comparison.model, comparison.records)
        super().__init__(comparison, choices)
        self.most_causes, self.progress = most_causes, progress
        # chance of each model tried, by the noise of its round: its residuals' number may differ
        self.chances: dict[FittedBuilding, float] = {}
        # for each cause taken, the others that came next to it, with their numbers; and the last
        # ones that were fitted in the present round
        self._others: dict[str, list[tuple[Candidate, Values]]] = {}
        self._last: list[FittedBuilding] = []
        self._n_tests = len({one.key for one in choices} | {(name, "") for name in LAYER_CAUSES})

    def over(
        self, comparison: BuildingComparison, choices: Sequence[Candidate] | None = None
    ) -> CauseSearch:
        """A new search of another comparison, of the same causes or of others."""
        choices = self.choices if choices is None else choices
        return CauseSearch(comparison, self.most_causes, self.progress, choices)

    def going_on(self, comparison: BuildingComparison) -> CauseSearch:
        """A search of another comparison that goes on from this one."""
        again = self.over(comparison)
        again.chances, again.rivals, again.simpler = self.chances, self.rivals, self.simpler
        again._others = self._others
        return again

    def candidates(self, current: FittedBuilding) -> list[FittedBuilding]:
        """Fit all causes; late and last ones only where no other explains the records.

        Last ones are ranked below the others unless they leave far less, or noise alone.
        """
        self.progress(f"looking for a cause{' beside ' * bool(current.cause_values)}"
                      f"{', '.join(current.causes)}")  # fmt: skip
        self._last, fits = [], self.fits
        plain = [cause for cause in self.choices if not (cause.late or cause.instead)]
        first = fits.helpful(current, plain)
        best = fits.refined(current, fits.rough(current, first, SIMULATED))
        if best and self.is_explained(best[0]) and not best[0].at_bound:
            return best
        if best:
            forms = [one for one in self.choices
                     if one.instead and one.key == best[0].cause_values[-1][0].key]  # fmt: skip
            best = rank(best + fits.refined(current, fits.rough(current, forms, SIMULATED)))
        if self._is_little(current):
            return best
        late = [cause for cause in self.choices if cause.late]
        gain = current.cost - best[0].cost if best else 0.0
        rough = near_the_best(current, fits.rough(current, late, LATE_SIMULATED, gain), best)
        best = rank(best + fits.refined(current, rough))
        if best and is_elsewhere(self.comparison, current.cause_values, best[0].cause_values):
            return best
        proposed = []
        for nearest, *simpler in proposed_effects(self.comparison, current.cause_values):
            proposed.append(nearest)
            self.simpler[nearest.key] = simpler
        last = self._last = fits.rough(current, proposed, LATE_SIMULATED)
        if best:  # flexible causes imitate simple ones
            last = [one for one in last if may_be_nearer(one, best[0])]
        last = fits.refined(current, last)
        if best and last:
            stands = self._stands_for(last[0], best[0])
            return [last[0], *rank(best + last[1:])] if stands else best + last
        return best or last

    @cached_property
    def not_of_layer(self) -> list[Candidate]:
        """Causes in the structure and of sensors, which are seen whatever the isolators' force."""
        model, records = self.comparison.model, self.comparison.records
        names = {one.name for one in (*structure_causes(model, records), *sensor_causes(records))}
        # a mass of the base acts at the isolators
        names.discard("base_mass_error")
        return [cause for cause in self.choices if cause.name in names]

    def beside_any_force(self) -> tuple[CauseValues, CauseValues]:
        """Causes that are seen whatever force the isolators exert, and which of them matter."""
        choices = [cause for cause in self.not_of_layer if not (cause.late or cause.instead)]
        beside = self.comparison.beside_any_force()
        if beside is None:
            return (), ()
        space = self.over(beside, choices)
        current, gains = space.before, []
        while not space.is_explained(current) and len(current.cause_values) < self.most_causes:
            tried = space.fits.refined(current, space.fits.rough(current, choices, SIMULATED))
            found = [one for one in tried if space._stands_out(current, one)
                     and one.held_out_cost < current.held_out_cost]  # fmt: skip
            if not found:
                break
            gains.append(current.cost - found[0].cost)
            current = found[0]
        least = LEAST_BUILDING_SHARE * sum(gains)
        seen = current.cause_values
        return seen, tuple(one for one, gain in zip(seen, gains, strict=True) if gain > least)

    def _is_little(self, current: FittedBuilding) -> bool:
        """Whether causes leave so little of the misfit that no late one would be named for it."""
        left, misfit = (self.comparison.above_noise(one) for one in (current, self.before))
        return bool(current.cause_values) and all(
            one < LEAST_BUILDING_SHARE * other for one, other in zip(left, misfit, strict=True)
        )

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
        return self.is_explained(last) and twice_log_odds(last, best) > STRONG_EVIDENCE

    def choose(
        self, current: FittedBuilding, tried: Sequence[FittedBuilding]
    ) -> FittedBuilding | None:
        """Select the best cause on which all three views agree."""
        accepted = [one for one in tried if self._is_significant(current, one)]
        # last ones that are ranked below others are only rivals
        eligible = [one for one in tried if _is_last(tried[0]) or not _is_last(one)]
        accepted_first = [one for one in accepted if one in eligible]
        best = simplest_form(accepted_first)
        if best is None:
            return None
        if not _is_last(best):  # it already stands for all others
            best = likelier_on_all(best, accepted_first)
        self.rivals[best.causes[-1]] = rivals_of(current, best, accepted)
        taken = best.cause_values[-1][0]
        others = best_of_each([one for one in eligible if not _is_last(one)], taken)
        self._others[best.causes[-1]] = others + best_of_each(self._last, taken)
        return best

    def revise(self, taken: FittedBuilding) -> FittedBuilding:
        """Estimate the noise again with the cause in the model, and drop needless causes."""
        current = self._compared_beside(taken.cause_values)
        if not self.is_explained(current):
            exchanged = self._exchange_causes(current)
            if exchanged is not current:
                current = self._compared_beside(exchanged.cause_values)
        while len(current.cause_values) > 1:
            best = min(self.fits_without_each(current), key=lambda outcome: outcome.cost)
            if p_value(self.comparison, best, current) * self._n_tests < FALSE_ALARM:
                break
            current = best
        return current

    def _compared_beside(self, causes: CauseValues) -> FittedBuilding:
        """Fit causes under the noise and the assumption between samples that are best with them."""
        again, causes = self.comparison.with_best_sampling(causes)
        if again is self.comparison:  # else it has the noise beside the causes
            again = again.with_noise_beside(causes)
        return self.fit_under(again, causes)

    def pairs(self) -> list[FittedBuilding]:
        """Roughly fit pairs of causes, the best first."""
        pairs = self.fits.pairs(self.choices)
        for pair in pairs:
            self.chances[pair] = p_value(self.comparison, self.before, pair)
        return pairs

    def beginning_with(self, causes: CauseValues) -> FittedBuilding:
        """Fit causes from which a search goes on, without those that are needless."""
        for cause, _ in causes:
            self.rivals.setdefault(cause.label, [])
            self._others.setdefault(cause.label, [])
        return self.revise(self.comparison.fit((), causes))

    def finish(self, best: FittedBuilding) -> FittedBuilding:
        """Replace each cause by a better variant; name none if together they remove too little."""
        best = exchange_for_one(self, exchange_for_simpler(self, best))
        best = exchange_histories(self, best)
        if self.is_calibration(best, self.before):
            return self.before
        best = self.with_best_sampling(exchange_variants(self, best))
        if len(best.cause_values) > 1:
            best = of_one_sensor(self, without_negligible(self, best))
        # weights may count a little gain that the error itself does not show
        nominal, error = (mean_error(self.comparison, one, True) for one in (self.before, best))
        helps = self.removed_share(best) >= TO_BLAME and not error > nominal
        return best if helps else self.before

    def without_each(self, best: FittedBuilding) -> list[FittedBuilding]:
        """Fits that lack one of the causes found."""
        return [self.before] if len(best.cause_values) == 1 else self.fits_without_each(best)

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
        noise = np.hypot(least_noise(self.comparison), LEAST_SENSOR_ERROR)
        if largest_excess(self.comparison, after) > min(REMAINS, SEVERAL_TIMES * noise):
            return False
        return self.removed_share(after) >= BUILDING_EXPLAINED

    def shows_where_fitted(self, one: FittedBuilding) -> bool:
        """Whether a model leaves less than half the error where it was fitted, beyond chance."""
        nominal, left = (
            excess_error(self.comparison, model, held_out=False) for model in (self.before, one)
        )
        return left < INSTEAD * nominal and self.chances[one] * self._n_tests < FALSE_ALARM

    def _stands_out(self, current: FittedBuilding, one: FittedBuilding) -> bool:
        """Whether a further cause follows the fitted data better than chance would."""
        n = one.n_independent
        self.chances[one] = p_value(self.comparison, current, one)
        stands_out = self.chances[one] * self._n_tests < FALSE_ALARM
        return stands_out and one.criterion(n) < current.criterion(n)

    def _is_significant(self, current: FittedBuilding, one: FittedBuilding) -> bool:
        if not self._stands_out(current, one):
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

    def _exchange_causes(self, current: FittedBuilding) -> FittedBuilding:
        """Put others that were tried in the place of earlier causes, if they are nearer now."""
        for k in range(len(current.cause_values) - 1):
            before, (cause, _), after = around(current, k)
            for other in self._others[cause.label]:
                if other[0].label in current.causes:
                    continue
                trial = self.fit_instead((*before, other, *after), current)
                if (
                    self._stands_for(trial, current) if other[0].last
                    else twice_log_odds(trial, current) > STRONG_EVIDENCE
                ):  # fmt: skip
                    current = trial
                    self.rivals.setdefault(other[0].label, [])
                    self._others.setdefault(other[0].label, [])
        return current


def _is_last(outcome: FittedBuilding) -> bool:
    """Whether the newest cause is one that must leave far less than others."""
    return outcome.cause_values[-1][0].last


def candidates(model: BuildingModel, records: Sequence[BuildingRecord]) -> tuple[Candidate, ...]:
    """All candidate causes for the records of a building."""
    return (
        *structure_causes(model, records), *layer_causes(model, records),
        *current_causes(model, records), *sensor_causes(records),
    )  # fmt: skip
