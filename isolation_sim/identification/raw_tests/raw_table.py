"""Tables of numbers in test files: columns with their headings, and how rows become a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ground_motions.readers.lines import Corners, is_number, other_decimal_mark, two_marks

from ...errors import InputError
from ..measured.run_table import MINIMUM_SAMPLES
from .channels import Heading, columns_named, heading_of, is_unit, listed, names_quantity
from .rate import (
    CLOCK_UNIT,
    are_clocks,
    current_in,
    is_clock,
    is_date,
    rate_in,
    seconds_of,
)

_MISSING = {"", "-", "--", "---", "na", "n/a", "#n/a", "nan", "null", "none", "1.#qnan", "-1.#ind"}


class Row(NamedTuple):
    """Cells of a line or of a sheet's row."""

    line: int
    cells: list[str]
    numbers: bool  # Whether it belongs to a table
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
    current: float | None = None  # That the file names above the table, A
    filtered: Corners | None = None  # That the file names

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
        if all(map(is_number, column)):
            numbers = np.array(column, float)
        else:
            other = other_decimal_mark(column)
            if other is not None:
                place = f"{self.place}, line {self.lines[other]}, column {self.headings[k].text}"
                raise InputError(place, *two_marks(column[other]))
            numbers = np.array([self._number(k, row, cell) for row, cell in enumerate(column)])
        numbers[np.isinf(numbers)] = np.nan
        return numbers

    def _number(self, k: int, row: int, cell: str) -> float:
        """Number in a cell of column k; NaN where it is missing."""
        if is_number(with_point(cell)):
            return float(with_point(cell))
        if cell.lower() not in _MISSING:
            place = f"{self.place}, line {self.lines[row]}, column {self.headings[k].text}"
            raise InputError(place, repr(cell), "a number, or an empty cell")
        return np.nan


def filter_note(filters: Sequence[Corners]) -> str:
    """Note of the filters that a file names."""
    below = ", ".join("-".join(f"{corner:g}" for corner in high) for high, _ in filters)
    return f"filtered below {below} Hz: slower and residual motion is missing"


def table_of_columns(
    path: Path,
    part: str,
    headings: list[Heading],
    columns: Sequence[NDArray],
    notes: Sequence[str] = (),
    *,
    rate: float | None = None,
    filtered: Corners | None = None,
) -> RawTable:
    """Table of columns of numbers, whose rows are counted from 1; see `RawTable`."""
    lines = list(range(1, len(columns[0]) + 1))
    return RawTable(path, part, headings, [*columns], lines, [*notes], rate=rate, filtered=filtered)


def tables_by_column(table: RawTable, choice: str) -> list[RawTable]:
    """Tables of the tests in one table, whose numbers or names are in a column; see `RawTable`."""
    matches = columns_named(choice, table.headings)
    if len(matches) != 1:
        expected = f"one of {listed(table.headings)}, or its number"
        raise InputError(f"{table.place}, --test-column", repr(choice), expected)
    rows_of: dict[str, list[int]] = {}
    for row, cell in enumerate(table.columns[matches[0]]):
        name = f"{cell:.12g}" if isinstance(cell, float) else cell
        rows_of.setdefault(name, []).append(row)
    tables, left_out = [], []
    for name, rows in rows_of.items():
        if name.lower() in _MISSING or len(rows) < MINIMUM_SAMPLES:
            left_out.append(f"{len(rows)} rows of test {name!r} left out")
            continue
        columns = [
            each[rows] if isinstance(each, np.ndarray) else [each[k] for k in rows]
            for each in table.columns
        ]
        part, lines = f"{table.part} test {name}".strip(), [table.lines[k] for k in rows]
        tables.append(replace(table, part=part, columns=columns, lines=lines, notes=[*table.notes]))
    if tables:
        tables[0].notes.extend(left_out)
    return tables


def tables_of_rows(path: Path, part: str, rows: Sequence[Row]) -> list[RawTable]:
    """Tables of rows of cells; one begins at a heading, or where the time begins again."""
    tests: list[list[RawTable]] = []  # of each test its sections between texts
    heading: list[Row] = []  # what stands above the test
    last = 0
    for block in _blocks(rows):
        between = [row for row in rows if last < row.line < block[0].line]
        last = block[-1].line
        if not tests or any(sum(map(names_quantity, row.cells)) > 1 for row in between):
            heading = between
            tests.append([_table(path, part, heading, block)])
            continue
        table = _table(path, part, heading, block)
        if _begins_again(tests[-1][-1], table):
            tests.append([table])
        else:
            tests[-1].append(table)
            texts = [row for row in between if any(row.cells) and not row.comment]
            tests[-1][0].notes.append(_left_out_between(texts))
    tables = [_joined(sections) for sections in tests]
    if tables and any(any(row.cells) and not row.comment for row in rows if row.line > last):
        tables[-1].notes.append(f"what stands below line {last} is left out")
    if len(tables) > 1:
        # what the file says of its rate stands above its first table
        tables = [
            replace(table, part=f"{part} table {number}".strip(), rate=table.rate or tables[0].rate)
            for number, table in enumerate(tables, 1)
        ]
    return tables


def _joined(sections: Sequence[RawTable]) -> RawTable:
    """One table of its sections, with the notes of the first."""
    if len(sections) == 1:
        return sections[0]
    columns: list[NDArray | list[str]] = []
    for parts in zip(*(section.columns for section in sections), strict=True):
        if isinstance(parts[0], list):
            columns.append([cell for column in parts for cell in column])
        else:
            columns.append(np.concatenate(parts))
    lines = [line for section in sections for line in section.lines]
    return replace(sections[0], columns=columns, lines=lines)


def _left_out_between(rows: Sequence[Row]) -> str:
    """Note of what stands among the numbers of a table."""
    first, last = rows[0], rows[-1]
    lines = f"line {first.line}" if first is last else f"lines {first.line} to {last.line}"
    return f"{lines} among the numbers left out, {' '.join(first.cells).strip()!r}"


def _begins_again(before: RawTable, after: RawTable) -> bool:
    """Whether the times of rows without a heading of their own begin again after a text."""
    clocks = [
        k for k, heading in enumerate(before.headings)
        if "time" in heading.quantities and before.usable(k)
    ]  # fmt: skip
    # a name that may be that of a time, "t", comes after one that is
    clocks.sort(key=lambda k: len(before.headings[k].quantities))
    if not clocks or before.headings != after.headings:
        raise InputError(
            before.place,
            f"rows of numbers from line {before.lines[0]}, and again from line {after.lines[0]}",
            "one table, a heading above each, or a column of times",
        )
    return bool(np.nanmin(after.numbers(clocks[0])) <= np.nanmax(before.numbers(clocks[0])))


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


def _blocks(rows: Sequence[Row]) -> list[list[Row]]:
    """Sequences of rows of numbers that are long enough for a test."""
    blocks: list[list[Row]] = [[]]
    for row in rows:
        if row.numbers:
            blocks[-1].append(row)
        elif blocks[-1] and any(row.cells) and not row.comment:
            blocks.append([])
    return [block for block in blocks if len(block) >= MINIMUM_SAMPLES]


def _table(path: Path, part: str, lines_above: Sequence[Row], block: Sequence[Row]) -> RawTable:
    """Table of a block of rows, with the names and units above it."""
    rows = [*lines_above, *block]
    width = len(block[0].cells)
    # a row that begins the table but has text where the others have numbers is above it
    while any(
        _are_texts([cell]) and not _are_texts([row.cells[k] for row in block])
        for k, cell in enumerate(block[0].cells)
    ):
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
    if not names:
        notes += [
            f"line {row.line} has {len(trim(row.cells))} names for {filled} columns of numbers"
            for row in lines_above
            if sum(map(names_quantity, row.cells)) > 1
        ]
    texts = [" ".join(row.cells) for row in rows if row.line < block[0].line]
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
        rate_in(texts),
        current_in(texts),
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
    values = sum(map(_is_value, cells))
    return values >= least and (values == len(cells) or not _are_texts(cells))


def _is_value(cell: str) -> bool:
    """Whether a cell is a number or a time of day."""
    return is_number(cell) or is_number(with_point(cell)) or is_clock(cell)
