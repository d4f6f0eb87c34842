"""The command ``isolation-sim evaluate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..io.files import check_new_files
from .common_options import (
    AsJson,
    Force,
    Quiet,
    ReportFile,
    TestsFolder,
    examples,
    print_result,
    write_report,
)

EXAMPLES = examples(
    "isolation-sim evaluate fitted.toml my_tests",
    "isolation-sim evaluate results/diagnosis/extended_law.toml my_tests --report errors.html",
)


def evaluate(
    law: Annotated[
        Path,
        typer.Argument(help="File of a law, as fit --out and diagnose write it, or their folder."),
    ],
    campaign: TestsFolder,
    report: ReportFile = None,
    force: Force = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Compute the errors of a saved law on measured runs, without fitting."""
    from ..api import evaluate as run_evaluation

    check_new_files(force, report)
    result = run_evaluation(law, campaign)
    print_result(result, as_json, quiet)
    if report is not None:
        write_report(report, result.to_html, as_json)
