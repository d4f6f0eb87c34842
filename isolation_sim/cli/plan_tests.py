"""The command ``isolation-sim plan-tests``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..io.files import check_new_files
from .common_options import AsJson, Force, Quiet, examples, print_path, print_result

EXAMPLES = examples(
    "isolation-sim plan-tests results/diagnosis_of_my_tests",
    "isolation-sim plan-tests my_tests --out next_tests.csv",
)


def plan_tests(
    source: Annotated[
        Path, typer.Argument(help="Folder of a saved diagnosis of device tests, or of a campaign.")
    ],
    out: Annotated[Path | None, typer.Option(help="Test matrix to write, *.csv.")] = None,
    force: Force = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """List the next tests: those that tell confusable causes apart, and missing conditions."""
    from ..discrepancy.plan_tests import plan_tests as run_plan

    check_new_files(force, out)
    plan = run_plan(source)
    print_result(plan, as_json, quiet)
    if out is not None:
        print_path("test matrix", plan.to_csv(out), as_json)
