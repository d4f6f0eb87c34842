"""Inference from fitted models: shares, chances, rivals, intervals, gain and verdict."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from ..identification.least_squares import DETERMINED, unit_columns
from ..identification.least_squares import at_bound as at_bound  # beside the other inference
from ..resampling import bootstrap_level
from .decisions import MAY_BE_ZERO, RESAMPLES, UNDETERMINED
from .device.generic_terms import OUTSIDE
from .diagnosis import Cause
from .verdict import Verdict


def shares(costs_without: Sequence[float], cost: float, explained: float) -> list[float]:
    """Split the explained share of a misfit among its causes."""
    # It is split in proportion to what the cost grows by without each cause. A model that fails
    # without a cause needs that cause above all.
    costs = np.array(costs_without, dtype=float)
    finite = costs[np.isfinite(costs)]
    costs[~np.isfinite(costs)] = 10 * max([cost, *finite])
    worth = np.maximum(costs - cost, 0.0)
    total = float(worth.sum())
    if total == 0.0:
        return [explained / len(worth)] * len(worth)
    return [float(explained * w / total) for w in worth]


def chi_squared_chance(gain: float, added: int, tried: int) -> float:
    """Chance that noise of unit variance lowers the cost so much for one of many forms."""
    from scipy.special import chdtrc

    return float(min(1.0, tried * chdtrc(added, gain)))


def f_chance(
    without: float, with_effect: float, added: int, freedom: float, tried: int = 1
) -> float:
    """Chance of such a decrease of the cost where the noise's variance comes from the residual."""
    from scipy.stats import f

    gain = (without - with_effect) / with_effect
    if not gain > 0:
        return 1.0
    return float(min(1.0, tried * f.sf(gain * freedom / added, added, freedom)))


def rivals(name: str, others: Iterable[tuple[str, float]], allowance: float) -> tuple[str, ...]:
    """Name causes that would serve nearly as well as one, the nearest first."""
    # ``others`` holds names and by how much each is worse than the cause that was chosen.
    near = (other for other, worse in sorted(others, key=lambda o: o[1]) if worse < allowance)
    return tuple(one for one in dict.fromkeys(near) if one not in (name, OUTSIDE))


def half_widths(jacobian: NDArray, variance: float, noise: NDArray | None = None) -> NDArray:
    """Half of the 95 % intervals of fitted values, (n_values,), by the residuals' derivatives.

    ``noise`` holds residuals that noise alone would leave, (n_examples, n). An interval is no
    narrower than the spread of the values by them, for residuals need not be independent.
    """
    from scipy.stats import t

    # Infinite for a value that the data do not determine.
    scaled, norm = unit_columns(jacobian)
    power, directions = np.linalg.eigh(scaled.T @ scaled)
    known = power > DETERMINED**2 * power[-1]
    shares, power = directions**2, power[known]
    half = 1.96 * np.sqrt(shares[:, known] @ (variance / power)) / norm
    if noise is not None:
        along = directions[:, known]
        moved = noise @ scaled @ along / power @ along.T / norm
        half = np.maximum(half, t.ppf(0.975, len(noise) - 1) * moved.std(axis=0, ddof=1))
    open_ = shares[:, ~known].sum(axis=1) > UNDETERMINED
    return np.where(open_ | ~np.isfinite(half), np.inf, half)


def gain_interval(blocks: NDArray, seed: int = 0) -> tuple[float, float] | None:
    """95 % interval of the relative decrease of the error, by resampling blocks of the data."""
    # ``blocks`` holds the sum of squared residuals before and after in each block, (n_blocks, 2).
    from scipy.stats import bootstrap

    if len(blocks) < 4:
        return None

    def decrease(before: NDArray, after: NDArray, axis: int) -> NDArray:
        return 1 - np.sqrt(after.sum(axis=axis) / before.sum(axis=axis))

    result = bootstrap(
        tuple(blocks.T), decrease, paired=True, vectorized=True, n_resamples=RESAMPLES,
        method="percentile", confidence_level=bootstrap_level(len(blocks)),
        rng=np.random.default_rng(seed),
    ).confidence_interval  # fmt: skip
    return float(result.low), float(result.high)


def verdict(causes: Sequence[Cause], adequate: bool, explained: bool) -> Verdict:
    """Judge a simulation by its causes and by the remaining misfit."""
    # interference is in the data: a law that is right beside it lacks nothing
    lacking = [
        cause for cause in causes if cause.name != OUTSIDE or "frequency" not in cause.parameters
    ]
    if not lacking:
        return ("explained" if causes else "adequate") if adequate else "unexplained"
    if all(cause.name == OUTSIDE for cause in lacking):
        return "unexplained"
    known = [cause for cause in lacking if cause.is_named]
    # what only acts like a cause leaves little to explain where its share is small
    small = [cause for cause in lacking if cause.acts_like and cause.share < MAY_BE_ZERO]
    every = bool(known) and len(known) + len(small) == len(lacking)
    return "explained" if explained and every else "partly_explained"
