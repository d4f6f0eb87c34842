"""``isolation-sim study``: the studies that come with the project."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from isolation_sim.cli.common_options import (
    AsJson,
    Out,
    Quiet,
    examples,
    print_results,
    progress,
)

from . import STUDIES

_PAPERS_WIDTH = 170
"""Columns of the papers' tables where standard output is no terminal."""

app = typer.Typer(
    help="Run a study that comes with the project.",
    no_args_is_help=True,
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
    out: Annotated[
        Path, typer.Option(help="Results folder; a number is added if it holds something already.")
    ] = Path("results/papers"),
    figures: Annotated[bool, typer.Option(help="Draw figures.")] = True,
    short: Annotated[
        bool, typer.Option("--short", help="Search by fewer runs: faster, shares less exact.")
    ] = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Recompute the four papers' checkable numbers and draw their figures."""
    from isolation_sim.reports.console import standard_console

    from .papers.study import reproduce
    from .papers.table import Check, layout

    records: dict[str, list[dict[str, str | float]]] = {}

    def show(title: str, checks: list[Check]) -> None:
        records[title] = [check.record() for check in checks]
        if not (as_json or quiet):
            standard_console(_PAPERS_WIDTH).print(layout(title, checks), "\n")

    path = reproduce(out, figures, short, show)
    if as_json:
        print(json.dumps(records, indent=2))
    print_results(path, as_json, quiet)


def _command(name: str, about: str) -> None:
    """Make the command that runs one of ``STUDIES``."""

    def run(
        out: Out = None,
        short: Annotated[bool, typer.Option("--short", help="Run fewer cases.")] = False,
        as_json: AsJson = False,
        quiet: Quiet = False,
    ) -> None:
        from isolation_sim.reports.console import standard_console

        from .study import layout, perform

        with progress(quiet, 1) as step:
            found, path = perform(name, out, short, step)
        if as_json:
            print(json.dumps({"finding": found.finding, "table": list(found.table)}, indent=2))
        elif not quiet:
            console = standard_console()
            console.print(layout(found.table, about))
            console.print(f"\n{found.finding}\n")
        print_results(path, as_json, quiet)

    run.__doc__ = f"{about[0].upper()}{about[1:]}."
    app.command(
        name,
        epilog=examples(f"isolation-sim study {name}", f"isolation-sim study {name} --short"),
    )(run)


for _name, _about in STUDIES.items():
    _command(_name, _about)
