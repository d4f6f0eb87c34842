"""Memory of a motion: its largest and its present amplitude. Shared by several effects."""

from __future__ import annotations

from typing import Any

import numpy as np

RISE = 2e-3
"""s: lag with which a peak is followed upwards; short beside any cycle of a structure."""


def positive(value: Any) -> Any:
    """Positive part."""
    return value * (value > 0)


def beyond(value: Any, width: Any) -> Any:
    """Part of a value beyond a width on either side of zero."""
    return positive(value - width) - positive(-value - width)


def rise(value: Any, peak: Any) -> Any:
    """Rate of a state that follows a value upwards and never falls."""
    return positive(value - peak) / RISE


def rise_and_fade(value: Any, peak: Any, time: Any) -> Any:
    """Rate of a state that follows a value upwards at once and downwards slowly."""
    return rise(value, peak) - positive(peak - value) / time


def amplitude(mean_square: Any) -> Any:
    """Amplitude of the sine that has a mean square."""
    return np.sqrt(2 * positive(mean_square) + 1e-24)
