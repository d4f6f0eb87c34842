"""Which causes a building's records show: the best one more, as long as it can be told from noise.

A cause is taken if three independent views agree: the likelihood-ratio test, its level divided by
the number of causes asked; Schwarz's criterion; and the data that were not fitted, all of their
time. No model of a real building comes down to the noise of its sensors: what the best model leaves
on data not fitted is then the floor, and the search is repeated with weights that expect so much.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from .causes import Candidate, candidates
from .errors import excess_error, relative_noise
from .fit import Comparison, Outcome, compare_records
from .part import Part, cell_means

FALSE_ALARM = 0.003
"""Level of the tests for one more cause, all candidates together."""
LEAST_SHARE = 0.02
"""A cause that removes less of the whole misfit is not worth a name."""
MOST_CAUSES = 4
TO_BLAME = 0.35
"""Share of the misfit, on data held out, that causes have to remove together to be named; as for
device tests."""
_NEARLY_RIGHT = 0.1
"""Share of the error that even the right cause is expected to leave: its form is not exact."""
_NOT_WORSE = 1.02
"""A cause must not make the mean square of any half of the data held out larger than this."""
_NEAR = 6.0
"""Rivals whose criterion is within this of the best are not told from it; beyond, evidence is
strong (Kass and Raftery 1995)."""
_SCREENING_STEPS, _REFINED = 4, 4
_QUIET = 0.1
"""Residuals as likely as this from noise alone are not searched."""


@dataclass(frozen=True)
class Trial:
    """A candidate that was tried.

    Attributes
    ----------
    cause : Candidate
        Which.
    outcome : Outcome
        With the causes found before and this one.
    p_value : float
        Of the likelihood-ratio test, alone.
    """

    cause: Candidate
    outcome: Outcome
    p_value: float


@dataclass(frozen=True, eq=False)
class Selection:
    """What was found, and on the way to it.

    Attributes
    ----------
    comparison : Comparison
        With the noise as it is seen with the causes in the model.
    before, after : Outcome
        Without any cause and with all of them.
    rounds : tuple of tuple of Trial
        In each round the candidates tried, the best first.
    without : tuple of Outcome
        Fits that lack one of the causes.
    p_values : tuple of float
        Of each cause, with all others in the model.
    shares : tuple of float
        Part of the misfit that goes with each.
    rivals : tuple of tuple of Trial
        What the data do not tell from each cause, when it was taken.
    """

    comparison: Comparison
    before: Outcome
    after: Outcome
    rounds: tuple[tuple[Trial, ...], ...]
    without: tuple[Outcome, ...]
    p_values: tuple[float, ...]
    shares: tuple[float, ...]
    rivals: tuple[tuple[Trial, ...], ...]


def select(
    comparison: Comparison,
    most_causes: int = MOST_CAUSES,
    progress: Callable[[str], None] | None = None,
) -> Selection:
    """Find the causes of what the model gets wrong.

    Parameters
    ----------
    comparison : Comparison
        Records against the model.
    most_causes : int
        Where to stop at the latest.
    progress : callable, optional
        Told what is being done.

    Returns
    -------
    Selection
    """
    expected = _NEARLY_RIGHT * excess_error(comparison, comparison.judged(()))
    while True:
        found = _search(comparison.expecting(expected), most_causes, progress)
        left = excess_error(found.comparison, found.after)
        if left < max(2 * expected, relative_noise(found.comparison)):
            return found
        expected = left


def _search(
    comparison: Comparison, most_causes: int, progress: Callable[[str], None] | None
) -> Selection:
    """Add causes one by one, weights as given."""
    choices = candidates(comparison.model, comparison.records)
    n_tests = len({choice.key for choice in choices})
    before = current = comparison.judged(())
    rounds: list[tuple[Trial, ...]] = []
    rivals: dict[tuple[str, str], tuple[Trial, ...]] = {}
    while len(current.found) < most_causes and not _quiet(comparison, current):
        taken = {cause.key for cause, _ in current.found}
        if progress is not None:
            names = ", ".join(cause.label for cause, _ in current.found)
            progress(f"looking for a cause{' beside ' * bool(names)}{names}")
        trials = _tried(comparison, current, [c for c in choices if c.key not in taken])
        rounds.append(tuple(trials))
        accepted = [t for t in trials if _is_found(t, comparison, current, before, n_tests)]
        if not accepted:
            break
        best = accepted[0]
        rivals[best.cause.key] = tuple(_near(best, accepted[1:]))
        # what the noise is, is seen better with the cause in the model
        comparison = compare_records(
            comparison.model, comparison.records, best.outcome.found, comparison.model_error
        )
        before = comparison.judged(())
        current = _pruned(comparison, comparison.fit((), best.outcome.found), n_tests)
    current = _reformed(comparison, current, choices)
    if removed_share(comparison.held_out, before.held_out, current.held_out) < TO_BLAME:
        current = before
    without = _without_each(comparison, before, current)
    return Selection(
        comparison, before, current, tuple(rounds), without,
        tuple(p_value(outcome, current) for outcome in without),
        _shares(comparison, before, current, without),
        tuple(rivals[cause.key] for cause, _ in current.found),
    )  # fmt: skip


def _quiet(comparison: Comparison, current: Outcome) -> bool:
    parts = comparison.fitted + comparison.held_out
    return adequacy(parts, current.fitted + current.held_out) > _QUIET


def p_value(smaller: Outcome, larger: Outcome) -> float:
    """Chance of the improvement that more causes bring, were they absent.

    Parameters
    ----------
    smaller, larger : Outcome
        Without and with them.

    Returns
    -------
    float
        Of the likelihood ratio, its residuals counted as far as they are independent.
    """
    from scipy.stats import f

    n = larger.n_independent
    degrees = max(larger.n_parameters - smaller.n_parameters, 1)
    gain = (smaller.cost - larger.cost) / larger.cost
    if not gain > 0:
        return 1.0
    return float(f.sf(gain * n / degrees, degrees, n))


def adequacy(parts: Sequence[Part], whitened: Sequence[np.ndarray]) -> float:
    """Chance of residuals as large as these, in any channel and band, were there noise alone.

    Parameters
    ----------
    parts : sequence of Part
        The data.
    whitened : sequence of numpy.ndarray
        Their weighted residuals.

    Returns
    -------
    float
    """
    p = np.concatenate([cell_p_values(a, w) for a, w in zip(parts, whitened, strict=True)])
    return float(1 - (1 - p.min()) ** p.size)


def cell_p_values(part: Part, whitened: np.ndarray) -> np.ndarray:
    """Chance of each cell's mean square, were there noise alone.

    Parameters
    ----------
    part : Part
        The data.
    whitened : numpy.ndarray, shape (n_frequencies, n_channels, 2)
        Weighted residual.

    Returns
    -------
    numpy.ndarray, shape (n_bands * n_channels,)
    """
    from scipy.stats import t

    # the logarithm, for the noise's estimate is off by a factor; Student's t, for so few examples
    examples = np.log(part.noise_cells)
    n = len(examples)
    off = np.log(np.nan_to_num(cell_means(whitened), nan=np.inf)) - examples.mean(axis=0)
    return t.sf(off / (examples.std(axis=0, ddof=1) * np.sqrt(1 + 1 / n)), n - 1)


def _tried(
    comparison: Comparison, current: Outcome, choices: Sequence[Candidate]
) -> list[Trial]:
    """Each candidate with its own numbers roughly fitted; the best ones again with all numbers."""
    trials = []
    for cause in choices:
        fits = [
            comparison.fit(current.found, ((cause, start),), _SCREENING_STEPS)
            for start in cause.starts
        ]
        best = min(fits, key=lambda outcome: outcome.cost)
        trials.append(Trial(cause, best, p_value(current, best)))
    trials = _ranked(trials)
    refined = []
    for trial in trials[:_REFINED]:
        outcome = comparison.fit((), trial.outcome.found)
        refined.append(Trial(trial.cause, outcome, p_value(current, outcome)))
    return _ranked(refined + trials[_REFINED:])


def _ranked(trials: Sequence[Trial]) -> list[Trial]:
    n = min((t.outcome for t in trials), key=lambda outcome: outcome.cost).n_independent
    return sorted(trials, key=lambda t: t.outcome.criterion(n))


def _is_found(
    trial: Trial, comparison: Comparison, current: Outcome, before: Outcome, n_tests: int
) -> bool:
    outcome, n = trial.outcome, trial.outcome.n_independent
    misfit = before.cost - sum(part.noise_cost for part in comparison.fitted)
    return (
        trial.p_value * n_tests < FALSE_ALARM
        and outcome.criterion(n) < current.criterion(n)
        and outcome.held_out_cost < current.held_out_cost
        and current.cost - outcome.cost > LEAST_SHARE * misfit
        and all(
            np.all(part.halves(after) < _NOT_WORSE * part.halves(without))
            for part, after, without in zip(
                comparison.held_out, outcome.held_out, current.held_out, strict=True
            )
        )
    )


def _near(best: Trial, others: Sequence[Trial]) -> list[Trial]:
    """Rivals that the data do not tell from the best."""
    n = best.outcome.n_independent
    near, seen = [], {best.cause.key}
    for other in others:
        worse = other.outcome.criterion(n) - best.outcome.criterion(n)
        if worse < _NEAR and other.cause.key not in seen:
            near.append(other)
            seen.add(other.cause.key)
    return near


def _pruned(comparison: Comparison, current: Outcome, n_tests: int) -> Outcome:
    """Leave out causes that those found later have made needless."""
    while len(current.found) > 1:
        without = [
            comparison.fit((), current.found[:k] + current.found[k + 1 :])
            for k in range(len(current.found))
        ]
        best = min(without, key=lambda outcome: outcome.cost)
        if p_value(best, current) * n_tests < FALSE_ALARM:
            break
        current = best
    return current


def _reformed(
    comparison: Comparison, current: Outcome, choices: Sequence[Candidate]
) -> Outcome:
    """Let each cause take another of its forms, if that is better now that all are known."""
    if len(current.found) < 2:
        return current
    for k in range(len(current.found)):
        cause = current.found[k][0]
        for other in choices:
            if other.key == cause.key and other is not cause:
                found = (*current.found[:k], (other, other.starts[0]), *current.found[k + 1 :])
                trial = comparison.fit((), found)
                n = min((trial, current), key=lambda outcome: outcome.cost).n_independent
                if trial.criterion(n) < current.criterion(n):
                    current = trial
    return current


def _without_each(
    comparison: Comparison, before: Outcome, current: Outcome
) -> tuple[Outcome, ...]:
    """Fits that lack one of the causes found."""
    found = current.found
    if len(found) == 1:
        return (before,)
    return tuple(comparison.fit((), found[:k] + found[k + 1 :]) for k in range(len(found)))


def _shares(
    comparison: Comparison, before: Outcome, current: Outcome, without: Sequence[Outcome]
) -> tuple[float, ...]:
    """What all causes remove, in proportion to what the misfit grows by without each."""
    losses = [max(one.held_out_cost - current.held_out_cost, 0.0) for one in without]
    removed = removed_share(comparison.held_out, before.held_out, current.held_out)
    return tuple(removed * loss / (sum(losses) or 1.0) for loss in losses)


def removed_share(
    parts: Sequence[Part], before: Sequence[np.ndarray], after: Sequence[np.ndarray]
) -> float:
    """Part of the misfit above the noise that is gone.

    Parameters
    ----------
    parts : sequence of Part
        The data.
    before, after : sequence of numpy.ndarray
        Their weighted residuals without and with causes.

    Returns
    -------
    float
        0 to 1.
    """
    noise = sum(part.noise_cost for part in parts)
    costs = [sum(float(np.vdot(w, w)) for w in whitened) for whitened in (before, after)]
    misfit, left = (max(cost - noise, 0.0) for cost in costs)
    return float(np.clip(1 - left / misfit, 0.0, 1.0)) if misfit > 0 else 0.0
