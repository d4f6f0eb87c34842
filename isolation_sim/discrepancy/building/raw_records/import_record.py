"""Import of a building record: files of loggers become the CSV file that a diagnosis reads."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ground_motions.argument_types import checked

from ....errors import InputError
from ....identification.raw_tests.files import tables_by_name
from ....io.files import check_new_files, write_text
from ....rendering import Printed, render
from ..channels import BASE, GROUND, ISOLATOR, ROTATION, channel
from ..record import BuildingRecord, read_building_record
from ..record_checks import check_quantities, record_problems
from ..record_filter import RecordFilter
from .columns import Column, Match, places_of
from .merge import merge
from .resolve import match_columns
from .sensors import Samples
from .settings import CURRENT, channel_of, read_settings

__all__ = ["ImportedRecord", "import_building_record"]


@dataclass(frozen=True, eq=False)
class ImportedRecord(Printed):
    """A building record that was imported, with what each column was taken for.

    Attributes
    ----------
    record : BuildingRecord
        The record as `isolation_sim.diagnose` reads it, in SI.
    columns : tuple of Column
        Columns of the files that are used: file, heading, unit and channel.
    settings : str
        Settings, as TOML, that import the same files in the same way.
    notes : tuple of str
        What was assumed, interpolated, resampled or left out, and what looks wrong.
    path : pathlib.Path or None
        CSV file that was written.
    """

    record: BuildingRecord
    columns: tuple[Column, ...]
    settings: str
    notes: tuple[str, ...]
    path: Path | None = None

    def _shown(self) -> Iterator[Any]:
        record = self.record
        headings = ("channel", "range", "in", "column", "unit", "file")
        rows = [_row(name, values, self.columns) for name, values in _signals(record)]
        title = (
            f"Record {record.name}: {len(record)} samples, "
            f"{(len(record) - 1) * record.dt:.4g} s, {1 / record.dt:.5g} Hz"
        )
        yield render("tables:TextTable", title, headings, rows)
        yield from (f"note: {each}" for each in self.notes)


@checked
def import_building_record(
    files: str | Path | Sequence[str | Path],
    out: str | Path | None = None,
    *,
    settings: str | Path | Mapping[str, Any] | None = None,
    columns: Mapping[str, str | int | Sequence[str | int]] | None = None,
    units: Mapping[str, str] | None = None,
    rate: float | None = None,
    leave_out: Sequence[str] = (),
    overwrite: bool = False,
) -> ImportedRecord:
    """Read files of loggers as one building record, and write it as CSV.

    Parameters
    ----------
    files : str or pathlib.Path, or a sequence of them
        Files of one record, or folders of them, as `isolation_sim.import_tests` reads them: one
        file, one per logger or one per sensor. Tables of a file are merged as well.
    out : str or pathlib.Path, optional
        CSV file to write. By default nothing is written.
    settings : str or pathlib.Path or mapping, optional
        TOML file, or its contents: columns of the channels, and what is done with them. Headings
        and names of files are recognised without it, if they name place and unit.
    columns : mapping, optional
        Heading of a column, or its number from 1, by channel: ``time``, ``current``,
        ``ground_acceleration``, ``base_acceleration``, ``floor1_acceleration``, ...,
        ``isolator_displacement``, each also with a direction, as ``base_x_acceleration``;
        ``"none"`` for no column; a list for several sensors, whose mean is taken. They go before
        those of ``settings``, which may also have positions of sensors.
    units : mapping, optional
        Unit by channel, or for all of ``acceleration``, ``displacement``, ``current`` or ``time``.
    rate : float, optional
        Samples per second of files without a column of time, Hz. By default the rate that the
        lines above the table name.
    leave_out : sequence of str
        Patterns of the names of files that are not read.
    overwrite : bool
        Whether an existing file ``out`` is replaced.

    Returns
    -------
    ImportedRecord
        Printing it shows the ranges of all channels, their columns and the notes.

    Raises
    ------
    InputError
        If a file cannot be read; a channel is not recognised, is in two columns or has no unit;
        files differ in their sampling and no common rate is set; a channel cannot be that of the
        building; or ``out`` exists. Errors name the options of ``isolation-sim import`` and the
        keys of the settings.
    """
    check_output(out, overwrite)
    match = read_columns(files, settings, columns, units, rate, leave_out)
    return import_match(match, out)


def check_output(out: str | Path | None, overwrite: bool) -> None:
    """Refuse an existing file, or one that a diagnosis would not take for a record."""
    if out is not None:
        if Path(out).suffix.lower() != ".csv":
            raise InputError(str(out), "as a building record", "a file *.csv")
        check_new_files(overwrite, Path(out))


def check_no_input(path: Path, match: Match) -> None:
    """Refuse to replace a file of the record."""
    if path.exists() and any(path.samefile(table.path) for table in match.tables.values()):
        raise InputError(str(path), "a file of the record", "another file")


def read_columns(
    files: str | Path | Sequence[str | Path],
    settings: str | Path | Mapping[str, Any] | None,
    columns: Mapping[str, str | int | Sequence[str | int]] | None,
    units: Mapping[str, str] | None,
    rate: float | None,
    leave_out: Sequence[str],
) -> Match:
    """Read files, and say what each column is taken for."""
    chosen = {
        key: [str(column)] if isinstance(column, str | int) else [str(one) for one in column]
        for key, column in (columns or {}).items()
    }
    choices = read_settings(settings, chosen, dict(units or {}), rate)
    places = [files] if isinstance(files, str | Path) else list(files)
    tables, notes = tables_by_name([Path(place) for place in places], leave_out, "record")
    return match_columns(tables, choices, notes).without_unused_tables()


def import_match(match: Match, out: str | Path | None) -> ImportedRecord:
    """Merge the channels, check them as a diagnosis does, and write them."""
    match.raise_unclear()
    path = Path(out) if out is not None else None
    if path is not None:
        check_no_input(path, match)
    samples = merge(match)
    used = [match.tables[name] for name in dict.fromkeys(one.table for one in match.columns)]
    places = list(dict.fromkeys(table.path for table in used))
    own = places[0].stem if len(places) == 1 else places[0].resolve().parent.name
    name = path.stem if path is not None else own
    notes = [*match.all_notes(), *samples.notes]
    if abs(samples.start) > 0.5 * samples.step:
        notes.append(f"time_s = 0 is {samples.start:.10g} s of the files")
    text = _text(match, samples, notes)
    record = _read_back(text, name, match)
    notes += record_problems(record)
    columns = tuple(one._replace(table=match.file_of(one.table)) for one in match.columns)
    result = ImportedRecord(record, columns, match.template(), tuple(notes))
    if path is None:
        return result
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(text, path)
    return replace(result, path=path)


def _text(match: Match, samples: Samples, notes: Sequence[str]) -> str:
    """The CSV file: what it was made of, as comments, then the channels in SI."""
    lines = ["# imported by isolation-sim import"]
    for one in match.columns:
        factor = f", factor to SI {one.factor:.9g}" if one.factor != 1 else ""
        unit = f" in {one.unit}" if one.unit else ""
        lines.append(f"# {one.key}: {one.heading!r}{unit} of {match.file_of(one.table)}{factor}")
    lines += [f"# {note}" for note in notes]
    passed = _filter(match)
    lines += [f"# {passed.line}"] if passed else []
    values = samples.values
    ordered = [one.key for one in match.columns if one.key in values]
    ordered += [key for key in values if key not in ordered]
    names = [_name(key) for key in ordered]
    count = len(values[ordered[0]])
    time = (samples.step * np.arange(count)).tolist()
    columns = [values[key].tolist() for key in ordered]
    lines.append(",".join(["time_s", *names]))
    lines += [
        ",".join([f"{t:.10g}", *(f"{value:.10g}" for value in row)])
        for t, *row in zip(time, *columns, strict=True)
    ]
    return "\n".join([*(" ".join(line.splitlines()) for line in lines), ""])


def _filter(match: Match) -> RecordFilter | None:
    """The filter of the settings, or the one that all files name."""
    named = {match.tables[one.table].filtered for one in match.columns}
    corners = named.pop() if len(named) == 1 else None
    if match.settings.filter is not None or corners is None:
        return match.settings.filter
    return RecordFilter.between(*corners)


def _name(key: str) -> str:
    """Column of a key in the CSV file."""
    one = channel_of(key)
    return one.name if one is not None else "current_A"


def _read_back(text: str, name: str, match: Match) -> BuildingRecord:
    """The record as a diagnosis reads it; errors name the columns of the files."""
    with tempfile.TemporaryDirectory() as folder:
        path = write_text(text, Path(folder) / f"{name}.csv")
        compared = ""
        try:
            record = read_building_record(path)
            compared = _compared(match)
            check_quantities(record)
        except InputError as error:
            place = places_of(match.tables[one.table] for one in match.columns)
            message = str(error).replace(str(path), place, 1)
            if message.startswith(f"{name}: "):
                message = place + message[len(name) :]
            for one in match.columns:
                message = message.replace(
                    f"{place}, {one.channel.name if one.channel else _name(one.key)}: ",
                    f"{match.tables[one.table].place}, column {one.heading!r}, {one.key}: ",
                )
            if match.settings.relative is None and message.endswith("relative to the ground"):
                message += ', or accelerations = "relative" in the settings'
            message = message.replace("; expected: ", f"{compared}; expected: ", 1)
            raise InputError(message) from None
    return record


def _compared(match: Match) -> str:
    """The columns whose quantities are compared, for a message."""
    columns = ", ".join(
        f"{one.key} {one.heading!r}"
        for one in match.columns
        if one.channel is not None and one.channel.place in (GROUND, BASE, ISOLATOR)
    )
    return f" (columns: {columns})"


def _signals(record: BuildingRecord) -> Iterator[tuple[str, np.ndarray]]:
    """Channels by name: ground, responses, current."""
    for name, motion in zip(record.ground_channels, record.ground, strict=True):
        yield name, motion.acceleration
    yield from record.response.items()
    if record.current is not None:
        yield "current_A", record.current


def _row(name: str, values: np.ndarray, columns: Sequence[Column]) -> tuple[str, ...]:
    """Channel, range, unit, heading, its unit, and file."""
    one = channel(name)
    key, unit = (one.key, one.unit) if one else (CURRENT, "A")
    sources = [each for each in columns if (each.channel.key if each.channel else each.key) == key]
    origin = ("base minus ground", "", "")
    if one is not None and one.axis == ROTATION:
        origin = ("from sensors along x and y", "", "")
    if sources:
        headings = ", ".join(each.heading for each in sources)
        origin = (headings, sources[0].unit, sources[0].table)
    return (key, f"{np.min(values):.3g} to {np.max(values):.3g}", unit, *origin)
