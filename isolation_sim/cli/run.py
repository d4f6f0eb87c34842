"""The command ``isolation-sim run``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from ..io.files import json_text
from .common_options import (
    AsJson,
    Export,
    Out,
    Overwrite,
    Quiet,
    ScenarioFile,
    check_exports,
    chosen_folder,
    examples,
    print_error,
    print_results,
    print_warning,
    progress,
    read_scenario,
    write_exports,
)

if TYPE_CHECKING:
    from ..simulation.result import Run

EXAMPLES = examples(
    "isolation-sim run",
    "isolation-sim run my_scenario.toml --out my_results",
    "isolation-sim run my_scenario.toml --json > report.json",
    "isolation-sim run my_scenario.toml --export mat",
)


def run(
    scenario: ScenarioFile = None,
    out: Out = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
    figures: Annotated[bool, typer.Option(help="Draw figures.")] = True,
    export: Export = None,
    quiet: Quiet = False,
) -> None:
    """Compare the controllers of a scenario."""
    from ..comparison import json_report, simulated
    from ..io.results_folder import ResultsFolder
    from ..reports.html.run_report import write_comparison
    from ..reports.tables import standard_console
    from ..scenario.compilation import compile_in_parallel

    check_exports(export)
    settings = read_scenario(scenario)
    job = settings.build()
    where = chosen_folder(out, settings.name, overwrite)
    with ResultsFolder(where, overwrite) as folder:
        with (
            progress(quiet, len(job.controllers) + 1) as step,
            compile_in_parallel(settings, job) as simulate,
        ):

            def run_one(label: str) -> Run:
                step(f"simulating {label}")
                return simulate(label)

            comparison = simulated(job.controllers, run_one, job.run_fixed_base)
            step("writing results")
            write_comparison(comparison, folder.unfinished, settings.to_toml(), figures)
    if as_json:
        print(json_text(json_report(comparison)))
    elif not quiet:
        console = standard_console()
        console.print(comparison.table())
        for sentence in comparison.verdict():
            console.print(sentence)
    for warning in comparison.warnings():
        print_warning(warning)
    for divergence in comparison.diverged.values():
        print_error(divergence)
    print_results(folder.path, as_json, quiet, where)
    write_exports(export, folder.path)
    if comparison.diverged:
        raise typer.Exit(1)
