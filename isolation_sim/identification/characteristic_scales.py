"""Sizes of parameters from the data, by their units."""

from __future__ import annotations

import re
from collections.abc import Mapping

from ..errors import InputError

# powers of force, length, time and current
_POWERS = {
    "N": (1, 0, 0, 0),
    "m": (0, 1, 0, 0),
    "s": (0, 0, 1, 0),
    "A": (0, 0, 0, 1),
    "J": (1, 1, 0, 0),
    "kg": (1, -1, 2, 0),
    "degC": (0, 0, 0, 0),
    "K": (0, 0, 0, 0),
    "T": (0, 0, 0, 0),
}


def characteristic_scale(
    unit: str,
    force: float,
    length: float,
    time: float,
    current: float = 1.0,
    exponents: Mapping[str, float] | None = None,
) -> float:
    """Size that a quantity has when force, length, time and current have given sizes.

    Examples
    --------
    >>> characteristic_scale("N/m", 10.0, 0.002, 0.1)
    5000.0
    """
    above, _, below = unit.partition("/")
    size, sizes = 1.0, (force, length, time, current)
    for part, sign in ((above, 1), (below.strip("()"), -1)):
        for symbol in part.split():
            if symbol in ("1", "-", ""):
                continue
            result = re.fullmatch(r"([A-Za-z]+)(?:\^(-?[\d.]+|[a-z]\w*))?", symbol)
            if result is None or result[1] not in _POWERS:
                raise InputError(f"unit {unit!r} is not made of {', '.join(_POWERS)}")
            power = sign * _exponent(result[2] or "1", exponents or {})
            for base, exponent in zip(sizes, _POWERS[result[1]], strict=True):
                size *= base ** (power * exponent)
    return size


def _exponent(text: str, exponents: Mapping[str, float]) -> float:
    """An exponent that is itself a parameter is mostly near 2."""
    return exponents.get(text, 2.0) if text[0].isalpha() else float(text)
