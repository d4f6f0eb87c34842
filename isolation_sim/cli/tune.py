"""The command ``isolation-sim tune``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from .common_options import (
    AsJson,
    Export,
    Overwrite,
    Quiet,
    check_exports,
    examples,
    print_path,
    print_result,
    print_results,
    read_numbers,
    read_values,
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
    fixed = read_values(fix, "--fix", "rule=skyhook")
    folder = out or Path("results") / f"tune-{file_name(controller.rpartition(':')[2])}"
    options: dict[str, Any] = {} if unseen is None else {"unseen": {each: each for each in unseen}}
    with resumable(folder, overwrite, resume, quiet, evaluations) as step:
        result = run_tune(
            controller, scenario, motions=motions, **options,
            criteria=read_numbers(criterion, "--criterion", "peak_drift_m=1") or None,
            settings=setting,
            fixed={name: _value(text) for name, text in fixed.items()},
            evaluations=evaluations, seed=seed, pga_g=pga_g, out=folder, resume=resume,
            workers=workers, progress=step,
        )  # fmt: skip
    print_result(result, as_json, quiet)
    print_path("tuned controller", folder / "controller.toml", as_json)
    print_results(folder, as_json, quiet)
    write_exports(export, folder)


def _value(text: str) -> Any:
    """A number, true, false or a word."""
    try:
        return json.loads(text)
    except ValueError:
        return text
