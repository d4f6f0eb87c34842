"""The command ``isolation-sim diagnose``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from .cli_habits import AsJson, Quiet, progress

_PARTS = 60
"""About how many parts of a diagnosis are told of."""


def diagnose(
    data: Annotated[
        Path,
        typer.Argument(help="Campaign folder, CSV of a loop table, or CSV of a building record."),
    ],
    law: Annotated[
        str, typer.Option(help="Law to judge; isolation-sim list laws.")
    ] = "strain_stiffening",
    parameters: Annotated[
        str, typer.Option(help="Its numbers: fit, published, or a file that fit --out wrote.")
    ] = "fit",
    scenario: Annotated[
        Path | None,
        typer.Option(
            help="Scenario of the consequence, the main job by default; for a building record, the "
            "building, and needed."
        ),
    ] = None,
    consequence: Annotated[
        bool, typer.Option(help="Run the scenario's controllers with the old and extended law.")
    ] = True,
    current_degree: Annotated[
        int | None,
        typer.Option(
            help="Degree of the parameters' polynomials of the current; not for building records."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Results folder; a number is added if it holds something already."),
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Say what a simulation gets wrong in measured data, and why."""
    from .front_door import diagnose as run_diagnosis
    from .results import ResultsFolder, file_name

    where = out or Path("results") / file_name(f"diagnosis of {data.resolve().stem}")
    with ResultsFolder(where) as folder:
        with progress(quiet, _PARTS) as step:
            result = run_diagnosis(
                data, law, parameters, scenario=scenario, consequence=consequence,
                current_degree=current_degree, progress=step,
            )  # fmt: skip
        result.save(folder.unfinished)
    if as_json:
        print(result.to_json())
    elif not quiet:
        result.report()
    path = folder.path
    shown = path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path
    if not quiet:
        print(f"report: {shown / 'report.html'}", file=sys.stderr if as_json else sys.stdout)
    print(f"results: {shown}", file=sys.stderr if as_json else sys.stdout)
