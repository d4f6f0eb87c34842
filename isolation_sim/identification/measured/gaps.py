"""Samples that a logger left out: empty cells and NaN."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError

MOST = 0.01
"""Share of missing samples up to which they are interpolated."""
LONGEST = 5
"""Missing samples in a row up to which they are interpolated."""


def fill_gaps(
    values: NDArray, path: str | Path, lines: Sequence[int], column: str
) -> tuple[NDArray, NDArray]:
    """Interpolate samples that are NaN, and return their places; refuse long gaps and many.

    ``path``, ``lines`` and ``column`` name the place of a sample, for errors.
    """
    missing = np.isnan(values)
    where = np.flatnonzero(missing)
    if not where.size:
        return values, where

    def refuse(sample: int, actual: str, expected: str) -> InputError:
        place = f"{path}, line {lines[sample]}, column {column}"
        return InputError(place, actual, expected)

    longest = max(np.split(where, np.flatnonzero(np.diff(where) > 1) + 1), key=len)
    if len(longest) > LONGEST:
        actual = f"{len(longest)} samples in a row without a number"
        raise refuse(longest[0], actual, f"at most {LONGEST}, which are interpolated")
    if len(where) > max(MOST * len(values), 1):
        actual = f"the first of {len(where)} samples without a number, of {len(values)}"
        raise refuse(where[0], actual, f"at most {MOST:.0%}, which are interpolated")
    if missing[0] or missing[-1]:
        ends = "numbers in the first and in the last row"
        raise refuse(0 if missing[0] else len(values) - 1, "no number", ends)
    places = np.arange(len(values))
    return np.interp(places, places[~missing], values[~missing]), where


def gap_note(what: str, number: int, first: float) -> str:
    """Note of the missing samples of a channel, the first at a time in s."""
    samples = "1 sample is" if number == 1 else f"{number} samples are"
    return f"{samples} missing in the {what}, first at {first:.4g} s; interpolated"
