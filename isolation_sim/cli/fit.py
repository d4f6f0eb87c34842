"""The command ``isolation-sim fit``."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import InputError
from ..io.output_place import check_new_files
from .common_options import AsJson, Force, Quiet, examples, progress

if TYPE_CHECKING:
    from ..identification.fitted import Fit

EXAMPLES = examples(
    "isolation-sim fit my_tests --law kelvin_voigt",
    "isolation-sim fit my_tests --law bouc_wen --fix n=2 --fix A=1 --out fitted.toml",
)


def fit(
    campaign: Annotated[Path, typer.Argument(help="Folder with campaign.toml and its CSV files.")],
    law: Annotated[
        str, typer.Option(help="Law to fit, of isolation-sim list laws; auto takes the best.")
    ],
    current_degree: Annotated[
        int | None, typer.Option(help="Degree of the parameters' polynomials of the current.")
    ] = None,
    fixed: Annotated[
        list[str] | None,
        typer.Option("--fix", help="Parameter to hold, as name=value; may be repeated."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="File for the fitted law, a scenario's [isolator] section."),
    ] = None,
    starts: Annotated[int, typer.Option(help="Number of starts.")] = 20,
    figure: Annotated[
        Path | None, typer.Option(help="File stem for a figure of the loops (SVG and PNG).")
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(help="File for the report (HTML); beside --out if that is given."),
    ] = None,
    force: Force = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Fit a law to measured runs."""
    from ..identification.fit import fit as run_fit

    if report is None and out is not None:
        report = out.with_suffix(".html")
    if report is not None and report == out:
        raise InputError(
            f"--out {out}: the report is written there; expected: a file such as "
            f"{out.with_suffix('.toml')}"
        )
    kinds = ("svg", "png") if figure else ()
    figures = [Path(f"{figure}.{kind}") for kind in kinds]
    check_new_files(force, out, report, *figures)
    with progress(quiet, starts, alike=True) as step:
        step("searching")
        result = run_fit(
            campaign, law, current_degree=current_degree, fixed=_numbers(fixed or []),
            starts=starts, progress=lambda done: step("searching", done),
        )  # fmt: skip
    if as_json:
        print(json.dumps(result.report(), indent=2))
    elif not quiet:
        _show(result)
    where = sys.stderr if as_json else sys.stdout
    for path in (out, report, figure):
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
    if out is not None:
        print(f"fitted law: {result.save(out)}", file=where)
    if figure is not None:
        from ..reports.style import save

        for path in save(result.plot(), figure.parent, figure.name):
            print(f"figure: {path}", file=where)
    if report is not None:
        print(f"report: {result.to_html(report)}", file=where)


def _numbers(given: list[str]) -> dict[str, float]:
    numbers = {}
    for text in given:
        name, equals, value = text.partition("=")
        try:
            numbers[name.strip()] = float(value)
        except ValueError:
            equals = ""
        if not equals:
            raise InputError(f"--fix {text}: expected: a parameter and a number, such as n=2")
    return numbers


def _show(result: Fit) -> None:
    from ..reports.console import standard_console

    console = standard_console()
    for table in result.tables():
        console.print(table)
    for note in result.notes:
        console.print(f"note: {note}")
