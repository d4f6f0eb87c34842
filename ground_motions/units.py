"""Units of the files that are read, and their factors to SI."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType

from ground_motions.errors import InputError, did_you_mean

STANDARD_GRAVITY = 9.80665
"""Standard gravity, m/s2 (3rd General Conference on Weights and Measures, 1901)."""

_INCH, _FOOT, _POUND_FORCE = 0.0254, 0.3048, 4.4482216

UNITS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0},
        "displacement": {"mm": 1e-3, "m": 1.0, "cm": 1e-2, "um": 1e-6, "in": _INCH},
        "force": {
            "N": 1.0, "kN": 1e3, "MN": 1e6, "lbf": _POUND_FORCE, "kip": 1e3 * _POUND_FORCE,
            "kgf": STANDARD_GRAVITY, "daN": 10.0, "tf": 1e3 * STANDARD_GRAVITY,
        },
        "current": {"A": 1.0, "mA": 1e-3},
        "velocity": {"mm/s": 1e-3, "m/s": 1.0, "cm/s": 1e-2, "in/s": _INCH},
        "acceleration": {
            "m/s2": 1.0, "g": STANDARD_GRAVITY, "mg": 1e-3 * STANDARD_GRAVITY, "cm/s2": 1e-2,
            "gal": 1e-2, "mm/s2": 1e-3, "ft/s2": _FOOT, "in/s2": _INCH,
        },
        "temperature": {"C": 1.0},
    }
)  # fmt: skip
"""Accepted units of each quantity and their factors to SI (temperature in degree Celsius)."""

ACCELERATION_UNITS = UNITS["acceleration"]
"""Accepted units of acceleration and their factors to m/s2."""

_SPELLINGS = {" ": "", "²": "2", "**": "", "^": "", "sec": "s", "/s/s": "/s2", "gals": "gal"}


def unit_name(text: str) -> str | None:
    """Return the accepted name of a unit of acceleration, such as ``cm/s2`` of ``CM/SEC^2``."""
    name = text.lower()
    for spelling, usual in _SPELLINGS.items():
        name = name.replace(spelling, usual)
    return name if name in ACCELERATION_UNITS else None


def to_m_s2(unit: str, place: str = "unit") -> float:
    """Return the factor that turns a unit of acceleration into m/s2."""
    name = unit_name(unit)
    if name is None:
        # a hint must not suggest another unit of length, such as m for yd
        same = [each for each in ACCELERATION_UNITS if each.split("/")[0] == unit.split("/")[0]]
        hint = did_you_mean(unit, same)
        raise InputError(place, f"unit {unit!r}", ", ".join(ACCELERATION_UNITS), hint)
    return ACCELERATION_UNITS[name]


def column_units(quantity: str, units: Iterable[str] = ()) -> dict[str, float]:
    """Return factors to SI by a unit's spelling in column names, such as ``m_s2`` for ``m/s2``."""
    known = UNITS[quantity]
    return {unit.replace("/", "_"): known[unit] for unit in units or known}
