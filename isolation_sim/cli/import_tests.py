"""The command ``isolation-sim import``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import InputError
from ..io.files import check_new_files
from .common_options import Force, examples, progress, read_values, write_new_file

if TYPE_CHECKING:
    from ..discrepancy.building.raw_records.columns import Match

EXAMPLES = examples(
    "isolation-sim import raw_files                            shows what would be read",
    "isolation-sim import raw_files --out my_tests --hold-out 4",
    "isolation-sim import raw_files/*.csv --out my_tests --rate 200 --current-from-name",
    "isolation-sim import tests.xlsx --out my_tests --column 'force=Load cell 2 (kN)'",
    "isolation-sim import quake.txt --building                  shows channels and settings",
    "isolation-sim import logger*.txt --building --write-settings sensors.toml",
    "isolation-sim import logger*.txt --settings sensors.toml --out quake.csv",
)


def import_tests(
    tests: Annotated[
        list[Path],
        typer.Argument(
            help="Text, Excel, MATLAB, JSON, HDF5 and LabVIEW files, or folders of them."
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            help="Campaign folder, or CSV file of a building record, to make. By default nothing "
            "is written."
        ),
    ] = None,
    column: Annotated[
        list[str] | None,
        typer.Option(
            help="Column of a quantity, as force=HEADING, force=3 or current=none; of some "
            "tests, as 'rig2_*:force=HEADING'; or of a building's channel, as "
            "base_x_acceleration=HEADING; may be repeated, also for several sensors of a quantity."
        ),
    ] = None,
    unit: Annotated[
        list[str] | None,
        typer.Option(
            help="Unit of a quantity whose heading has none or a wrong one, as displacement=mm, or "
            "a multiple, as current='0.1667 A' of a voltage or force='-1 kN'; 'b_03:force=-1 kN' "
            "for the tests that fit a pattern; may be repeated."
        ),
    ] = None,
    current: Annotated[
        float | None, typer.Option(help="Current of tests without a column of it, A.")
    ] = None,
    current_from_name: Annotated[
        bool, typer.Option("--current-from-name", help="Read it from names such as 4mm_2A.csv.")
    ] = False,
    rate: Annotated[
        float | None,
        typer.Option(
            help="Samples per second of files without a column of time; by default what the lines "
            "above the table say."
        ),
    ] = None,
    test_column: Annotated[
        str | None,
        typer.Option(help="Column whose values tell the tests of a table apart."),
    ] = None,
    hold_out: Annotated[
        list[str] | None,
        typer.Option(help="Tests to hold out of a fit: every k-th, or a pattern as '*_2A'."),
    ] = None,
    leave_out: Annotated[
        list[str] | None, typer.Option(help="Pattern of tests or files that are not imported.")
    ] = None,
    building: Annotated[
        bool,
        typer.Option(
            "--building", help="The files are one record of a building or a shaking table."
        ),
    ] = False,
    settings: Annotated[
        Path | None,
        typer.Option(help="Settings of a building record (TOML): its channels' columns."),
    ] = None,
    write_settings: Annotated[
        Path | None,
        typer.Option(help="File for the settings of a building record, as far as they are clear."),
    ] = None,
    force: Force = False,
) -> None:
    """Make a campaign, or a building record, of files as machines write them."""
    if building or settings is not None or write_settings is not None:
        for option, value in (
            ("--current", current is not None),
            ("--current-from-name", current_from_name),
            ("--test-column", test_column is not None),
            ("--hold-out", hold_out),
        ):
            if value:
                raise InputError(option, "with a building record", "device tests alone")
        from ..discrepancy.building.raw_records.import_record import check_output

        check_output(out, force)
        check_new_files(force, write_settings)
        matched = _columns(tests, settings, column, unit, rate, leave_out)
        _import_building(matched, out, write_settings, force)
        return
    if force:
        raise InputError("--force", "with device tests", "a building record, or a new folder")
    from ..identification.raw_tests.files import raw_files
    from ..identification.raw_tests.import_tests import import_tests as run_import

    held = hold_out or []
    every = len(held) == 1 and held[0].isdigit()
    # every file is read, then its tests are checked
    with progress(False, 2 * len(raw_files(tests))) as step:
        result = run_import(
            tests,
            out,
            columns=_sensors(column),
            units=read_values(unit, "--unit", "force=kN"),
            current=current,
            current_from_name=current_from_name,
            rate=rate,
            test_column=test_column,
            hold_out=int(held[0]) if every else held,
            leave_out=leave_out or [],
            progress=step,
        )
    result.report()
    if result.folder is None:
        print("nothing is written; --out my_tests writes the campaign")
    else:
        print(f"campaign: {result.folder}")


def _sensors(texts: list[str] | None) -> dict[str, list[str]]:
    """Columns by quantity or channel; several sensors of one if the option is repeated for it."""
    columns: dict[str, list[str]] = {}
    for text in texts or ():
        ((quantity, column),) = read_values([text], "--column", "force=3").items()
        columns.setdefault(quantity, []).append(column)
    return columns


def _columns(
    files: list[Path],
    settings: Path | None,
    column: list[str] | None,
    unit: list[str] | None,
    rate: float | None,
    leave_out: list[str] | None,
) -> Match:
    """What each column of a building record's files is taken for."""
    from ..discrepancy.building.raw_records.import_record import read_columns

    columns = _sensors(column)
    units = read_values(unit, "--unit", "force=kN")
    return read_columns(files, settings, columns, units, rate, leave_out or [])


def _import_building(
    match: Match, out: Path | None, write_settings: Path | None, force: bool
) -> None:
    """Print what is clear, write the settings, and import the record."""
    from ..discrepancy.building.raw_records.import_record import check_no_input, import_match

    if write_settings is not None:
        check_no_input(write_settings, match)
        write_new_file(write_settings, match.template(), force)
        if out is None and match.unclear:
            match.report()
            print(f"settings: {write_settings}, to be completed")
            return
        print(f"settings: {write_settings}")
    try:
        result = import_match(match, out)
    except InputError:
        if out is None and write_settings is None:
            match.report()
            print(f"\n{match.template()}")
        raise
    result.report()
    if result.path is None:
        print("no record is written; --out quake.csv writes it")
    else:
        print(f"record: {result.path}")
