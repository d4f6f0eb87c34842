"""What a search for causes in a building has found so far, and fits in the light of it."""

from __future__ import annotations

from collections.abc import Sequence

from ...decisions import INSTEAD, LEAST_SENSOR_ERROR, SCREENING_STEPS
from ..causes.candidate import Candidate
from ..comparison import BuildingComparison, CauseValues, FittedBuilding
from ..errors import relative_errors
from ..goodness_of_fit import is_quiet
from .cause_fits import CauseFits


class SearchState:
    """The records with the noise seen so far, the causes that are tried, and rivals of those found.

    ``comparison`` holds the noise as it is seen with the causes taken so far in the model,
    ``before`` the nominal model under that noise, ``rivals`` the models that the data do not tell
    from each cause when it was taken, and ``simpler`` the forms of fewer numbers of each cause that
    was proposed.
    """

    def __init__(self, comparison: BuildingComparison, choices: Sequence[Candidate]):
        self.comparison, self.choices = comparison, choices
        # what each cause changes alone is simulated once, whatever is assumed later
        self._alone = comparison
        self.before = comparison.evaluate(())
        self.rivals: dict[str, list[FittedBuilding]] = {}
        self.simpler: dict[tuple[str, str], list[Candidate]] = {}

    @property
    def fits(self) -> CauseFits:
        """Fits of causes under the present noise."""
        return CauseFits(self.comparison, self._alone)

    def is_explained(self, current: FittedBuilding) -> bool:
        """Whether the residuals are as likely as those of noise alone."""
        return is_quiet(self.comparison, current)

    def with_best_sampling(self, best: FittedBuilding) -> FittedBuilding:
        """Fit causes again if another assumption between samples is nearer with their last form."""
        comparison, causes = self.comparison.with_best_sampling(best.cause_values)
        return best if comparison is self.comparison else self.fit_under(comparison, causes)

    def fit_under(self, comparison: BuildingComparison, causes: CauseValues) -> FittedBuilding:
        """Fit causes under another comparison, which is the search's from then on."""
        self.comparison, self.before = comparison, comparison.evaluate(())
        return comparison.fit((), causes)

    def fit_instead(self, causes: CauseValues, current: FittedBuilding) -> FittedBuilding:
        """Fit causes in the place of others, to the end only if they come near to those."""
        rough = self.comparison.fit((), causes, SCREENING_STEPS)
        far = INSTEAD**2 * rough.cost > current.cost
        return rough if far else self.comparison.fit((), rough.cause_values)

    def fit_effect_instead(
        self, rest: CauseValues, k: int, effect: Candidate, current: FittedBuilding
    ) -> FittedBuilding:
        """Fit an effect, before the k-th of other causes, in the place of the causes of a model."""
        fits = [
            self.fit_instead((*rest[:k], (effect, start), *rest[k:]), current)
            for start in effect.starts
        ]
        return min(fits, key=lambda one: one.cost)

    def is_calibration(self, best: FittedBuilding, other: FittedBuilding) -> bool:
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

    def fits_without_each(self, current: FittedBuilding) -> list[FittedBuilding]:
        """Fits that lack one of the causes in a model."""
        result = current.cause_values
        return [self.comparison.fit((), result[:k] + result[k + 1 :]) for k in range(len(result))]
