"""The command ``isolation-sim diagnose``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from .common_options import (
    AsJson,
    Export,
    Out,
    Overwrite,
    Quiet,
    check_exports,
    chosen_folder,
    examples,
    print_results,
    progress,
    write_exports,
)

if TYPE_CHECKING:
    from ..discrepancy.tiers.result import Tier

EXAMPLES = examples(
    "isolation-sim diagnose my_tests --law bouc_wen",
    "isolation-sim diagnose my_tests --law auto",
    "isolation-sim diagnose loops.csv --parameters published --out diagnosis",
    "isolation-sim diagnose record.csv --scenario my_building.toml --json",
    "isolation-sim diagnose weak.csv strong.csv --hold-out second.csv --scenario my_building.toml",
)
_STEPS = 60
"""Approximate number of steps of a diagnosis, for the progress bar."""


def diagnose(
    data: Annotated[
        list[Path],
        typer.Argument(
            help="Campaign folder, CSV of a loop table, or one or several CSV files of records of "
            "one building."
        ),
    ],
    law: Annotated[
        str,
        typer.Option(
            help="Law to evaluate, of isolation-sim list laws; auto compares all of them."
        ),
    ] = "strain_stiffening",
    parameters: Annotated[
        str,
        typer.Option(
            help="Parameters of the law: fit, published, or what fit --out wrote, file or folder."
        ),
    ] = "fit",
    scenario: Annotated[
        Path | None,
        typer.Option(
            help="Scenario to run with both laws; the main job by default. A building record "
            "needs the scenario of its building."
        ),
    ] = None,
    hold_out: Annotated[
        list[Path] | None,
        typer.Option(
            help="Building record that is not used in the fit; may be repeated. By default it is "
            "the last of several records, or the later part of a single one."
        ),
    ] = None,
    consequence: Annotated[
        bool, typer.Option(help="Run the scenario's controllers with the old and the extended law.")
    ] = True,
    current_degree: Annotated[
        int | None,
        typer.Option(help="Degree of the polynomials in the current; not for building records."),
    ] = None,
    significance: Annotated[
        float | None,
        typer.Option(
            help="Share of the force (RMS) below which an effect is negligible, 0.002 by default; "
            "not for building records."
        ),
    ] = None,
    tiers: Annotated[
        str,
        typer.Option(
            help="Methods for device tests and building records: causes; equation, beside them; "
            "learned, a term of that kind, too; auto: all of these where the causes do not explain "
            "the data."
        ),
    ] = "auto",
    out: Out = None,
    overwrite: Overwrite = False,
    export: Export = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Find the differences between a simulation and measured data, and their causes."""
    from ..api import diagnose as run_diagnosis
    from ..io.results_folder import ResultsFolder

    check_exports(export)
    names = " and ".join(path.resolve().stem for path in data)
    where = chosen_folder(out, f"diagnosis of {names}", overwrite)
    with ResultsFolder(where, overwrite) as folder:
        with progress(quiet, _STEPS) as step:
            result = run_diagnosis(
                data if len(data) > 1 else data[0], law, parameters, scenario=scenario,
                hold_out=hold_out or [], consequence=consequence, current_degree=current_degree,
                significance=significance, tiers=cast("Tier", tiers), progress=step,
            )  # fmt: skip
        result.save(folder.unfinished)
    if as_json:
        print(result.to_json())
    elif not quiet:
        result.report()
    print_results(folder.path, as_json, quiet, where)
    write_exports(export, folder.path)
