"""Engineering units of tables and figures, by the unit at the end of an SI name."""

from __future__ import annotations

UNITS = {
    "drift_ratio": ("%", 1e2),
    "m2_s4": ("m²/s⁴", 1.0),
    "m_s3": ("m/s³", 1.0),
    "m_s2": ("m/s²", 1.0),
    "m_s": ("m/s", 1.0),
    "s": ("s", 1.0),
    "m": ("mm", 1e3),
    "N": ("kN", 1e-3),
    "J": ("kJ", 1e-3),
    "A": ("A", 1.0),
}
"""Printed unit and its factor from SI."""


def ending_of(name: str) -> str:
    """SI unit at the end of a name; empty without one."""
    return next((ending for ending in UNITS if name.endswith(f"_{ending}")), "")


def unit_of(name: str) -> tuple[str, float]:
    """Find the printed unit of a quantity."""
    return UNITS.get(ending_of(name), ("", 1.0))


_ENDINGS = {
    "m2_s3": "m²/s³", "kg_m2": "kg m²", "kg_m3": "kg/m³", "N_per_m": "N/m", "A_per_s": "A/s",
    "m_s2": "m/s²", "m_s": "m/s", "km": "km", "kg": "kg", "Hz": "Hz", "hz": "Hz", "rad": "rad",
    "s": "s", "m": "m", "g": "g", "N": "N", "J": "J", "A": "A",
}  # fmt: skip
_WITHOUT_UNIT = ("count", "factor", "ratio", "scale")


def split_unit(key: str) -> tuple[str, str]:
    """Split a key of a scenario into its name and its printed unit; - without dimension."""
    for ending, unit in _ENDINGS.items():
        if key.endswith(f"_{ending}"):
            return key.removesuffix(f"_{ending}"), unit
    return key, "-" if key.endswith(_WITHOUT_UNIT) else ""
