"""``isolation-sim study``: the studies that come with the project."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from studies import STUDIES

from .cli_habits import AsJson, Quiet, examples, page, progress

TABLE_WIDTH = 170
"""Columns to print for where nobody says how wide the paper is."""

studies = typer.Typer(
    help="Run a study that comes with the project.",
    no_args_is_help=True,
    rich_markup_mode=None,
    epilog=examples(
        "isolation-sim study papers",
        "isolation-sim study controllers --short --out my_results",
        "isolation-sim study level_and_period --json",
    ),
)


@studies.callback()
def _options() -> None:
    """Take options that belong to no study."""


@studies.command(
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
    from studies.papers.study import reproduce
    from studies.papers.table import Check, layout

    records: dict[str, list[dict[str, str | float]]] = {}

    def show(title: str, checks: list[Check]) -> None:
        records[title] = [check.record() for check in checks]
        if not (as_json or quiet):
            page(TABLE_WIDTH).print(layout(title, checks), "\n")

    path = reproduce(out, figures, short, show)
    if as_json:
        print(json.dumps(records, indent=2))
    told = sys.stderr if as_json else sys.stdout
    if not quiet:
        print(f"report: {path / 'report.html'}", file=told)
    print(f"results: {path}", file=told)


def _command(name: str, about: str) -> None:
    """Make the command that runs one of ``STUDIES``."""

    def run(
        out: Annotated[
            Path | None,
            typer.Option(help="Results folder; a number is added if it holds something already."),
        ] = None,
        short: Annotated[bool, typer.Option("--short", help="Run fewer cases.")] = False,
        as_json: AsJson = False,
        quiet: Quiet = False,
    ) -> None:
        from studies.study import layout, perform

        with progress(quiet, 1) as step:
            found, path = perform(name, out, short, step)
        if as_json:
            print(json.dumps({"finding": found.finding, "table": list(found.table)}, indent=2))
        elif not quiet:
            paper = page()
            paper.print(layout(found.table, about))
            paper.print(f"\n{found.finding}\n")
        told = sys.stderr if as_json else sys.stdout
        if not quiet:
            print(f"report: {path / 'report.html'}", file=told)
        print(f"results: {path}", file=told)

    run.__doc__ = f"{about[0].upper()}{about[1:]}."
    studies.command(
        name,
        epilog=examples(f"isolation-sim study {name}", f"isolation-sim study {name} --short"),
    )(run)


for _name, _about in STUDIES.items():
    _command(_name, _about)
