"""Table of the consequence of a law's or a model's error for control."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..discrepancy.consequence import SUBJECTS
from ..written_names import as_written
from .tables import TextTable
from .units import unit_of

if TYPE_CHECKING:
    from ..discrepancy.consequence import Consequence, Performance

_HEADINGS = (
    "controller",
    "base displ., mm: old", "new", "error, %",
    "floor acc., m/s²: old", "new", "error, %",
    "J: old", "new", "new design",
    "rank: old", "new", "new design",
)  # fmt: skip


def consequence_note(consequence: Consequence) -> str:
    """Meaning of the table's columns."""
    old, new = SUBJECTS[consequence.subject]
    return (
        f"Old: building and controllers use the {old}. New: the building uses the {new}, the "
        f"controllers the old one. New design: both use the {new}. J: mean of the two peaks, each "
        "over its value with the coils off. Rank: by J."
    )


def consequence_table(consequence: Consequence) -> TextTable:
    """Controllers with the old and with the new law or model."""
    rows = []
    for name, cases in consequence.performance.items():
        predicted, actual, redesigned = (
            cases[case] for case in ("predicted", "actual", "redesigned")
        )
        row = [as_written(name)]
        for key in ("peak_base_displacement_m", "peak_floor_acceleration_m_s2"):
            row += [_number(predicted, key), _number(actual, key), _error(predicted, actual, key)]
        row += [_number(one, "J") for one in (predicted, actual, redesigned)]
        row += [str(one.rank) if one else "-" for one in (predicted, actual, redesigned)]
        rows.append(row)
    return TextTable(
        f"Consequence of the {consequence.subject}'s error for control", _HEADINGS, rows
    )


def _number(one: Performance | None, key: str) -> str:
    return "-" if one is None else f"{getattr(one, key) * unit_of(key)[1]:.3g}"


def _error(predicted: Performance | None, actual: Performance | None, key: str) -> str:
    if predicted is None or actual is None:
        return "-"
    return f"{100 * (getattr(predicted, key) / getattr(actual, key) - 1):+.0f}"
