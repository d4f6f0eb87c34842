"""The command ``isolation-sim cite``."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .common_options import AsJson, examples

if TYPE_CHECKING:
    from ..scenario import Scenario

EXAMPLES = examples("isolation-sim cite", "isolation-sim cite results/main_job --json")


def cite(
    what: Annotated[
        Path | None,
        typer.Argument(
            help="Folder of a run, sweep, suite or tuning, or scenario file; the main job by "
            "default.",
            metavar="[DIR|SCENARIO]",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Print the references of the methods that a result used."""
    from ..reports.references import of_scenarios
    from ..version import __version__

    citations = of_scenarios(scenarios_of(what))
    if as_json:
        records = [{"reference": text, "used_for": list(uses)} for text, uses in citations]
        print(json.dumps({"version": __version__, "references": records}, indent=2))
        return
    print(f"isolation-sim {__version__}; its CITATION.cff says how to cite it.\n")
    for text, uses in citations:
        print(f"{text}\n    for: {', '.join(uses)}")


def scenarios_of(path: Path | None) -> Iterable[Scenario]:
    """Scenarios behind a results folder or in a file; the main job for None."""
    from ..api import load
    from ..errors import InputError
    from ..scenario import Scenario, main_job
    from ..sweeps.design import Design
    from ..sweeps.result import Sweep
    from ..sweeps.suites.result import Suite
    from ..tuning.tuning import Tuning

    if path is None:
        return [main_job()]
    if not path.is_dir() or (path / "scenario.toml").is_file():
        return [Scenario.read(path / "scenario.toml" if path.is_dir() else path)]
    inside = [result.parent for result in sorted(path.glob("*/scenario.toml"))]
    remedy = f", such as {inside[0]}" if inside else "; isolation-sim run makes one"
    expected = f"expected: a scenario file, or the folder of a run, sweep, suite or tuning{remedy}"
    try:
        result = load(path)
    except InputError:
        raise InputError(f"{path}: holds no result; {expected}") from None
    if isinstance(result, Suite):
        result = result.sweep
    if isinstance(result, Sweep):
        return Design(result.plan).scenarios()
    if isinstance(result, Tuning):
        plant = Scenario.from_toml(result.content["scenario"])
        tuned = Scenario.from_toml(result.scenario_section())
        return [plant.model_copy(update={"controller": tuned.controller})]
    raise InputError(f"{path}: a {type(result).__name__.lower()}; {expected}")
