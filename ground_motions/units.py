"""Units of acceleration that files may come in."""

from __future__ import annotations

from types import MappingProxyType

from ground_motions.errors import InputError, nearest

STANDARD_GRAVITY = 9.80665
"""Standard gravity, m/s2 (3rd General Conference on Weights and Measures, 1901)."""

ACCELERATION_UNITS = MappingProxyType(
    {
        "m/s2": 1.0,
        "g": STANDARD_GRAVITY,
        "cm/s2": 1e-2,
        "gal": 1e-2,
        "mm/s2": 1e-3,
    }
)
"""Each accepted unit in m/s2."""


def to_m_s2(unit: str, place: str = "unit") -> float:
    """Return the factor that turns a unit of acceleration into m/s2."""
    try:
        return ACCELERATION_UNITS[unit.lower()]
    except (KeyError, AttributeError):
        raise InputError(place, f"unit {unit!r}", nearest(str(unit), ACCELERATION_UNITS)) from None
