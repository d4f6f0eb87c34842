"""Ablations of the predictive controller: the contribution of each part.

Each is removed alone, without preview and with a preview time, on random motions that no
setting was tuned on; the difference in J, the peak base displacement and the peak floor
acceleration, each over its value without current, added, is paired motion by motion.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from controllers import Controller, controller

from . import controller_runs as runs
from .controllers import HOME, PREVIEW, interval, motions
from .study import Outcome, Step

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

TITLE = "Predictive control: ablations"
WHOLE = "as it is"
ABLATIONS: dict[str, dict[str, Any]] = {
    "slack weights on the peaks": {
        "displacement_excess": 0.0, "acceleration_excess": 0.0, "regret": 0.0,
    },
    "fading of the ground forecast": {"fading": None},
    "stiff start": {"stiff_start": 0.0},
    "unavoidable levels": {"displacement_level": 0.0, "acceleration_level": 0.0},
    "ground forecast": {"order": 0, "settling": None},
    "the return of the ground velocity alone": {"settling": None},
    "terminal cost": {"end": 0.0},
    "the terminal ground velocity alone": {"stop": 0.0},
    "horizon beyond 0.6 s": {"horizon": 0.6},
    "constraint tightening": {"margin": 0.0},
    "integration steps shorter than a decision": {"substep": 0.02},
    "the law (linear prediction)": {"model": "linear"},
}  # fmt: skip
"""What is taken away, and the settings without it."""
PREVIEWS = (0.0, 0.1, 0.2, 0.4, 0.8, 1.2)
"""Preview times, s."""
SHORT = ("slack weights on the peaks", "terminal cost")

Rows = list[dict[str, Any]]


def candidates(short: bool) -> dict[str, Controller]:
    """Return the controllers to compare, by what is removed and the preview time."""
    names = SHORT if short else tuple(ABLATIONS)
    compared: dict[str, Controller] = {}
    for preview in sorted({0.0, PREVIEW, *(() if short else PREVIEWS)}):
        compared[label(WHOLE, preview)] = controller("mpc", preview=preview)
    for preview in (0.0, PREVIEW):
        for name in names:
            compared[label(name, preview)] = controller("mpc", preview=preview, **ABLATIONS[name])
    return compared


def label(name: str, preview: float) -> str:
    """Name of a controller: what is removed, and its preview time in s."""
    return f"{name}, {preview:g} s"


def scores(short: bool, step: Step) -> tuple[dict[str, NDArray], NDArray]:
    """Run all of them under all random motions."""
    compared = candidates(short)
    records = {name: record for name, record in motions(short).items() if name != HOME}
    tasks = {
        name: (runs.run_candidates, (compared, record, runs.Case()))
        for name, record in records.items()
    }
    workers = 1 if short else os.cpu_count() or 1
    rows = runs.in_processes(tasks, workers, lambda name: step(name, 1 / len(tasks)))
    table = np.array([[row["J"] for row in rows[name]] for name in records])
    constant = np.array([rows[name][0]["constant"] for name in records])
    return dict(zip(compared, table.T, strict=True)), constant


def table(result: dict[str, NDArray], constant: NDArray) -> Rows:
    """Lay out the scores."""
    rows = []
    for name, own in result.items():
        taken, preview = name.rsplit(", ", 1)
        whole = result[f"{WHOLE}, {preview}"]
        row = {"without": taken, "preview_s": float(preview.removesuffix(" s")), "J": own.mean()}
        for what, other in (("lost", whole), ("over_constant", constant)):
            low, high = interval(own - other)
            row |= {what: (own - other).mean(), f"{what}_from": low, f"{what}_to": high}
        rows.append({k: round(float(v), 3) if k != "without" else v for k, v in row.items()})
    return rows


def outcome(folder: Path, short: bool, step: Step) -> Outcome:
    """Run the study."""
    result, constant = scores(short, step)
    rows = table(result, constant)
    return Outcome(rows, finding(rows, len(constant)), {"levers": figure(rows)})


def finding(rows: Rows, n_motions: int) -> str:
    """Describe the results of the table."""
    sentences = [
        f"J is the mean over {n_motions} random motions that no setting was tuned on; intervals "
        "are 95 %, bootstrapped over the motions."
    ]
    for preview in (0.0, PREVIEW):
        some = [row for row in rows if row["preview_s"] == preview]
        (whole,) = [row for row in some if row["without"] == WHOLE]
        kinds = {
            "helps": [row for row in some if row["lost_from"] > 0],
            "harms": [row for row in some if row["lost_to"] < 0],
            "not significant": [
                row for row in some
                if row is not whole and row["lost_from"] <= 0 <= row["lost_to"]
            ],
        }  # fmt: skip
        losses = "; ".join(
            f"{kind}: "
            + (", ".join(f"{row['without']} ({row['lost']:+.3f})" for row in among) or "nothing")
            for kind, among in kinds.items()
        )
        sentences.append(
            f"With {preview:g} s of preview J is {whole['over_constant']:+.3f} "
            f"({whole['over_constant_from']:+.3f} to {whole['over_constant_to']:+.3f}) from the "
            f"best constant current's. What the controller loses without each part: {losses}."
        )
    return " ".join(sentences)


def figure(rows: Rows) -> Figure:
    """Draw what is lost without each part, and J over the preview time."""
    from isolation_sim.reports.style import DOUBLE_COLUMN, legend, line_styles, new_figure, style

    with style():
        drawing = new_figure(DOUBLE_COLUMN, 3.0)
        left, right = drawing.subplots(1, 2, width_ratios=[3, 2])
        names = list(dict.fromkeys(r["without"] for r in rows if r["without"] != WHOLE))
        looks = line_styles(2, markers=True)
        for k, (preview, look) in enumerate(zip((0.0, PREVIEW), looks, strict=True)):
            some = {row["without"]: row for row in rows if row["preview_s"] == preview}
            at = np.arange(len(names)) + 0.15 * (1 - 2 * k)
            middle, low, high = (
                np.array([some[name][key] for name in names])
                for key in ("lost", "lost_from", "lost_to")
            )
            left.errorbar(
                middle, at, xerr=[middle - low, high - middle], linestyle="",
                marker=look["marker"], color=look["color"], markersize=4.5, capsize=2.5,
                label=f"{preview:g} s of preview" if preview else "no preview",
            )  # fmt: skip
        left.axvline(0.0, color="0.6", linewidth=0.8, zorder=0)
        left.set_yticks(np.arange(len(names)), names)
        left.invert_yaxis()
        left.set_xlabel("J lost without it")
        whole = sorted((r for r in rows if r["without"] == WHOLE), key=lambda r: r["preview_s"])
        times, middle, low, high = (
            np.array([row[key] for row in whole])
            for key in ("preview_s", "over_constant", "over_constant_from", "over_constant_to")
        )
        right.fill_between(times, low, high, color="0.85")
        right.plot(times, middle, "o-", color="black", markersize=4.5)
        right.axhline(0.0, color="0.6", linewidth=0.8)
        right.set(xlabel="preview time, s", ylabel="J minus that of the best constant current")
        legend(drawing, left, "outside lower center")
    return drawing
