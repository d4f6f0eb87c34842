"""The command ``isolation-sim cite``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..io.files import json_text
from .common_options import AsJson, examples

if TYPE_CHECKING:
    from ..reports.references import Citation

EXAMPLES = examples("isolation-sim cite", "isolation-sim cite results/main_job --json")


def cite(
    what: Annotated[
        Path | None,
        typer.Argument(
            help="Results folder or scenario file; the main job by default.",
            metavar="[DIR|SCENARIO]",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Print the references of the methods behind a result."""
    from ..version import __version__

    citations = citations_of(what)
    if as_json:
        records = [{"reference": text, "used_for": list(uses)} for text, uses in citations]
        print(json_text({"version": __version__, "references": records}))
        return
    print(f"isolation-sim {__version__}; CITATION.cff says how to cite it.\n")
    for text, uses in citations:
        print(f"{text}\n    for: {', '.join(uses)}")


def citations_of(path: Path | None) -> list[Citation]:
    """References of a results folder or a scenario file; of the main job for None."""
    from ..api import load
    from ..discrepancy.diagnosis import Diagnosis
    from ..errors import InputError
    from ..identification.fitted import Fit
    from ..reports.references import of_device, of_scenarios
    from ..scenario import Scenario, main_job
    from ..sweeps.design import Design
    from ..sweeps.result import Sweep
    from ..sweeps.study import Study
    from ..sweeps.suites.result import Suite
    from ..tuning.tuning import Tuning

    if path is None:
        return of_scenarios([main_job()])
    if not path.is_dir() or (path / "scenario.toml").is_file():
        return of_scenarios([Scenario.read(path / "scenario.toml" if path.is_dir() else path)])
    inside = [result.parent for result in sorted(path.glob("*/scenario.toml"))]
    remedy = f", such as {inside[0]}" if inside else "; isolation-sim run makes one"
    expected = f"expected: a scenario file or a results folder{remedy}"
    try:
        result = load(path)
    except InputError:
        raise InputError(f"{path}: holds no result; {expected}") from None
    runs = result.sweep if isinstance(result, Suite | Study) else result
    if isinstance(runs, Sweep):
        return of_scenarios(Design(runs.plan).scenarios())
    if isinstance(result, Tuning):
        plant = Scenario.from_toml(result.content["scenario"])
        tuned = Scenario.from_toml(result.scenario_section())
        return of_scenarios([plant.model_copy(update={"controller": tuned.controller})])
    if isinstance(result, Fit):
        return of_device(result.device)
    if isinstance(result, Diagnosis) and result.extended is not None:
        return of_device(result.extended)
    raise InputError(f"{path}: its results name no sources; {expected}")
