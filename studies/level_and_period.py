"""Current level and isolation period: displacement and acceleration of each pair.

The reference building, its isolators more or fewer, holds one current through a far-field and a
near-fault motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from isolation_sim.structures.reference import ISOLATED_PERIOD

from .study import MOTIONS, Outcome, Step, along_motions, swept

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

TITLE = "Current level and isolation period"
CRITERIA = {
    "peak_base_displacement_m": ("base displacement, mm", 1e3),
    "peak_floor_acceleration_m_s2": ("floor acceleration, m/s²", 1.0),
}
GAPS = (0.1, 0.15, 0.2, 0.3)
"""Room that the base may have, m."""
TESTED = 0.08
"""Largest deformation that the isolators' tests covered, m: 8 mm at ten times the size."""


def plan(short: bool) -> dict[str, Any]:
    """Return the sweep's plan."""
    count = 4 if short else 25
    periods = np.linspace(1.4, 3.8, count)
    return {
        "name": "level and period",
        "scenario": {"controller": [{"name": "constant", "amperes": 0.0}]},
        "vary": [
            along_motions(MOTIONS),
            # the period goes with the root of the mass over the isolators' number
            {"field": "isolator.count", "label": "count",
             "values": ((ISOLATED_PERIOD / periods) ** 2).tolist()},
            {"field": "controller.amperes", "label": "current_A", "low": 0.0, "high": 3.0,
             "count": count},
        ],
    }  # fmt: skip


def outcome(folder: Path, short: bool, step: Step) -> Outcome:
    """Run the study."""
    runs = swept(plan(short), folder, step).table
    runs["period_s"] = (ISOLATED_PERIOD / np.sqrt(runs["count"])).round(6)
    table = [row for motion in MOTIONS for gap in GAPS for row in _best(runs, motion, gap)]
    return Outcome(table, _finding(runs, table), {"maps": _figure(runs)})


def _best(runs: pandas.DataFrame, motion: str, gap: float) -> list[dict[str, Any]]:
    """Pair with the least floor acceleration whose base stays within a gap; none if none does."""
    within = runs[(runs["motion"] == motion) & (runs["peak_base_displacement_m"] <= gap)]
    if within.empty:
        return []
    best = within.loc[within["peak_floor_acceleration_m_s2"].idxmin()]
    return [
        {
            "motion": motion,
            "gap_m": gap,
            "period_s": float(best["period_s"]),
            "current_A": float(best["current_A"]),
            **{name: float(best[name]) for name in CRITERIA},
        }
    ]


def _finding(runs: pandas.DataFrame, table: Sequence[dict[str, Any]]) -> str:
    sentences = []
    for motion in MOTIONS:
        rows = runs[runs["motion"] == motion]
        periods = np.unique(rows["period_s"])
        period = periods[np.argmin(np.abs(periods - ISOLATED_PERIOD))]
        here = rows[rows["period_s"] == period].set_index("current_A")
        off, on = here.loc[0.0], here.loc[here.index.max()]
        moved, shaken = (100 * (on[name] / off[name] - 1) for name in CRITERIA)
        beyond = float(np.mean(rows["peak_base_displacement_m"] > TESTED))
        sentences.append(
            f"Under the {motion} motion, at a period of {period:.2g} s, 3 A instead of none "
            f"changes the base displacement by {moved:+.0f} % and the floor acceleration by "
            f"{shaken:+.0f} %; {_choices(motion, table)}. {100 * beyond:.0f} % of these runs go "
            f"beyond the {TESTED * 1e3:.0f} mm that the isolators were tested at."
        )
    return "\n".join(sentences)


def _choices(motion: str, table: Sequence[dict[str, Any]]) -> str:
    rows = [row for row in table if row["motion"] == motion]
    if not rows:
        return f"no pair keeps the base within {max(GAPS) * 1e3:.0f} mm"
    pairs = (
        f"{row['period_s']:.2g} s and {row['current_A']:.2g} A within {row['gap_m'] * 1e3:.0f} mm "
        f"({row['peak_floor_acceleration_m_s2']:.2g} m/s²)"
        for row in rows
    )
    return f"the floors are shaken least at {', '.join(pairs)}"


def _figure(runs: pandas.DataFrame) -> Figure:
    from isolation_sim.reports.style import (
        DOUBLE_COLUMN,
        contour_map,
        label_outer,
        new_figure,
        style,
    )

    with style():
        figure = new_figure(DOUBLE_COLUMN, 5.2)
        panels = figure.subplots(2, 2)
        for row, motion in zip(panels, MOTIONS, strict=True):
            for axes, (key, (title, factor)) in zip(row, CRITERIA.items(), strict=True):
                cells = runs[runs["motion"] == motion].pivot(
                    index="current_A", columns="period_s", values=key
                )
                values = cells.to_numpy() * factor
                image = contour_map(axes, cells.columns, cells.index, values, 20, 7)
                figure.colorbar(image, ax=axes)
                axes.set(title=f"{motion}: {title}", xlabel="isolation period at 1.5 A, s",
                         ylabel="current, A")  # fmt: skip
        label_outer(panels.ravel().tolist(), 2)
    return figure
