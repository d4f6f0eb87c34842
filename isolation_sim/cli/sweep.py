"""The command ``isolation-sim sweep``: run a plan, show its results, write a plan template."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from ..errors import InputError
from ..io.files import check_new_files, check_writable, json_text
from .common_options import (
    AsJson,
    DefaultOut,
    Export,
    Force,
    Overwrite,
    Quiet,
    Workers,
    check_exports,
    count_failures,
    examples,
    print_results,
    print_warning,
    resumable,
    write_exports,
    write_new_file,
)

if TYPE_CHECKING:
    from ..sweeps import Estimate, Sweep

PLAN = """\
# A plan of isolation-sim sweep: a scenario, and the quantities to vary.
# The cases are all combinations; each case is run with every controller of the scenario.
# Lines that begin with # and no space are examples; remove the # to use them.

#energy = true  # energy ledger of every run; about 20 ms more per run
#histories = [0, 5]  # save the time histories of these cases; true for all cases
#floors = true  # save peaks of each level and storey, and floor spectra; about 0.1 s per run

# The scenario of every case: a file, scenario = "my_scenario.toml", or its sections here.
# A section that is left out is that of the main job.
[[scenario.controller]]
name = "passive_off"

[[scenario.controller]]
name = "clipped_lqr"

# A quantity over a range: low and high with count, or with step; spacing = "linear" or "log".
# A field is a key of a section; [k] picks an item of a list. Without [k] all items are varied.
# label is the heading of the table's column; the field by default.
[[vary]]
field = "ground.scale_factor"
label = "scale_factor"
low = 0.25
high = 1.0
count = 4

# A quantity over a list of values. With factor = true the values multiply the scenario's value.
# Several fields can be varied together.
[[vary]]
field = ["isolator.count"]
label = "isolators"
factor = true
values = [0.8, 1.0, 1.2]

# Whole sections can be varied, too: records, structures, laws. names appear in the table.
#[[vary]]
#field = "ground"
#values = [
#{ name = "el_centro_1940_ns" },
#{ kind = "ricker_pulse", peak_velocity_m_s = 0.5, pulse_period_s = 1.5 },
#]
#names = ["El Centro", "pulse"]

# Quantities with only low and high are sampled together.
#[[vary]]
#field = "driver.lag_s"
#low = 0.005
#high = 0.05

# Methods: latin_hypercube; sobol (count is a power of 2); saltelli, for Sobol indices (count times
# (number of quantities + 2) cases); morris (count is the number of trajectories).
#[sample]
#method = "latin_hypercube"
#count = 64
#seed = 1

# Your own cases: a CSV file whose headings are fields.
#[cases]
#file = "cases.csv"

# Repetitions with different noise and random motion; each case has its own seed.
#[seeds]
#count = 10
"""


class _WithDefault(TyperGroup):
    """Treat an argument that is no subcommand as a plan to run."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if args and args[0] not in self.commands and args[0] != "--help":
            args = ["run", *args]
        return super().parse_args(ctx, args)


app = typer.Typer(
    cls=_WithDefault,
    help="Run a plan of many cases, and show its results.",
    no_args_is_help=True,
    rich_markup_mode=None,
    epilog=examples(
        "isolation-sim sweep new my_plan.toml",
        "isolation-sim sweep my_plan.toml",
        "isolation-sim sweep show results/my_plan",
    ),
)


@app.command(
    "run",
    epilog=examples(
        "isolation-sim sweep new my_plan.toml",
        "isolation-sim sweep my_plan.toml --out my_sweep",
        "isolation-sim sweep my_plan.toml --out my_sweep --resume",
        "isolation-sim sweep my_plan.toml --scheduler tcp://10.0.0.1:8786",
    ),
)
def run_plan(
    plan: Annotated[Path, typer.Argument(help="The plan, TOML.")],
    out: DefaultOut = None,
    resume: Annotated[
        bool,
        typer.Option("--resume", help="Continue an interrupted sweep; run failed cases again."),
    ] = False,
    workers: Workers = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a Dask scheduler to run the sweep on.")
    ] = None,
    overwrite: Overwrite = False,
    export: Export = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Run a plan; the word ``run`` can be left out."""
    from ..io.results_folder import write_contents
    from ..reports.sweep_tables import controllers_table
    from ..reports.tables import standard_console
    from ..sweeps.design import Design
    from ..sweeps.plan import SweepPlan
    from ..sweeps.run import default_folder, run_design

    design = Design(SweepPlan.read(plan), str(plan))
    folder = default_folder(design.plan) if out is None else out
    check_exports(export, None if overwrite else folder)
    start = time.perf_counter()

    def announce(expected: Estimate) -> None:
        if not (quiet or as_json):
            print(_estimate_text(expected, None if scheduler else workers or os.cpu_count() or 1))

    try:
        with resumable(folder, overwrite, resume, quiet, design.n_runs, alike=True) as step:
            step("measuring")
            result = run_design(
                design, folder, resume=resume, workers=workers, scheduler=scheduler,
                announce=announce, progress=count_failures(step),
            )  # fmt: skip
    except OSError as error:
        raise InputError(
            f"{error.filename or folder}: {error.strerror or error}; finished runs are saved. "
            "Free some disk space, then continue with --resume"
        ) from None
    report = result.folder / "report.html"
    if not report.exists():
        result.to_html(report)
        write_contents(result.folder, f"Sweep {result.name}")
    if as_json:
        print(json_text(_report(result, time.perf_counter() - start)))
    elif not quiet:
        standard_console().print(controllers_table(result))
    _print_failures(result)
    for warning in result.warnings():
        print_warning(warning)
    print_results(result.folder, as_json, quiet)
    write_exports(export, Path(result.folder))
    if set(result.counts) - {"ok"}:
        raise typer.Exit(1)


@app.command(
    epilog=examples(
        "isolation-sim sweep show my_sweep",
        "isolation-sim sweep show my_sweep --criterion rms_drift_m --csv table.csv",
    )
)
def show(
    folder: Annotated[Path, typer.Argument(help="Folder of a sweep, finished or unfinished.")],
    criterion: Annotated[
        str, typer.Option(help="Criterion to show.")
    ] = "peak_floor_acceleration_m_s2",
    x: Annotated[
        str | None, typer.Option(help="Varied quantity on the map's horizontal axis.")
    ] = None,
    y: Annotated[
        str | None, typer.Option(help="Varied quantity on the map's vertical axis.")
    ] = None,
    best: Annotated[int, typer.Option(help="Number of best runs to print.")] = 5,
    csv: Annotated[Path | None, typer.Option(help="File for the table (CSV).")] = None,
    figures: Annotated[
        Path | None,
        typer.Option(help="Folder for report and figures; the sweep's folder by default."),
    ] = None,
    draw: Annotated[
        bool, typer.Option("--draw/--no-draw", help="Draw figures and write the report.")
    ] = True,
    force: Force = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="Print only errors and warnings.")] = False,
) -> None:
    """Print and draw the results of a sweep: medians, maps, sensitivities and the best runs.

    Existing figures and reports are replaced only with --force.
    """
    from ..io.results_folder import update_contents
    from ..sweeps import Sweep

    result = Sweep(folder)
    if figures is not None and figures.is_file():
        raise InputError(f"--figures {figures}: a file; expected: a folder")
    check_new_files(force, csv)
    if figures is not None and (figures / "report.html").exists() and not force:
        raise InputError(
            f"{figures / 'report.html'}: exists; expected: a new folder, or --force to replace it"
        )
    if draw:
        check_writable(figures or folder)
    sensitivity = _print_tables(result, criterion, best, quiet)
    _print_failures(result)
    for warning in result.warnings():
        print_warning(warning)

    def print_line(line: str) -> None:
        if not quiet:
            print(line)

    if csv is not None:
        print_line(f"table: {result.to_csv(csv)}")
    if not draw:
        return
    plots = _plots(result, criterion, x, y, sensitivity)
    for line in _write_plots(plots, figures or folder / "figures", force):
        print_line(line)
    page = (figures or folder) / "report.html"
    if force or not page.exists():
        print_line(f"report: {result.to_html(page, criterion)}")
    else:
        print_line(f"report: {page} (unchanged; --force replaces it)")
    if figures is None:
        update_contents(folder)


def _print_tables(result: Sweep, criterion: str, best: int, quiet: bool) -> bool:
    """Print medians, best runs and sensitivities; return whether there are sensitivities."""
    from ..reports.sweep_tables import best_table, controllers_table, sensitivity_table
    from ..reports.tables import standard_console

    console = standard_console()
    console.quiet = quiet
    console.print(controllers_table(result))
    console.print(best_table(result, criterion, best))
    if not result.finished or not result.sampled:
        return False
    for label in result.controllers:
        try:
            console.print(sensitivity_table(result, criterion, label))
        except InputError as error:
            # the rest of the page does not depend on it
            console.print(f"no sensitivity: {error}")
            return False
    return True


def _plots(
    result: Sweep, criterion: str, x: str | None, y: str | None, sensitivity: bool
) -> dict[str, Callable[[], Any]]:
    """Functions that draw the figures of a sweep, by the name of the file."""
    plots: dict[str, Callable[[], Any]] = {"comparison": result.plot_comparison}
    numbers = [name for name in result.parameters if result.table[name].dtype.kind in "if"]
    if len(numbers) > 1 or x or y:
        plots["map"] = lambda: result.plot_map(x, y, criterion)
    if sensitivity:
        plots["sensitivity"] = lambda: result.plot_sensitivity(criterion)
    return plots


def _write_plots(plots: dict[str, Callable[[], Any]], folder: Path, force: bool) -> Iterator[str]:
    """Write the figures that are missing, or all with ``force``; yield a line for each file."""
    from ..reports.style import save

    for name, plot in plots.items():
        if force or not (folder / f"{name}.svg").exists():
            yield from (f"figure: {path}" for path in save(plot(), folder, name))
        else:
            yield f"figure: {folder / name}.svg (unchanged; --force replaces it)"


@app.command("new", epilog=examples("isolation-sim sweep new my_plan.toml"))
def new_plan(
    path: Annotated[Path, typer.Argument(help="File to write.")] = Path("sweep.toml"),
    force: Force = False,
) -> None:
    """Write a commented plan as a starting point."""
    write_new_file(path, PLAN, force)
    print(f"wrote {path}; run it with: isolation-sim sweep {path}")


def _estimate_text(expected: Estimate, processes: int | None) -> str:
    """Runs, time and disk space of a sweep, in one line."""
    where = "on one processor, less on the cluster"
    if processes is not None:
        where = f"on {processes} process{'es' * (processes > 1)}"
    return (
        f"{expected.n_runs:,} runs ({expected.n_cases:,} cases): about "
        f"{_duration_text(expected.seconds / (processes or 1))} {where}, "
        f"{expected.size / 1e6:.1f} MB"
    )


def _duration_text(seconds: float) -> str:
    if seconds < 90:
        return f"{max(seconds, 1):.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def _report(result: Sweep, seconds: float) -> dict[str, Any]:
    return {
        "name": result.name,
        "folder": str(result.folder),
        "runs": sum(result.counts.values()),
        "status": result.counts,
        "seconds": round(seconds, 3),
        "warnings": result.warnings(),
    }


def _print_failures(result: Sweep) -> None:
    """Print the number of failed runs and the most frequent reasons."""
    if not set(result.counts) - {"ok"}:
        return
    print(f"{len(result.failed)} of {len(result.table)} runs failed:", file=sys.stderr)
    groups = sorted(result.failed.groupby(["status", "reason"]), key=lambda one: -len(one[1]))
    for (status, reason), rows in groups[:5]:
        more = f" and {len(rows) - 1} more" if len(rows) > 1 else ""
        print(f"  case {rows['case'].iloc[0]}{more}: {status}: {reason}", file=sys.stderr)
    if "error" in result.counts:
        print("--resume runs the cases with an error again", file=sys.stderr)
