"""Text tables, as most test machines write them."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from ground_motions.readers.lines import is_number, read_lines

from ..measured.run_table import MINIMUM_SAMPLES
from .channels import heading_of, is_unit
from .raw_table import RawTable, Row, is_data, tables_of_rows, trim, with_point

_SEPARATORS = (";", "\t", ",", " ")
_LOOKED_AT = 2000
"""Lines by which the separator is found."""
_COMMENT = re.compile(r"\s*(?:[%#!]+|//|;+)\s*")
_BLANK = re.compile(r"\s{2,}|\t")
_NOT_BEFORE_UNIT = re.compile(r"\s+(?![\[({<])")
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")
_LONG_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d{3,}(?:[eE][+-]?\d+)?")


def read_text(path: Path) -> list[RawTable]:
    """Text tables: names, possibly units, then numbers; several with a heading each."""
    lines = [(number, line) for number, line in enumerate(read_lines(path), 1) if line.strip()]
    separator, width = _format([line for _, line in lines[:_LOOKED_AT]])
    if not width:
        return []
    rows = []
    for number, line in lines:
        cells = _cells(line, separator)
        comment = bool(_COMMENT.match(line)) and not (separator == ";" and is_data(cells))
        numbers = len(cells) == width and is_data(cells) and not comment
        cells = cells if numbers else _heading_cells(line, separator, width)
        rows.append(Row(number, cells, numbers, comment))
    if _is_cut_off(path, rows):
        # as the rest of an incomplete row, it stands below the table
        rows[-1] = rows[-1]._replace(numbers=False)
    return tables_of_rows(path, "", rows)


def _is_cut_off(path: Path, rows: Sequence[Row]) -> bool:
    """Whether the last number lacks digits that all others of its column have, and a line end."""
    if path.read_bytes().rstrip(b"\0")[-1:] in (b"\n", b"\r", b"\x1a") or not rows[-1].numbers:
        return False
    *others, last = [_decimals(row.cells[-1]) for row in rows if row.numbers]
    return bool(others) and last < min(others)


def _decimals(cell: str) -> int:
    """Number of characters behind the decimal mark."""
    return len(with_point(cell).partition(".")[2])


def _cells(line: str, separator: str) -> list[str]:
    if separator == " ":
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]


def _format(lines: Sequence[str]) -> tuple[str, int]:
    """Separator of a text table and number of its columns; no columns without a table."""
    best = ("", 0, 0)
    for separator in _SEPARATORS:
        widths = Counter(
            len(cells) for line in lines
            if not (separator != ";" and _COMMENT.match(line))
            and is_data(cells := _cells(line, separator), least=2)
        )  # fmt: skip
        for width, count in widths.most_common(1):
            if count > best[2]:
                best = (separator, width, count)
    bare = [line.strip() for line in lines]
    alone = sum(map(is_number, map(with_point, bare)))
    if alone >= MINIMUM_SAMPLES and (best[2] < MINIMUM_SAMPLES or _are_decimal_commas(bare, best)):
        return "\t", 1  # one column, its lines without a separator
    return best[0], best[1]


def _are_decimal_commas(lines: Sequence[str], layout: tuple[str, int, int]) -> bool:
    """Whether a table of two columns is one column of decimal commas, by the heading above it."""
    first = next(k for k, line in enumerate(lines) if is_number(with_point(line)))
    above = _COMMENT.sub("", lines[first - 1], count=1) if first else ""
    heading = heading_of(above)
    name, *others = above.split(",")
    # "Acc, g" is one heading, and "Time,Acc" are two
    alone = not others or (len(others) == 1 and is_unit(others[0]) and not heading_of(name).unit)
    decimal = _DECIMAL_COMMA if heading.unit or heading.quantities else _LONG_DECIMAL_COMMA
    matching = sum(bool(decimal.fullmatch(line)) for line in lines)
    return layout[:2] == (",", 2) and alone and matching > 0.9 * layout[2]


def _heading_cells(line: str, separator: str, width: int) -> list[str]:
    """Cells of a line above the table, which may be separated otherwise."""
    bare = _COMMENT.sub("", line, count=1) if _COMMENT.match(line) else line
    # an empty first cell before semicolons is no comment
    whole = [_cells(line, separator)] if separator == ";" else []
    splits = [
        *whole, _cells(bare, separator), *(_cells(bare, other) for other in _SEPARATORS[:-1]),
        _BLANK.split(bare.strip()), _NOT_BEFORE_UNIT.split(bare.strip()), bare.split(),
    ]  # fmt: skip
    return next((cells for cells in splits if len(trim(cells)) == width), splits[0])
