"""Options, help examples and printing functions that all commands use."""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

from ..errors import InputError
from ..io.files import check_new_files, json_text, write_text
from ..progress_lines import occasional_lines

if TYPE_CHECKING:
    from ..scenario import Scenario

TABLE_WIDTH = 100
"""Width of tables in characters if standard output is not a terminal."""
AsJson = Annotated[
    bool, typer.Option("--json", help="Print only the JSON report on standard output.")
]
Quiet = Annotated[bool, typer.Option("--quiet", help="Print only errors and the results folder.")]
Out = Annotated[
    Path | None,
    typer.Option(help="Results folder; results/NAME by default, or the next free results/NAME-2."),
]
DefaultOut = Annotated[Path | None, typer.Option(help="Results folder; results/NAME by default.")]
Workers = Annotated[
    int | None, typer.Option(help="Processes on this machine; one per processor by default.")
]
ScenarioFile = Annotated[
    Path | None, typer.Argument(help="Scenario file; the main job by default.")
]
ReportFile = Annotated[Path | None, typer.Option(help="File for the report (HTML).")]
TestsFolder = Annotated[Path, typer.Argument(help="Folder with campaign.toml and its CSV files.")]
Export = Annotated[
    list[str] | None,
    typer.Option("--export", help="Also write all tables and histories: mat, xlsx or csv."),
]
Overwrite = Annotated[
    bool,
    typer.Option("--overwrite", help="Replace earlier results in the folder; other files stay."),
]
Force = Annotated[bool, typer.Option("--force", help="Replace a file that exists.")]

_errors = Console(stderr=True, soft_wrap=True, highlight=False)


def examples(*lines: str) -> str:
    """Example commands for the end of a command's help."""
    # \b keeps the lines as they are
    return "\b\nExamples:\n" + "\n".join(f"  {line}" for line in lines)


def print_error(problem: Exception | str) -> None:
    """Print one line in red on standard error."""
    _errors.print(f"isolation-sim: {problem}", style="red", markup=False)


printed_warnings: set[str] = set()
"""Warnings that the command has printed."""


def print_warning(text: str) -> None:
    """Print one line in yellow on standard error, once in a command."""
    if text not in printed_warnings:
        printed_warnings.add(text)
        _errors.print(f"warning: {text}", style="yellow", markup=False)


def read_scenario(file: Path | None) -> Scenario:
    """Scenario of a file; without a file the main job."""
    from ..scenario import Scenario, main_job

    return main_job() if file is None else Scenario.read(file)


def read_values(texts: list[str] | None, option: str, example: str) -> dict[str, str]:
    """Values by name of an option NAME=VALUE that may be repeated."""
    values: dict[str, str] = {}
    for text in texts or ():
        name, _, value = (part.strip() for part in text.partition("="))
        if not (name and value):
            raise InputError(f"{option} {text}: expected: a name and a value, such as {example}")
        if name in values:
            raise InputError(f"{option} {name}", f"{values[name]!r} and {value!r}", "one of them")
        values[name] = value
    return values


def read_numbers(texts: list[str] | None, option: str, example: str) -> dict[str, float]:
    """Numbers by name of an option NAME=NUMBER that may be repeated."""
    numbers = {}
    for name, value in read_values(texts, option, example).items():
        try:
            numbers[name] = float(value)
        except ValueError:
            raise InputError(
                f"{option} {name}={value}: expected: a number, such as {example}"
            ) from None
    return numbers


def print_result(result: Any, as_json: bool, quiet: bool) -> None:
    """Print a result's tables and sentences, or its numbers as JSON."""
    if as_json:
        print(json_text(result.to_dict()))
    elif not quiet:
        result.report()


def print_path(label: str, path: object, as_json: bool) -> None:
    """Print the path of a result; on standard error if JSON is on standard output."""
    print(f"{label}: {path}", file=sys.stderr if as_json else sys.stdout)


def write_report(path: Path, write: Callable[[Path], Path], as_json: bool) -> None:
    """Write a report to a folder that may be missing, and print its path."""
    path.parent.mkdir(parents=True, exist_ok=True)
    print_path("report", write(path), as_json)


def chosen_folder(out: Path | None, default: str, overwrite: bool) -> Path:
    """Results folder: that of ``--out``, which must be free, or ``results/`` and the name."""
    from ..io.results_folder import check_free, file_name

    if out is not None and not overwrite:
        check_free(out)
    return Path("results") / file_name(default) if out is None else out


def print_results(folder: Path, as_json: bool, quiet: bool, requested: Path | None = None) -> None:
    """Print the paths of report and results.

    ``requested``: the default folder, which may already contain files.
    """
    renamed = requested is not None and folder.absolute() != requested.absolute()
    if folder.is_relative_to(Path.cwd()):
        folder = folder.relative_to(Path.cwd())
    if renamed:
        print_warning(
            f"{requested} is not empty; the results are in {folder}. --overwrite replaces earlier "
            "results"
        )
    if not quiet:
        print_path("report", folder / "report.html", as_json)
    print_path("results", folder, as_json)


def check_exports(
    forms: list[str] | None, folder: Path | None = None, known: Collection[str] | None = None
) -> None:
    """Refuse an unknown format of ``--export``, or an existing file, before the work starts."""
    from ..io.interchange import EXPORTS, check_form, export_place

    for form in forms or ():
        check_form(form, known or EXPORTS)
        if folder is not None and (place := export_place(folder, form)).exists():
            raise InputError(
                f"--export {form}: {place} exists; expected: isolation-sim export {form} --force, "
                "which replaces it"
            )


def write_exports(forms: list[str] | None, folder: Path) -> None:
    """Write the results of a folder in other formats, and update its list of files."""
    from ..io.interchange import export_results
    from ..io.results_folder import update_contents

    for form in forms or ():
        export_results(folder, form)
        update_contents(folder)


def write_new_file(path: Path, text: str, force: bool) -> None:
    """Write a file; an existing file is replaced only with ``force``."""
    check_new_files(force, path)
    write_text(text, path)


@contextmanager
def progress(quiet: bool, steps: int, alike: bool = False) -> Iterator[Callable[..., None]]:
    """Show progress; yields ``step(text, done=1, total=None)``, to call when a step begins."""
    # ``alike``: the steps take equal time, so that the remaining time can be shown.
    # ``total``: the number of steps, counted anew from here, if it was not known before.
    from rich.progress import (
        BarColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    console = Console(stderr=True)
    if not console.is_terminal:
        yield occasional_lines(steps, quiet)
        return
    left = (TextColumn("left"), TimeRemainingColumn()) if alike else ()
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), *left)
    with Progress(*columns, console=console, transient=True, disable=quiet) as shown:
        task = shown.add_task("starting", total=steps, completed=-1)

        def step(text: str, done: float = 1, total: int | None = None) -> None:
            if total is not None:
                shown.update(task, total=total, completed=0)
            shown.update(task, description=text, advance=done)

        yield step


@contextmanager
def resumable(
    folder: Path, overwrite: bool, resume: bool, quiet: bool, steps: int, alike: bool = False
) -> Iterator[Callable[..., None]]:
    """Show the `progress` of work in a folder that ``--resume`` continues after an interrupt."""
    from ..io.results_folder import replace_results

    try:
        with replace_results(folder, overwrite, resume), progress(quiet, steps, alike) as step:
            yield step
    except KeyboardInterrupt:
        where = f"finished runs are in {folder}; --resume continues"
        print(f"stopped; {f'{folder} is unchanged' if overwrite else where}", file=sys.stderr)
        raise typer.Exit(130) from None


def count_failures(step: Callable[..., None]) -> Callable[[int, int], None]:
    """Return a function that shows the progress of runs with the number of failed ones."""
    failures = 0

    def advance(done: int, failed: int) -> None:
        nonlocal failures
        failures += failed
        step(f"running, {failures} failed" if failures else "running", done)

    return advance
