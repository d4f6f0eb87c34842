"""The sampling rate that a file names beside its table."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

_NUMBER = r"(?P<number>(?:\d+(?:[.,]\d+)?|[.,]\d+)(?:[eE][+-]?\d+)?)"
_RATE = (
    r"(?:sampl\w*[ _-]*(?:rate|freq\w*)|scan[ _-]*rate|samples?[ _]*(?:per|/)[ _]*s(?:ec\w*)?"
    r"|abtast(?:rate|frequenz)|messrate|(?<![a-z/])(?:fs|sps)(?![a-z]))"
)
_STEP = (
    r"(?:sampl\w*[ _-]*(?:interval|period|time|step)|time[ _-]*step|abtast(?:intervall|zeit)"
    r"|delta[ _]?[xt]|(?<![a-z])dt(?![a-z]))"
)
# a unit stands before the number, as in "Abtastrate [kHz]: 1,2", or behind it
_BETWEEN = r"[^\d\n+-]{0,24}?"
_RATES = re.compile(rf"{_RATE}(?P<before>{_BETWEEN}){_NUMBER}\s*(?P<after>[a-z/]*)", re.IGNORECASE)
_STEPS = re.compile(rf"{_STEP}(?P<before>{_BETWEEN}){_NUMBER}\s*(?P<after>[a-zµμ]*)", re.IGNORECASE)
_STEP_UNITS = {"ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6}
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
        for match in _STEPS.finditer(line):
            words = re.findall(r"[a-zµμ]+", f"{match['before']} {match['after']}".lower())
            factor = next((_STEP_UNITS[word] for word in words if word in _STEP_UNITS), 1.0)
            step = _number(match["number"]) * factor
            rates.add(float(f"{1 / step:.9g}") if step else 0.0)
    return rates.pop() if len(rates) == 1 and min(rates) > 0 else None


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
