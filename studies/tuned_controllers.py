"""Classical controllers as published and as tuned, beside the best constant current.

All are tuned by `isolation-sim tune` with one budget on one mixture of random far-field motions and
near-fault pulses; ``studies/tuned`` holds what it found, with the command and the seeds. Judged is
on another mixture and on recorded components, El Centro among them, that no tuning saw. Score: J,
the peak base displacement and the peak floor acceleration, each over its value without current,
added, minus the least J of any constant current under the same motion.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ground_motions import STANDARD_GRAVITY, el_centro_1940, read_folder
from isolation_sim.errors import InputError
from isolation_sim.scenario import Scenario
from isolation_sim.tuning.candidate_runs import Candidate
from isolation_sim.tuning.motions import MotionSet, motion_set
from isolation_sim.tuning.trials import CRITERIA, Trials
from isolation_sim.tuning.tuning import MARGIN, MeanInterval, mean_interval
from isolation_sim.written_names import as_written

from .cache import cached_result
from .study import PUBLISHED, Outcome, Step, data_folder, published_entry

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TITLE = "Classical controllers, as published and as tuned"
TUNED = Path(__file__).with_name("tuned")
"""Scenario sections that ``isolation-sim tune`` wrote, one per controller, and the plant."""
PGA_G = 0.33
"""Peak to which recorded components are scaled, g."""
UNSEEN_SEED = 1
"""Of the unseen mixture: that of a tuning with the seed 0."""
AS_TUNED, OFF = "tuned", "no current"


def tuned_settings() -> dict[str, dict[str, Any]]:
    """Read what the tuning of each controller found."""
    result = {}
    for path in sorted(TUNED.glob("*.toml")):
        for entry in Scenario.read(path).controller if path.stem != "reference" else ():
            result[entry.name] = dict(entry.settings)
    return result


def motions(short: bool) -> tuple[dict[str, MotionSet], str]:
    """Return the sets of motions for the evaluation, and what is absent."""
    job = Scenario.read(TUNED / "reference.toml").build()
    if short:
        return {"mixture": motion_set("mixture:4", job, UNSEEN_SEED)}, ""
    sets = {"mixture": motion_set("mixture:64", job, UNSEEN_SEED)}
    try:
        result = read_folder(data_folder("benchmark_8_storey"))
    except InputError as error:
        return sets, str(error)
    records = el_centro_1940(), *(one for each in result for one in each.components)
    scaled = [record.scaled_to_pga(PGA_G * STANDARD_GRAVITY) for record in records]
    return sets | {"recorded components": motion_set(scaled, job)}, ""


def scores(group: MotionSet, candidates: dict[str, Candidate]) -> dict[str, list[float]]:
    """Score controllers under one set of motions; kept in the cache folder."""

    def find() -> dict[str, Any]:
        trials = Trials(Scenario.read(TUNED / "reference.toml"), group, CRITERIA)
        result = trials.scores(list(candidates.values())).tolist()
        return dict(zip(candidates, result, strict=True))

    return cached_result("tuned", f"{group.digest} {json.dumps(candidates)}".encode(), find)


def _candidate(entry: Mapping[str, Any]) -> Candidate:
    """The controller of a scenario's entry."""
    return Candidate(entry["name"], {key: entry[key] for key in entry if key != "name"})


def outcome(folder: Path, short: bool, step: Step) -> Outcome:
    """Run the study."""
    result = tuned_settings()
    names = list(result)[: 2 if short else None]
    sets, absent = motions(short)
    candidates = {OFF: Candidate("passive_off", {})}
    for name in names:
        candidates |= {
            f"{name} {PUBLISHED}": _candidate(published_entry(name)),
            f"{name} {AS_TUNED}": Candidate(name, result[name]),
        }
    means: dict[tuple[str, str], MeanInterval] = {}
    table = []
    for motion, group in sets.items():
        each = scores(group, candidates)
        means |= {(motion, key): mean_interval(values) for key, values in each.items()}
        for name in names:
            tuned = np.array(each[f"{name} {AS_TUNED}"])
            row = {"motions": motion, "number": len(tuned), "controller": name}
            for what in (PUBLISHED, AS_TUNED):
                one = means[motion, f"{name} {what}"]
                row |= {what: one.mean, f"{what}_from": one.low, f"{what}_to": one.high}
            table.append(row | {"beats_constant": int(np.sum(tuned < -MARGIN))})
        step("running", 1 / len(sets))
    return Outcome(
        table, _finding(means, table, sets, absent), {"scores": _figure(means, names, sets)}
    )


def _finding(
    means: dict[tuple[str, str], MeanInterval], table: list[dict[str, Any]],
    sets: dict[str, MotionSet], absent: str,
) -> str:  # fmt: skip
    """Describe the results of the table, one paragraph per line."""
    sentences = [
        "The score is J minus that of the best constant current of each motion; intervals are 95 %."
    ]
    for motion in sets:
        rows = [row for row in table if row["motions"] == motion]
        beats = [as_written(row["controller"]) for row in rows if row["tuned_to"] < 0]
        loses = [as_written(row["controller"]) for row in rows if row["tuned_from"] > 0]
        worse = [as_written(row["controller"]) for row in rows if row["tuned"] > row["published"]]
        first = min(rows, key=lambda row: row["tuned"])
        sentences.append(
            f"{motion[:1].upper()}{motion[1:]}: no current at all scores {means[motion, OFF]}. "
            f"Tuned, surely better than the best constant current: {', '.join(beats) or 'none'}; "
            f"surely worse: {', '.join(loses) or 'none'}. The least tuned score is that of "
            f"{as_written(first['controller'])}, "
            f"{means[motion, first['controller'] + ' ' + AS_TUNED]}; as published it has "
            f"{means[motion, first['controller'] + ' ' + PUBLISHED]}. "
            f"Tuned worse than published: {', '.join(worse) or 'none'}."
        )
    return "\n".join(
        sentences + ([f"Recorded components are left out: {absent}."] if absent else [])
    )


def _figure(
    means: dict[tuple[str, str], MeanInterval], names: list[str], sets: dict[str, MotionSet]
) -> Figure:
    """Draw mean scores with their intervals, one panel per set of motions."""
    from isolation_sim.reports.style import DOUBLE_COLUMN, legend, line_styles, new_figure, style

    with style():
        drawing = new_figure(DOUBLE_COLUMN, 1.4 + 0.3 * len(names))
        panels = list(np.atleast_1d(drawing.subplots(1, len(sets), sharey=True)))
        for axes, motion in zip(panels, sets, strict=True):
            for k, look in enumerate(line_styles(2, markers=True)):
                what = (PUBLISHED, AS_TUNED)[k]
                each = [means[motion, f"{name} {what}"] for name in names]
                middle = np.array([one.mean for one in each])
                bars = np.abs([[one.mean - one.low, one.high - one.mean] for one in each]).T
                at = np.arange(len(names)) + 0.2 * (k - 0.5)
                axes.errorbar(
                    middle, at, xerr=np.nan_to_num(bars), label=what, capsize=1.5,
                    **(look | {"linestyle": ""}),
                )  # fmt: skip
            axes.axvline(means[motion, OFF].mean, color="0.5", linestyle=":", label=OFF)
            axes.axvline(0.0, color="0.3", linewidth=0.6)
            axes.set(title=motion, xlabel="J minus constant")
        panels[0].set_yticks(range(len(names)), list(map(as_written, names)))
        panels[0].invert_yaxis()
        legend(drawing, panels[0], "outside lower center")
    return drawing
