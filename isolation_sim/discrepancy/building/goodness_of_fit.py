"""Goodness of fit of a building's model: the chance of its residuals, and of what causes gain."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..decisions import QUIET
from ..inference import f_chance
from .comparison import Comparison, FittedBuilding
from .segment import Segment, cell_means


def p_value(smaller: FittedBuilding, larger: FittedBuilding) -> float:
    """Chance of the improvement by more causes if they were absent (likelihood ratio)."""
    added = max(larger.n_parameters - smaller.n_parameters, 1)
    return f_chance(smaller.cost, larger.cost, added, larger.n_independent)


def adequacy(segments: Sequence[Segment], whitened: Sequence[NDArray]) -> float:
    """Chance of residuals as large as these, in any channel and band, under noise alone."""
    p = np.concatenate([cell_p_values(a, w) for a, w in zip(segments, whitened, strict=True)])
    return float(1 - (1 - p.min()) ** p.size)


def is_quiet(comparison: Comparison, outcome: FittedBuilding) -> bool:
    """Whether a model leaves residuals as likely as those of noise alone."""
    segments = comparison.fitted + comparison.held_out
    return adequacy(segments, outcome.fitted + outcome.held_out) > QUIET


def cell_p_values(segment: Segment, whitened: NDArray) -> NDArray:
    """Chance of each cell's mean square under noise alone, (n_bands * n_channels,)."""
    from scipy.stats import t

    # the logarithm, for the noise's estimate is off by a factor; Student's t, for so few examples
    examples = np.log(segment.noise_cells)
    n = len(examples)
    off = np.log(np.nan_to_num(cell_means(whitened), nan=np.inf)) - examples.mean(axis=0)
    return t.sf(off / (examples.std(axis=0, ddof=1) * np.sqrt(1 + 1 / n)), n - 1)
