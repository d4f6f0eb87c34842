"""The command line: ``isolation-sim run``, ``fit``, ``cite``, ``list`` and ``new``.

Exit codes: 0 all well; 1 a run diverged, with the results of the others written; 2 input that
cannot be used, told in one line on standard error.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from typer.core import TyperGroup
from typer.main import get_command

from . import __version__, cli_cite, cli_diagnose, cli_fit
from .cli_habits import TABLE_WIDTH, AsJson, Quiet, examples, page, progress
from .cli_lists import SUBJECTS
from .cli_sweep import sweeps
from .errors import Diverged, InputError, unknown_name
from .registry import COMMANDS

if TYPE_CHECKING:
    from .simulation.result import Run


class _Commands(TyperGroup):
    """The commands, with those that other packages add, loaded when they are asked for."""

    def list_commands(self, ctx: Any) -> list[str]:
        return [*super().list_commands(ctx), *COMMANDS]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        own = super().get_command(ctx, cmd_name)
        added = own is None and cmd_name in COMMANDS
        return get_command(COMMANDS[cmd_name]) if added else own


app = typer.Typer(
    name="isolation-sim",
    cls=_Commands,
    help="Semi-active base isolation with magnetorheological isolators.",
    no_args_is_help=True,
    epilog=examples(
        "isolation-sim run                     the main job: five controllers under El Centro",
        "isolation-sim new my_scenario.toml    a commented scenario to start from",
        "isolation-sim COMMAND --help          more examples",
    ),
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"max_content_width": TABLE_WIDTH},
)
app.add_typer(sweeps, name="sweep")
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


@app.command(
    epilog=examples(
        "isolation-sim run",
        "isolation-sim run my_scenario.toml --out my_results",
        "isolation-sim run my_scenario.toml --json > report.json",
    )
)
def run(
    scenario: Annotated[
        Path | None, typer.Argument(help="Scenario file; the main job by default.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Results folder; a number is added if it holds something already."),
    ] = None,
    as_json: AsJson = False,
    figures: Annotated[bool, typer.Option(help="Draw figures.")] = True,
    quiet: Quiet = False,
) -> None:
    """Compare the controllers of a scenario."""
    from .comparison import simulated
    from .results import ResultsFolder, file_name, json_text, write_comparison
    from .scenario import Scenario

    described = Scenario() if scenario is None else Scenario.read(scenario)
    job = described.build()
    with ResultsFolder(out or Path("results") / file_name(described.name)) as folder:
        with progress(quiet, len(job.controllers) + 1) as step:

            def run_one(label: str) -> Run:
                step(f"simulating {label}")
                return job.run(label)

            comparison = simulated(job.controllers, run_one)
            step("writing results")
            write_comparison(comparison, folder.unfinished, described.to_toml(), figures)
    if as_json:
        print(json_text(comparison), end="")
    elif not quiet:
        page().print(comparison.table())
        for label in comparison.runs:
            said = getattr(job.controllers[label], "report", None)
            if said is not None:
                print(f"{label}: {said}")
    for warning in comparison.warnings():
        _messages.print(f"warning: {warning}", style="yellow", markup=False)
    for divergence in comparison.diverged.values():
        _tell(divergence)
    where = _relative(folder.path)
    told = sys.stderr if as_json else sys.stdout
    if not quiet:
        print(f"report: {where / 'report.html'}", file=told)
    print(f"results: {where}", file=told)
    if comparison.diverged:
        raise typer.Exit(1)


# what some will type for it
app.command("compare", hidden=True)(run)


@app.command(
    "list", epilog=examples("isolation-sim list laws", "isolation-sim list controllers --json")
)
def list_names(
    subject: Annotated[
        str,
        typer.Argument(
            help="What to list.", metavar="|".join(SUBJECTS), autocompletion=lambda: list(SUBJECTS)
        ),
    ],
    as_json: AsJson = False,
) -> None:
    """List what a scenario may name."""
    from rich.table import Table

    if subject not in SUBJECTS:
        raise unknown_name("subject", subject, SUBJECTS)
    headings, entries = SUBJECTS[subject]()
    if as_json:
        print(json.dumps([dict(zip(headings, entry, strict=True)) for entry in entries], indent=2))
        return
    if not entries:
        print(f"no {subject} yet")
        return
    table = Table(box=None, pad_edge=False, header_style="bold")
    for k, heading in enumerate(headings):
        table.add_column(heading, no_wrap=k == 0)
    for entry in entries:
        table.add_row(*entry)
    page().print(table)


app.command(
    "fit",
    epilog=examples(
        "isolation-sim fit my_tests --law kelvin_voigt",
        "isolation-sim fit my_tests --law bouc_wen --fix n=2 --fix A=1 --out fitted.toml",
    ),
)(cli_fit.fit)
app.command(
    "diagnose",
    epilog=examples(
        "isolation-sim diagnose my_tests --law bouc_wen",
        "isolation-sim diagnose loops.csv --parameters published --out diagnosis",
        "isolation-sim diagnose record.csv --scenario my_building.toml --json",
    ),
)(cli_diagnose.diagnose)
app.command(
    "cite",
    epilog=examples("isolation-sim cite", "isolation-sim cite results/main_job --json"),
)(cli_cite.cite)


@app.command(epilog=examples("isolation-sim new", "isolation-sim new my_scenario.toml --force"))
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
