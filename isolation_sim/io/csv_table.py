"""CSV tables with column names in the first line; errors name the cell."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ground_motions.files import atomic_write
from ground_motions.readers.lines import parse_number, table_cells

from ..errors import InputError


@dataclass(frozen=True)
class CsvTable:
    """Cells of a file, and their line numbers."""

    path: str | Path  # The file
    names: list[str]  # Column names
    rows: list[list[str]]  # Cells below the names
    lines: list[int]  # Line number of the names, then of each row

    @property
    def head(self) -> str:
        """Place of the column names."""
        return f"{self.path}, line {self.lines[0]}"

    def numbers(self, used: Sequence[int], gaps: Sequence[int] = ()) -> NDArray:
        """Numbers of some columns; in the columns ``gaps`` an empty cell or NaN is NaN."""
        table = np.zeros((len(self.rows), len(self.names)))
        try:
            table[:, used] = [
                [float(row[k] or ("nan" if k in gaps else "")) for k in used] for row in self.rows
            ]
            alike = all(len(row) == len(self.names) for row in self.rows)
            right = np.isfinite(table)
            right[:, gaps] |= np.isnan(table[:, gaps])
            usable = alike and bool(right.all())
        except (ValueError, IndexError):
            usable = False
        if not usable:
            self._refuse(used, gaps)
        return table

    def _refuse(self, used: Sequence[int], gaps: Sequence[int]) -> None:
        """Name the first row or cell that is wrong."""
        for row, line in zip(self.rows, self.lines[1:], strict=True):
            place = f"{self.path}, line {line}"
            if len(row) != len(self.names):
                raise InputError(
                    f"{place}: {len(row)} cells; expected: {len(self.names)}, one per column of "
                    "the header"
                )
            for k in used:
                if k in gaps and row[k].lower() in ("", "nan"):
                    continue
                parse_number(row[k], f"{place}, column {self.names[k]}")


def read_csv_table(path: str | Path) -> CsvTable:
    """Read the cells of a CSV file; lines that begin with ``#`` are skipped."""
    numbered = table_cells(path)
    names, *rows = [cells for _, cells in numbered]
    return CsvTable(path, names, rows, [number for number, _ in numbered])


def write_table(records: Sequence[Mapping[str, Any]], path: str | Path) -> Path:
    """Write records as CSV, one column per key."""
    keys = list(dict.fromkeys(key for record in records for key in record))
    with (
        atomic_write(path) as unfinished,
        unfinished.open("w", newline="", encoding="utf-8") as file,
    ):
        writer = csv.DictWriter(file, keys, restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows(records)
    return Path(path)
