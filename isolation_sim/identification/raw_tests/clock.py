"""Times of day and dates in test files, such as ``10:21:33.250`` or ``2026-11-27T10:21:33Z``."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

CLOCK_UNIT = "h:min:s"
"""Unit of a column of times of day."""

_DATE = r"(?:\d{4}[-/.]\d{1,2}[-/.]\d{1,2}|\d{1,2}[-/.]\d{1,2}[-/.](?:\d{4}|\d{2}))"
_OF_DAY = (
    r"(?P<hours>\d{1,3}):(?P<minutes>[0-5]\d):(?P<seconds>[0-5]\d(?:[.,:]\d+)?)"
    r"(?:\s*(?P<half>[ap])\.?m\.?)?"
)
_CLOCK = re.compile(rf"(?:{_DATE}(?:T|\s+|,\s*))?{_OF_DAY}(?:\s*(?:Z|UTC|[+-]\d\d:?\d\d))?", re.I)
_ONLY_DATE = re.compile(_DATE)
_DAY = 86400.0


def is_clock(cell: str) -> bool:
    """Whether a cell is a time of day, with or without a date."""
    return ":" in cell and bool(_CLOCK.fullmatch(cell))


def is_date(cell: str) -> bool:
    """Whether a cell is a date."""
    return bool(_ONLY_DATE.fullmatch(cell))


def are_clocks(cells: Sequence[str]) -> bool:
    """Whether most cells that hold something are times of day."""
    written = [cell for cell in cells if cell]
    return bool(written) and 2 * sum(map(is_clock, written)) > len(written)


def seconds_of(cells: Sequence[str]) -> NDArray:
    """Seconds since the midnight before the first time, (n,); NaN where a cell is no time."""
    seconds = np.full(len(cells), np.nan)
    for k, cell in enumerate(cells):
        match = _CLOCK.fullmatch(cell)
        if match:
            hours = int(match["hours"])
            if match["half"]:
                hours = hours % 12 + (12 if match["half"].lower() == "p" else 0)
            # "10:21:33:250", as some loggers write the milliseconds
            rest = float(re.sub("[,:]", ".", match["seconds"]))
            seconds[k] = 3600 * hours + 60 * int(match["minutes"]) + rest
    there = np.flatnonzero(np.isfinite(seconds))
    midnights = np.cumsum(np.diff(seconds[there], prepend=seconds[there[:1]]) < -_DAY / 2)
    seconds[there] += _DAY * midnights
    return seconds
