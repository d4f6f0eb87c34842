"""The command ``isolation-sim check``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..io.files import check_new_files, json_text
from .common_options import AsJson, Force, Quiet, ReportFile, examples, progress, write_report

EXAMPLES = examples(
    "isolation-sim check my_building.toml",
    "isolation-sim check my_building.toml --report check.html",
)


def check(
    scenario: Annotated[Path, typer.Argument(help="Scenario file with a [check] section.")],
    report: ReportFile = None,
    force: Force = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Check an isolated building by rules like ASCE 7-22, chapter 17; this is no certification."""
    from ..reports.code_check import check_page, console_table
    from ..reports.tables import standard_console
    from ..scenario import Scenario
    from ..sweeps.suites.prepare import motions_of

    check_new_files(force, report)
    settings = Scenario.read(scenario)
    rows = []
    with progress(quiet, 1) as step:
        motions = motions_of(settings, step)
        step("checking")
        isolated, check_rows = settings.check_rows(motions)
        for row in check_rows:
            step(f"{row.group}: {row.case}", 0)
            rows.append(row)
    if as_json:
        print(json_text([row._asdict() for row in rows], ensure_ascii=False))
    elif not quiet:
        standard_console().print(console_table(rows, settings.name))
    if report is not None:
        write_report(report, check_page(rows, isolated, settings.name).write, as_json)
