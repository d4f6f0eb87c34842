"""How soft may isolation be? Currents held, under random motions on two soils."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from studies.study import Outcome, Step, far_field, swept

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

TITLE = "How soft may isolation be?"
SOILS = ("firm", "medium")
DISPLACEMENT, ACCELERATION = "peak_base_displacement_m", "peak_floor_acceleration_m_s2"


def plan(short: bool) -> dict[str, Any]:
    """Return the sweep's plan.

    Parameters
    ----------
    short : bool
        Whether to take few currents and motions.

    Returns
    -------
    dict
    """
    currents = [0.0, 3.0] if short else [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]
    return {
        "name": "soft isolation",
        "scenario": {
            "ground": far_field(seed=0),
            "controller": [{"name": "constant"}],
        },
        "vary": [
            {"field": "ground.soil", "label": "soil", "values": list(SOILS)},
            {"field": "controller.amperes", "label": "current_A", "values": currents},
        ],
        "seeds": {"count": 2 if short else 20},
    }


def outcome(folder: Path, short: bool, step: Step) -> Outcome:
    """Run the study.

    Parameters
    ----------
    folder : pathlib.Path
        Where the sweep is kept.
    short : bool
        Whether to take few currents and motions.
    step : callable
        Told the share that has just been done.

    Returns
    -------
    Outcome
        Table: medians over the motions.
    """
    runs = swept(plan(short), folder, step).table
    medians = runs.groupby(["soil", "current_A"], sort=False)[[DISPLACEMENT, ACCELERATION]].median()
    table = [
        {"soil": soil, "current_A": float(current)} | {key: float(row[key]) for key in row.index}
        for (soil, current), row in medians.iterrows()
    ]
    return Outcome(table, _finding(medians), {"trade": _figure(medians)})


def _finding(medians: pandas.DataFrame) -> str:
    said = []
    for soil in SOILS:
        own = medians.loc[soil]
        off, on = own.iloc[0], own.iloc[-1]
        said.append(
            f"On {soil} soil, {own.index[-1]:g} A instead of none changes the base displacement "
            f"by {100 * (on[DISPLACEMENT] / off[DISPLACEMENT] - 1):+.0f} % and the floor "
            f"acceleration by {100 * (on[ACCELERATION] / off[ACCELERATION] - 1):+.0f} %."
        )
    return " ".join(said)


def _figure(medians: pandas.DataFrame) -> Figure:
    from isolation_sim.reports.style import line_styles, new_figure, style

    with style():
        figure = new_figure(4.5, 3.0)
        axes = figure.subplots()
        for soil, look in zip(SOILS, line_styles(2, markers=True), strict=True):
            own = medians.loc[soil]
            axes.plot(1e3 * own[DISPLACEMENT], own[ACCELERATION], label=f"{soil} soil", **look)
        axes.set(xlabel="base displacement (mm)", ylabel="floor acceleration (m/s²)")
        axes.legend()
    return figure
