"""Rates, currents and times of day in test files: ``fs = 200``, ``Current: 2 A``, ``10:21:33``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

_NUMBER = r"(?P<number>(?:\d+(?:[.,]\d+)?|[.,]\d+)(?:[eE][+-]?\d+)?)"
_RATE = (
    r"(?:sampl\w*[ _-]*(?:rate|freq\w*)|(?:scan|acquisition)[ _-]*rate"
    r"|samples?[ _]*(?:per|/)[ _]*s(?:ec\w*)?|abtast(?:rate|frequenz)|messrate"
    r"|(?<![a-z/])(?:fs|sps)(?![a-z]))"
)
_STEP = (
    r"(?:sampl\w*[ _-]*(?:interval|period|time|step)|time[ _-]*step|abtast(?:intervall|zeit)"
    r"|delta[ _]?[xt]|(?<![a-z])dt(?![a-z]))"
)
# a unit stands before the number, as in "Abtastrate [kHz]: 1,2", or behind it
_BETWEEN = r"[^\d\n+-]{0,24}?"
_RATES = re.compile(rf"{_RATE}(?P<before>{_BETWEEN}){_NUMBER}\s*(?P<after>[a-z/]*)", re.IGNORECASE)
_PER_SECOND = re.compile(
    rf"{_NUMBER}\s*(?P<kilo>k?)s(?:a|amples?)?/s(?:ec)?(?![a-z])", re.IGNORECASE
)
_STEPS = re.compile(rf"{_STEP}(?P<before>{_BETWEEN}){_NUMBER}\s*(?P<after>[a-zµμ]*)", re.IGNORECASE)
_STEP_UNITS = {"ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6}
# the whole of a line; neither a highest current nor that of an instrument
_CURRENT = re.compile(
    r"\W*(?:(?:applied|coil|constant|dc|test)\W*)*(?:current|(?:spulen|prüf)?strom)"
    rf"(?:\W+(?P<before>m?A)\b)?[^\w-]+?(?P<sign>-(?=\d))?{_NUMBER}\s*(?P<after>m?A(?:mp\w*)?)?\W*",
    re.IGNORECASE,
)
_RATE_NAMES = {
    "fs", "sps", "rate", "samplerate", "samplingrate", "samplefrequency", "samplingfrequency",
    "ratehz", "fshz",
}  # fmt: skip
_STEP_NAMES = {"dt", "dts", "timestep", "samplingtime", "samplingperiod", "samplinginterval", "ts"}


def rate_in(lines: Iterable[str]) -> float | None:
    """Samples per second in lines of text; None if there is none, or if they disagree."""
    rates = set()
    for line in lines:
        for match in _RATES.finditer(line):
            kilo = "khz" in f"{match['before']} {match['after']}".lower()
            rates.add(_number(match["number"]) * (1e3 if kilo else 1.0))
        for match in _PER_SECOND.finditer(line):
            rates.add(_number(match["number"]) * (1e3 if match["kilo"] else 1.0))
        for match in _STEPS.finditer(line):
            words = re.findall(r"[a-zµμ]+", f"{match['before']} {match['after']}".lower())
            factor = next((_STEP_UNITS[word] for word in words if word in _STEP_UNITS), 1.0)
            step = _number(match["number"]) * factor
            rates.add(float(f"{1 / step:.9g}") if step else 0.0)
    return rates.pop() if len(rates) == 1 and min(rates) > 0 else None


def current_in(lines: Iterable[str]) -> float | None:
    """The current that lines of text name, A; None if there is none, or if they disagree."""
    currents = set()
    for line in lines:
        match = _CURRENT.fullmatch(line)
        unit = match and (match["after"] or match["before"])
        if match and unit:
            size = _number(match["number"]) * (1e-3 if unit[0] in "mM" else 1.0)
            currents.add(-size if match["sign"] else size)
    return currents.pop() if len(currents) == 1 else None


def rate_of(struct: Mapping[str, Any]) -> float | None:
    """Samples per second in the scalars of a struct, such as ``fs`` or ``dt``."""
    rates = set()
    for name, value in struct.items():
        if isinstance(value, bool) or not isinstance(value, int | float | np.number) or value <= 0:
            continue
        bare = name.lower().replace("_", "")
        if bare in _RATE_NAMES:
            rates.add(float(value))
        elif bare in _STEP_NAMES:
            rates.add(float(f"{1 / value:.9g}"))
    return rates.pop() if len(rates) == 1 else None


def _number(text: str) -> float:
    return float(text.replace(",", "."))


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
