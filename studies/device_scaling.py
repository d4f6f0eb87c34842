"""Size and number of the isolators.

An isolator ``s`` times as large as the tested one carries ``s`` times the deformation and ``s²``
times the force at the same strain and stress; ``n`` of them stand under the reference building.
Pairs of the same ``n s`` have the same stiffness and so the same period; the larger ones are
strained less.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from isolation_sim.structures.reference import FORCE_SCALE, ISOLATED_PERIOD, LENGTH_SCALE
from isolation_sim.written_names import as_written

from .study import MOTIONS, Outcome, Step, along_motions, published_entry, swept

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

TITLE = "Size and number of the isolators"
CONTROLLERS = ("passive_off", "passive_on", "clipped_lqr")
SHOWN = "clipped_lqr"
FIRST = next(iter(MOTIONS))
TESTED = 8e-3
"""Largest deformation that the tests covered, m, of the isolator as it was tested."""
REFERENCE_COUNT = FORCE_SCALE / LENGTH_SCALE**2
"""Isolators of the reference building's size that carry it."""
ACCELERATION = "peak_floor_acceleration_m_s2"
DISPLACEMENT = "peak_base_displacement_m"


def plan(short: bool) -> dict[str, Any]:
    """Return the sweep's plan."""
    sizes = [10, 30] if short else np.geomspace(5, 30, 13).round(2).tolist()
    return {
        "name": "device scaling",
        "scenario": {"controller": [published_entry(name) for name in CONTROLLERS]},
        "vary": [
            along_motions(MOTIONS),
            {"field": "isolator", "label": "size", "names": [str(size) for size in sizes],
             "values": [{"length_scale": size, "force_scale": size**2} for size in sizes]},
            {"field": "isolator.count", "label": "count", "low": 6.0, "high": 96.0,
             "count": 3 if short else 13, "spacing": "log"},
        ],
    }  # fmt: skip


def period(size: Any, count: Any) -> Any:
    """Isolation period at 1.5 A and small vibrations, s."""
    return ISOLATED_PERIOD * np.sqrt(LENGTH_SCALE * REFERENCE_COUNT / (size * count))


def outcome(folder: Path, short: bool, step: Step) -> Outcome:
    """Run the study."""
    runs = swept(plan(short), folder, step).table
    runs["size"] = runs["size"].astype(float)
    runs["strain"] = runs[DISPLACEMENT] / (runs["size"] * TESTED)
    runs["rubber"] = runs["count"] * runs["size"] ** 3
    table = []
    for (motion, name), rows in runs.groupby(["motion", "controller"], sort=False):
        within = rows[rows["strain"] <= 1]
        for what, column in (("least rubber", "rubber"), ("least shaken floors", ACCELERATION)):
            if within.empty:
                continue
            best = within.loc[within[column].idxmin()]
            size, count = float(best["size"]), float(best["count"])
            table.append({
                "motion": motion, "controller": name, "design": what, "size": size,
                "count": count, "period_s": float(period(size, count)),
                DISPLACEMENT: float(best[DISPLACEMENT]), ACCELERATION: float(best[ACCELERATION]),
            })  # fmt: skip
    return Outcome(table, _finding(runs, table), {"designs": _figure(runs)})


def _finding(runs: pandas.DataFrame, table: Sequence[dict[str, Any]]) -> str:
    shown = runs[runs["controller"] == SHOWN]
    sentences = []
    for motion in MOTIONS:
        rows = shown[shown["motion"] == motion]
        within = rows[rows["strain"] <= 1]
        text = (
            f"Under the {motion} motion {100 * len(within) / len(rows):.0f} % of the designs stay "
            "within the tested strain"
        )
        if len(within):
            text += f", none smaller than {within['size'].min():.3g} times the tested isolator"
        here = [r for r in table if r["motion"] == motion and r["controller"] == SHOWN]
        for row in here:
            text += (
                f"; {row['design']}: {row['count']:.3g} of {row['size']:.3g} times "
                f"({row['period_s']:.2g} s, {row[DISPLACEMENT] * 1e3:.0f} mm, "
                f"{row[ACCELERATION]:.2g} m/s²)"
            )
        sentences.append(text + ".")
    sentences.append(_same_period(shown))
    return f"With {as_written(SHOWN)}: " + " ".join(sentences)


def _same_period(shown: pandas.DataFrame) -> str:
    """What size alone does: designs of about one stiffness, the smallest and the largest ones."""
    far = shown[shown["motion"] == FIRST]
    product = far["size"] * far["count"]
    target = LENGTH_SCALE * REFERENCE_COUNT
    alike = far[np.abs(np.log(product / target)) < 0.13].sort_values("size")
    if len(alike) < 2:
        return ""
    small, large = alike.iloc[0], alike.iloc[-1]
    moved, shaken = (100 * (large[name] / small[name] - 1) for name in (DISPLACEMENT, ACCELERATION))
    return (
        f"At one stiffness (about {ISOLATED_PERIOD:g} s, {FIRST}) {large['count']:.2g} "
        f"isolators of {large['size']:.3g} times instead of {small['count']:.2g} of "
        f"{small['size']:.3g} times take {large['rubber'] / small['rubber']:.1f} times the rubber "
        f"and strain it {small['strain'] / large['strain']:.1f} times less, which changes the base "
        f"displacement by {moved:+.0f} % and the floor acceleration by {shaken:+.0f} %. The weight "
        "that the isolators can carry is not considered."
    )


def _figure(runs: pandas.DataFrame) -> Figure:
    from isolation_sim.reports.style import (
        DOUBLE_COLUMN,
        contour_lines,
        label_outer,
        light_shades,
        new_figure,
        style,
    )

    with style():
        figure = new_figure(DOUBLE_COLUMN, 3.3)
        panels = figure.subplots(1, 2)
        for axes, motion in zip(panels, MOTIONS, strict=True):
            rows = runs[(runs["motion"] == motion) & (runs["controller"] == SHOWN)]
            cells = {
                key: rows.pivot(index="count", columns="size", values=key)
                for key in (ACCELERATION, "strain")
            }
            size, count = cells["strain"].columns.to_numpy(), cells["strain"].index.to_numpy()
            image = axes.contourf(size, count, cells[ACCELERATION], 12, cmap=light_shades())
            contour_lines(
                axes, size, count, cells["strain"], [0.5, 1, 2, 4], "%g of tested", linewidths=1.0
            )
            periods = period(size[np.newaxis], count[:, np.newaxis])
            contour_lines(
                axes, size, count, periods, [1, 1.5, 2, 3, 4], "%g s", linestyles="dashed"
            )
            figure.colorbar(image, ax=axes, label="peak floor acceleration, m/s²")
            axes.set(title=motion, xlabel="size, times the tested isolator",
                     ylabel="number of isolators", xscale="log", yscale="log")  # fmt: skip
            for axis in (axes.xaxis, axes.yaxis):
                axis.set_major_formatter("{x:g}")
                axis.set_minor_formatter("")
            axes.set_xticks([5, 10, 20, 30])
            axes.set_yticks([6, 12, 24, 48, 96])
            axes.grid(False)
        label_outer(panels.tolist(), 2)
    return figure
