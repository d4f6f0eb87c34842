"""Checks of arguments, each refusing with one line that names the argument."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from ground_motions.errors import InputError, wrong_choice

FloatArray = npt.NDArray[np.floating[Any]]


MOST_SAMPLES = 20_000_000
"""Samples of a ground motion: 55 hours at 0.01 s."""


def number(name: str, value: Any, accepted: str) -> float:
    """Return a finite float."""
    try:
        result = float(value)
    except (TypeError, ValueError):
        raise InputError(name, repr(value), accepted) from None
    if not math.isfinite(result):
        raise InputError(name, repr(value), accepted)
    return result


def positive(name: str, value: Any) -> float:
    """Return a finite float above zero, or raise `InputError`."""
    accepted = "a finite number above 0"
    result = number(name, value, accepted)
    if result <= 0.0:
        raise InputError(name, repr(value), accepted)
    return result


def within(name: str, value: Any, low: float, high: float, *, open_high: bool = False) -> float:
    """Return a float in [low, high], or in [low, high) if ``open_high``."""
    if math.isinf(high):
        accepted = f"a finite number, {low:g} or above"
    else:
        accepted = f"a number from {low:g} to {'below ' if open_high else ''}{high:g}"
    result = number(name, value, accepted)
    if result < low or result > high or (open_high and result == high):
        raise InputError(name, repr(value), accepted)
    return result


def exactly_one(**values: Any) -> tuple[str, float]:
    """Return the name and value of the one positive argument that is not None."""
    specified = {name: value for name, value in values.items() if value is not None}
    if len(specified) != 1:
        raise InputError(
            " and ".join(values), " and ".join(specified) or "neither", "exactly one of them"
        )
    ((name, value),) = specified.items()
    return name, positive(name, value)


def choice(name: str, value: str, options: Iterable[str]) -> str:
    """Return a value that is one of the options, or raise naming the nearest."""
    if value not in (options := list(options)):
        raise wrong_choice(name, str(value), options)
    return value


def sample_count(duration: float, dt: float) -> int:
    """Return how many samples reach from zero to a duration, both ends included."""
    duration, dt = positive("duration (s)", duration), positive("dt (s)", dt)
    if duration < dt:
        raise InputError("duration (s)", f"{duration:g}", f"one step or more (dt {dt:g} s)")
    return whole_steps(duration, dt) + 1


def whole_steps(duration: float, dt: float) -> int:
    """Return the least number of steps that cover a duration."""
    steps = duration / dt * (1.0 - 1e-12)
    few_enough(steps, f"{duration:g} s at steps of {dt:g} s")
    return math.ceil(steps)


def few_enough(samples: float, subject: str) -> None:
    """Refuse a motion with more samples than ``MOST_SAMPLES``."""
    if samples > MOST_SAMPLES:
        raise InputError(
            "ground motion",
            f"{subject}, {samples:.3g} samples",
            f"up to {MOST_SAMPLES:,} samples",
        )


def read_only(values: npt.ArrayLike) -> FloatArray:
    """Return a float64 copy that cannot be written to."""
    array: FloatArray = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


def finite_row(name: str, values: npt.ArrayLike) -> FloatArray:
    """Return a read-only copy of one row of two or more finite numbers."""
    accepted = "one row of two or more finite numbers"
    try:
        row = read_only(values)
    except (TypeError, ValueError):
        raise InputError(name, "values that are not numbers", accepted) from None
    if row.ndim != 1 or len(row) < 2:
        raise InputError(name, f"shape {row.shape}", accepted)
    bad = np.flatnonzero(~np.isfinite(row))
    if bad.size:
        raise InputError(name, f"{row[bad[0]]} at sample {bad[0]}", accepted)
    return row
