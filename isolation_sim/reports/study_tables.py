"""The table of a study, in engineering units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..written_names import as_written
from .sweep_tables import heading
from .tables import TextTable
from .units import unit_of

Records = Sequence[Mapping[str, Any]]
"""One row per case; headings end in the SI unit; None for a missing number."""


def layout(records: Records, title: str) -> TextTable:
    """Format a study's table for the terminal, in engineering units."""
    words = [any(isinstance(record.get(key), str) for record in records) for key in _keys(records)]
    # the words at the beginning of a row identify the case
    keys = max(1, next((k for k, word in enumerate(words) if not word), len(words)))
    return TextTable(title, *texts(records), keys=keys)


def texts(records: Records) -> tuple[list[str], list[list[str]]]:
    """Write a study's table as text, in engineering units."""
    keys = _keys(records)
    headings = [heading(key).replace("_", " ") for key in keys]
    return headings, [[_cell_text(key, record.get(key, "")) for key in keys] for record in records]


def _keys(records: Records) -> list[str]:
    return list(dict.fromkeys(key for record in records for key in record))


def _cell_text(key: str, value: Any) -> str:
    if value is None:
        return "never"
    if key == "controller":
        return as_written(value)
    if isinstance(value, float):
        return f"{value * unit_of(key)[1]:.3g}"
    return str(value)
