"""Causes that were found are exchanged for their like, or dropped, once all are known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...decisions import (
    LEAST_BUILDING_SHARE,
    LEAST_SENSOR_ERROR,
    MANY_NUMBERS,
    MINOR_IN_BUILDING,
    NEARLY_RIGHT,
    RIVALS_TRIED,
    STRONG_EVIDENCE,
    UNRESOLVED,
)
from ..causes.candidate import Candidate, Values
from ..causes.isolator_causes import CURRENT_CAUSES, LAYER_NUMBERS
from ..comparison import CauseValues, FittedBuilding, squared, with_causes
from ..errors import mean_error
from ..goodness_of_fit import is_quiet
from ..isolator_effects import HISTORIES, ISOLATOR_EFFECTS, LAYER_CAUSES
from .layer_effects import proposed_effects
from .ranking import is_nearer, twice_log_odds
from .search_state import SearchState


def exchange_for_one(state: SearchState, current: FittedBuilding) -> FittedBuilding:
    """Put one effect of the isolators in the place of several causes, if it is far nearer."""
    # a force, a stiffness or a damping of another size mends the form of an effect
    several = [one for one in current.cause_values if _is_of_layer(one[0])]
    if len(several) < 2 or not any(cause.name in LAYER_NUMBERS for cause, _ in several):
        return current
    rest = tuple(one for one in current.cause_values if one not in several)
    for nearest, *simpler in proposed_effects(state.comparison, rest):
        trial = state.fit_effect_instead(rest, len(rest), nearest, current)
        no_worse = trial.held_out_cost <= current.held_out_cost
        if no_worse and is_nearer(trial, current, STRONG_EVIDENCE):
            current = trial
            state.simpler[nearest.key] = simpler
            state.rivals.setdefault(nearest.label, [])
    return current


def exchange_for_simpler(state: SearchState, current: FittedBuilding) -> FittedBuilding:
    """Put causes of fewer numbers in the place of those of many, if they are nearer."""
    # at the ends of their ranges many numbers imitate a single one
    for k in range(len(current.cause_values)):
        before, (many, _), after = around(current, k)
        if len(many.parameters) < MANY_NUMBERS:
            continue
        fewer = [
            cause for cause in state.choices
            if len(cause.parameters) < len(many.parameters)
            and not (cause.of_sensor or cause.late or cause.instead)
        ]  # fmt: skip
        without = state.comparison.fit((), (*before, *after))
        for _, other, starts in state.fits.screened(without, fewer, RIVALS_TRIED):
            trial = state.fit_instead((*before, (other, starts[0]), *after), current)
            still = current.cause_values[k][0] is many
            alike = still and state.is_calibration(current, trial)
            if is_nearer(trial, current) or _is_enough(state, trial, current) or alike:
                current = trial
                state.rivals.setdefault(other.label, [])
    return current


def exchange_histories(state: SearchState, current: FittedBuilding) -> FittedBuilding:
    """Compare what softens with its history in all forms: one motion hardly tells which."""
    for k in range(len(current.cause_values)):
        if current.cause_values[k][0].name not in HISTORIES:
            continue
        found, compared = current, (state.comparison, state.before)
        more = state.comparison.fitting_more()
        if more is not None:  # how fast something cools shows late
            current = state.fit_under(more, current.cause_values)
        before, (cause, _), after = around(current, k)
        rest = (*before, *after)  # fitted without a history, they would follow it in part
        fits = [
            state.fit_effect_instead(rest, k, one, current)
            for one, *_ in proposed_effects(state.comparison, rest, HISTORIES, 0.0, True)
            if (one.key, one.form) != (cause.key, cause.form)
        ]
        fits = sorted([current, *fits], key=lambda one: twice_log_odds(current, one))
        nearest = {one.causes[k]: one for one in reversed(fits)}
        current, listed = fits[0], state.rivals.setdefault(fits[0].causes[k], [])
        known = {one.causes[-1] for one in listed}
        # none need have the exact form
        share = NEARLY_RIGHT**2 * state.before.cost / current.cost
        most = STRONG_EVIDENCE + current.n_independent * np.log1p(share)
        listed += [
            replace(one, cause_values=(*before, *after, one.cause_values[k]))
            for name, one in nearest.items()
            if name not in (current.causes[k], *known) and twice_log_odds(current, one) < most
        ]
        if current.cause_values[k][0] is cause:
            current, (state.comparison, state.before) = found, compared
    return current


def _is_enough(state: SearchState, trial: FittedBuilding, current: FittedBuilding) -> bool:
    """Whether a model of fewer numbers leaves noise alone, no more of it where held out.

    Many numbers follow errors of the simulation that are smaller than the noise.
    """
    return trial.held_out_cost <= current.held_out_cost and state.is_explained(trial)


def exchange_variants(state: SearchState, current: FittedBuilding) -> FittedBuilding:
    """Put other forms of the causes in their place, from the numbers found as well."""
    for k in range(len(current.cause_values)):
        before, (cause, values), after = around(current, k)
        for other in (*state.choices, *state.simpler.get(cause.key, ())):
            if other.key == cause.key and other.form != cause.form:
                choices = (*other.starts, carried_over(other, cause, values))
                starts = [(*before, (other, start), *after) for start in choices]
                costs = [squared(state.comparison.fitted_residuals(one)) for one in starts]
                trial = state.fit_instead(starts[int(np.argmin(costs))], current)
                more = len(other.parameters) > len(cause.parameters)
                if is_nearer(trial, current, STRONG_EVIDENCE if more else 0.0):
                    current = trial
    return current


def without_negligible(state: SearchState, best: FittedBuilding) -> FittedBuilding:
    """Drop causes that correct too little of the signal, the least one first."""

    def left(outcomes: Sequence[FittedBuilding]) -> NDArray:
        errors = [
            [mean_error(state.comparison, one, held_out) for held_out in (False, True)]
            for one in outcomes
        ]
        # a model that diverges without a cause needs it
        return np.nan_to_num(errors, nan=np.inf) ** 2

    while len(best.cause_values) > 1:
        trials = state.fits_without_each(best)
        unresolved = between_samples(state, best, trials)
        if unresolved is not None:
            best = trials[unresolved]
            continue
        nominal, after, *without = left([state.before, best, *trials])
        # on fitted or held-out data: what acts in strong motion alone shows in one of them
        corrected = np.maximum(without - after, 0.0)
        least = int(np.argmin(corrected.max(axis=1)))
        small = corrected[least] < np.minimum(
            MINOR_IN_BUILDING**2, LEAST_BUILDING_SHARE * (nominal - after)
        )
        if corrected[least].max() > LEAST_SENSOR_ERROR**2 and not small.all():
            break
        best = trials[least]
    return best


def of_one_sensor(state: SearchState, best: FittedBuilding) -> FittedBuilding:
    """Leave a sensor's error alone where all other channels show noise without other causes."""
    # causes beside an error of a sensor also follow what its form does not
    for one in best.cause_values if len(best.cause_values) > 1 else ():
        if one[0].of_sensor and one[0].place in state.comparison.records[0].channels:
            others = state.comparison.without_channel(one[0].place)
            if is_quiet(others, others.evaluate((one,))):
                return state.comparison.fit((), (one,))
    return best


def between_samples(
    state: SearchState, best: FittedBuilding, without: Sequence[FittedBuilding]
) -> int | None:
    """A cause that changes the current less than the record tells of it; None without one.

    ``without`` are the models fitted without each cause, whose others may take its share.
    """
    of_current = [
        k for k, (cause, _) in enumerate(best.cause_values) if cause.name in CURRENT_CAUSES
    ]
    if not of_current:
        return None
    records = state.comparison.records
    recorded = [record.current for record in records if record.current is not None]

    def currents(causes: CauseValues) -> list[NDArray]:
        model = with_causes(state.comparison.model, causes)
        return [model.run(record).current[:, 0] for record in records]

    with_all, changes = currents(best.cause_values), {}
    for k in of_current:
        pairs = zip(with_all, currents(without[k].cause_values), strict=True)
        changes[k] = sum(float(np.sum((one - other) ** 2)) for one, other in pairs)
    # by how much the current differs from itself a part of a sample before
    resolved = sum(float(np.sum((UNRESOLVED * np.diff(one)) ** 2)) for one in recorded)
    least = min(changes, key=lambda k: changes[k])
    return least if changes[least] < resolved else None


def around(
    fitted: FittedBuilding, place: int
) -> tuple[CauseValues, tuple[Candidate, Values], CauseValues]:
    """The causes before one, it with its numbers, and those after it."""
    causes = fitted.cause_values
    return causes[:place], causes[place], causes[place + 1 :]


def carried_over(other: Candidate, cause: Candidate, values: Values) -> Values:
    """Numbers of a form that start from those of the same name in another one."""
    found = dict(zip((p.name for p in cause.parameters), values, strict=True))
    own = zip(other.parameters, other.starts[0], strict=True)
    return tuple(float(np.clip(found.get(p.name, v), p.lower, p.upper)) for p, v in own)


def _is_of_layer(cause: Candidate) -> bool:
    """Whether a cause changes the force of the isolators along their motion."""
    return cause.name in (*LAYER_NUMBERS, *ISOLATOR_EFFECTS, *LAYER_CAUSES)
