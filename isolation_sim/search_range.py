"""Search range of a setting: bounds and scale."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from .errors import InputError

DIGITS = 4
"""Significant digits of a tuned value; further digits would not change the score noticeably."""


@dataclass(frozen=True)
class SearchRange:
    """Search range of a setting for tuning."""

    # low, high: Bounds, in the setting's unit
    low: float
    high: float
    # {"log", "linear"}: Logarithmic (bounds above 0) or linear
    scale: Literal["log", "linear"] = "log"

    def __post_init__(self) -> None:
        least = 0.0 if self.scale == "log" else -math.inf
        if self.scale not in ("log", "linear") or not least < self.low < self.high < math.inf:
            raise InputError(
                f"search range from {self.low} to {self.high}, scale {self.scale!r}; expected: "
                "finite bounds that increase, scale 'log' (bounds above 0) or 'linear'"
            )

    def __str__(self) -> str:
        return f"{self.low:g} to {self.high:g}, {self.scale}"

    def value(self, place: float) -> float:
        """Return the setting at a place of its range, 0 to 1."""
        if self.scale == "log":
            exact = self.low * (self.high / self.low) ** place
        else:
            exact = self.low + place * (self.high - self.low)
        return float(f"{exact:.{DIGITS}g}")

    def place(self, value: float | None) -> float:
        """Return the place of a value in the range."""
        if value is None or not math.isfinite(value):
            return 0.5
        inside = min(max(value, self.low), self.high)
        if self.scale == "log":
            return math.log(inside / self.low) / math.log(self.high / self.low)
        return (inside - self.low) / (self.high - self.low)
