"""The sampling step from a column of times."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ground_motions.errors import InputError

TOLERANCE = 0.02
"""How far a time may lie from the uniform grid, in steps: some times are printed short."""
_COARSEST = 0.3
"""Unit to which times may be rounded, in steps."""


def uniform_step(times: Sequence[float], line_numbers: Sequence[int], column: str) -> float:
    """Return the step of increasing, uniform times."""
    t = np.asarray(times)
    steps = np.diff(t)
    backward = np.flatnonzero(steps <= 0.0)
    if backward.size:
        i = backward[0] + 1
        raise InputError(
            f"{column}, line {line_numbers[i]}",
            f"{t[i]:.12g} after {t[i - 1]:.12g}",
            "times that increase",
        )
    step = (t[-1] - t[0]) / len(steps)
    off = np.abs(t - t[0] - step * np.arange(len(t)))
    if off.max() > TOLERANCE * step:
        rounded = _step_of_rounded(t)
        if rounded is not None:
            return float(f"{rounded:.12g}")
        usual = float(np.median(steps))
        i = int(np.argmax(np.abs(steps - usual))) + 1
        raise InputError(
            f"{column}, line {line_numbers[i]}",
            f"a step of {steps[i - 1]:.6g} s where {usual:.6g} s is usual",
            f"uniform times, each within {TOLERANCE:g} of a step of its place",
        )
    return float(f"{step:.12g}")


def _step_of_rounded(t: np.ndarray) -> float | None:
    """Return the step of times that were rounded or cut to a decimal unit; else None."""
    places = np.arange(len(t))
    step = float(np.polyfit(places, t, 1)[0])
    off = t - step * places
    # the places of all times within one unit are those of rounding
    for digits in range(12):
        unit = 10.0**-digits
        if unit < _COARSEST * step and np.allclose(t / unit, np.round(t / unit), rtol=0, atol=1e-4):
            return step if np.ptp(off) < 1.1 * unit else None
    return None
