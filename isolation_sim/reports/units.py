"""Engineering units that tables and figures print, by the ending of an SI name."""

from __future__ import annotations

UNITS = {
    "m_s2": ("m/s²", 1.0),
    "m_s": ("m/s", 1.0),
    "s": ("s", 1.0),
    "m": ("mm", 1e3),
    "N": ("kN", 1e-3),
    "J": ("kJ", 1e-3),
    "A": ("A", 1.0),
}
"""Unit to print and factor from SI."""


def unit_of(name: str) -> tuple[str, float]:
    """Find the unit to print for a quantity."""
    for ending, unit in UNITS.items():
        if name.endswith(f"_{ending}"):
            return unit
    return "", 1.0
