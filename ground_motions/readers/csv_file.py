"""CSV files whose column names end in their unit: reading and writing."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ground_motions.argument_types import checked
from ground_motions.component_names import direction_in
from ground_motions.errors import InputError, wrong_choice
from ground_motions.files import atomic_write
from ground_motions.readers.lines import (
    cells_of,
    counted,
    excerpt,
    is_number,
    parse_number,
    refuse_two_decimal_marks,
    require_two,
    separator_of,
    table_lines,
    uniform_step,
)
from ground_motions.record import Record
from ground_motions.units import ACCELERATION_UNITS, UNITS, to_m_s2, unit_name

TIME_COLUMN = "time_s"
PREFERRED_QUANTITY = "ground_acceleration"
_SUFFIXES = {f"_{unit.replace('/', '_')}": unit for unit in ACCELERATION_UNITS}
# "Acc[cm/s2]", "Beschleunigung [m/s²]", "Acceleration (g)"
_BRACKETS = re.compile(r"(?P<quantity>.*?)\s*[\[(](?P<unit>[^\[\]()]+)[\])]")
_TIME_UNITS = {**UNITS["time"], "sec": 1.0, "second": 1.0, "seconds": 1.0, "msec": 1e-3}
"""Spellings of units of time, and their factors to s."""
_TIME_SUFFIXES = {f"time_{unit}": factor for unit, factor in UNITS["time"].items()}
_MOTION_UNITS = [*UNITS["velocity"], *UNITS["displacement"]]
_OTHER_UNITS = {
    unit.lower() for quantity in UNITS if quantity != "acceleration" for unit in UNITS[quantity]
}
_EXAMPLES = "'time_s,ground_acceleration_m_s2' or 'Time [s],Acceleration [cm/s2]'"


@checked
def read_csv(path: str | Path, column: str | None = None, unit: str | None = None) -> Record:
    """Read one acceleration column of a CSV file.

    Parameters
    ----------
    path : str or Path
        Comma-separated text, UTF-8 or Latin-1: a line of column names, then numbers. Semicolons
        or tabs may separate, too; commas are then decimal. Lines that start with ``#``, blank
        lines and lines above the column names are skipped. The units may stand in a row below the
        names. A column ``time_s``, or one with ``[s]`` behind its name, gives the step; so does
        one with another unit of time, such as ``time_ms``.
    column : str, optional
        Name of the acceleration column, ending in its unit: ``_m_s2``, ``_cm_s2``, ``_mm_s2``,
        ``_ft_s2``, ``_in_s2``, ``_gal`` or ``_g``; or with a unit in brackets, such as
        ``Acc [cm/s2]``. May be left out where one column alone has such a name, or one alone
        is named ``ground_acceleration_...``.
    unit : str, optional
        Unit of a column whose name has none, as in `read_text`; times are then in s in a column
        ``time`` or ``t``, too.

    Returns
    -------
    Record
        The motion in m/s2. Its name is the file's, with the column's where there are several.

    Raises
    ------
    InputError
        If the file cannot be read; a column is missing, unknown or named twice; a unit is missing,
        unknown or given twice; a cell is not a finite number; or the times do not increase
        uniformly.
    """
    header_line, names, rows = _table(path, unit)
    place = f"{path}, line {header_line}"
    if all(map(is_number, names)):
        raise InputError(place, "numbers", f"a heading such as {_EXAMPLES}")
    time_column = _time_column(names, place, unit)
    units = {name: own for name in names if (own := unit_of(name))}
    if unit is not None:
        to_m_s2(unit, f"{path}, unit")
        units = _with_unit(units, unit, names, time_column, column, place)
    column = _chosen_column(names, list(units), column, place)
    require_two(len(rows), str(path))

    places = names.index(time_column), names.index(column)
    seconds = _seconds_of(time_column) or 1.0
    times, values, line_numbers = [], [], []
    for number, cells in rows:
        if len(cells) != len(names):
            raise InputError(
                f"{path}, line {number}",
                counted(len(cells), "cell"),
                f"{len(names)}, as in the header",
            )
        time, value = (
            parse_number(cells[i], f"{path}, line {number}, column {names[i]}") for i in places
        )
        times.append(time * seconds)
        values.append(value)
        line_numbers.append(number)

    dt = uniform_step(times, line_numbers, f"{path}, column {time_column}")
    stem = Path(path).stem
    return Record(
        np.array(values) * to_m_s2(units[column]),
        dt,
        name=f"{stem}_{quantity_of(column)}" if len(units) > 1 else stem,
        source=f"{path}, column {column}",
        file_unit=units[column],
    )


def columns_of(path: str | Path) -> list[str]:
    """Return the names of the columns of a CSV file."""
    return _table(path, None)[1]


def acceleration_columns(path: str | Path) -> dict[str, str]:
    """Columns whose names have a unit of acceleration, and the words that may be directions."""
    return {name: direction_in(quantity_of(name)) for name in columns_of(path) if unit_of(name)}


def has_units(path: str | Path) -> bool:
    """Whether a text file is a table whose headings have units of times and accelerations."""
    try:
        names = columns_of(path)
    except InputError:
        return False
    return bool(_time_columns(names, None)) and any(map(unit_of, names))


class _Table(NamedTuple):
    """A table in a text file."""

    line: int  # Number of the line of the column names, from 1
    names: list[str]  # Column names with their units
    rows: list[tuple[int, list[str]]]  # Number and cells of each line below


def _table(path: str | Path, unit: str | None) -> _Table:
    """The table of a file: from the first heading with times and numbers below it."""
    lines = table_lines(path)
    start, used, names = 0, 1, None
    for start, (_, line) in enumerate(lines):
        for used in (1, 2):
            names = names or _heading([text for _, text in lines[start:][: used + 1]], unit)
            if names:
                break
        if names or all(map(is_number, cells_of(line, separator_of(line)))):
            break
    if names is None:
        start, used = 0, 1
    separator = separator_of(lines[start][1])
    names = names or cells_of(lines[start][1], separator)
    refuse_two_decimal_marks(lines[start + used :], separator, path)
    rows = [
        (number, _without_empty_end(cells_of(line, separator, decimal=True), len(names)))
        for number, line in lines[start + used :]
    ]
    return _Table(lines[start][0], names, [row for row in rows if any(row[1])])


def _heading(lines: list[str], unit: str | None) -> list[str] | None:
    """Column names above a line of numbers; with their units, if these are on a second line."""
    if len(lines) < 2:
        return None
    separator = separator_of(lines[0])
    names = _without_empty_end(cells_of(lines[0], separator))
    if len(lines) == 3:
        units = [cell.strip("[]() ") for cell in cells_of(lines[1], separator)]
        units = _without_empty_end(units, len(names))
        if len(units) != len(names):
            return None
        pairs = zip(names, units, strict=True)
        names = [f"{name} [{unit}]" if unit else name for name, unit in pairs]
    numbers = cells_of(lines[-1], separator, decimal=True)
    times = _time_columns(names, unit)
    if not times or len(numbers) < len(names):
        return None
    return names if is_number(numbers[names.index(times[0])]) else None


def _without_empty_end(cells: list[str], least: int = 0) -> list[str]:
    """Cells without the empty ones behind the last column, as Excel writes them."""
    while len(cells) > least and not cells[-1]:
        cells = cells[:-1]
    return cells


def _suffix_of(column: str) -> str:
    return next((suffix for suffix in _SUFFIXES if column.lower().endswith(suffix)), "")


def unit_of(column: str) -> str | None:
    """Unit of acceleration at the end of a name, or in brackets; None if there is none."""
    brackets = _BRACKETS.fullmatch(column)
    return unit_name(brackets["unit"]) if brackets else _SUFFIXES.get(_suffix_of(column))


def quantity_of(column: str) -> str:
    """A column's name without its unit."""
    brackets = _BRACKETS.fullmatch(column)
    return brackets["quantity"] if brackets else column[: len(column) - len(_suffix_of(column))]


def _seconds_of(name: str) -> float | None:
    """Seconds in the unit of time of a column's name; None if it has none."""
    if name in _TIME_SUFFIXES:
        return _TIME_SUFFIXES[name]
    brackets = _BRACKETS.fullmatch(name)
    return _TIME_UNITS.get(brackets["unit"].lower()) if brackets else None


def _time_columns(names: list[str], unit: str | None) -> list[str]:
    """Columns of times; their names need no unit where ``unit`` is given."""
    if TIME_COLUMN in names:
        return [TIME_COLUMN]
    times = [name for name in names if _seconds_of(name)]
    if unit is not None and not times:
        times = [name for name in names if name.lower() in ("time", "t")]
    return times


def _time_column(names: list[str], place: str, unit: str | None) -> str:
    """Return the one column of times."""
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(place, f"column {twice[0]!r} twice", "different column names")
    times = _time_columns(names, unit)
    if len(times) != 1:
        raise InputError(
            place,
            f"columns {excerpt(', '.join(names))}",
            f"a column {TIME_COLUMN} among them, or one with [s]: a heading such as {_EXAMPLES}",
        )
    return times[0]


def _with_unit(
    units: dict[str, str],
    unit: str,
    names: list[str],
    time_column: str,
    column: str | None,
    place: str,
) -> dict[str, str]:
    """Return the units of the columns, with the caller's unit where a name has none."""
    name = unit_name(unit) or unit
    chosen = column if column in names else None
    for each in [chosen] if chosen else units:
        if units.get(each, name) != name:
            raise InputError(
                place, f"unit {unit!r} for column {each!r}", f"{units[each]}, as in its name"
            )
    if units and chosen in (None, *units):
        return units
    others = [each for each in names if each != time_column and chosen in (None, each)]
    return {each: name for each in others if not is_of_another_quantity(each)}


def is_of_another_quantity(column: str) -> bool:
    """Whether a name has a unit, but of no acceleration, as ``Vel (cm/s)`` and ``disp_cm``."""
    brackets = _BRACKETS.fullmatch(column)
    if brackets:
        return brackets["unit"].lower().replace("sec", "s") in _OTHER_UNITS
    return unit_of(column) is None and any(
        column.lower().endswith(f"_{unit.replace('/', '_')}") for unit in _MOTION_UNITS
    )


def _chosen_column(names: list[str], candidates: list[str], column: str | None, place: str) -> str:
    """Return the column asked for, or the one that is meant where none is; see `read_csv`."""
    suffixes = ", ".join(_SUFFIXES)
    if column in candidates:
        return column
    if column is not None and column in names:
        raise InputError(
            place,
            f"column {column!r}",
            f"a name that ends in a unit: {suffixes}, or with one in brackets; or unit=",
        )
    if not candidates:
        raise InputError(
            place,
            f"columns {excerpt(', '.join(names))}",
            f"an acceleration column whose name ends in a unit: {suffixes}, or has one in "
            f"brackets; a heading such as {_EXAMPLES}; or unit=",
        )
    if column is not None:
        raise wrong_choice(f"{place}, column", column, candidates)
    ground = [name for name in candidates if quantity_of(name) == PREFERRED_QUANTITY]
    for chosen in (candidates, ground):
        if len(chosen) == 1:
            return chosen[0]
    raise InputError(
        place,
        f"{len(candidates)} acceleration columns and no choice",
        f"column= one of {', '.join(candidates)}",
    )


@checked
def write_csv(record: Record, path: str | Path) -> Path:
    """Write a record as ``time_s, ground_acceleration_m_s2``; accelerations with every digit.

    Parameters
    ----------
    record : Record
        The motion.
    path : str or Path
        The file to write. It appears whole or not at all.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    path = Path(path)
    comments = [f"# {' '.join(text.split())}" for text in (record.name, record.source)]
    rows = (
        f"{time:.12g},{value!r}"
        for time, value in zip(record.time.tolist(), record.acceleration.tolist(), strict=True)
    )
    text = "\n".join([*comments, f"{TIME_COLUMN},{PREFERRED_QUANTITY}_m_s2", *rows, ""])
    try:
        with atomic_write(path) as unfinished:
            unfinished.write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise InputError(
            str(path), f"a file that cannot be written ({error.strerror})", "a writable place"
        ) from None
    return path
