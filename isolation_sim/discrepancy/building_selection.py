"""Which causes a building's records show: the best one more, as long as it can be told from noise.

A cause is taken if three independent views agree: the likelihood-ratio test, its level divided by
the number of causes asked; Schwarz's criterion; and the data that were not fitted.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from .building_causes import Candidate, candidates
from .building_fit import Comparison, Outcome, compare_records
from .building_noise import Part, cell_means

FALSE_ALARM = 0.003
"""Level of the tests for one more cause, all candidates together."""
LEAST_SHARE = 0.02
"""A cause that removes less of the whole misfit is not worth a name."""
MOST_CAUSES = 4
_NEAR = 6.0
"""Rivals whose criterion is within this of the best are not told from it; beyond, evidence is
strong (Kass and Raftery 1995)."""
_SCREENING_STEPS, _REFINED = 4, 4
_QUIET = 0.1
"""Once a cause is found, residuals as likely as this from noise alone are not searched again."""


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
    choices = candidates(comparison.model, comparison.records)
    n_tests = len({choice.key for choice in choices})
    before = current = comparison.judged(())
    rounds, rivals = [], {}
    while len(current.found) < most_causes:
        taken = {cause.key for cause, _ in current.found}
        if progress is not None:
            names = ", ".join(cause.label for cause, _ in current.found)
            progress(f"looking for a cause{' beside ' * bool(names)}{names}")
        trials = _tried(comparison, current, [c for c in choices if c.key not in taken])
        rounds.append(tuple(trials))
        accepted = [t for t in trials if _is_found(t, current, before, n_tests)]
        if not accepted:
            break
        best = accepted[0]
        rivals[best.cause.key] = tuple(_near(best, accepted[1:]))
        # what the noise is, is seen better with the cause in the model
        comparison = compare_records(comparison.model, comparison.records, best.outcome.found)
        before = comparison.judged(())
        current = _pruned(comparison, comparison.fit((), best.outcome.found), n_tests)
        parts = comparison.fitted + comparison.held_out
        if adequacy(parts, current.fitted + current.held_out) > _QUIET:
            break
    current = _reformed(comparison, current, choices)
    without = _without_each(comparison, before, current)
    return Selection(
        comparison, before, current, tuple(rounds), without,
        tuple(p_value(outcome, current) for outcome in without),
        _shares(before, current, without),
        tuple(rivals[cause.key] for cause, _ in current.found),
    )  # fmt: skip


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
    from scipy.stats import gamma

    shape = (part.expected / part.spread) ** 2
    means = np.nan_to_num(cell_means(whitened), nan=np.inf)
    return gamma.sf(means, shape, scale=part.spread**2 / part.expected)


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


def _is_found(trial: Trial, current: Outcome, before: Outcome, n_tests: int) -> bool:
    outcome, n = trial.outcome, trial.outcome.n_independent
    excess = max(before.cost - before.n, 1e-9)
    return (
        trial.p_value * n_tests < FALSE_ALARM
        and outcome.criterion(n) < current.criterion(n)
        and outcome.held_out_cost < current.held_out_cost
        and (not current.found or current.cost - outcome.cost > LEAST_SHARE * excess)
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


def _shares(before: Outcome, current: Outcome, without: Sequence[Outcome]) -> tuple[float, ...]:
    """What all causes remove, in proportion to what the misfit grows by without each."""
    losses = [max(one.held_out_cost - current.held_out_cost, 0.0) for one in without]
    total = sum(losses) or 1.0
    return tuple(removed_share(before, current) * loss / total for loss in losses)


def removed_share(before: Outcome, after: Outcome) -> float:
    """Part of the misfit above the noise that is gone, on data not fitted.

    Parameters
    ----------
    before, after : Outcome
        Without and with causes.

    Returns
    -------
    float
        0 to 1.
    """
    n = sum(part.size for part in before.held_out)
    excess = before.held_out_cost - n
    if excess <= 0:
        return 0.0
    return float(np.clip((before.held_out_cost - max(after.held_out_cost, n)) / excess, 0.0, 1.0))
