"""The command line: ``isolation-sim run``, ``fit``, ``list`` and ``new``.

Exit codes: 0 all well; 1 a run diverged, with the results of the others written; 2 input that
cannot be used, told in one line on standard error.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from . import __version__, cli_fit
from .cli_lists import SUBJECTS
from .cli_studies import studies
from .errors import Diverged, InputError, unknown_name

if TYPE_CHECKING:
    from .comparison import Comparison
    from .scenario import Job
    from .simulation.result import Run

TABLE_WIDTH = 100
"""Columns to print for where nobody says how wide the paper is."""

app = typer.Typer(
    name="isolation-sim",
    help="Semi-active base isolation with magnetorheological isolators.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
app.add_typer(studies, name="study")
_messages = Console(stderr=True, soft_wrap=True, highlight=False)


def _show_version(wanted: bool) -> None:
    if wanted:
        print(f"isolation-sim {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    """Take options that belong to no command."""


@app.command()
def run(
    scenario: Annotated[
        Path | None, typer.Argument(help="Scenario file; the main job by default.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Results folder; a number is added if it holds something already."),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the JSON report alone on standard output.")
    ] = False,
    figures: Annotated[bool, typer.Option(help="Draw figures.")] = True,
    quiet: Annotated[
        bool, typer.Option("--quiet", help="Print only errors and where the results are.")
    ] = False,
) -> None:
    """Compare the controllers of a scenario."""
    from .comparison import Comparison
    from .results import ResultsFolder, file_name, json_text, write_comparison
    from .scenario import Scenario

    described = Scenario() if scenario is None else Scenario.read(scenario)
    job = described.build()
    with ResultsFolder(out or Path("results") / file_name(described.name)) as folder:
        with _progress(quiet) as step:
            runs: dict[str, Run] = {}
            diverged: list[Diverged] = []
            for label in job.controllers:
                step(f"simulating {label}")
                try:
                    runs[label] = job.run(label)
                except Diverged as error:
                    diverged.append(error)
            if not runs:
                raise diverged[0]
            comparison = Comparison(runs)
            step("writing results")
            write_comparison(comparison, folder.unfinished, described.to_toml(), figures)
    if as_json:
        print(json_text(comparison), end="")
    elif not quiet:
        _page().print(comparison.table())
    for warning in _warnings(comparison, job):
        _messages.print(f"warning: {warning}", style="yellow", markup=False)
    for divergence in diverged:
        _tell(divergence)
    where = _relative(folder.path)
    print(f"results: {where}", file=sys.stderr if as_json else sys.stdout)
    if diverged:
        raise typer.Exit(1)


@app.command("list")
def list_names(
    subject: Annotated[str, typer.Argument(help="What to list.", metavar="|".join(SUBJECTS))],
) -> None:
    """List what a scenario may name."""
    from rich.table import Table

    if subject not in SUBJECTS:
        raise unknown_name("subject", subject, SUBJECTS)
    headings, entries = SUBJECTS[subject]()
    if not entries:
        print(f"no {subject} yet")
        return
    table = Table(box=None, pad_edge=False, header_style="bold")
    for k, heading in enumerate(headings):
        table.add_column(heading, no_wrap=k == 0)
    for entry in entries:
        table.add_row(*entry)
    _page().print(table)


app.command("fit")(cli_fit.fit)


@app.command()
def new(
    path: Annotated[Path, typer.Argument(help="File to write.")] = Path("scenario.toml"),
    force: Annotated[bool, typer.Option("--force", help="Replace a file that exists.")] = False,
) -> None:
    """Write a commented scenario to start from."""
    from .results import write_text
    from .scenario import Scenario

    if path.exists() and not force:
        raise InputError(f"{path}: exists; accepted: a new name, or --force to replace it")
    write_text(Scenario(name=path.stem).to_toml(comments=True), path)
    print(f"wrote {path}; run it with: isolation-sim run {path}")


def _page() -> Console:
    """Return standard output, as wide as the terminal or as the tables are laid out for."""
    width = None if sys.stdout.isatty() else TABLE_WIDTH
    return Console(width=width, highlight=False, markup=False)


@contextmanager
def _progress(quiet: bool) -> Iterator[Callable[[str], None]]:
    """Spinner on standard error that names the present step and how long it has been at work."""
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    if quiet or not _messages.is_terminal:
        yield lambda what: None
        return
    columns = SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn()
    with Progress(*columns, console=_messages, transient=True) as progress:
        task = progress.add_task("starting")
        yield lambda what: progress.update(task, description=what)


def _warnings(comparison: Comparison, job: Job) -> Iterator[str]:
    """Yield what a user must know before trusting the numbers."""
    for element in job.isolated.elements:
        device = element.device
        tested = device.length * device.tested_deformation
        beyond = {
            name: peak
            for name, run in comparison.runs.items()
            if (peak := float(abs(run.output(f"{element.name}_deformation_m")).max())) > tested
        }
        if beyond:
            peaks = ", ".join(f"{name} {1e3 * peak:.0f} mm" for name, peak in beyond.items())
            yield (
                f"{element.name} deforms further than its law was tested, {1e3 * tested:.0f} mm at "
                f"this scale: {peaks}"
            )
    for name, run in comparison.runs.items():
        if run.clamped:
            yield f"{name}: {run.clamped} commands were clamped to the supply's limits"


def _relative(path: Path) -> Path:
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and end the process.

    Parameters
    ----------
    arguments : list of str, optional
        What follows the program's name; the process's own by default.
    """
    from ground_motions.errors import GroundMotionError

    try:
        app(arguments)
    except (InputError, GroundMotionError, Diverged) as error:
        _tell(error)
        sys.exit(1 if isinstance(error, Diverged) else 2)
    except OSError as error:
        _tell(f"{error.filename or 'results'}: {error.strerror or error}")
        sys.exit(2)


def _tell(problem: Exception | str) -> None:
    _messages.print(f"isolation-sim: {problem}", style="red", markup=False)
