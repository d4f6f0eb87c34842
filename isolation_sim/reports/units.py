"""Engineering units of tables and figures, by the unit at the end of an SI name."""

from __future__ import annotations

from typing import Any

import numpy as np

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


_STATISTICS = ("mean", "standard_deviation", "median", "percentile_84", "maximum", "design")
"""Columns of a suite's statistics in the unit of the row's criterion."""


def in_engineering_units(part: Any) -> Any:
    """A table or a history with mm, kN, kJ and % in place of m, N, J and a ratio."""
    import pandas

    if hasattr(part, "data_vars"):
        return _converted_history(part)
    columns = {}
    for name, values in part.items():
        shown, factor = _printed(str(name))
        measured = factor != 1 and values.dtype.kind in "fi"
        columns[shown if measured else name] = factor * values if measured else values
    result = pandas.DataFrame(columns)
    if "criterion" in result and len(result):  # the statistics of a suite: a row per criterion
        names, factors = zip(*map(_printed, map(str, result["criterion"])), strict=True)
        numbers = [name for name in result if name in _STATISTICS]
        result[numbers] = result[numbers].mul(list(factors), axis=0)
        result["criterion"] = names
    return result


def _converted_history(history: Any) -> Any:
    factors = {unit: (shown, factor) for unit, (shown, factor) in UNITS.items() if factor != 1}
    changed = {}
    for name, array in history.variables.items():
        shown, factor = factors.get(array.attrs.get("units", ""), ("", 1.0))
        if shown:
            values, rotations = factor * array.values, array.attrs.get("rotations", "").split()
            if rotations:  # in rad, which is printed as it is
                values = np.where(history["dof"].isin(rotations), array.values, values)
            changed[name] = array.dims, values, array.attrs | {"units": shown}
    return history.assign(changed)


def _printed(name: str) -> tuple[str, float]:
    """Name of a column with its printed unit, and the factor of its values."""
    ending = ending_of(name)
    shown, factor = unit_of(name)
    before = name.removesuffix(f"_{ending}")
    # a stiffness in N_per_m and a moment in N_m keep their units
    if factor == 1 or before.endswith(("_per", *(f"_{unit}" for unit in UNITS))):
        return name, 1.0
    return f"{before}_{'drift_percent' if shown == '%' else shown}", factor
