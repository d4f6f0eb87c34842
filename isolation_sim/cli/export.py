"""The command ``isolation-sim export``: one sub-command a form."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .common_options import Force, examples, write_new_file

app = typer.Typer(
    help="Write parts of a scenario for other programs.",
    no_args_is_help=True,
    rich_markup_mode=None,
)

Scenario = Annotated[Path | None, typer.Argument(help="Scenario file; the main job by default.")]


@app.command(
    "c",
    epilog=examples(
        "isolation-sim export c --controller clipped_lqr --out laboratory",
        "isolation-sim export c my_scenario.toml --controller on_off --out laboratory",
    ),
)
def export_c(
    controller: Annotated[
        str, typer.Option(help="Controller of the scenario, by the name that it is printed with.")
    ],
    scenario: Scenario = None,
    out: Annotated[Path, typer.Option(help="Folder for the files.")] = Path("."),
    force: Force = False,
) -> None:
    """Write a controller as C99, without allocation or dependencies."""
    from ..export.controller import controller_files
    from ..scenario import Scenario

    described = Scenario() if scenario is None else Scenario.read(scenario)
    files = controller_files(described.build(), controller)
    out.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        write_new_file(out / name, text, force)
        print(out / name)
