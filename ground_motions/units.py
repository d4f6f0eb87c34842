"""Units of acceleration that files may come in."""

from __future__ import annotations

from types import MappingProxyType

from ground_motions.errors import InputError

STANDARD_GRAVITY = 9.80665
"""Standard gravity, m/s2 (3rd General Conference on Weights and Measures, 1901)."""

ACCELERATION_UNITS = MappingProxyType(
    {
        "m/s2": 1.0,
        "g": STANDARD_GRAVITY,
        "cm/s2": 1e-2,
        "gal": 1e-2,
        "mm/s2": 1e-3,
        "ft/s2": 0.3048,
        "in/s2": 0.0254,
    }
)
"""Each accepted unit in m/s2."""

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
        hint = f"{same[0]} (did you mean it?), " if same else ""
        others = ", ".join(each for each in ACCELERATION_UNITS if each not in same)
        raise InputError(place, f"unit {unit!r}", hint + others)
    return ACCELERATION_UNITS[name]
