"""The command ``isolation-sim suite``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import check_name
from ..io.files import json_text
from .common_options import (
    AsJson,
    DefaultOut,
    Export,
    Overwrite,
    Quiet,
    Workers,
    check_exports,
    count_failures,
    examples,
    print_results,
    print_warning,
    resumable,
    write_exports,
)

if TYPE_CHECKING:
    from ..sweeps.suites.result import Suite

EXAMPLES = examples(
    "isolation-sim suite my_suite.toml",
    "isolation-sim suite my_suite.toml --out my_results --resume",
    "isolation-sim suite my_suite.toml --criterion peak_drift_m",
)


def suite(
    scenario: Annotated[
        Path, typer.Argument(help="Scenario whose [ground] is a folder, files or a PEER download.")
    ],
    out: DefaultOut = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue an interrupted suite.")
    ] = False,
    workers: Workers = None,
    criterion: Annotated[
        str, typer.Option(help="Criterion of the table with one row per motion.")
    ] = "peak_base_displacement_m",
    overwrite: Overwrite = False,
    export: Export = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Run all records of a suite with all controllers, and compute the statistics of codes."""
    from ..criteria import standard_criteria
    from ..criterion import selected_criteria
    from ..io.results_folder import file_name
    from ..reports.suite_tables import tables_and_verdict
    from ..reports.tables import standard_console
    from ..scenario import Scenario
    from ..sweeps.suites.run import run_suite

    check_exports(export, out)
    settings = Scenario.read(scenario)
    # others, such as the force of a wall, depend on the structure and are known after the runs
    selected = (one.name for one in selected_criteria(settings.simulation.criteria))
    check_name("criterion", criterion, [*standard_criteria(), *selected])
    folder = out or Path("results") / file_name(settings.name)
    with resumable(folder, overwrite, resume, quiet, 1) as step:
        result = run_suite(
            settings, folder, resume=resume, workers=workers,
            step=lambda text, total=None: step(text, 0, total), progress=count_failures(step),
        )  # fmt: skip
    check_name("criterion", criterion, result.criteria)
    if as_json:
        print(_json(result))
    elif not quiet:
        console = standard_console()
        for each in tables_and_verdict(result, criterion):
            console.print(each)
        if len(result.controllers) > 1:
            console.print("The report has the statistics of all criteria with each controller.")
    failures = result.failures()
    for failure in failures:
        print_warning(failure)
    for warning in result.warnings():
        print_warning(warning)
    print_results(result.folder, as_json, quiet)
    write_exports(export, Path(result.folder))
    if failures:
        raise typer.Exit(1)


def _json(result: Suite) -> str:
    """Statistics and runs as JSON, in SI units; null for a missing number."""
    return json_text(
        {
            "name": result.name,
            "folder": str(result.folder),
            "rule": result.rule.name,
            "design_statistic": result.design_statistic,
            "mean_spectrum_over_target": result.mean_ratio,
            "meets_rule": result.meets_rule,
            "motions": result.index["motions"],
            "left_out": result.left_out,
            "statistics": json.loads(result.statistics.reset_index().to_json(orient="records")),
            "runs": json.loads(result.table.to_json(orient="records")),
            "warnings": result.warnings(),
        }
    )
