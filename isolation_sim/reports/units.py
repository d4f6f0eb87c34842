"""Engineering units of tables and figures, by the unit at the end of an SI name."""

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
"""Printed unit and its factor from SI."""


def unit_of(name: str) -> tuple[str, float]:
    """Find the printed unit of a quantity."""
    for ending, unit in UNITS.items():
        if name.endswith(f"_{ending}"):
            return unit
    return "", 1.0
