"""Import of test files as machines write them: text, Excel and MATLAB files become a campaign."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatch
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ground_motions.argument_types import checked

from ...errors import InputError, several
from ...io.files import check_writable
from ...rendering import Printed, render
from ..campaign import Campaign, write_campaign
from ..measured.data_checks import same_forces_notes, turned_runs, unit_notes
from ..measured.run_table import TestRun, make_run
from ..run_preparation import repaired
from .channels import NEEDED, Channel, check_choices, find_channels, listed
from .files import notes_of, pattern_of, tables_by_name
from .rate import CLOCK_UNIT
from .raw_table import RawTable
from .samples import samples_of

__all__ = ["ImportedTests", "import_tests"]

T = TypeVar("T")

_CURRENT_IN_NAME = re.compile(r"(?<![A-Za-z\d.,])(\d+(?:[.,p]\d+)?) ?(m?)A(?![A-Za-z])")


class _Choices(NamedTuple):
    """Choices of the caller; see `import_tests`."""

    columns: dict[str, list[str]]
    units: dict[str, str]
    current: float | None
    current_from_name: bool
    rate: float | None


@dataclass(frozen=True, eq=False)
class ImportedTests(Printed):
    """Tests that were imported, with what each column was taken for.

    Attributes
    ----------
    campaign : Campaign
        The tests, in SI.
    channels : tuple of dict
        For each test its columns by quantity: heading, unit and factor to SI.
    notes : tuple of str
        What was interpolated, resampled or left out, and what looks wrong.
    folder : pathlib.Path or None
        Campaign folder that was written.
    """

    campaign: Campaign
    channels: tuple[dict[str, Channel], ...]
    notes: tuple[str, ...]
    folder: Path | None = None

    def _shown(self) -> Iterator[Any]:
        runs = self.campaign.runs
        size = max(float(np.max(np.abs(run.force))) for run in runs)
        factor, unit = (1e-3, "kN") if size >= 1e4 else (1.0, "N")
        headings = (
            "test", "samples", "duration, s", "rate, Hz", "displacement, mm", f"force, {unit}",
            "current, A", "",
        )  # fmt: skip
        rows = [
            (run.name, str(run.time.size), f"{np.ptp(run.time):.4g}", f"{1 / run.step:.4g}",
             _range(1e3 * run.displacement), _range(factor * run.force),
             _range(run.current) if run.current_measured else "none",
             "held out" if run.hold_out else "")
            for run in runs
        ]  # fmt: skip
        yield render("tables:TextTable", f"Tests of {self.campaign.name}", headings, rows)
        columns = Counter(
            (what, one.heading, one.unit or "s, none given")
            for channels in self.channels
            for what, channel in channels.items()
            for one in (channel, *channel.others)
        )  # fmt: skip
        yield render(
            "tables:TextTable", "Columns", ("read as", "heading", "unit", "tests"),
            [(*key, str(count)) for key, count in columns.items()],
        )  # fmt: skip
        yield from (f"note: {each}" for each in self.notes)


@checked
def import_tests(
    tests: str | Path | Sequence[str | Path],
    out: str | Path | None = None,
    *,
    columns: Mapping[str, str | int | Sequence[str | int]] | None = None,
    units: Mapping[str, str] | None = None,
    current: float | None = None,
    current_from_name: bool = False,
    rate: float | None = None,
    test_column: str | int | None = None,
    hold_out: int | Sequence[str] = (),
    leave_out: Sequence[str] = (),
    progress: Callable[[str], None] | None = None,
) -> ImportedTests:
    """Read test files as machines write them, and write them as a campaign.

    Parameters
    ----------
    tests : str or pathlib.Path, or a sequence of them
        Files, or folders of them: text tables (``.csv``, ``.txt``, ``.dat``, ``.asc``, ``.tsv``),
        Excel workbooks (``.xlsx``, ``.xlsm``; a test per sheet), MATLAB, JSON and HDF5 files
        (``.mat``, ``.json``, ``.h5``, ``.hdf5``; a test per struct, object or group, or per
        matrix), LabVIEW's (``.lvm``, ``.tdms``; a test per segment or group), and those
        of readers that are registered.
    out : str or pathlib.Path, optional
        Campaign folder to make; it must not exist. By default nothing is written.
    columns : mapping, optional
        Heading of a column, or its number from 1, by quantity: ``time``, ``displacement``,
        ``force``, ``current``, ``velocity``, ``acceleration``, ``temperature``; ``"none"`` for no
        column. Of a list of columns the mean is read, and of forces the sum. The others are
        recognised by usual English and German names. ``"PATTERN:force"`` is that of the tests
        alone whose names fit the pattern.
    units : mapping, optional
        Unit by quantity, for columns whose heading has none or a wrong one, or a multiple of it:
        ``{"current": "0.1667 A"}`` of the volts of a coil of 6 ohm, ``{"force": "-1 kN"}`` of a
        load cell with the other sign; of some tests as a column.
    current : float, optional
        Current of the tests without a column of it, A.
    current_from_name : bool
        Whether their current is in their name, as in ``4mm_2A.csv``.
    rate : float, optional
        Samples per second of the tests without a column of time. By default the rate that the
        lines above the table name.
    test_column : str or int, optional
        Heading or number of the column whose values tell the tests of a table apart.
    hold_out : int or sequence of str
        Tests to hold out of a fit: every k-th, or patterns of their names such as ``"*_2A"``.
    leave_out : sequence of str
        Patterns of the names of tests that are not imported.
    progress : callable, optional
        Called with a text before each file is read, and before each test is checked.

    Returns
    -------
    ImportedTests
        Printing it shows the ranges of all tests, the columns and the notes.

    Raises
    ------
    InputError
        If a file cannot be read; a quantity is not recognised, is in two columns, or has no unit;
        time goes back; more than 1 % or 5 in a row of a channel's samples are missing; a pattern
        fits no test; or the folder exists. Errors name the options of ``isolation-sim import``.
    """
    choices = _Choices(
        {
            quantity: [str(c) for c in ([column] if isinstance(column, str | int) else column)]
            for quantity, column in (columns or {}).items()
        },
        {quantity: str(unit) for quantity, unit in (units or {}).items()},
        current,
        current_from_name,
        rate,
    )
    check_choices(choices.columns, choices.units)
    if rate is not None and not rate > 0:
        raise InputError("--rate", f"{rate:g}", "a positive number of samples per second")
    if current is not None and current_from_name:
        raise InputError("--current and --current-from-name: both given; expected: one of them")
    if out is not None:
        if Path(out).exists():
            raise InputError(f"{out}: exists already; expected: a folder to be made")
        check_writable(Path(out).parent)
    places = [tests] if isinstance(tests, str | Path) else list(tests)
    report = progress or (lambda text: None)
    apart = None if test_column is None else str(test_column)
    files = [Path(place) for place in places]
    errors: list[InputError] = []
    tables, notes = tables_by_name(
        files, leave_out, progress=report, test_column=apart, unreadable=errors.append
    )
    runs, channels = [], []
    own_notes: list[tuple[str, str]] = []
    n_tests = len(tables) + len(errors)
    for name, table in tables.items():
        report(f"checking {name}")
        try:
            run, columns_read, own = _read_test(name, table, choices)
        except InputError as error:
            errors.append(error)
            continue
        runs.append(run)
        channels.append(columns_read)
        if own:
            own_notes.append((name, "; ".join(own)))
    notes += notes_of(own_notes)
    if len(errors) > 1:
        what = f"{len(errors)} of {n_tests} tests cannot be read"
        raise several(what, errors, "; --leave-out imports the others, by patterns of names")
    if errors:
        raise errors[0]
    for option, chosen in (("--column", choices.columns), ("--unit", choices.units)):
        for pattern in (key.rpartition(":")[0] for key in chosen if ":" in key):
            _check_fits(option, pattern, runs)
    _refuse_some_without_current(runs, list(tables.values()))
    if current is None and not any("current" in key for key in choices.columns):
        notes += _named_currents(runs)
    title = Path(out).name if out is not None else Path(places[0]).resolve().stem
    source = f"imported from {', '.join(map(str, places[:3]))}{' ...' if len(places) > 3 else ''}"
    campaign = Campaign(title, source, tuple(_held_out(runs, hold_out)))
    campaign, wrong = repaired(campaign)
    notes += [*wrong, *unit_notes(campaign.runs), *same_forces_notes(campaign.runs)]
    places_read = [table.place for table in tables.values()]
    notes += _sign_notes(campaign.runs, places_read, channels)
    result = ImportedTests(campaign, tuple(channels), tuple(notes))
    if out is None:
        return result
    folder = write_campaign(campaign, out)
    (folder / "import.txt").write_text(f"{source}\n\n{result.summary()}\n", encoding="utf-8")
    return replace(result, folder=folder)


def _of_test(choices: Mapping[str, T], name: str) -> dict[str, T]:
    """What is chosen for a test, by quantity; what is chosen for some tests goes before all."""
    return {
        quantity: one
        for key, one in sorted(choices.items(), key=lambda each: ":" in each[0])
        for pattern, _, quantity in [key.rpartition(":")]
        if not pattern or fnmatch(name, pattern)
    }


def _read_test(
    name: str, table: RawTable, choices: _Choices
) -> tuple[TestRun, dict[str, Channel], list[str]]:
    """A table as a run, its columns by quantity, and notes."""
    headings, place = table.headings, table.place
    usable = [table.usable(k) for k in range(len(headings))]
    columns, units = _of_test(choices.columns, name), _of_test(choices.units, name)
    channels = find_channels(headings, usable, columns, units, place)
    rate = table.rate if choices.rate is None else choices.rate
    lacking = [q for q in NEEDED if q not in channels and (q != "time" or rate is None)]
    if lacking:
        options = [f"--column {quantity}=HEADING" for quantity in lacking]
        options[-1] += " (or its number)"
        if "time" in lacking:
            options.append("or --rate 200 (samples per second) without a time")
        raise InputError(
            place,
            f"columns {listed(headings)}, none recognised as {' and '.join(lacking)}"
            + "".join(f"; {note}" for note in table.notes),
            ", ".join(options),
        )
    data, notes = samples_of(table, channels, choices.rate)
    if "time" in channels and headings[channels["time"].column].unit == CLOCK_UNIT:
        data["time"] = data["time"] - data["time"][0]
    for what, channel in channels.items():
        own = headings[channel.column].unit
        if own and channel.unit != own:
            notes.append(f"{what} in {channel.unit} as given, not in {own} as in the heading")
    if "current" not in channels and (choices.current_from_name or choices.current is not None):
        current = _current_in(name, place) if choices.current_from_name else choices.current
        data["current"] = np.full(len(data["time"]), current)
    elif table.current is not None and not {"current"} & {*channels, *columns}:
        data["current"] = np.full(len(data["time"]), table.current)
        notes.append(f"a current of {table.current:g} A, as the file says")
    read = {k for channel in channels.values() for k in channel.columns}
    unused = tuple(heading.text for k, heading in enumerate(headings) if k not in read)
    velocity = f"column {channels['velocity'].heading}" if "velocity" in channels else ""
    remedy = ", or --unit velocity=UNIT for another one, or --column velocity=none to derive it"
    run = make_run(name, data, place, velocity, remedy, ignored_columns=unused)
    return run, channels, [*table.notes, *notes]


def _current_in(name: str, place: str) -> float:
    """The current in the name of a test, A."""
    currents = {
        float(number.replace(",", ".").replace("p", ".")) * (1e-3 if milli else 1.0)
        for number, milli in _CURRENT_IN_NAME.findall(name)
    }
    if len(currents) != 1:
        written = f"{len(currents)} currents" if currents else "no current"
        raise InputError(place, f"{written} in the name {name!r}", "one, such as 2A, 0.5A or 500mA")
    return currents.pop()


def _named_currents(runs: Sequence[TestRun]) -> Iterator[str]:
    """Say so if no test has a current, and their names have different ones."""
    if any(run.current_measured for run in runs):
        return
    found = [_CURRENT_IN_NAME.search(run.name) for run in runs]
    texts = list(dict.fromkeys(each[0] for each in found if each))
    if len(texts) > 1 and all(found):
        yield (
            f"the names of the tests have currents ({', '.join(texts)}), their columns have none: "
            "--current-from-name reads them"
        )


def _held_out(runs: Sequence[TestRun], hold_out: int | Sequence[str]) -> list[TestRun]:
    """The runs, every k-th marked as held out or those whose names fit a pattern."""
    if isinstance(hold_out, int):
        if hold_out < 2:
            raise InputError("--hold-out", str(hold_out), "2 or more, or a pattern of names")
        return [replace(run, hold_out=k % hold_out == 0) for k, run in enumerate(runs, 1)]
    for pattern in hold_out:
        _check_fits("--hold-out", pattern, runs)
    return [replace(run, hold_out=any(fnmatch(run.name, p) for p in hold_out)) for run in runs]


def _check_fits(option: str, pattern: str, runs: Sequence[TestRun]) -> None:
    """Refuse a pattern that no test's name fits."""
    if not any(fnmatch(run.name, pattern) for run in runs):
        raise InputError(option, repr(pattern), pattern_of([run.name for run in runs]))


def _sign_notes(
    runs: Sequence[TestRun], places: Sequence[str], channels: Sequence[dict[str, Channel]]
) -> Iterator[str]:
    """Files whose force or displacement has the other sign, with their columns and the remedy."""
    turned, why = turned_runs(runs)
    wrong = {run.name for run in turned}
    for run, place, columns in zip(runs, places, channels, strict=True):
        if run.name in wrong:
            pattern = "" if len(wrong) == len(runs) else f"{run.name}:"
            force, displacement = (columns[each] for each in ("force", "displacement"))
            yield (
                f"{place}: {why}; the sign of {force.heading!r} or of {displacement.heading!r} is "
                f"turned: --unit '{pattern}force=-1 {_plain_unit(force)}' or --unit "
                f"'{pattern}displacement=-1 {_plain_unit(displacement)}' turns it"
            )


def _plain_unit(channel: Channel) -> str:
    """The unit of a channel without a multiple."""
    return channel.unit.split()[-1]


def _refuse_some_without_current(runs: Sequence[TestRun], tables: Sequence[RawTable]) -> None:
    with_it = [run.name for run in runs if run.current_measured]
    for run, table in zip(runs, tables, strict=True):
        if with_it and not run.current_measured:
            raise InputError(
                table.place,
                f"columns {listed(table.headings)}, none recognised as the current, which "
                f"{with_it[0]!r} has",
                "--column current=HEADING, --current 0, --current-from-name, or for all tests "
                "--column current=none",
            )


def _range(values: np.ndarray) -> str:
    low, high = float(np.min(values)), float(np.max(values))
    return f"{low:.3g} to {high:.3g}"
