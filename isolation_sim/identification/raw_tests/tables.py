"""Tables of numbers in text files, Excel workbooks and MATLAB files."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ground_motions.readers.lines import is_number, read_lines

from ...errors import InputError
from ..run_table import MINIMUM_SAMPLES
from .channels import Heading, heading_of, is_unit, names_quantity
from .rate import rate_in, rate_of

_SEPARATORS = (";", "\t", ",", " ")
_LOOKED_AT = 2000
"""Lines by which the separator is found."""
_COMMENT = re.compile(r"\s*(?:[%#!]+|//|;+)\s*")
_BLANK = re.compile(r"\s{2,}|\t")
_NOT_BEFORE_UNIT = re.compile(r"\s+(?![\[({<])")
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")
_LONG_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d{3,}(?:[eE][+-]?\d+)?")
_MISSING = {"", "-", "--", "---", "na", "n/a", "#n/a", "nan", "null", "none", "1.#qnan", "-1.#ind"}
_MOST_COLUMNS = 64
"""Columns of a matrix without names, at most."""


class _Row(NamedTuple):
    """Cells of a line or of a sheet's row."""

    line: int
    cells: list[str]


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
        return any(is_number(_with_point(cell)) and cell.lower() != "nan" for cell in column)

    def numbers(self, k: int) -> NDArray:
        """Numbers of a column; NaN where a cell is empty or says so."""
        column = self.columns[k]
        if isinstance(column, np.ndarray):
            return column
        numbers = np.full(len(column), np.nan)
        for row, cell in enumerate(column):
            if is_number(_with_point(cell)):
                numbers[row] = float(_with_point(cell))
            elif cell.lower() not in _MISSING:
                place = f"{self.place}, line {self.lines[row]}, column {self.headings[k].text}"
                raise InputError(place, repr(cell), "a number, or an empty cell")
        numbers[np.isinf(numbers)] = np.nan
        return numbers


def read_tables(path: Path) -> list[RawTable]:
    """Tests of a file; none if it holds no table of 16 rows or more."""
    return READERS[path.suffix.lower()](path)


def _read_text(path: Path) -> list[RawTable]:
    lines = [(number, line) for number, line in enumerate(read_lines(path), 1) if line.strip()]
    separator, width = _format([line for _, line in lines[:_LOOKED_AT]])
    if not width:
        return []
    rows = [_Row(number, _cells(line, separator)) for number, line in lines]
    comments = [
        bool(_COMMENT.match(line)) and not (separator == ";" and _is_data(row.cells))
        for row, (_, line) in zip(rows, lines, strict=True)
    ]
    data = [row for row, comment in zip(rows, comments, strict=True) if not comment]
    first = _block(data, width, path)[0].line
    above = [_Row(k, _heading_cells(line, separator, width)) for k, line in lines if k < first]
    table = _table(path, "", [*above, *(row for row in data if row.line >= first)], width)
    return [] if table is None else [table]


def _read_excel(path: Path) -> list[RawTable]:
    try:
        import openpyxl
    except ModuleNotFoundError:
        raise InputError(
            f"{path}: needs openpyxl, which is not installed; expected: "
            "pip install 'isolation-sim[excel]'"
        ) from None
    try:
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
        sheets = {sheet.title: list(sheet.iter_rows(values_only=True)) for sheet in book.worksheets}
        book.close()
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except Exception as error:  # openpyxl raises many kinds
        words = " ".join(str(error).split())
        raise InputError(f"{path}: cannot be read ({words}); expected: a workbook *.xlsx") from None
    tables = []
    for title, values in sheets.items():
        width = max(map(len, values), default=0)
        rows = [
            _Row(k, ["" if cell is None else str(cell).strip() for cell in row])
            for k, row in enumerate(values, 1)
        ]
        for row in rows:
            row.cells.extend([""] * (width - len(row.cells)))
        tables.append(_table(path, f"sheet {title}", rows, width))
    return [table for table in tables if table is not None]


def _read_mat(path: Path) -> list[RawTable]:
    from scipy.io import loadmat

    try:
        with path.open("rb") as file:
            content = loadmat(file, simplify_cells=True)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except NotImplementedError:
        raise InputError(
            f"{path}: MATLAB's format 7.3 is HDF5; expected: save(..., '-v7') in MATLAB"
        ) from None
    except Exception:  # SciPy raises many kinds
        raise InputError(f"{path}: not a MATLAB .mat file") from None
    variables = {name: value for name, value in content.items() if not name.startswith("__")}
    return list(_structs(path, "", variables))


READERS: dict[str, Callable[[Path], list[RawTable]]] = {
    **dict.fromkeys((".csv", ".txt", ".dat", ".asc", ".tsv"), _read_text),
    **dict.fromkeys((".xlsx", ".xlsm"), _read_excel),
    ".mat": _read_mat,
}
"""Readers by the suffix of their files."""


def _with_point(cell: str) -> str:
    return cell.replace(",", ".")


def _cells(line: str, separator: str) -> list[str]:
    if separator == " ":
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]


def _is_data(cells: Sequence[str], least: int = 1) -> bool:
    """Whether a row has numbers, and texts in half of its cells at most."""
    numbers = sum(map(is_number, map(_with_point, cells)))
    return numbers >= least and not _are_texts(cells)


def _format(lines: Sequence[str]) -> tuple[str, int]:
    """Separator of a text table and number of its columns; no columns without a table."""
    best = ("", 0, 0)
    for separator in _SEPARATORS:
        widths = Counter(
            len(cells) for line in lines
            if not (separator != ";" and _COMMENT.match(line))
            and _is_data(cells := _cells(line, separator), least=2)
        )  # fmt: skip
        for width, count in widths.most_common(1):
            if count > best[2]:
                best = (separator, width, count)
    bare = [line.strip() for line in lines]
    alone = sum(map(is_number, map(_with_point, bare)))
    if alone >= MINIMUM_SAMPLES and (best[2] < MINIMUM_SAMPLES or _are_decimal_commas(bare, best)):
        return "\t", 1  # one column, its lines without a separator
    return best[0], best[1]


def _are_decimal_commas(lines: Sequence[str], found: tuple[str, int, int]) -> bool:
    """Whether a table of two columns is one column of decimal commas, by the heading above it."""
    first = next(k for k, line in enumerate(lines) if is_number(_with_point(line)))
    above = _COMMENT.sub("", lines[first - 1], count=1) if first else ""
    heading = heading_of(above)
    name, *others = above.split(",")
    # "Acc, g" is one heading, and "Time,Acc" are two
    alone = not others or (len(others) == 1 and is_unit(others[0]) and not heading_of(name).unit)
    decimal = _DECIMAL_COMMA if heading.unit or heading.quantities else _LONG_DECIMAL_COMMA
    matching = sum(bool(decimal.fullmatch(line)) for line in lines)
    return found[:2] == (",", 2) and alone and matching > 0.9 * found[2]


def _heading_cells(line: str, separator: str, width: int) -> list[str]:
    """Cells of a line above the table, which may be separated otherwise."""
    bare = _COMMENT.sub("", line, count=1) if _COMMENT.match(line) else line
    # an empty first cell before semicolons is no comment
    whole = [_cells(line, separator)] if separator == ";" else []
    splits = [
        *whole, _cells(bare, separator), *(_cells(bare, other) for other in _SEPARATORS[:-1]),
        _BLANK.split(bare.strip()), _NOT_BEFORE_UNIT.split(bare.strip()), bare.split(),
    ]  # fmt: skip
    return next((cells for cells in splits if len(_trim(cells)) == width), splits[0])


def _trim(cells: Sequence[str]) -> list[str]:
    """Cells without the empty ones at the end."""
    trimmed = list(cells)
    while trimmed and not trimmed[-1]:
        trimmed.pop()
    return trimmed


def _block(rows: Sequence[_Row], width: int, place: str | Path) -> list[_Row]:
    """Longest sequence of rows of numbers; a second long one is refused."""
    blocks: list[list[_Row]] = [[]]
    for row in rows:
        if len(row.cells) == width and _is_data(row.cells):
            blocks[-1].append(row)
        elif blocks[-1] and any(row.cells):
            blocks.append([])
    blocks.sort(key=len)
    if len(blocks) > 1 and len(blocks[-2]) >= MINIMUM_SAMPLES:
        lines = sorted(block[0].line for block in blocks[-2:])
        raise InputError(
            str(place),
            f"rows of numbers from line {lines[0]}, and again from line {lines[1]}",
            "one table, or one test per file",
        )
    return blocks[-1] or [_Row(0, [])]


def _table(path: Path, part: str, rows: Sequence[_Row], width: int) -> RawTable | None:
    """Table of rows of cells, with its names and units above."""
    place = f"{path}, {part}" if part else path
    block = _block(rows, width, place) if width else []
    if len(block) < MINIMUM_SAMPLES:
        return None
    # a row that begins the table but has text where the others have numbers is above it
    texts = [_are_texts([row.cells[k] for row in block]) for k in range(width)]
    while any(_are_texts([block[0].cells[k]]) and not texts[k] for k in range(width)):
        block = block[1:]
    filled = max(k for k in range(width) if any(row.cells[k] for row in block)) + 1
    above = [
        row.cells for row in rows
        if row.line < block[0].line
        and (len(row.cells) == width or len(_trim(row.cells)) == filled)
    ]  # fmt: skip
    units = next((cells for cells in reversed(above) if _are_units(cells)), [])
    named = [cells for cells in reversed(above) if any(cells) and cells is not units]
    names = max(named, key=lambda cells: sum(map(names_quantity, cells)), default=[])
    used = [k for k in range(width) if _at(names, k) or any(row.cells[k] for row in block)]
    notes = []
    if any(_is_data(cells, least=2) for cells in above):
        notes.append(f"numbers above line {block[0].line} are left out")
    if any(any(row.cells) for row in rows if row.line > block[-1].line):
        notes.append(f"what stands below line {block[-1].line} is left out")
    return RawTable(
        path,
        part,
        [heading_of(_at(names, k) or f"column {k + 1}", _at(units, k)) for k in used],
        [[row.cells[k] for row in block] for k in used],
        [row.line for row in block],
        notes,
        rate_in(" ".join(row.cells) for row in rows if row.line < block[0].line),
    )


def _at(cells: Sequence[str], k: int) -> str:
    return cells[k].strip() if k < len(cells) else ""


def _are_texts(cells: Sequence[str]) -> bool:
    """Whether most of the cells are neither numbers nor missing."""
    texts = sum(not is_number(_with_point(c)) and c.lower() not in _MISSING for c in cells)
    return 2 * texts > len(cells)


def _are_units(cells: Sequence[str]) -> bool:
    written = [cell for cell in cells if cell.strip("[](){}<>- ")]
    return len(written) > 1 and 2 * sum(map(is_unit, written)) >= len(written)


def _structs(path: Path, name: str, value: Any, above: float | None = None) -> Iterator[RawTable]:
    """Tables of a struct, of a list of structs, or of the variables of a file."""
    if isinstance(value, list) or (isinstance(value, np.ndarray) and value.dtype == object):
        for number, each in enumerate(value, 1):
            yield from _structs(path, f"{name} {number}".strip(), each, above)
        return
    if not isinstance(value, dict):
        return
    rate = rate_of(value) or above
    arrays = {key: a for key, each in value.items() if (a := _numbers(each)) is not None}
    vectors = {key: a.ravel() for key, a in arrays.items() if a.size == max(a.shape)}
    lengths = Counter(a.size for a in vectors.values() if a.size >= MINIMUM_SAMPLES)
    for length, count in lengths.most_common(1):
        if count > 1:
            alike = {key: a for key, a in vectors.items() if a.size == length}
            units = value.get("units")
            texts = units if isinstance(units, dict) else {}
            headings = [heading_of(key, str(texts.get(key, ""))) for key in alike]
            yield RawTable(path, name, headings, [*alike.values()], _one_to(length), rate=rate)
    for key, array in arrays.items():
        own = f"{name} {key}".strip()
        matrix = array.ndim == 2 and len(array) >= MINIMUM_SAMPLES
        if matrix and 2 <= array.shape[1] <= _MOST_COLUMNS:
            headings = _column_headings(value, array.shape[1])
            beside = {} if any(map(_is_time, headings)) else _time_beside(vectors, len(array))
            headings = [*map(heading_of, beside), *headings]
            columns = [*beside.values(), *array.T]
            yield RawTable(path, own, headings, columns, _one_to(len(array)), rate=rate)
    for key, each in value.items():
        yield from _structs(path, f"{name} {key}".strip(), each, rate)


def _is_time(heading: Heading) -> bool:
    return "time" in heading.quantities


def _time_beside(vectors: dict[str, NDArray], length: int) -> dict[str, NDArray]:
    """The vector of times of a matrix's rows, by its name; empty if there is not one."""
    times = {key: a for key, a in vectors.items() if a.size == length and _is_time(heading_of(key))}
    return times if len(times) == 1 else {}


def _numbers(value: Any) -> NDArray | None:
    real = isinstance(value, np.ndarray) and value.dtype.kind in "fiu" and value.size
    return np.asarray(value, float) if real else None


def _one_to(length: int) -> list[int]:
    return list(range(1, length + 1))


def _column_headings(struct: dict[str, Any], number: int) -> list[Heading]:
    """Headings of a matrix's columns: lists of names, as ``colheaders``, and of units beside it."""
    lists = [
        [str(each) for each in value] for value in struct.values()
        if isinstance(value, list | np.ndarray) and len(value) == number
        and all(isinstance(each, str) for each in value)
    ]  # fmt: skip
    units = next((each for each in lists if _are_units(each)), [""] * number)
    numbered = [f"column {k}" for k in range(1, number + 1)]
    names = next((each for each in lists if each is not units), numbered)
    return [heading_of(name.strip(), unit) for name, unit in zip(names, units, strict=True)]
