"""A number with its interval."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_MOST_DIGITS = 7


@dataclass(frozen=True)
class Interval:
    """A number with its 95 % interval.

    Attributes
    ----------
    value, low, high : float
        In ``unit``.
        Infinite ends belong to a value that the data do not determine.
    unit : str
        SI unit.
    at_bound : bool
        Whether the value lies at a bound of its range.
    """

    value: float
    low: float
    high: float
    unit: str
    at_bound: bool = False

    @property
    def determined(self) -> bool:
        """Whether one end is finite, at least."""
        return bool(np.isfinite(self.low) or np.isfinite(self.high))

    def __str__(self) -> str:
        """Value and ends, with as many digits as the ends need to differ from the value."""
        if self.low == self.value == self.high:
            return f"{self.value:.4g}"
        if not self.determined:
            return f"{self.value:.4g} (not determined)"
        digits = next((n for n in range(3, _MOST_DIGITS) if self._differ(n)), _MOST_DIGITS)
        low, high = (f"{end:.{digits}g}" for end in (self.low, self.high))
        return f"{self.value:.{max(digits, 4)}g} ({low} to {high})"

    def _differ(self, digits: int) -> bool:
        value = f"{self.value:.{digits}g}"
        return all(
            end == self.value or f"{end:.{digits}g}" != value for end in (self.low, self.high)
        )


def percent(share: float, digits: int = 2) -> str:
    """A share in percent, without an exponent."""
    value = 100 * share
    return f"{value:.0f}" if abs(value) >= 10**digits - 0.5 else f"{value:.{digits}g}"
