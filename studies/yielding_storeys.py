"""Storeys that yield: benefit of isolation for a building that is not elastic.

Each storey of the reference building becomes a Bouc-Wen element: elastic and as stiff as before up
to its yield drift, nearly flat beyond it. The same building stands on a fixed base and on
isolators, under a motion that grows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import isolation_sim as iso
from controllers import controller
from ground_motions import STANDARD_GRAVITY, Record
from isolation_sim.io.csv_table import write_table
from isolation_sim.scenario import Scenario
from isolation_sim.simulation.batch import Case, simulate_many
from isolation_sim.structures import IsolatedStructure, Structure, yielding_storeys
from isolation_sim.written_names import as_written

from .study import MOTIONS, Outcome, Step, published_entry

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from isolation_sim.simulation.result import Run

TITLE = "Yielding storeys"
YIELD_SHEAR = 0.15
"""Yield shear of a storey over the building's weight."""
HARDENING = 0.05
"""Stiffness after yielding over that before."""
SMOOTHNESS = 5.0
"""Bouc and Wen's exponent: a nearly sharp corner."""
FIXED = "fixed base"
CONTROLLERS = ("passive_off", "passive_on", "clipped_lqr")


def yield_drift(structure: Structure) -> float:
    """Drift at which the reference building's storeys yield, m."""
    weight = STANDARD_GRAVITY * (structure.total_mass - structure.mass[0, 0])
    return YIELD_SHEAR * weight / -structure.stiffness[0, 1]


def yielding(structure: Structure) -> IsolatedStructure:
    """Replace the storeys' stiffness above hardening by Bouc-Wen elements."""
    elastic = iso.reference_building()
    shear = -elastic.stiffness[0, 1] * yield_drift(elastic)
    return yielding_storeys(IsolatedStructure(structure, ()), shear, HARDENING, SMOOTHNESS)


def buildings() -> dict[str, tuple[IsolatedStructure, str]]:
    """By what is compared: the plant and its controller's name."""
    elastic = iso.reference_building()
    on_isolators = yielding(elastic)
    isolator = elastic.on(iso.reference_isolators()).elements
    isolated = replace(on_isolators, elements=(*isolator, *on_isolators.elements))
    result = {FIXED: (yielding(elastic.fixed_base()), "passive_off")}
    return result | {name: (isolated, name) for name in CONTROLLERS}


def motion(section: dict[str, Any]) -> Record:
    """Read a ground section of the common ones."""
    return Scenario.model_validate({"ground": section}).build().records[0]


def outcome(folder: Path, short: bool, step: Step) -> Outcome:
    """Run the study."""
    scales = [1.0, 3.0] if short else np.arange(0.25, 3.01, 0.25).tolist()
    plants, drift = buildings(), yield_drift(iso.reference_building())
    runs: list[dict[str, Any]] = []
    loops: dict[str, Run] = {}
    for name, section in MOTIONS.items():
        record = motion(section)
        for label, (plant, law_of) in plants.items():
            step(f"{name}, {label}", 0.0)
            control = controller(**published_entry(law_of))
            cases = [Case(plant, record.scaled(scale), control) for scale in scales]
            batch = simulate_many(cases)
            for k, scale in enumerate(scales):
                result = {key: float(values[k]) for key, values in batch.criteria.items()}
                runs.append({
                    "motion": name, "scale": scale, "building": label,
                    "ductility": result["peak_drift_m"] / drift,
                    **{key: result[key] for key in (
                        "peak_drift_m", "peak_base_displacement_m", "peak_floor_acceleration_m_s2"
                    )},
                })  # fmt: skip
            if name == "El Centro" and label in (FIXED, "passive_on"):
                loops[label] = iso.simulate(plant, record.scaled(2.0), law_of)
            step(f"{name}, {label}", 1 / (len(MOTIONS) * len(plants)))
    write_table(runs, folder / "runs.csv")
    table = [
        {
            "motion": name, "building": label,
            "yields at scale": _onset(runs, name, label, 1.0),
            "worse than fixed at": _worse_at(runs, name, label),
            "ductility 3 at scale": _onset(runs, name, label, 3.0),
            f"ductility at {scales[-1]:g}": next(
                row["ductility"] for row in reversed(runs)
                if (row["motion"], row["building"]) == (name, label)
            ),
        }
        for name in MOTIONS
        for label in plants
    ]  # fmt: skip
    return Outcome(table, _finding(table), {"ductility": _figure(runs, loops)})


def _onset(
    runs: Sequence[dict[str, Any]], name: str, building: str, ductility: float
) -> float | None:
    """Scale at which a ductility is reached; None where none reaches it."""
    rows = [row for row in runs if row["motion"] == name and row["building"] == building]
    scales = np.array([0.0, *(row["scale"] for row in rows)])
    result = np.array([0.0, *(row["ductility"] for row in rows)])
    above = np.flatnonzero(result >= ductility)
    if not above.size:
        return None
    k = above[0]
    return float(np.interp(ductility, result[k - 1 : k + 1], scales[k - 1 : k + 1]))


def _worse_at(runs: Sequence[dict[str, Any]], name: str, building: str) -> str:
    """At how many scales the storeys yield, and further than on a fixed base."""
    here = [row for row in runs if row["motion"] == name]
    fixed = {row["scale"]: row["ductility"] for row in here if row["building"] == FIXED}
    worse = [
        row["ductility"] > max(1.0, fixed[row["scale"]])
        for row in here
        if row["building"] == building
    ]
    return f"{sum(worse)} of {len(worse)}"


def _finding(table: Sequence[dict[str, Any]]) -> str:
    sentences = [
        f"The storeys yield at {100 * YIELD_SHEAR:g} % of the weight above the base, a drift of "
        f"{1e3 * yield_drift(iso.reference_building()):.1f} mm."
    ]
    for name in MOTIONS:
        parts = []
        for row in (row for row in table if row["motion"] == name):
            first, third = row["yields at scale"], row["ductility 3 at scale"]
            began = "does not yield" if first is None else f"yields from {first:.2f} on"
            if first is not None and third is not None:
                began += f" and reaches a ductility of 3 at {third / first:.1f} times that"
            worse = row["worse than fixed at"]
            than = f", worse than a fixed base at {worse} scales" if worse[0] != "0" else ""
            parts.append(f"{as_written(row['building'])} {began}{than}")
        sentences.append(f"Under {name}, by the motion's scale: {'; '.join(parts)}.")
    growth = {
        kind: [
            row["ductility 3 at scale"] / row["yields at scale"] for row in table
            if (row["building"] == FIXED) == (kind == FIXED)
            and row["ductility 3 at scale"] is not None
        ]
        for kind in (FIXED, "isolators")
    }  # fmt: skip
    if growth["isolators"]:
        sentences.append(
            "From first yielding to a ductility of 3 the motion grows "
            f"{np.median(growth[FIXED]):.1f} times on a fixed base and "
            f"{np.median(growth['isolators']):.1f} times on isolators (medians)."
        )
    return "\n".join(sentences)


def _figure(runs: Sequence[dict[str, Any]], loops: dict[str, Run]) -> Figure:
    from matplotlib.ticker import LogFormatter

    from isolation_sim.reports.style import DOUBLE_COLUMN, legend, line_styles, new_figure, style

    labels = (FIXED, *CONTROLLERS)
    looks = dict(zip(labels, line_styles(len(labels), markers=True), strict=True))
    with style():
        figure = new_figure(DOUBLE_COLUMN, 2.9)
        panels = figure.subplots(1, 3)
        for axes, name in zip(panels, MOTIONS, strict=False):
            for label in labels:
                rows = [r for r in runs if r["motion"] == name and r["building"] == label]
                axes.plot([r["scale"] for r in rows], [r["ductility"] for r in rows],
                          label=as_written(label), **looks[label])  # fmt: skip
            axes.axhline(1.0, color="0.4", linewidth=0.6)
            axes.set(xlabel="scale of the motion", ylabel="ductility demand", title=name,
                     yscale="log")  # fmt: skip
            axes.yaxis.set_major_formatter("{x:g}")
            axes.yaxis.set_minor_formatter(LogFormatter())
        for label, run in loops.items():
            drift = run.output("storey1_drift_m")
            shear = run.output("storey1_hysteresis_force_N")
            linear = _storey_stiffness(run.isolated.structure) * drift
            look = {**looks[label], "marker": ""}
            panels[2].plot(1e3 * drift, 1e-6 * (shear + linear), label=as_written(label), **look)
        panels[2].set(xlabel="drift of the first storey, mm", ylabel="its shear, MN",
                      title="twice El Centro")  # fmt: skip
        legend(figure, panels[0], "outside upper center")
    return figure


def _storey_stiffness(structure: Structure) -> float:
    """Stiffness that the linear structure keeps in each storey, N/m."""
    return float(-structure.stiffness[-1, -2])
