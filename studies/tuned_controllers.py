"""Classical controllers as published and as tuned, beside the best constant current.

All are tuned by `isolation-sim tune` with one budget on one mixture of random far-field motions and
near-fault pulses; ``studies/tuned`` holds what it found, with the command and the seeds. Judged is
on another mixture, on recorded components that no tuning saw, and on El Centro. Score: J, the peak
base displacement and the peak floor acceleration, each over its value without current, added, minus
the least J of any constant current under the same motion.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from controllers import controller
from isolation_sim.errors import InputError
from isolation_sim.scenario import Scenario
from isolation_sim.simulation.control import Control
from isolation_sim.tuning.intervals import MeanInterval, mean_interval
from isolation_sim.tuning.motions import Motions, MotionSet, motion_set
from isolation_sim.tuning.trials import CRITERIA, Trials

from .cache import cached_result
from .study import PUBLISHED, Outcome, Step, data_folder, published_entry

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TITLE = "Classical controllers, as published and as tuned"
TUNED = Path(__file__).with_name("tuned")
"""Scenario sections that ``isolation-sim tune`` wrote, one a controller, and the plant."""
PGA_G = 0.33
"""Peak to which recorded components are scaled, g."""
UNSEEN_SEED = 1
"""Of the unseen mixture: that of a tuning with the seed 0."""
AS_TUNED, OFF = "tuned", "no current"


def tuned_settings() -> dict[str, dict[str, Any]]:
    """Read what the tuning of each controller found.

    Returns
    -------
    dict of str to dict
        Settings by controller.
    """
    found = {}
    for path in sorted(TUNED.glob("*.toml")):
        for entry in Scenario.read(path).controller if path.stem != "reference" else ():
            found[entry.name] = dict(entry.settings)
    return found


def motions(short: bool) -> tuple[dict[str, MotionSet], str]:
    """Return the sets of motions to judge by, and what is absent.

    Parameters
    ----------
    short : bool
        Whether to take four motions of the mixture alone.

    Returns
    -------
    sets : dict of str to MotionSet
        By the name to print.
    absent : str
        Why the recorded components are left out; empty if they are not.
    """
    job = Scenario.read(TUNED / "reference.toml").build()
    if short:
        return {"mixture": motion_set("mixture:4", job, UNSEEN_SEED)}, ""
    given: dict[str, Motions] = {"mixture": "mixture:64", "El Centro": "scenario"}
    absent = ""
    try:
        given["recorded components"] = data_folder("benchmark_8_storey")
    except InputError as error:
        absent = str(error)
    return {name: motion_set(one, job, UNSEEN_SEED, PGA_G) for name, one in given.items()}, absent


def scores(group: MotionSet, entrants: dict[str, Control]) -> dict[str, list[float]]:
    """Score controllers under one set of motions; kept in the cache folder.

    Parameters
    ----------
    group : MotionSet
        Motions.
    entrants : dict of str to Control
        By any name.

    Returns
    -------
    dict of str to list of float
        A number a motion, by the same names.
    """

    def find() -> dict[str, Any]:
        job = Scenario.read(TUNED / "reference.toml").build()
        trials = Trials(job, group, CRITERIA, None)
        found = trials.scores(list(entrants.values())).tolist()
        return dict(zip(entrants, found, strict=True))

    given = {name: repr(one) for name, one in entrants.items()}
    return cached_result("tuned", f"{group.digest} {json.dumps(given)}".encode(), find)


def outcome(folder: Path, short: bool, step: Step) -> Outcome:
    """Run the study.

    Parameters
    ----------
    folder : pathlib.Path
        Not used: the runs are not kept.
    short : bool
        Whether to take two controllers and four motions.
    step : callable
        Told the share that has just been done.

    Returns
    -------
    Outcome
        Table: mean scores with 95 % intervals, a row a controller and set of motions.
    """
    found = tuned_settings()
    names = list(found)[: 2 if short else None]
    sets, absent = motions(short)
    entrants = {OFF: controller("passive_off")}
    for name in names:
        entrants |= {
            f"{name} {PUBLISHED}": controller(**published_entry(name)),
            f"{name} {AS_TUNED}": controller(name, **found[name]),
        }
    means: dict[tuple[str, str], MeanInterval] = {}
    table = []
    for motion, group in sets.items():
        each = scores(group, entrants)
        means |= {(motion, key): mean_interval(values) for key, values in each.items()}
        for name in names:
            tuned = np.array(each[f"{name} {AS_TUNED}"])
            row = {"motions": motion, "number": len(tuned), "controller": name}
            for what in (PUBLISHED, AS_TUNED):
                one = means[motion, f"{name} {what}"]
                row |= {what: one.mean, f"{what}_from": one.low, f"{what}_to": one.high}
            table.append(row | {"tuned_beats_constant_in": int(np.sum(tuned < 0))})
        step("running", 1 / len(sets))
    return Outcome(
        table, _finding(means, table, sets, absent), {"scores": _figure(means, names, sets)}
    )


def _finding(
    means: dict[tuple[str, str], MeanInterval], table: list[dict[str, Any]],
    sets: dict[str, MotionSet], absent: str,
) -> str:  # fmt: skip
    """Say what the table says, a paragraph a line."""
    told = [
        "The score is J minus that of the best constant current of each motion; intervals are 95 %."
    ]
    for motion in sets:
        rows = [row for row in table if row["motions"] == motion]
        beats = [row["controller"] for row in rows if row["tuned_to"] < 0]
        loses = [row["controller"] for row in rows if row["tuned_from"] > 0]
        worse = [row["controller"] for row in rows if row["tuned"] > row["published"]]
        first = min(rows, key=lambda row: row["tuned"])
        told.append(
            f"{motion[:1].upper()}{motion[1:]}: no current at all scores {means[motion, OFF]}. "
            f"Tuned, {', '.join(beats) or 'no controller'} surely beats the best constant current; "
            f"{', '.join(loses) or 'none'} surely does not. The least is that of "
            f"{first['controller']}, {means[motion, first['controller'] + ' ' + AS_TUNED]}, "
            f"published {means[motion, first['controller'] + ' ' + PUBLISHED]}. "
            f"Worse than published: {', '.join(worse) or 'none'}."
        )
    return "\n".join(told + ([f"Recorded components are left out: {absent}."] if absent else []))


def _figure(
    means: dict[tuple[str, str], MeanInterval], names: list[str], sets: dict[str, MotionSet]
) -> Figure:
    """Draw mean scores with their intervals, a panel a set of motions."""
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
        panels[0].set_yticks(range(len(names)), names)
        panels[0].invert_yaxis()
        legend(drawing, panels[0], "outside lower center")
    return drawing
