"""Goodness of fit of a building's model: the chance of its residuals, and of what causes gain."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...identification.least_squares import orthonormal
from ..decisions import QUIET
from ..inference import f_chance
from .comparison import BuildingComparison, FittedBuilding
from .segment import Segment, cell_means


def p_value(
    comparison: BuildingComparison, smaller: FittedBuilding, larger: FittedBuilding
) -> float:
    """Chance of the improvement by more causes if they were absent (likelihood ratio)."""
    if not larger.cost < smaller.cost:
        return 1.0
    added = max(larger.n_parameters - smaller.n_parameters, 1)
    gain = (smaller.cost - larger.cost) / _gain_by_noise(comparison, smaller, larger, added)
    return f_chance(larger.cost + gain, larger.cost, added, larger.n_independent)


def _gain_by_noise(
    comparison: BuildingComparison, smaller: FittedBuilding, larger: FittedBuilding, added: int
) -> float:
    """Decrease of the cost of noise alone by more causes, over that of independent residuals."""
    # noise of the ground's sensors moves many residuals together, along what a cause changes
    noise, small, large = comparison.fitted_noise, *_derivatives(smaller, larger)
    along = [np.sum((noise @ orthonormal(one)) ** 2, axis=1) for one in (small, large)]
    ratio = np.mean(along[1] - along[0]) / (added * np.mean(noise**2))
    return max(float(ratio), 1.0)


def _derivatives(smaller: FittedBuilding, larger: FittedBuilding) -> tuple[NDArray, NDArray]:
    """Derivatives of the residuals by the numbers of two models, (n, n_parameters)."""
    small, large = (
        np.empty((one.n, 0)) if one.optimum is None else one.optimum.jacobian
        for one in (smaller, larger)
    )
    # a first fit of one more cause holds the numbers of the others
    return small, large if large.shape[1] == larger.n_parameters else np.hstack([small, large])


def adequacy(segments: Sequence[Segment], whitened: Sequence[NDArray]) -> float:
    """Chance of residuals as large as these, in any channel and band, under noise alone."""
    p = np.concatenate([cell_p_values(a, w) for a, w in zip(segments, whitened, strict=True)])
    # exact for chances far below the spacing of numbers around one, too
    return float(-np.expm1(p.size * np.log1p(-min(float(p.min()), 1 - 1e-12))))


def noise_chance(comparison: BuildingComparison, outcome: FittedBuilding) -> float:
    """Chance of what a model leaves of all data, under noise alone."""
    segments = comparison.fitted + comparison.held_out
    return adequacy(segments, outcome.fitted + outcome.held_out)


def is_quiet(comparison: BuildingComparison, outcome: FittedBuilding) -> bool:
    """Whether a model leaves residuals as likely as those of noise alone."""
    return noise_chance(comparison, outcome) > QUIET


def cell_p_values(segment: Segment, whitened: NDArray) -> NDArray:
    """Chance of each cell's mean square under noise alone, (n_bands * n_channels,)."""
    from scipy.stats import t

    # the logarithm, for the noise's estimate is off by a factor; Student's t, for so few examples
    examples = np.log(segment.noise_cells)
    n = len(examples)
    off = np.log(np.nan_to_num(cell_means(whitened), nan=np.inf)) - examples.mean(axis=0)
    return t.sf(off / (examples.std(axis=0, ddof=1) * np.sqrt(1 + 1 / n)), n - 1)
