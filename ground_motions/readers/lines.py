"""Text files as lines, numbers and columns of time, with errors that name the place."""

from __future__ import annotations

import codecs
import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ground_motions.errors import InputError, warn

_UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_END_OF_FILE = "\x1a"  # of DOS, at the end of old files
_AROUND_CELLS = re.compile(r'["\s]')
FEW = 0.01
"""Share of the samples that may differ from the number in a header."""
Corners = tuple[tuple[float, ...], tuple[float, ...]]
"""Corners of a high-pass and of a low-pass filter, each one or the two ends of a ramp, Hz."""


class AnotherQuantityError(InputError):
    """A file of velocities, displacements or spectra, which databases give beside accelerations."""


def read_lines(path: str | Path) -> list[str]:
    """Return the lines of a text file that holds something."""
    # The text is UTF-16 if it begins with the mark of it, else UTF-8, or Latin-1 where it is not.
    accepted = "a file of UTF-8 text, or Latin-1"
    try:
        raw = Path(path).read_bytes()
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except (OSError, ValueError) as error:  # ValueError: a path with a NUL in it
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(str(path), f"unreadable ({reason})", accepted) from None
    try:
        text = raw.decode("utf-16" if raw[:2] in _UTF_16 else "utf-8-sig")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    text = text.rstrip(_END_OF_FILE)
    if "\0" in text:
        raise InputError(f"{path}, byte {raw.index(0)}", "binary content", accepted)
    if not text.strip():
        raise InputError(str(path), "an empty file", accepted)
    return text.replace("\r\n", "\n").replace("\r", "\n").removesuffix("\n").split("\n")


def table_lines(path: str | Path) -> list[tuple[int, str]]:
    """Lines of a table's text file, without blank ones and those that begin with ``#``."""
    rows = [
        (number, line)
        for number, line in enumerate(read_lines(path), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not rows:
        raise InputError(str(path), "comments only", "a line of column names, then numbers")
    return rows


def table_cells(path: str | Path) -> list[tuple[int, list[str]]]:
    """Cells of a table's text file, line by line; the first line separates as all others do."""
    rows = table_lines(path)
    separator = separator_of(rows[0][1])
    refuse_two_decimal_marks(rows[1:], separator, path)
    return [
        (number, cells_of(line, separator, decimal=k > 0)) for k, (number, line) in enumerate(rows)
    ]


def other_decimal_mark(cells: Sequence[str]) -> int | None:
    """Place of a number with another decimal mark than the first of its column has, if any."""
    # such as 1.023 beside 987,5, where the point separates thousands
    first = ""
    for k, cell in enumerate(cells):
        mark = "," if "," in cell else "." if "." in cell else ""
        if mark and is_number(cell.replace(",", ".")):
            first = first or mark
            if mark != first:
                return k
    return None


def refuse_two_decimal_marks(
    rows: Sequence[tuple[int, str]], separator: str, path: str | Path
) -> None:
    """Refuse a table with decimal commas and points in one column."""
    marks = {mark for mark in ",." for _, line in rows if mark in line}
    if separator == "," or len(marks) < 2:
        return
    table = [(number, cells_of(line, separator)) for number, line in rows]
    for k in range(len(table[0][1])):
        column = [(number, cells[k]) for number, cells in table if k < len(cells)]
        if (place := other_decimal_mark([cell for _, cell in column])) is not None:
            number, cell = column[place]
            raise InputError(f"{path}, line {number}, column {k + 1}", *two_marks(cell))


def two_marks(cell: str) -> tuple[str, str]:
    """What is given and expected where a number has another decimal mark than its column."""
    others = "decimal points" if "," in cell else "decimal commas"
    return f"{excerpt(cell)} below {others}", "one decimal mark, and none of thousands"


def separator_of(line: str) -> str:
    """The separator of a line of a table: a semicolon or a tab, else a comma."""
    return next((one for one in ";\t" if one in line), ",")


def cells_of(line: str, separator: str, *, decimal: bool = False) -> list[str]:
    """Cells of a line of a table; ``decimal``: beside semicolons and tabs commas are decimal."""
    if decimal and separator != ",":
        line = line.replace(",", ".")
    if not _AROUND_CELLS.search(line):
        return line.split(separator)
    return [cell.strip().strip('"').strip() for cell in line.split(separator)]


def fixed_cells(line: str, width: int) -> list[str]:
    """Cells of a line of a fixed width; wide numbers touch each other."""
    line = line.rstrip()
    return [line[k : k + width].strip() for k in range(0, len(line), width)]


def is_number(cell: str) -> bool:
    """Whether a cell is written as a number, finite or not."""
    try:
        float(cell)
    except ValueError:
        return False
    return True


def parse_number(cell: str, place: str) -> float:
    """Return the finite number in a cell."""
    value = float(cell) if is_number(cell) else math.nan
    if not math.isfinite(value):
        raise InputError(place, excerpt(cell), "a finite number")
    return value


def numbers_in(
    lines: Sequence[str], rows: Iterable[int], path: str | Path, width: int = 0
) -> list[float]:
    """Numbers of some lines, which are counted from 0: of a fixed width, or between blanks."""
    return [
        parse_number(cell, f"{path}, line {row + 1}, column {column}")
        for row in rows
        if row < len(lines)
        for column, cell in enumerate(
            fixed_cells(lines[row], width) if width else lines[row].split(), start=1
        )
    ]


def counted(count: int, noun: str) -> str:
    """A number with its noun."""
    return f"{count} {noun}{'s' * (count != 1)}"


def excerpt(text: str) -> str:
    """Return text in quotation marks for an error, cut to 60 characters."""
    return repr(text if len(text) <= 60 else text[:57] + "...")


def require_two(count: int, place: str) -> None:
    """Refuse a file with fewer than two samples."""
    if count < 2:
        raise InputError(place, f"{count} samples", "two samples or more")


def require_count(count: int, announced: int, place: str, name: str) -> None:
    """Refuse a file that is cut off; warn where a few samples are missing or too many."""
    if abs(count - announced) > FEW * announced:
        raise InputError(
            place, f"{name} {announced} over {count} samples",
            f"equal numbers, or within {FEW:.0%}",
        )  # fmt: skip
    if count != announced:
        warn(f"{place}: {name} is {announced}; {count} samples are there and used", UserWarning)


TOLERANCE = 0.02
"""How far a time may lie from the uniform grid, in steps: some times are printed short."""
_COARSEST = 0.3
"""Unit to which times may be rounded, in steps."""


def uniform_step(times: ArrayLike, line_numbers: Sequence[int], column: str) -> float:
    """Return the step of increasing, uniform times."""
    t = np.asarray(times)
    steps = np.diff(t)
    backward = np.flatnonzero(steps <= 0.0)
    if backward.size:
        i = backward[0] + 1
        raise InputError(
            f"{column}, line {line_numbers[i]}",
            f"{t[i]:.12g} after {t[i - 1]:.12g}",
            "times that increase",
        )
    step = (t[-1] - t[0]) / len(steps)
    off = np.abs(t - t[0] - step * np.arange(len(t)))
    if off.max() > TOLERANCE * step:
        rounded = _step_of_rounded(t)
        if rounded is not None:
            return float(f"{rounded:.12g}")
        usual = float(np.median(steps))
        i = int(np.argmax(np.abs(steps - usual))) + 1
        raise InputError(
            f"{column}, line {line_numbers[i]}",
            f"a step of {steps[i - 1]:.6g} s where {usual:.6g} s is usual",
            f"uniform times, each within {TOLERANCE:g} of a step of its place",
        )
    return float(f"{step:.12g}")


def _step_of_rounded(t: np.ndarray) -> float | None:
    """Return the step of times that were rounded or cut to a decimal unit; else None."""
    places = np.arange(len(t))
    step = float(np.polyfit(places, t, 1)[0])
    off = t - step * places
    # the places of all times within one unit are those of rounding
    for digits in range(12):
        unit = 10.0**-digits
        if unit < _COARSEST * step and np.allclose(t / unit, np.round(t / unit), rtol=0, atol=1e-4):
            return step if np.ptp(off) < 1.1 * unit else None
    return None
