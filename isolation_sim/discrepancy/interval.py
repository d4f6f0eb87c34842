"""A number with its interval."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


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


def number(value: float) -> float | None:
    """A number for JSON."""
    return float(value) if np.isfinite(value) else None
