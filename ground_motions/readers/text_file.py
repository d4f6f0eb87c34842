"""Plain text of one or two columns."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ground_motions.argument_types import checked
from ground_motions.checks import positive
from ground_motions.errors import InputError
from ground_motions.readers.lines import (
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
    path: str | Path, unit: str, dt: float | None = None, *, skip_lines: int = 0
) -> Record:
    """Read one column of accelerations, or two of times and accelerations.

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
        Sampling step, s; needed for one column, refused for two.
    skip_lines : int
        Lines to pass over at the top, for a header with lines that begin with a number.

    Returns
    -------
    Record
        The motion in m/s2, named after the file.

    Raises
    ------
    InputError
        If the file cannot be read, the unit is unknown, ``dt`` is missing or given for nothing, a
        line has another number of columns, a cell is not a finite number, or the times do not
        increase uniformly.
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
        width = len(rows[0]) if rows else len(cells)
        if len(cells) not in (1, 2) or len(cells) != width:
            raise InputError(
                f"{path}, line {number}",
                counted(len(cells), "column"),
                f"{width}, as above"
                if rows
                else "one column (acceleration) or two (time first); accelerations that go on "
                "from line to line, written one a line",
            )
        rows.append(
            [parse_number(cell, f"{path}, line {number}, column {i}")
             for i, cell in enumerate(cells, start=1)]
        )  # fmt: skip
        line_numbers.append(number)
    require_two(len(rows), str(path))

    table = np.array(rows)
    if table.shape[1] == 2:
        if dt is not None:
            raise InputError(
                f"{path}, dt", f"{dt!r} beside a column of times", "dt for one column only"
            )
        dt = uniform_step(table[:, 0].tolist(), line_numbers, f"{path}, column 1")
    elif dt is None:
        raise InputError(
            f"{path}, dt", "one column and no dt", "dt=, the step in s; dt_s in a scenario"
        )
    return Record(
        table[:, -1] * factor,
        positive(f"{path}, dt (s)", dt),
        name=Path(path).stem,
        source=f"{path}, {unit}",
        file_unit=unit_name(unit) or unit,
    )


def _cells(line: str) -> list[str]:
    """Return the cells of a line, with decimal points."""
    parts = line.replace(";", " ").split()
    whole = all("," in part.strip(",") or part.isdecimal() for part in parts)
    blanks = len(parts) == 2 and "," in line and "." not in line and whole
    if ";" in line or "\t" in line.strip() or blanks:
        return [part.strip(",").replace(",", ".") for part in parts]
    return line.replace(",", " ").split()
