"""Plain text: accelerations, or times and one or several columns of accelerations."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ground_motions.argument_types import checked
from ground_motions.checks import positive
from ground_motions.errors import InputError
from ground_motions.readers.lines import (
    TOLERANCE,
    counted,
    is_number,
    parse_number,
    read_lines,
    require_two,
    uniform_step,
)
from ground_motions.record import Record
from ground_motions.units import to_m_s2, unit_name


@checked
def read_text(
    path: str | Path,
    unit: str,
    dt: float | None = None,
    *,
    column: str | None = None,
    skip_lines: int = 0,
) -> Record:
    """Read accelerations at a fixed step, or columns of times and accelerations.

    Parameters
    ----------
    path : str or Path
        Text, UTF-8 or Latin-1; columns parted by blanks, commas, semicolons or tabs. Commas are
        decimal beside semicolons and tabs, and between blanks (``0,01 1,5``). Blank
        lines and lines that start with ``#`` or ``%`` are skipped, and so is a header: the lines
        before the first one that begins with a number.
    unit : str
        Unit of the accelerations: ``m/s2``, ``g``, ``cm/s2``, ``gal``, ``mm/s2``, ``ft/s2`` or
        ``in/s2``.
    dt : float, optional
        Sampling step, s, of accelerations without times: one a line, or several that go on from
        line to line, as the files of OpenSees have them. Refused beside a column of times. Not
        needed where the first line has the number of samples and the step.
    column : str, optional
        Number of the column of accelerations, such as ``"3"``, where there are several; without
        ``dt`` the first has the times.
    skip_lines : int
        Lines to pass over at the top, for a header with lines that begin with a number.

    Returns
    -------
    Record
        The motion in m/s2, named after the file.

    Raises
    ------
    InputError
        If the file cannot be read, the unit or the column is unknown, ``dt`` is missing or given
        for nothing, a line has another number of columns, a cell is not a finite number, or the
        times do not increase uniformly.
    """
    factor = to_m_s2(unit, f"{path}, unit")
    rows: list[list[float]] = []
    line_numbers: list[int] = []
    for number, line in enumerate(read_lines(path), start=1):
        if number <= skip_lines or not line.strip() or line.lstrip()[0] in "#%":
            continue
        cells = _cells(line)
        if not rows and not (cells and is_number(cells[0])):
            continue
        rows.append(
            [parse_number(cell, f"{path}, line {number}, column {i}")
             for i, cell in enumerate(cells, start=1)]
        )  # fmt: skip
        line_numbers.append(number)
    own = _own_step(rows)
    if own is not None:
        del rows[0], line_numbers[0]
        if len(rows[0]) != 2 or not _are_times(rows):
            dt = _agreed(own, dt, path)
    samples = np.array([value for row in rows for value in row])
    require_two(len(samples), str(path))

    width = len(rows[0])
    for number, row in zip(line_numbers, rows, strict=True):
        goes_on = dt is not None and column is None
        last = number == line_numbers[-1] and goes_on and len(row) < width
        if len(row) != width and not last:
            raise InputError(
                f"{path}, line {number}", counted(len(row), "column"),
                f"{width}, as above{'; fewer in the last line alone' * goes_on}",
            )  # fmt: skip
    first = 1 if dt is not None else 2
    if column is not None and column not in map(str, range(first, width + 1)):
        choices = f"a number from {first} to {width}{', behind the times' * (dt is None)}"
        raise InputError(f"{path}, column", repr(column), choices)
    if dt is None:
        if column is None and width != 2:
            raise InputError(
                f"{path}, dt", f"{'one column' if width == 1 else f'{width} columns'} and no dt",
                "for accelerations without times: dt=, the step in s; dt_s in a scenario"
                + ('; or column="2" of several beside times in the first' if width > 2 else ""),
            )  # fmt: skip
        require_two(len(rows), str(path))
        table = np.array(rows)
        samples = table[:, int(column or 2) - 1]
        dt = uniform_step(table[:, 0].tolist(), line_numbers, f"{path}, column 1")
    elif width > 1 and _are_times(rows):
        given = f"{dt!r} beside a column of times"
        expected = "dt for accelerations without times; or two columns, times first, and no dt"
        raise InputError(f"{path}, dt", given, expected)
    elif column is not None:
        samples = np.array(rows)[:, int(column) - 1]
    return Record(
        samples * factor,
        positive(f"{path}, dt (s)", dt),
        name=Path(path).stem + (f"_{column}" if column and width > 2 else ""),
        source=f"{path}, {unit}",
        file_unit=unit_name(unit) or unit,
    )


def _are_times(rows: list[list[float]]) -> bool:
    """Whether the first column increases like times; one in ten may be misprinted."""
    return len(rows) > 1 and float(np.mean(np.diff([row[0] for row in rows]) > 0.0)) > 0.9


def _own_step(rows: list[list[float]]) -> float | None:
    """The step in a first line that has the number of samples before it; else none."""
    if len(rows) < 3 or len(rows[0]) != 2 or rows[0][1] <= 0:
        return None
    counts = len(rows) - 1, sum(map(len, rows[1:]))
    return rows[0][1] if rows[0][0] in counts else None


def _agreed(own: float, given: float | None, path: str | Path) -> float:
    """The step of a file; another one given beside it is refused."""
    if given is not None and abs(given / own - 1) > TOLERANCE:
        raise InputError(
            f"{path}, dt", f"{given!r} beside {own:g} in the first line", "one of them"
        )
    return own


def _cells(line: str) -> list[str]:
    """Return the cells of a line, with decimal points."""
    parts = line.replace(";", " ").split()
    whole = all("," in part.strip(",") or part.isdecimal() for part in parts)
    blanks = len(parts) == 2 and "," in line and "." not in line and whole
    if ";" in line or "\t" in line.strip() or blanks:
        return [part.strip(",").replace(",", ".") for part in parts]
    return line.replace(",", " ").split()
