"""What the commands have in common: examples in their help, options, how they print."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rich.console import Console

TABLE_WIDTH = 100
"""Columns to print for where nobody says how wide the paper is."""

AsJson = Annotated[
    bool, typer.Option("--json", help="Print the JSON report alone on standard output.")
]
Quiet = Annotated[
    bool, typer.Option("--quiet", help="Print only errors and where the results are.")
]


def examples(*lines: str) -> str:
    """Text below a command's help.

    Parameters
    ----------
    *lines : str
        Commands, as they are typed.

    Returns
    -------
    str
        For ``epilog`` of a command.
    """
    # \b: as it stands, not rewrapped
    return "\b\nExamples:\n" + "\n".join(f"  {line}" for line in lines)


def page(width: int = TABLE_WIDTH) -> Console:
    """Find standard output, as wide as the terminal or as the tables are laid out for.

    Parameters
    ----------
    width : int
        Columns where standard output is no terminal.

    Returns
    -------
    rich.console.Console
        Coloured on a terminal only.
    """
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else width, highlight=False, markup=False)


@contextmanager
def progress(quiet: bool, steps: int) -> Iterator[Callable[..., None]]:
    """Show on standard error what is being done and how long it will take; off a terminal nothing.

    Parameters
    ----------
    quiet : bool
        Whether to show nothing there either.
    steps : int
        How many steps there are.

    Yields
    ------
    callable
        ``step(what)``, to be called when a step begins; ``step(what, done)`` ends several at once.
    """
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), TextColumn("left"),
        TimeRemainingColumn(),
    )  # fmt: skip
    hidden = quiet or not console.is_terminal
    with Progress(*columns, console=console, transient=True, disable=hidden) as shown:
        task = shown.add_task("starting", total=steps, completed=-1)
        yield lambda what, done=1: shown.update(task, description=what, advance=done)
