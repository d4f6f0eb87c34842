"""Tables of numbers in test files: columns with their headings, and how rows become a table."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ground_motions.readers.lines import is_number

from ...errors import InputError
from ..run_table import MINIMUM_SAMPLES
from .channels import Heading, heading_of, is_unit, names_quantity
from .clock import CLOCK_UNIT, are_clocks, is_clock, is_date, seconds_of
from .rate import rate_in

_MISSING = {"", "-", "--", "---", "na", "n/a", "#n/a", "nan", "null", "none", "1.#qnan", "-1.#ind"}


class Row(NamedTuple):
    """Cells of a line or of a sheet's row."""

    line: int
    cells: list[str]
    comment: bool = False  # Whether it may stand among numbers


@dataclass(frozen=True)
class RawTable:
    """One test as it is in a file."""

    path: Path  # The file
    part: str  # Sheet or variable; empty if the file is one table
    headings: list[Heading]  # Of the columns
    columns: list[NDArray | list[str]]  # Numbers, or cells of text
    lines: list[int]  # Line of each row
    notes: list[str] = field(default_factory=list)  # What was left out
    rate: float | None = None  # Samples per second that the file names beside the table, Hz

    @property
    def place(self) -> str:
        """File and part, for errors."""
        return f"{self.path}, {self.part}" if self.part else str(self.path)

    def usable(self, k: int) -> bool:
        """Whether a column has numbers."""
        column = self.columns[k]
        if isinstance(column, np.ndarray):
            return bool(np.isfinite(column).any())
        return any(is_number(with_point(cell)) and cell.lower() != "nan" for cell in column)

    def numbers(self, k: int) -> NDArray:
        """Numbers of a column; NaN where a cell is empty or says so."""
        column = self.columns[k]
        if isinstance(column, np.ndarray):
            return column
        numbers = np.full(len(column), np.nan)
        for row, cell in enumerate(column):
            if is_number(with_point(cell)):
                numbers[row] = float(with_point(cell))
            elif cell.lower() not in _MISSING:
                place = f"{self.place}, line {self.lines[row]}, column {self.headings[k].text}"
                raise InputError(place, repr(cell), "a number, or an empty cell")
        numbers[np.isinf(numbers)] = np.nan
        return numbers


def tables_of_rows(path: Path, part: str, rows: Sequence[Row], width: int) -> list[RawTable]:
    """Tables of rows of cells; a further one begins where quantities are named again."""
    place = f"{path}, {part}" if part else str(path)
    blocks = _blocks(rows, width) if width else []
    starts = [0] if blocks else []
    for before, block in pairwise(blocks):
        between = [row for row in rows if before[-1].line < row.line < block[0].line]
        named = [row.line for row in between if sum(map(names_quantity, row.cells)) > 1]
        if not named:
            raise InputError(
                place,
                f"rows of numbers from line {before[0].line}, and again from line {block[0].line}",
                "one table, or a heading above each",
            )
        starts.append(before[-1].line)
    tables: list[RawTable] = []
    for number, (start, block) in enumerate(zip(starts, blocks, strict=True), 1):
        end = starts[number] if number < len(blocks) else math.inf
        several = f"table {number}" if len(blocks) > 1 else ""
        own = [row for row in rows if start < row.line <= end]
        table = _table(path, f"{part} {several}".strip(), own, block)
        # what the file says of its rate stands above its first table
        tables.append(replace(table, rate=table.rate or (tables[0].rate if tables else None)))
    return tables


def tables_of_frames(path: Path, result: Any) -> list[RawTable]:
    """Tables of what a reader of one's own gave: a data frame, or several by the tests' names."""
    frames = result if isinstance(result, Mapping) else {"": result}
    tables = []
    for part, frame in frames.items():
        headings = [heading_of(str(name)) for name in frame.columns]
        columns = [np.asarray(frame.iloc[:, k], float) for k in range(len(headings))]
        rate = frame.attrs.get("rate_Hz")
        lines = list(range(1, len(frame) + 1))
        tables.append(RawTable(path, str(part), headings, [*columns], lines, rate=rate))
    return tables


def _blocks(rows: Sequence[Row], width: int) -> list[list[Row]]:
    """Sequences of rows of numbers that are long enough for a test."""
    blocks: list[list[Row]] = [[]]
    for row in rows:
        if len(row.cells) == width and is_data(row.cells) and not row.comment:
            blocks[-1].append(row)
        elif blocks[-1] and any(row.cells) and not row.comment:
            blocks.append([])
    return [block for block in blocks if len(block) >= MINIMUM_SAMPLES]


def _table(path: Path, part: str, rows: Sequence[Row], block: Sequence[Row]) -> RawTable:
    """Table of a block of rows, with the names and units above it."""
    width = len(block[0].cells)
    # a row that begins the table but has text where the others have numbers is above it
    texts = [_are_texts([row.cells[k] for row in block]) for k in range(width)]
    while any(_are_texts([block[0].cells[k]]) and not texts[k] for k in range(width)):
        block = block[1:]
    filled = max(k for k in range(width) if any(row.cells[k] for row in block)) + 1
    above = [
        row.cells for row in rows
        if row.line < block[0].line
        and (len(row.cells) == width or len(trim(row.cells)) == filled)
    ]  # fmt: skip
    units = next((cells for cells in reversed(above) if are_units(cells)), [])
    named = [cells for cells in reversed(above) if any(cells) and cells is not units]
    names = max(named, key=lambda cells: sum(map(names_quantity, cells)), default=[])
    used = [k for k in range(width) if _at(names, k) or any(row.cells[k] for row in block)]
    notes = []
    if any(is_data(cells, least=2) for cells in above):
        notes.append(f"numbers above line {block[0].line} are left out")
    if any(any(row.cells) and not row.comment for row in rows if row.line > block[-1].line):
        notes.append(f"what stands below line {block[-1].line} is left out")
    headings, columns = [], []
    for k in used:
        cells = [row.cells[k] for row in block]
        heading = heading_of(_at(names, k) or f"column {k + 1}", _at(units, k))
        if are_clocks(cells):
            # another column of times is better: a clock's are often rounded
            heading = Heading(heading.text, CLOCK_UNIT, ("time",), True, heading.name)
        headings.append(heading)
        columns.append(seconds_of(cells) if heading.unit == CLOCK_UNIT else cells)
    return RawTable(
        path,
        part,
        headings,
        columns,
        [row.line for row in block],
        notes,
        rate_in(" ".join(row.cells) for row in rows if row.line < block[0].line),
    )


def _at(cells: Sequence[str], k: int) -> str:
    return cells[k].strip() if k < len(cells) else ""


def _are_texts(cells: Sequence[str]) -> bool:
    """Whether most of the cells are neither numbers nor missing."""
    texts = sum(not (_is_value(c) or is_date(c)) and c.lower() not in _MISSING for c in cells)
    return 2 * texts > len(cells)


def are_units(cells: Sequence[str]) -> bool:
    """Whether most cells of a row are units."""
    written = [cell for cell in cells if cell.strip("[](){}<>- ")]
    return len(written) > 1 and 2 * sum(map(is_unit, written)) >= len(written)


def trim(cells: Sequence[str]) -> list[str]:
    """Cells without the empty ones at the end."""
    trimmed = list(cells)
    while trimmed and not trimmed[-1]:
        trimmed.pop()
    return trimmed


def with_point(cell: str) -> str:
    """A cell with a decimal point."""
    return cell.replace(",", ".")


def is_data(cells: Sequence[str], least: int = 1) -> bool:
    """Whether a row has numbers, and texts in half of its cells at most."""
    return sum(map(_is_value, cells)) >= least and not _are_texts(cells)


def _is_value(cell: str) -> bool:
    """Whether a cell is a number or a time of day."""
    return is_number(with_point(cell)) or is_clock(cell)
