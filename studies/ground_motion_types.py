"""Predictive control under recorded, near-fault and far-field ground motion.

A mean over motions of one kind hides the motions under which a controller does harm. ``mpc`` and
``trained_policy`` run under four kinds of motion: 14 recorded components, near-fault pulses, random
far-field motions of two processes, and El Centro 1940. Only the last one is of the process that
the settings of ``mpc`` were tuned on. Score: J, the peak base displacement and the peak floor
acceleration, each over its value without current, added, less that of the best constant current,
which knows the motion.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from controllers import Controller, controller
from ground_motions import (
    STANDARD_GRAVITY,
    Record,
    clough_penzien_motion,
    el_centro_1940,
    kanai_tajimi_motion,
    mavroeidis_papageorgiou_pulse,
    read,
)
from isolation_sim.errors import InputError

from . import controller_runs as runs
from .cache import cached_result
from .controllers import OBSERVING, PREVIEW, interval
from .study import Outcome, Step, data_folder

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TITLE = "Kinds of ground motion: where predictive control gains and where it loses"
PGA = 0.33 * STANDARD_GRAVITY
"""Of recorded and far-field motions, m/s^2."""
HARM = 0.02
"""J above that of the best constant current that counts as harm."""
RECORDED, NEAR_FAULT, FAR_FIELD, HOME = (
    "recorded", "near-fault pulse", "far field", "El Centro",
)  # fmt: skip
COUNT = 40
"""Pulses, and far-field motions."""
SEED = 700
"""Of the pulses; the far-field motions have this one and the next ones."""
PERIODS = (0.5, 6.0)
"""Shortest and longest pulse, s."""
SOILS = ("firm", "medium", "soft")
DEGRADED = {
    "noise, delay and 20 % too soft": "soft", "noise, delay and 20 % too stiff": "stiff",
    "passive rule": runs.PASSIVE,
}  # fmt: skip
"""Degraded conditions of controllers with sensors, on the recorded motions."""

Rows = list[dict[str, Any]]


def candidates(short: bool) -> dict[str, tuple[Controller, runs.Case]]:
    """Return the controllers to evaluate and their conditions, by the name to print."""
    ideal = runs.CASES[runs.NOMINAL]
    if short:
        return {"mpc": (controller("mpc"), ideal)}
    observing, policy = controller("mpc", **OBSERVING), controller("trained_policy")
    warned = f"{PREVIEW:g} s preview"
    return {
        "mpc": (controller("mpc"), ideal),
        "mpc, observing": (observing, ideal),
        f"mpc, {warned}": (controller("mpc", preview=PREVIEW), ideal),
        "trained policy": (policy, ideal),
        f"trained policy, {warned}": (controller("trained_policy", preview=PREVIEW), ideal),
    } | {
        f"{one}, {name}": (control, runs.CASES[case])
        for one, control in (("mpc, observing", observing), ("trained policy", policy))
        for name, case in DEGRADED.items()
    }


def recorded_components() -> dict[str, Record]:
    """Return both components of the benchmark building's records; none without shared data."""
    try:
        folder = data_folder("benchmark_8_storey")
    except InputError:
        return {}
    return {
        f"{path.stem} {component}": read(path, column=f"fault_{component}_m_s2").scaled_to_pga(PGA)
        for path in sorted(folder.glob("*.csv"))
        for component in ("normal", "parallel")
    }


def pulses(seed: int, count: int) -> dict[str, Record]:
    """Return near-fault velocity pulses of both signs.

    Their periods are spread evenly on a logarithmic scale; length, phase, strength and onset are
    drawn. The peak velocity is 0.25 to 0.7 m/s, the peak acceleration 0.5 g at most.
    """
    rng = np.random.default_rng(seed)
    shortest, longest = PERIODS
    motions = {}
    for k in range(count):
        period = shortest * (longest / shortest) ** ((k + rng.random()) / count)
        phase = rng.uniform(0.0, np.pi / 2) + np.pi * (k % 2)
        pulse = mavroeidis_papageorgiou_pulse(
            1.0, period, rng.uniform(1.2, 3.0), phase, before=rng.uniform(0.5, 3.0), after=12.0
        )
        factor = min(rng.uniform(0.25, 0.7) / pulse.pgv, 0.5 * STANDARD_GRAVITY / pulse.pga)
        motions[f"pulse of {'+-'[k % 2]}{period:.2f} s"] = pulse.scaled(factor)
    return motions


def far_field(seed: int, count: int) -> dict[str, Record]:
    """Return random motions of two processes on three soils."""
    motions = {}
    for k in range(count):
        soil, process = SOILS[k % 3], (clough_penzien_motion, kanai_tajimi_motion)[k // 3 % 2]
        name = process.__name__.removesuffix("_motion").replace("_", "-")
        motions[f"{name} {soil} {seed + k}"] = process(soil, duration=24.0, seed=seed + k, pga=PGA)
    return motions


def motions(short: bool) -> dict[tuple[str, str], Record]:
    """Return the ground motions by kind and name."""
    count = 2 if short else COUNT
    kinds = {
        RECORDED: {} if short else recorded_components(),
        NEAR_FAULT: pulses(SEED, count),
        FAR_FIELD: far_field(SEED, count),
        HOME: {} if short else {HOME: el_centro_1940()},
    }
    return {
        (kind, name): record.cut(0.0, min(8.0, record.duration)) if short else record
        for kind, some in kinds.items()
        for name, record in some.items()
    }


def score(one: Controller, record: Record, case: runs.Case) -> dict[str, float]:
    """Score one controller under one motion; it is kept in the cache folder."""

    def find() -> dict[str, float]:
        (row,) = runs.run_candidates({one.name: one}, record, case)
        return {key: float(row[key]) for key in ("base", "floor", "J", "constant")}

    content = np.append(record.acceleration, record.dt).tobytes() + f"{one!r} {case!r}".encode()
    return cached_result("ground_motion_types", content, find)


def scores(short: bool, step: Step) -> Rows:
    """Run every controller under every motion."""
    controllers, records = candidates(short), motions(short)
    tasks = {
        (kind, motion, name): (score, (one, record, case))
        for name, (one, case) in controllers.items()
        for (kind, motion), record in records.items()
        if case == runs.CASES[runs.NOMINAL] or kind in (RECORDED, HOME)
    }
    workers = 1 if short else os.cpu_count() or 1
    result = runs.in_processes(tasks, workers, lambda key: step(": ".join(key), 1 / len(tasks)))
    return [{"kind": key[0], "motion": key[1], "controller": key[2]} | result[key] for key in tasks]


def table(result: Rows) -> Rows:
    """Summarise the scores by kind of motion and controller."""
    rows = []
    groups = dict.fromkeys((row["kind"], row["controller"]) for row in result)
    for kind, name in groups:
        some = [row for row in result if (row["kind"], row["controller"]) == (kind, name)]
        over = np.array([row["J"] - row["constant"] for row in some])
        low, high = interval(over)
        worst = int(over.argmax())
        numbers = {
            "over_constant": over.mean(), "from": low, "to": high, "worst": over[worst],
            "J": np.mean([row["J"] for row in some]), "J_worst": max(row["J"] for row in some),
        }  # fmt: skip
        rows.append(
            {"kind": kind, "controller": name, "motions": len(some)}
            | {key: round(float(value), 3) + 0.0 for key, value in numbers.items()}
            | {"worst_motion": some[worst]["motion"], "harmed": int(np.sum(over > HARM))}
        )
    return rows


def finding(rows: Rows) -> str:
    """Describe the results of the table."""
    lines = [
        "J less that of the best constant current, which knows the motion: mean with 95 % bounds, "
        f"and motions with more than {HARM:g}."
    ]
    for name in dict.fromkeys(row["controller"] for row in rows):
        by_kind = "; ".join(
            f"{row['kind']} {row['over_constant']:+.3f} ({row['from']:+.3f} to {row['to']:+.3f}), "
            f"{row['harmed']} of {row['motions']}"
            + (f", worst {row['worst_motion']} {row['worst']:+.2f}" if row["harmed"] else "")
            for row in rows
            if row["controller"] == name
        )
        lines.append(f"{name}: {by_kind}.")
    return "\n".join(lines)


def figure(result: Rows) -> Figure:
    """Draw J less the best constant current's, motion by motion."""
    from isolation_sim.reports.style import DOUBLE_COLUMN, legend, line_styles, new_figure, style

    kinds = dict.fromkeys(row["kind"] for row in result)
    names = dict.fromkeys(row["controller"] for row in result)
    counts = [len({row["motion"] for row in result if row["kind"] == kind}) for kind in kinds]
    with style():
        drawing = new_figure(DOUBLE_COLUMN, 3.0)
        panels = drawing.subplots(
            1, len(kinds), sharey=True, squeeze=False, width_ratios=[n + 6 for n in counts]
        )[0]
        looks = line_styles(len(names), markers=True)
        for axes, kind in zip(panels, kinds, strict=True):
            for name, look in zip(names, looks, strict=True):
                over = [
                    row["J"] - row["constant"] for row in result
                    if (row["kind"], row["controller"]) == (kind, name)
                ]  # fmt: skip
                axes.plot(
                    np.arange(1, len(over) + 1), over, linestyle="", marker=look["marker"],
                    color=look["color"], markersize=3.5, label=name,
                )  # fmt: skip
            axes.axhline(0.0, color="0.6", linewidth=0.8, zorder=0)
            axes.set(title=kind, xlabel="motion", xticks=[])
        panels[0].set_ylabel("J above the best constant current's")
        legend(drawing, panels[0], "outside lower center")
    return drawing


def outcome(folder: Path, short: bool, step: Step) -> Outcome:
    """Run the study."""
    result = scores(short, step)
    rows = table(result)
    return Outcome(rows, finding(rows), {"ground_motion_types": figure(result)})
