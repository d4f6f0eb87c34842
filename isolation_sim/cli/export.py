"""The command ``isolation-sim export``: one sub-command a form."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .common_options import Force, examples

app = typer.Typer(
    help="Write parts of a scenario for other programs.",
    no_args_is_help=True,
    rich_markup_mode=None,
    epilog=examples(
        "isolation-sim export c --controller clipped_lqr --out laboratory",
        "isolation-sim export fmu --controller clipped_lqg --out clipped_lqg.fmu",
        "isolation-sim export mat results/main_job",
    ),
)

Scenario = Annotated[Path | None, typer.Argument(help="Scenario file; the main job by default.")]
Controller = Annotated[
    str, typer.Option(help="Controller of the scenario, by the name that it is printed with.")
]


@app.command(
    "c",
    epilog=examples(
        "isolation-sim export c --controller clipped_lqr --out laboratory",
        "isolation-sim export c my_scenario.toml --controller on_off --out laboratory",
    ),
)
def export_c(
    controller: Controller,
    scenario: Scenario = None,
    out: Annotated[Path, typer.Option(help="Folder for the files.")] = Path("."),
    force: Force = False,
) -> None:
    """Write a controller as C99, without allocation or dependencies."""
    from ..export.controller import controller_files
    from ..io.atomic_write import write_text
    from ..io.output_place import check_new_files
    from ..scenario import Scenario, main_job

    described = main_job() if scenario is None else Scenario.read(scenario)
    files = controller_files(described.build(), controller)
    check_new_files(force, *(out / name for name in files))
    out.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        print(write_text(text, out / name))


@app.command(
    "fmu",
    epilog=examples(
        "isolation-sim export fmu --controller clipped_lqg --out clipped_lqg.fmu",
        "isolation-sim export fmu my_scenario.toml --controller on_off --out on_off.fmu --fmi 3.0",
    ),
)
def export_fmu(
    controller: Controller,
    out: Annotated[Path, typer.Option(help="File to write, *.fmu.")],
    scenario: Scenario = None,
    fmi: Annotated[str, typer.Option(help="Version of the interface: 2.0 or 3.0.")] = "2.0",
    force: Force = False,
) -> None:
    """Write a controller as a functional mock-up unit for co-simulation, compiled from C."""
    from ..export.fmu import controller_fmu
    from ..io.output_place import check_new_files
    from ..scenario import Scenario, main_job

    check_new_files(force, out)
    described = main_job() if scenario is None else Scenario.read(scenario)
    print(controller_fmu(described.build(), controller, out, fmi))


Folder = Annotated[Path, typer.Argument(help="Results of a run, a diagnosis, a sweep or a study.")]
OutFile = Annotated[
    Path | None, typer.Option(help="File to write; results.mat or .xlsx in the folder by default.")
]


@app.command("mat", epilog=examples("isolation-sim export mat results/main_job"))
def export_mat(results: Folder, out: OutFile = None, force: Force = False) -> None:
    """Write all tables and histories of a results folder to one MATLAB file."""
    _export(results, "mat", out, force)


@app.command("xlsx", epilog=examples("isolation-sim export xlsx results/main_job"))
def export_xlsx(results: Folder, out: OutFile = None, force: Force = False) -> None:
    """Write all tables and histories of a results folder to one Excel workbook."""
    _export(results, "xlsx", out, force)


def _export(results: Path, form: str, out: Path | None, force: bool) -> None:
    from ..io.interchange import export_results
    from ..io.output_place import check_new_files

    check_new_files(force, out or results / f"results.{form}")
    print(export_results(results, form, out))
