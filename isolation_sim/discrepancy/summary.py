"""Numbers of a diagnosis: shares, chances, and what the data cannot tell apart."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .candidates import Fitted, noise_gain
from .selection import SIGNIFICANT
from .terms import OUTSIDE

_NEAR = 0.1
"""Part of a cause's gain by which a rival may fall short and still count as confusable."""


def shares(costs_without: Sequence[float], cost: float, explained: float) -> list[float]:
    """Split the explained part of a misfit among its causes.

    Parameters
    ----------
    costs_without : sequence of float
        Cost without each cause, the others fitted again.
    cost : float
        Cost with all of them.
    explained : float
        Part of the misfit that they remove together.

    Returns
    -------
    list of float
        In proportion to what each one's absence costs; a model that fails without one needs it
        above all.
    """
    costs = np.array(costs_without, dtype=float)
    finite = costs[np.isfinite(costs)]
    costs[~np.isfinite(costs)] = 10 * max([cost, *finite])
    worth = np.maximum(costs - cost, 0.0)
    total = float(worth.sum())
    if total == 0.0:
        return [explained / len(worth)] * len(worth)
    return [float(explained * w / total) for w in worth]


def p_value(without: Fitted, given: Fitted, noise: NDArray, tried: int) -> float:
    """Chance that noise alone brings the improvement, over all forms that were tried.

    Parameters
    ----------
    without, given : Fitted
        The model without and with the cause.
    noise : (n_fitted, n_examples) array
        Residuals that noise alone leaves.
    tried : int
        Number of forms that could have been chosen.

    Returns
    -------
    float
        From the chi-squared distribution, times ``tried``; 1 at most.
    """
    from scipy.special import chdtrc

    inflation = noise_gain(given.residual - without.residual, noise)
    gain = max(without.cost - given.cost, 0.0) / max(inflation, 1.0)
    freedom = max(len(given.values) - len(without.values), 1)
    return float(min(1.0, tried * chdtrc(freedom, gain)))


def confusable(
    given: Fitted, rivals: Sequence[Fitted], without: Fitted, cause: str
) -> tuple[str, ...]:
    """Causes that would serve nearly as well in place of one.

    Parameters
    ----------
    given : Fitted
        The model with the cause.
    rivals : sequence of Fitted
        The same model with other causes in its place.
    without : Fitted
        The model without it.
    cause : str
        Its name.

    Returns
    -------
    tuple of str
        Names, the nearest first.
    """
    gain = without.cost - given.cost
    allowance = max(SIGNIFICANT, _NEAR * gain)
    found: list[str] = []
    for rival in sorted(rivals, key=lambda f: f.cost):
        name = rival.causes[-1]
        if name not in (cause, OUTSIDE, *found) and rival.cost < given.cost + allowance:
            found.append(name)
    return tuple(found)


def gain_interval(
    before: NDArray, after: NDArray, starts: NDArray, chosen: NDArray, seed: int
) -> tuple[float, float] | None:
    """95 % interval of the relative decrease of the error, by resampling pieces of the runs.

    Parameters
    ----------
    before, after : (n_samples,) array
        Residuals, N.
    starts : (n_runs + 1,) int array
        First sample of each run, and the end.
    chosen : (n_samples,) bool array
        Samples on which it is judged.
    seed : int
        Of the resampling.

    Returns
    -------
    tuple of float or None
        None where there is nothing to resample.
    """
    sums = []
    for a, b in pairwise(starts):
        for part in np.array_split(np.arange(a, b), 4):
            at = part[chosen[part]]
            if at.size:
                sums.append((float(before[at] @ before[at]), float(after[at] @ after[at])))
    if len(sums) < 4:
        return None
    table = np.array(sums)
    random = np.random.default_rng(seed)
    drawn = table[random.integers(0, len(table), (2000, len(table)))].sum(axis=1)
    decrease = 1 - np.sqrt(drawn[:, 1] / drawn[:, 0])
    low, high = np.quantile(decrease, [0.025, 0.975])
    return float(low), float(high)
