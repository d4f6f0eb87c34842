"""Options that several commands share, examples in their help, and printing."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

TABLE_WIDTH = 100
"""Columns of a table where standard output is no terminal."""

AsJson = Annotated[
    bool, typer.Option("--json", help="Print the JSON report alone on standard output.")
]
Quiet = Annotated[
    bool, typer.Option("--quiet", help="Print only errors and where the results are.")
]
Out = Annotated[
    Path | None,
    typer.Option(help="Results folder; a number is added to the name if it is not empty."),
]
Export = Annotated[
    list[str] | None,
    typer.Option("--export", help="Also write everything to one file: mat or xlsx."),
]
Overwrite = Annotated[
    bool, typer.Option("--overwrite", help="Replace earlier results in the results folder.")
]
Force = Annotated[bool, typer.Option("--force", help="Replace a file that exists.")]

_errors = Console(stderr=True, soft_wrap=True, highlight=False)


def examples(*lines: str) -> str:
    """Text below a command's help: commands as they are typed."""
    # \b keeps the lines as they are
    return "\b\nExamples:\n" + "\n".join(f"  {line}" for line in lines)


def print_error(problem: Exception | str) -> None:
    """Print one line in red on standard error."""
    _errors.print(f"isolation-sim: {problem}", style="red", markup=False)


def print_warning(text: str) -> None:
    """Print one line in yellow on standard error."""
    _errors.print(f"warning: {text}", style="yellow", markup=False)


def print_results(folder: Path, as_json: bool, quiet: bool, wanted: Path | None = None) -> None:
    """Print where report and results are; on standard error if JSON is on standard output.

    ``wanted``: the folder that was asked for, which may hold something already.
    """
    renamed = wanted is not None and folder.absolute() != wanted.absolute()
    if folder.is_relative_to(Path.cwd()):
        folder = folder.relative_to(Path.cwd())
    stream = sys.stderr if as_json else sys.stdout
    if renamed:
        print_warning(
            f"{wanted} is not empty: a number was added to the name; --overwrite replaces "
            "earlier results"
        )
    if not quiet:
        print(f"report: {folder / 'report.html'}", file=stream)
    print(f"results: {folder}", file=stream)


def print_stopped(folder: Path, overwrite: bool) -> None:
    """Print where the results stand that an interrupt ended."""
    where = (
        f"{folder} is unchanged"
        if overwrite
        else (f"finished runs are in {folder}: --resume continues")
    )
    print(f"stopped; {where}", file=sys.stderr)


def check_exports(forms: list[str] | None, folder: Path | None = None) -> None:
    """Refuse a form of ``--export`` that is unknown or already in the folder, before the work."""
    from ..errors import InputError
    from ..io.interchange import check_form

    for form in forms or ():
        check_form(form)
        if folder is not None and (folder / f"results.{form}").exists():
            raise InputError(
                f"--export {form}: {folder / f'results.{form}'} exists; expected: isolation-sim "
                f"export {form} --force, which replaces it"
            )


def write_exports(forms: list[str] | None, folder: Path, title: str) -> None:
    """Also write a results folder in other formats, and update its list of files."""
    from ..io.interchange import export_results
    from ..io.results_folder import write_contents

    for form in forms or ():
        export_results(folder, form)
    if forms:
        write_contents(folder, title)


def write_new_file(path: Path, text: str, force: bool) -> None:
    """Write a file; one that exists is replaced only by ``force``."""
    from ..io.atomic_write import write_text
    from ..io.output_place import check_new_files

    check_new_files(force, path)
    write_text(text, path)


@contextmanager
def progress(quiet: bool, steps: int, alike: bool = False) -> Iterator[Callable[..., None]]:
    """Show progress on standard error if it is a terminal.

    Yields ``step(text)``, to call when a step begins; ``step(text, done)`` ends several at once.
    ``alike``: all steps take equally long, so that the remaining time can be estimated.
    """
    from rich.progress import (
        BarColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    console = Console(stderr=True)
    left = (TextColumn("left"), TimeRemainingColumn()) if alike else ()
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), *left)
    hidden = quiet or not console.is_terminal
    with Progress(*columns, console=console, transient=True, disable=hidden) as shown:
        task = shown.add_task("starting", total=steps, completed=-1)
        yield lambda text, done=1: shown.update(task, description=text, advance=done)
