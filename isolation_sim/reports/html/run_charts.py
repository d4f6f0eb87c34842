"""Charts of runs: time histories, loops coloured by current, peaks over the height, energies."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..chart import (
    OVER_TIME,
    Panel,
    base_and_roof,
    coil_current,
    elements_along,
    ground_acceleration,
    layer_loop,
    loop,
    touching,
)
from ..chart import envelopes as level_envelopes
from ..energy import SINKS, SUPPLY, instants_of, supply
from ..style import Look
from .charts import choose_samples, layout, line, numbers, over, peaks, span, symbol
from .page import Chart, Gallery, Key
from .panels import panel_chart

if TYPE_CHECKING:
    from ...simulation.result import Run

# limit for the points of all lines together, which keeps reports of many long runs small
_POINTS_OVER_TIME = 30_000
_POINTS_OF_LOOPS, _LEAST_POINTS = 15_000, 1_500
# light to dark, so that the order shows without colour
_BY_CURRENT = [[0, "#e8a33d"], [0.5, "#b5367a"], [1, "#1b0c42"]]


def trade_off(
    criteria: Mapping[str, Mapping[str, float]],
    looks: Mapping[str, Look],
    optima: Collection[str] = (),
    beside: Collection[str] = (),
) -> tuple[Chart, Key]:
    """Peak floor acceleration over peak base displacement, one point per run, and their legend.

    The runs named in ``beside`` are not drawn.
    """
    traces, lines = [], {}
    values = {
        name: (1e3 * each["peak_base_displacement_m"], each["peak_floor_acceleration_m_s2"])
        for name, each in criteria.items()
    }
    # the building with a fixed base is far from the controllers, and is named above the chart
    shown_values = {name: each for name, each in values.items() if name not in beside} or values
    for name, (x, y) in shown_values.items():
        look = looks[name]
        optimum = name in optima
        shown = f"{name}{' (full-information optimum)' * optimum}"
        # an optimum is no controller
        look = lines[shown] = replace(look, joined=False, filled=not optimum)
        traces.append({
            "type": "scatter", "mode": "markers", "name": name, "meta": name, "x": [x], "y": [y],
            "cliponaxis": False,
            "marker": {"symbol": symbol(look), "size": 11, "color": look.colour},
            "hovertemplate": f"{shown}<br>%{{x:.4g}} mm, %{{y:.4g}} m/s²<extra></extra>",
        })  # fmt: skip
    across, up = (_around([each[k] for each in shown_values.values()]) for k in (0, 1))
    axes = layout(
        "Peak base displacement (mm)", "Peak floor acceleration (m/s²)", hovermode="closest",
        xaxis={"range": across}, yaxis={"range": up},
    )  # fmt: skip
    if beside:
        far = ", ".join(f"{name} {values[name][1]:.3g} m/s²" for name in beside)
        axes["annotations"] = [{
            "text": f"not drawn: {far}", "showarrow": False, "xref": "paper", "yref": "paper",
            "x": 0.01, "y": 0.99, "xanchor": "left", "yanchor": "top",
        }]  # fmt: skip
    listed = ", ".join(f"{name} {x:.3g} mm and {y:.3g} m/s²" for name, (x, y) in values.items())
    chart = Chart(
        "Trade-off: the lower left is better",
        {"data": traces, "layout": axes},
        f"{listed}.",
        height=340,
    )
    return chart, Key({}, lines)


def _around(values: Sequence[float]) -> list[float]:
    """Interval around values, wide enough that differences of a few percent look small."""
    low, high = min(values), max(values)
    room = max(0.15 * (high - low), 0.05 * high)
    return [max(low - room, -0.02 * high), high + room]


def time_histories(runs: Mapping[str, Run], looks: Mapping[str, Look]) -> list[Chart]:
    """Time histories of ground, base and roof in each direction and of the coil currents."""
    first = next(iter(runs.values()))
    structure = first.isolated.structure
    directions, horizontal = range(len(structure.directions)), range(len(structure.horizontal))
    panels = [panel for number in horizontal for panel in base_and_roof(runs, number)]
    channels = max(run.isolated.n_channels for run in runs.values())
    panels += [coil_current(runs, channel) for channel in range(channels)]
    most = _POINTS_OVER_TIME // (len(runs) * len(panels))
    grounds = [ground_acceleration(first, number) for number in directions]
    return [
        *(panel_chart(panel, most=most, height=215) for panel in grounds),
        *(panel_chart(panel, looks=looks, most=most, height=215) for panel in panels),
    ]


def loops(runs: Mapping[str, Run]) -> list[Gallery]:
    """Force over deformation of one element of each kind at the base, and of all together."""
    isolated = next(iter(runs.values())).isolated
    panels: list[tuple[Panel, int | None]] = []
    for direction in range(len(isolated.structure.horizontal)):
        names = elements_along(runs, direction)
        for name in names:
            shown = touching(runs, name) if name.startswith("moat_wall") else runs
            panels.append((loop(shown, name), isolated.element(name).channel))
        if len(names) > 1:
            panels.append((layer_loop(runs, direction), None))
    most = max(_POINTS_OF_LOOPS // (len(panels) * len(runs)), _LEAST_POINTS)
    return [_loops(runs, panel, channel, most) for panel, channel in panels]


def _loops(runs: Mapping[str, Run], panel: Panel, channel: int | None, most: int) -> Gallery:
    """Loops of all runs on equal axes, coloured by the current of a coil."""
    deformation = {name: x for name, (x, _) in panel.lines.items()}
    force = {name: y for name, (_, y) in panel.lines.items()}
    currents = {n: _current(run, channel) for n, run in runs.items()}
    low, high = span(currents.values(), 0.0)
    axes = layout(
        panel.x, panel.y,
        xaxis={"range": span(deformation.values())}, yaxis={"range": span(force.values())},
        hovermode="closest",
    )  # fmt: skip
    bar = {"title": {"text": "A", "side": "top"}, "thickness": 12, "len": 0.9, "outlinewidth": 0}
    charts = []
    for name in panel.lines:
        keep = choose_samples(most, deformation[name], force[name])
        trace = {
            "type": "scatter", "mode": "lines+markers", "meta": name,
            "x": numbers(deformation[name][keep]), "y": numbers(force[name][keep]),
            "line": {"color": "#a0a0a0", "width": 0.8},
            "marker": {
                "size": 3.5, "colorscale": _BY_CURRENT,
                "color": "#404040" if channel is None else numbers(currents[name][keep]),
                "cmin": low, "cmax": high, "showscale": channel is not None, "colorbar": bar,
            },
            "hovertemplate": "%{x:.3g} mm, %{y:.4g} kN"
            + "<br>%{marker.color:.3g} A" * (channel is not None) + "<extra></extra>",
        }  # fmt: skip
        summary = (
            f"{peaks({'deformation': deformation[name]}, 'mm')} "
            f"{peaks({'force': force[name]}, 'kN')}"
        )
        if channel is not None:
            summary += (
                f" Currents between {currents[name].min():.3g} and {currents[name].max():.3g} A."
            )
        title = f"{name}, {panel.title}"
        charts.append(Chart(title, {"data": [trace], "layout": axes}, summary, "loop", 300))
    return Gallery(tuple(charts))


def _current(run: Run, channel: int | None) -> NDArray:
    return np.zeros(len(run.time)) if channel is None else run.current[:, channel]


def envelopes(runs: Mapping[str, Run], looks: Mapping[str, Look]) -> Gallery:
    """Peak absolute acceleration and peak drift over the height."""
    return Gallery(tuple(
        panel_chart(panel, looks=looks, height=340,
              yaxis={"range": [-0.4, len(panel.rows) - 0.6]})
        for panel in level_envelopes(runs)
        if panel.rows
    ))  # fmt: skip


def energies(runs: Mapping[str, Run]) -> tuple[Key, Gallery]:
    """Energy ledgers over time, one chart per run with equal axes."""
    series = {name: supply(run.energy) for name, run in runs.items()}
    limits = span([[0.0], *(values for each in series.values() for values in each.values())])
    charts = []
    for name, run in runs.items():
        ledger = run.energy
        at = instants_of(ledger)
        traces: list[dict[str, Any]] = [
            {
                "type": "scatter", "mode": "lines", "name": label, "stackgroup": "spent",
                "line": {"color": "#555", "width": 0.5},
                "fillcolor": _shade(shade),
                "fillpattern": {"shape": hatch[:1], "fgcolor": "#444", "bgcolor": _shade(shade),
                                "size": 7, "solidity": 0.15},
                **over(ledger.time[at], 1e-3 * getattr(ledger, sink)[at]),
            }
            for sink, label, shade, hatch in SINKS
        ]  # fmt: skip
        traces += [
            line(label, SUPPLY[label]) | over(ledger.time[at], values[at])
            for label, values in series[name].items()
        ]
        ends = ", ".join(
            f"{label} {1e-3 * getattr(ledger, sink)[-1]:.3g} kJ" for sink, label, *_ in SINKS
        )
        axes = layout(
            OVER_TIME, "Energy (kJ)", hovermode="x", yaxis={"range": limits},
            xaxis={"range": [float(ledger.time[0]), float(ledger.time[-1])]},
        )  # fmt: skip
        charts.append(Chart(
            f"{name} (closure error {ledger.closure_error:.1g})", {"data": traces, "layout": axes},
            f"At the end: input {1e-3 * ledger.input_J[-1]:.4g} kJ, field work "
            f"{1e-3 * ledger.field_work_J[-1]:.3g} kJ, {ends}.", "time", 290,
        ))  # fmt: skip
    areas = {label: (_shade(shade), hatch[:1]) for _, label, shade, hatch in SINKS}
    return Key(areas, SUPPLY), Gallery(tuple(charts))


def _shade(shade: str) -> str:
    """Colour in HTML's notation; matplotlib writes greys as numbers."""
    try:
        return f"rgb{(round(255 * float(shade)),) * 3}"
    except ValueError:
        return shade
