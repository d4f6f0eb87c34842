"""The command ``isolation-sim import``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from .common_options import examples

EXAMPLES = examples(
    "isolation-sim import raw_files                            shows what would be read",
    "isolation-sim import raw_files --out my_tests --hold-out 4",
    "isolation-sim import raw_files/*.csv --out my_tests --rate 200 --current-from-name",
    "isolation-sim import tests.xlsx --out my_tests --column 'force=Load cell 2 (kN)'",
)


def import_tests(
    tests: Annotated[
        list[Path], typer.Argument(help="Text, Excel and MATLAB files, or folders of them.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(help="Campaign folder to make. By default nothing is written."),
    ] = None,
    column: Annotated[
        list[str] | None,
        typer.Option(
            help="Column of a quantity, as force=HEADING, force=3 or current=none; may be repeated."
        ),
    ] = None,
    unit: Annotated[
        list[str] | None,
        typer.Option(
            help="Unit of a quantity whose heading has none, as displacement=mm; may be repeated."
        ),
    ] = None,
    current: Annotated[
        float | None, typer.Option(help="Current of tests without a column of it, A.")
    ] = None,
    current_from_name: Annotated[
        bool, typer.Option("--current-from-name", help="Read it from names such as 4mm_2A.csv.")
    ] = False,
    rate: Annotated[
        float | None, typer.Option(help="Samples per second of tests without a column of time.")
    ] = None,
    hold_out: Annotated[
        list[str] | None,
        typer.Option(help="Tests to hold out of a fit: every k-th, or a pattern as '*_2A'."),
    ] = None,
    leave_out: Annotated[
        list[str] | None, typer.Option(help="Pattern of tests that are not imported.")
    ] = None,
) -> None:
    """Make a campaign of test files as machines write them."""
    from ..identification.raw_tests.import_tests import import_tests as run_import

    held = hold_out or []
    every = len(held) == 1 and held[0].isdigit()
    result = run_import(
        tests,
        out,
        columns=_pairs("--column", column),
        units=_pairs("--unit", unit),
        current=current,
        current_from_name=current_from_name,
        rate=rate,
        hold_out=int(held[0]) if every else held,
        leave_out=leave_out or [],
    )
    result.report()
    if result.folder is None:
        print("nothing is written; --out my_tests writes the campaign")
    else:
        print(f"campaign: {result.folder}")


def _pairs(option: str, texts: list[str] | None) -> dict[str, str]:
    pairs = dict(text.partition("=")[::2] for text in texts or ())
    for quantity, value in pairs.items():
        if not value:
            raise InputError(f"{option} {quantity}: expected: a quantity and its value, as force=3")
    return pairs
