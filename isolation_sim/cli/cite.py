"""The command ``isolation-sim cite``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from .common_options import AsJson, examples

EXAMPLES = examples("isolation-sim cite", "isolation-sim cite results/main_job --json")


def cite(
    what: Annotated[
        Path | None,
        typer.Argument(
            help="Folder that a run left, or scenario file; the main job by default.",
            metavar="[DIR|SCENARIO]",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Print the references of the methods that a result used."""
    from ..reports.references import of_path
    from ..version import __version__

    citations = of_path(what)
    if as_json:
        records = [{"reference": text, "used_for": list(uses)} for text, uses in citations]
        print(json.dumps({"version": __version__, "references": records}, indent=2))
        return
    print(f"isolation-sim {__version__}; its CITATION.cff says how to cite it.\n")
    for text, uses in citations:
        print(f"{text}\n    for: {', '.join(uses)}")
