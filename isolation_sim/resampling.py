"""Level of bootstrap intervals of few values.

T. C. Hesterberg, "What teachers should know about the bootstrap", The American Statistician 69
(2015) 371-386.
"""

from __future__ import annotations

CONFIDENCE = 0.95
_EXTREME = 5.0
"""Normal quantile beyond every resample; of two or three values."""


def bootstrap_level(n: int) -> float:
    """Level at which a bootstrap of ``n`` values gives an interval of `CONFIDENCE`."""
    # a bootstrap has the normal quantile for Student's, and n in place of n - 1 in the variance
    from scipy.stats import norm, t

    quantile = t.ppf(0.5 + 0.5 * CONFIDENCE, n - 1) * (n / (n - 1)) ** 0.5
    return float(1 - 2 * norm.sf(min(quantile, _EXTREME)))
