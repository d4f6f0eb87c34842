"""The command ``isolation-sim tune``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import InputError
from ..io.json_text import json_text
from .common_options import (
    AsJson,
    Export,
    Overwrite,
    Quiet,
    check_exports,
    examples,
    print_path,
    print_results,
    resumable,
    write_exports,
)

EXAMPLES = examples(
    "isolation-sim tune clipped_lqr --out my_tuning",
    "isolation-sim tune clipped_lqr --out my_tuning --resume",
    "isolation-sim tune my_controllers.py:Outwards --scenario my_scenario.toml",
    "isolation-sim tune on_off --fix rule=skyhook --motions mixture:40 --unseen my_records",
    "isolation-sim tune fuzzy --criterion peak_drift_m=1 --criterion rms_drift_m=0.5",
)


def tune(
    controller: Annotated[
        str, typer.Argument(help="isolation-sim list controllers, or file.py:CLASS.")
    ],
    scenario: Annotated[
        Path | None,
        typer.Option(help="Scenario with plant, driver and sensors; the main job by default."),
    ] = None,
    motions: Annotated[
        str,
        typer.Option(
            help="Motions for tuning: mixture, mixture:COUNT, scenario, or a folder of records."
        ),
    ] = "mixture",
    unseen: Annotated[
        list[str] | None,
        typer.Option(help="Motions for evaluation; may be repeated. Another mixture by default."),
    ] = None,
    criterion: Annotated[
        list[str] | None,
        typer.Option(help="Criterion and weight, as peak_drift_m=1; may be repeated."),
    ] = None,
    setting: Annotated[
        list[str] | None,
        typer.Option(help="Setting to tune; may be repeated. All with a search range by default."),
    ] = None,
    fix: Annotated[
        list[str] | None,
        typer.Option(help="Setting to hold constant, as rule=skyhook; may be repeated."),
    ] = None,
    evaluations: Annotated[int, typer.Option(help="Largest number of candidates.")] = 400,
    seed: Annotated[int, typer.Option(help="Random seed of search, mixtures and intervals.")] = 0,
    pga_g: Annotated[
        float | None,
        typer.Option(help="Peak acceleration of records from folders after scaling, g."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Results folder; results/tune-NAME by default.")
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue an interrupted tuning.")
    ] = False,
    workers: Annotated[
        int | None, typer.Option(help="Threads or processes; one per processor by default.")
    ] = None,
    overwrite: Overwrite = False,
    export: Export = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Tune a controller on some motions and evaluate it on other motions."""
    from ..io.results_folder import file_name
    from ..tuning.tune import tune as run_tune

    check_exports(export, out)
    folder = out or Path("results") / f"tune-{file_name(controller.rpartition(':')[2])}"
    options: dict[str, Any] = {} if unseen is None else {"unseen": {each: each for each in unseen}}
    with resumable(folder, overwrite, resume, quiet, evaluations) as step:
        result = run_tune(
            controller, scenario, motions=motions, **options,
            criteria=_weights(criterion) if criterion else None, settings=setting,
            fixed=dict(_pair(text, "--fix", "rule=skyhook") for text in fix or ()),
            evaluations=evaluations, seed=seed, pga_g=pga_g, out=folder, resume=resume,
            workers=workers, progress=step,
        )  # fmt: skip
    if as_json:
        print(json_text(result.to_dict()))
    elif not quiet:
        result.report()
    print_path("tuned controller", folder / "controller.toml", as_json)
    print_results(folder, as_json, quiet)
    write_exports(export, folder)


def _pair(text: str, option: str, example: str) -> tuple[str, Any]:
    """Read NAME=VALUE; the value is a number, true, false or a word."""
    name, equals, value = (part.strip() for part in text.partition("="))
    if not (name and equals and value):
        raise InputError(f"{option} {text}: expected: a name and a value, such as {example}")
    try:
        return name, json.loads(value)
    except ValueError:
        return name, value


def _weights(texts: list[str]) -> dict[str, float]:
    pairs = dict(_pair(text, "--criterion", "peak_drift_m=1") for text in texts)
    for name, weight in pairs.items():
        if isinstance(weight, bool) or not isinstance(weight, int | float):
            raise InputError(f"--criterion {name}={weight}: expected: a number, as {name}=1")
    return pairs
