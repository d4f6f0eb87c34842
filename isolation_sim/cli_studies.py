"""``isolation-sim study``: the studies that come with the project."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

TABLE_WIDTH = 170
"""Columns to print for where nobody says how wide the paper is."""

studies = typer.Typer(
    help="Run a study that comes with the project.", no_args_is_help=True, rich_markup_mode=None
)


@studies.callback()
def _options() -> None:
    """Take options that belong to no study."""


@studies.command()
def papers(
    out: Annotated[
        Path, typer.Option(help="Results folder; a number is added if it holds something already.")
    ] = Path("results/papers"),
    figures: Annotated[bool, typer.Option(help="Draw figures.")] = True,
    short: Annotated[
        bool, typer.Option("--short", help="Search by fewer runs: faster, shares less exact.")
    ] = False,
) -> None:
    """Recompute every checkable number of the four papers and draw their figures."""
    from rich.console import Console

    from studies.papers.study import reproduce
    from studies.papers.table import layout

    page = Console(
        width=None if sys.stdout.isatty() else TABLE_WIDTH, highlight=False, markup=False
    )
    path = reproduce(
        out, figures, short, show=lambda title, checks: page.print(layout(title, checks), "\n")
    )
    print(f"results: {path}")
