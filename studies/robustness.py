"""Controllers with a wrong nominal model and a computation delay.

Each controller believes in isolators that are softer or stiffer than the true ones, by one factor
on the force, and its commands come late. The isolators switch either as the papers' laws say, where
a current that rises stiffens a stretched spring and so puts energy into the building, or by the
passive rule, where it does not. Score: the mean of both peaks, base displacement and floor
acceleration, each over its value with the coils off; the median over three motions.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from isolation_sim.scenario import Scenario
from isolation_sim.written_names import as_written

from .study import (
    EL_CENTRO,
    MOTIONS,
    Outcome,
    Step,
    along_motions,
    far_field,
    published_entry,
    swept,
)

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

TITLE = "Robustness of the controllers: nominal model error and computation delay"
CONTROLLERS = ("clipped_lqr", "clipped_lqg", "lyapunov", "sliding_mode")
PASSIVE = ("passive_off", "best_constant")
RULES = ("instantaneous", "passive")
GROUNDS = MOTIONS | {"random": far_field(1)}

LATE = 0.04
"""Delay at which the energies are looked at, s."""

Maps = dict[tuple[str, str], "pandas.DataFrame"]
"""By rule and controller the score over delay (rows, s) and nominal over true force."""


def plan(short: bool) -> dict[str, Any]:
    """Return the sweep's plan."""
    names = CONTROLLERS[:1] if short else CONTROLLERS
    grounds = dict(list(GROUNDS.items())[: 1 if short else None])
    factors = [0.5, 1.0] if short else [0.5, 0.6, 0.8, 1.0, 1.25, 1.6, 2.0]
    delays = [0.0, 0.04] if short else [0.0, 0.005, 0.01, 0.015, 0.02, 0.03, 0.04, 0.06, 0.08]
    return {
        "name": "robustness",
        "scenario": {"controller": [published_entry(name) for name in (*PASSIVE, *names)]},
        "vary": [
            along_motions(grounds),
            {"field": "isolator.switching", "label": "switching", "values": list(RULES)},
            {"field": "simulation.computation_delay_s", "label": "delay_s", "values": delays},
            {"field": "nominal.force_factor", "label": "nominal_force", "values": factors},
        ],
    }  # fmt: skip


def outcome(folder: Path, short: bool, step: Step) -> Outcome:
    """Run the study."""
    runs = swept(plan(short), folder, step).table
    peaks = ["normalised_peak_base_displacement", "normalised_peak_floor_acceleration"]
    runs["score"] = runs[peaks].mean(axis=1)
    over = runs.groupby(["switching", "controller", "delay_s", "nominal_force"])
    scores = over["score"].median()
    names = [name for name in runs["controller"].unique() if name not in PASSIVE]
    maps = {(rule, name): scores[rule, name].unstack() for rule in RULES for name in names}
    constant = float(scores[RULES[0], "best_constant"].median())
    table = [
        {
            "switching": rule, "controller": name, "right and prompt": float(cells.loc[0.0, 1.0]),
            f"{1e3 * cells.index.max():.0f} ms late": float(cells.loc[cells.index.max(), 1.0]),
            "softest nominal model": float(cells.loc[0.0, cells.columns.min()]),
            "stiffest nominal model": float(cells.loc[0.0, cells.columns.max()]),
            "worst": float(cells.to_numpy().max()),
            "better than constant": float(np.mean(cells.to_numpy() < constant)),
        }
        for (rule, name), cells in maps.items()
    ]  # fmt: skip
    return Outcome(table, _finding(maps, constant), {"maps": _figure(maps)})


def _finding(maps: Maps, constant: float) -> str:
    right = {key: float(cells.loc[0.0, 1.0]) for key, cells in maps.items()}
    best = min(right, key=lambda key: right[key])
    sentences = [
        "With the right model and no delay the best score is that of "
        f"{as_written(best[1])} by the {best[0]} rule, {right[best]:.2f} (coils off 1; the best "
        f"constant current, which knows the motion, {constant:.2f})."
    ]
    for rule in RULES:
        here = {name: cells for (of, name), cells in maps.items() if of == rule}
        worst = {name: float(cells.to_numpy().max()) for name, cells in here.items()}
        sturdy = min(worst, key=lambda name: worst[name])
        worst_scores = ", ".join(
            f"{as_written(name)} {cells[1.0].max():.2f} and {cells.loc[0.0].max():.2f}"
            for name, cells in here.items()
        )
        doubled = []
        for name, cells in here.items():
            late = cells.index[cells[1.0] > 2 * right[rule, name]]
            if len(late):
                doubled.append(f"{as_written(name)} from {1e3 * late[0]:.0f} ms on")
        sentences.append(
            f"By the {rule} rule the worst scores with delay alone, and with a wrong nominal model "
            f"alone, are {worst_scores}; delay more than doubles the score of "
            f"{', '.join(doubled) or 'none'}; the least bad worst case is that of "
            f"{as_written(sturdy)}, {worst[sturdy]:.2f}."
        )
    worst_of = {
        rule: max(float(cells.to_numpy().max()) for (of, _), cells in maps.items() if of == rule)
        for rule in RULES
    }
    work = {rule: field_work(rule, LATE) for rule in RULES}
    sentences.append(
        f"The worst of all is {worst_of['instantaneous']:.1f} by the instantaneous rule and "
        f"{worst_of['passive']:.1f} by the passive one. The energy ledger says why: under El "
        f"Centro the current of {as_written(CONTROLLERS[0])}, {1e3 * LATE:.0f} ms late, puts "
        f"{work['instantaneous']:.2f} times the ground's energy into the building by the "
        "instantaneous rule, "
        f"{work['passive']:.2f} times by the passive one."
    )
    return "\n".join(sentences)


def field_work(rule: str, delay: float) -> float:
    """Work of changing the current, over the ground motion's input."""
    job = Scenario.model_validate({
        "ground": EL_CENTRO,
        "isolator": {"switching": rule},
        "controller": [published_entry(CONTROLLERS[0])],
        "simulation": {"computation_delay_s": delay},
    }).build()  # fmt: skip
    energy = job.run(CONTROLLERS[0]).energy.final
    return energy["field_work_J"] / energy["input_J"]


def _figure(maps: Maps) -> Figure:
    from matplotlib.colors import LogNorm

    from isolation_sim.reports.style import (
        DOUBLE_COLUMN,
        contour_map,
        label_outer,
        new_figure,
        style,
    )

    values = np.concatenate([cells.to_numpy().ravel() for cells in maps.values()])
    levels = np.geomspace(values.min(), values.max(), 25)
    across = len(maps) // len(RULES)
    with style():
        figure = new_figure(DOUBLE_COLUMN, 4.6)
        panels = list(figure.subplots(len(RULES), across, squeeze=False).ravel())
        for axes, ((rule, name), cells) in zip(panels, maps.items(), strict=True):
            at = cells.columns, 1e3 * cells.index, cells
            lines = [1.2, 1.5, 2, 4, 8, 12]
            image = contour_map(axes, *at, levels, lines, "%g", norm=LogNorm())
            axes.set(xlabel="nominal over true force", ylabel="delay, ms",
                     title=f"{as_written(name)}, {rule}", xscale="log")  # fmt: skip
            axes.set_xticks([0.5, 1.0, 2.0])
            axes.xaxis.set_major_formatter("{x:g}")
            axes.xaxis.set_minor_formatter("")
            axes.set_xlim(cells.columns.min(), cells.columns.max())
        label_outer(panels, across)
        ticks = [tick for tick in (0.5, 1, 2, 5, 10, 20) if levels[0] <= tick <= levels[-1]]
        bar = figure.colorbar(image, ax=panels, ticks=ticks, format="%g")
        bar.set_label("mean of both peaks, over coils off")
    return figure
