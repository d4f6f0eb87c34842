"""``isolation-sim study``: one command a study."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup
from typer.main import get_command

from ground_motions.registry import is_place
from isolation_sim.cli.common_options import (
    AsJson,
    Out,
    Overwrite,
    Quiet,
    chosen_folder,
    examples,
    print_results,
    progress,
)
from isolation_sim.errors import check_name
from isolation_sim.io.files import json_text
from isolation_sim.registry import STUDIES

from .study import about, perform

_PAPERS_WIDTH = 170
"""Columns of the papers' tables where standard output is no terminal."""


class _Studies(TyperGroup):
    """The registered studies as commands, each made when it is asked for."""

    def list_commands(self, ctx: Any) -> list[str]:
        return [*super().list_commands(ctx), *STUDIES]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        found = super().get_command(ctx, cmd_name)
        if found is None and not is_place(cmd_name):
            check_name("study", cmd_name, self.list_commands(ctx))
        return found or get_command(_run(cmd_name))


app = typer.Typer(
    cls=_Studies,
    help="Run a study by its name, or by the path of its file.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    epilog=examples(
        "isolation-sim study papers",
        "isolation-sim study controllers --short --out my_results",
        "isolation-sim study level_and_period --json",
    ),
)


@app.callback()
def _options() -> None:
    """Take options that belong to no study."""


@app.command(
    epilog=examples("isolation-sim study papers", "isolation-sim study papers --short --quiet")
)
def papers(
    out: Out = None,
    overwrite: Overwrite = False,
    figures: Annotated[bool, typer.Option(help="Draw figures.")] = True,
    short: Annotated[
        bool, typer.Option("--short", help="Search by fewer runs: faster, shares less exact.")
    ] = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Recompute the four papers' checkable numbers and draw their figures."""
    from isolation_sim.reports.tables import standard_console

    from .papers.study import reproduce
    from .papers.table import Check, layout

    records: dict[str, list[dict[str, str | float]]] = {}

    def show(title: str, checks: list[Check]) -> None:
        records[title] = [check.record() for check in checks]
        if not (as_json or quiet):
            standard_console(_PAPERS_WIDTH).print(layout(title, checks), "\n")

    where = chosen_folder(out, "papers", overwrite)
    path = reproduce(where, figures, short, show, overwrite)
    if as_json:
        print(json_text(records))
    print_results(path, as_json, quiet, where)


def _run(name: str) -> typer.Typer:
    """The command that runs a study."""
    command = typer.Typer(add_completion=False, rich_markup_mode=None)

    def run(
        out: Out = None,
        overwrite: Overwrite = False,
        short: Annotated[bool, typer.Option("--short", help="Run fewer cases.")] = False,
        as_json: AsJson = False,
        quiet: Quiet = False,
    ) -> None:
        from isolation_sim.reports.sweep_tables import study_table
        from isolation_sim.reports.tables import standard_console

        where = chosen_folder(out, Path(name).stem, overwrite)
        with progress(quiet, 1) as step:
            result, path = perform(name, where, short, step, overwrite)
        if as_json:
            print(json_text({"finding": result.finding, "table": list(result.table)}))
        elif not quiet:
            console = standard_console()
            console.print(study_table(result.table, run.__doc__ or ""))
            console.print(f"\n{result.finding}\n")
        print_results(path, as_json, quiet, where)

    said = about(name)
    run.__doc__ = f"{said[:1].upper()}{said[1:]}."
    called = f"isolation-sim study {name}"
    command.command(name, epilog=examples(called, f"{called} --short"))(run)
    return command
