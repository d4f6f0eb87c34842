"""Moat wall: response of the building when the base hits the wall around it.

The wall is an element between ground and base that has a gap and no force within it: a spring of
no stiffness with an end stop around it. It is elastic: it is not crushed, and an impact costs no
energy.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from isolation_sim.written_names import as_written

from .study import NEAR_FAULT, Outcome, Step, published_entry, swept

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

TITLE = "Moat wall impact"
CONTROLLERS = ("passive_off", "passive_on", "clipped_lqr")
SHORT = ("passive_off", "clipped_lqr")
"""So few runs that they are not computed side by side, which would be compiled for them."""
WIDE = 2.0
"""Gap that no run here reaches, m: the building without a wall."""
WALL = {"stiffness": 1e9, "exponent": 1.0}
"""N/m: a concrete wall with soil behind it, far stiffer than the isolators."""
ACCELERATION = "peak_floor_acceleration_m_s2"
DISPLACEMENT = "peak_base_displacement_m"


def plan(short: bool) -> dict[str, Any]:
    """Return the sweep's plan."""
    gaps = [0.2, 0.3] if short else np.arange(0.1, 0.4001, 0.025).round(3).tolist()
    wall = {
        "name": "wall", "direction": "base", "law": "linear", "parameters": {"k": 0.0},
        "length_scale": 1.0, "force_scale": 1.0,
        "effect": [{"name": "end_stop", "form": "power", "gap": WIDE, **WALL}],
    }  # fmt: skip
    return {
        "name": "moat wall",
        "scenario": {
            "ground": NEAR_FAULT,
            "element": [wall],
            "controller": [published_entry(n) for n in (SHORT if short else CONTROLLERS)],
        },
        "vary": [
            {"field": "ground.scale_factor", "label": "scale",
             "values": [1.0] if short else [0.5, 0.75, 1.0, 1.25]},
            {"field": "element.effect.parameters.gap", "label": "gap_m", "values": [*gaps, WIDE]},
        ],
    }  # fmt: skip


def outcome(folder: Path, short: bool, step: Step) -> Outcome:
    """Run the study."""
    runs = swept(plan(short), folder, step).table
    free = runs[runs["gap_m"] == WIDE].set_index(["scale", "controller"])
    key = list(zip(runs["scale"], runs["controller"], strict=True))
    runs["amplification"] = runs[ACCELERATION] / free.loc[key, ACCELERATION].to_numpy()
    runs["room"] = runs["gap_m"] / free.loc[key, DISPLACEMENT].to_numpy()
    table = [
        {
            "scale": float(scale),
            "controller": str(name),
            "room_needed_m": float(free.loc[(scale, name), DISPLACEMENT]),
            "acceleration_without_wall_m_s2": float(free.loc[(scale, name), ACCELERATION]),
            "largest_amplification": float(rows["amplification"].max()),
            "at_gap_m": float(rows.loc[rows["amplification"].idxmax(), "gap_m"]),
        }
        for (scale, name), rows in runs.groupby(["scale", "controller"], sort=False)
    ]
    return Outcome(table, _finding(runs, table), {"amplification": _figure(runs)})


def _finding(runs: pandas.DataFrame, table: Sequence[dict[str, Any]]) -> str:
    full = [row for row in table if row["scale"] == 1.0]
    rooms = ", ".join(
        f"{as_written(row['controller'])} {row['room_needed_m'] * 1e3:.0f} mm" for row in full
    )
    hits = runs[runs["room"] < 1]
    # a gap that is only just too narrow, and one far too narrow
    near, far = hits[hits["room"] >= 0.8], hits[hits["room"] < 0.6]
    said = [
        f"{how}, an impact multiplies the floor acceleration by "
        f"{rows['amplification'].median():.1f} ({rows['amplification'].min():.1f} to "
        f"{rows['amplification'].max():.1f}; runs: {len(rows)})"
        for how, rows in (
            ("Where the gap is 80 to 100 % of this displacement", near),
            ("where it is below 60 %", far),
        )
        if len(rows)
    ]
    worst = max(table, key=lambda row: row["largest_amplification"])
    walled = runs[(runs["scale"] == 1.0) & (runs["gap_m"] < WIDE)]
    best = walled.loc[walled.groupby("gap_m")[ACCELERATION].idxmin()]
    wins = "; ".join(
        f"{as_written(name)} at " + ", ".join(f"{gap * 1e3:.0f}" for gap in rows["gap_m"])
        for name, rows in best.groupby("controller", sort=False)
    )
    return (
        f"Without a wall the near-fault pulse displaces the base by: {rooms}. {'; '.join(said)}. "
        f"The worst case is {as_written(worst['controller'])} at {worst['scale']:g} times the "
        f"pulse and a gap of {worst['at_gap_m'] * 1e3:.0f} mm, with "
        f"{worst['largest_amplification']:.1f} times the acceleration without a wall. The "
        f"controller with the smallest floor acceleration depends on the gap: {wins} mm."
    )


def _figure(runs: pandas.DataFrame) -> Figure:
    from matplotlib.ticker import LogFormatter

    from isolation_sim.reports.style import (
        DOUBLE_COLUMN,
        label_outer,
        legend,
        line_styles,
        new_figure,
        style,
    )

    scales, names = sorted(runs["scale"].unique()), list(runs["controller"].unique())
    with style():
        figure = new_figure(DOUBLE_COLUMN, 2.9)
        panels = figure.subplots(1, len(names), sharey=True)
        looks = line_styles(len(scales), markers=True)
        for axes, name in zip(panels, names, strict=True):
            for scale, look in zip(scales, looks, strict=True):
                rows = runs[(runs["controller"] == name) & (runs["scale"] == scale)]
                walled = rows[rows["gap_m"] < WIDE].sort_values("gap_m")
                axes.plot(1e3 * walled["gap_m"], walled[ACCELERATION],
                          label=f"{scale:g} of the pulse", **look)  # fmt: skip
                free = float(rows[rows["gap_m"] == WIDE][ACCELERATION].iloc[0])
                axes.axhline(free, color=look["color"], linewidth=0.5, linestyle=":")
            axes.set(xlabel="gap, mm", ylabel="peak floor acceleration, m/s²",
                     title=as_written(name), yscale="log")  # fmt: skip
            axes.yaxis.set_major_formatter("{x:g}")
            axes.yaxis.set_minor_formatter(LogFormatter())
        label_outer(panels.tolist(), len(names))
        legend(figure, panels[0], "outside upper center")
    return figure
