"""Means over motions with their intervals."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

CONFIDENCE = 0.95

MARGIN = 1e-3
"""Smallest difference of scores that counts. The scan of constant currents finds the smallest sum
to a tenth of it."""


class MeanInterval(NamedTuple):
    """A mean with the bounds of its interval."""

    mean: float
    low: float
    high: float

    def __str__(self) -> str:
        bounds = "" if np.isnan(self.low) else f" ({self.low:+z.3f} to {self.high:+z.3f})"
        return f"{self.mean:+z.3f}{bounds}"


def mean_interval(values: ArrayLike, seed: int = 0) -> MeanInterval:
    """Mean of the values of a sample of motions, with its 95 % interval."""
    from scipy.stats import bootstrap

    array = np.sort(np.asarray(values, dtype=float))
    mean = float(array.mean())
    if np.ptp(array) == 0.0:
        bounds = (np.nan, np.nan) if len(array) == 1 else (mean, mean)
        return MeanInterval(mean, *bounds)
    result = bootstrap(
        (array,), np.mean, confidence_level=CONFIDENCE, random_state=np.random.default_rng(seed)
    ).confidence_interval
    return MeanInterval(mean, float(result.low), float(result.high))
