"""Means over motions with their intervals."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

CONFIDENCE = 0.95


class MeanInterval(NamedTuple):
    """A mean with the bounds of its interval."""

    mean: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.mean:+.3f} ({self.low:+.3f} to {self.high:+.3f})"


def mean_interval(values: ArrayLike, seed: int = 0) -> MeanInterval:
    """Mean of some motions' values, with its 95 % interval over other such motions.

    Parameters
    ----------
    values : array_like, shape (n_motions,)
        A value a motion.
    seed : int
        Of the resampling.

    Returns
    -------
    MeanInterval
        By ``scipy.stats.bootstrap``, bias-corrected and accelerated; not a number for the bounds
        of a single value.
    """
    from scipy.stats import bootstrap

    array = np.asarray(values, dtype=float)
    mean = float(array.mean())
    if np.ptp(array) == 0.0:
        bounds = (np.nan, np.nan) if len(array) == 1 else (mean, mean)
        return MeanInterval(mean, *bounds)
    found = bootstrap(
        (array,), np.mean, confidence_level=CONFIDENCE, random_state=np.random.default_rng(seed)
    ).confidence_interval
    return MeanInterval(mean, float(found.low), float(found.high))
