"""Which of several fitted causes is nearer to the records, and which the data do not tell apart."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...decisions import NEARLY_RIGHT, RIVALS_TRIED, STRONG_EVIDENCE
from ...inference import rivals
from ..causes.candidate import Candidate, Values
from ..comparison import FittedBuilding


def rank(outcomes: Sequence[FittedBuilding]) -> list[FittedBuilding]:
    """Fits by Schwarz's criterion, the best first."""
    if not outcomes:
        return []
    n = min(outcomes, key=lambda outcome: outcome.cost).n_independent
    return sorted(outcomes, key=lambda outcome: outcome.criterion(n))


def is_nearer(trial: FittedBuilding, current: FittedBuilding, least: float = 0.0) -> bool:
    """Whether a model is nearer to the data than another, by Schwarz's criterion."""
    n = min((trial, current), key=lambda outcome: outcome.cost).n_independent
    return trial.criterion(n) < current.criterion(n) - least


def may_be_nearer(trial: FittedBuilding, current: FittedBuilding) -> bool:
    """Whether a model is about as near to the fitted data as another, or clearly nearer to all."""
    return (
        is_nearer(trial, current, -STRONG_EVIDENCE)
        or twice_log_odds(trial, current) > STRONG_EVIDENCE
    )  # fmt: skip


def twice_log_odds(one: FittedBuilding, other: FittedBuilding) -> float:
    """Logarithm of the odds of a model against another, twice, by what both predict, too."""
    n = one.n_independent
    predicted = n * sum(part.size for part in one.held_out) / one.n
    return float(
        other.criterion(n) - one.criterion(n)
        + predicted * np.log(other.held_out_cost / one.held_out_cost)
    )  # fmt: skip


def simplest_form(accepted: Sequence[FittedBuilding]) -> FittedBuilding | None:
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


def likelier_on_all(best: FittedBuilding, accepted: Sequence[FittedBuilding]) -> FittedBuilding:
    """One of no more numbers than the best cause, if what it predicts makes it clearly likelier."""
    likelier = [
        one for one in accepted
        if one.n_parameters <= best.n_parameters and twice_log_odds(one, best) > STRONG_EVIDENCE
    ]  # fmt: skip
    return max(likelier, key=lambda one: twice_log_odds(one, best), default=best)


def best_of_each(
    tried: Sequence[FittedBuilding], taken: Candidate
) -> list[tuple[Candidate, Values]]:
    """The best causes beside the one taken, each in its best form."""
    best: dict[tuple[str, str], tuple[Candidate, Values]] = {}
    for one in tried:
        cause, values = one.cause_values[-1]
        if cause.key != taken.key:
            best.setdefault(cause.key, (cause, values))
    return list(best.values())[:RIVALS_TRIED]


def rivals_of(
    current: FittedBuilding, best: FittedBuilding, others: Sequence[FittedBuilding]
) -> list[FittedBuilding]:
    """Models that the data do not tell from the best, one for each other cause."""
    n, allowance = best.n_independent, STRONG_EVIDENCE
    if best.at_bound:  # it only acts like the right one, and none need have the exact form
        allowance += n * np.log1p(NEARLY_RIGHT**2 * current.cost / best.cost)
    worse = [(one.causes[-1], one.criterion(n) - best.criterion(n)) for one in others]
    near = rivals(best.causes[-1], worse, allowance)
    return [next(one for one in others if one.causes[-1] == name) for name in near]
