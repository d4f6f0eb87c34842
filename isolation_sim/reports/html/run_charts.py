"""Charts of runs: time histories, loops coloured by current, envelopes, energies."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...criteria import columns
from ...simulation.quantities import level_dofs, storey_rows
from ..energy import SINKS, instants_of, supply
from ..panels import base_dof, element_along, roof_dof, without_direction
from .charts import Look, layout, numbers, over, peaks, span, thinned
from .page import Chart, Gallery, Key

if TYPE_CHECKING:
    from ...simulation.result import Run

# points of all lines together: what keeps a report of many runs of a long record small
_POINTS_OVER_TIME = 30_000
_POINTS_OF_LOOPS = 15_000
# light to dark, so that the order survives without colour
_BY_CURRENT = [[0, "#e8a33d"], [0.5, "#b5367a"], [1, "#1b0c42"]]


def trade_off(
    criteria: Mapping[str, Mapping[str, float]],
    looks: Mapping[str, Look],
    optima: Collection[str] = (),
) -> Chart:
    """Peak floor acceleration over peak base displacement, a point a run."""
    traces = []
    values = {
        name: (1e3 * each["peak_base_displacement_m"], each["peak_floor_acceleration_m_s2"])
        for name, each in criteria.items()
    }
    widest, highest = (max(each[k] for each in values.values()) for k in (0, 1))
    # labels of neighbours above and below in turn; at the left edge beside the point
    ranks = {name: rank for rank, name in enumerate(sorted(values, key=lambda one: values[one]))}
    for name, (x, y) in values.items():
        side = "middle right" if x < 0.1 * widest else "top center" if ranks[name] % 2 else ""
        symbol = looks[name].symbol if name in looks else "star"
        colour = looks[name].colour if name in looks else "#666666"
        shown = f"{name.replace('_', ' ')}{' (full-information optimum)' * (name in optima)}"
        traces.append({
            "type": "scatter", "mode": "markers+text", "name": name, "meta": name,
            "x": [x], "y": [y], "text": [shown], "textposition": side or "bottom center",
            "cliponaxis": False,
            "marker": {"symbol": symbol + "-open" * (name in optima), "size": 11, "color": colour},
            "hovertemplate": f"{shown}<br>%{{x:.4g}} mm, %{{y:.4g}} m/s²<extra></extra>",
        })  # fmt: skip
    axes = layout(
        "Peak base displacement (mm)",
        "Peak floor acceleration (m/s²)",
        hovermode="closest",
        xaxis={"range": [-0.02 * widest, 1.15 * widest]},
        yaxis={"range": [-0.1 * highest, 1.15 * highest]},
    )
    listed = ", ".join(f"{name} {x:.3g} mm and {y:.3g} m/s²" for name, (x, y) in values.items())
    return Chart(
        "Trade-off: the lower left is better",
        {"data": traces, "layout": axes},
        f"{listed}.",
        height=340,
    )


def time_histories(runs: Mapping[str, Run], looks: Mapping[str, Look]) -> list[Chart]:
    """Ground, base and roof in each direction and the coils' currents, over time."""
    first = next(iter(runs.values()))
    directions = first.isolated.structure.directions
    panels: list[tuple[str, str, dict[str, NDArray], str]] = []
    for number, direction in enumerate(directions):
        along = f" along {direction}" if len(directions) > 1 else ""
        base, roof = base_dof(first, number), roof_dof(first, number)
        for what, symbol, dof, quantity, factor in (
            ("Base displacement relative to the ground", "mm", base, "displacement_m", 1e3),
            ("Absolute roof acceleration", "m/s²", roof, "acceleration_m_s2", 1.0),
        ):
            lines = {
                name: factor * columns(run, [dof], quantity)[:, 0] for name, run in runs.items()
            }
            panels.append((f"{what}{along} ({symbol})", symbol, lines, "linear"))
    for channel in range(max(run.isolated.n_channels for run in runs.values())):
        which = f", channel {channel}" if first.isolated.n_channels > 1 else ""
        lines = {
            name: run.current[:, channel]
            for name, run in runs.items() if run.isolated.n_channels > channel
        }  # fmt: skip
        panels.append((f"Coil current{which} (A)", "A", lines, "hv"))
    most = _POINTS_OVER_TIME // (len(runs) * len(panels))
    ground = [_ground(first, number, most) for number in range(len(directions))]
    charts = []
    for title, symbol, lines, shape in panels:
        traces = []
        for name, values in lines.items():
            keep = thinned(most, values)
            drawn = over(runs[name].time[keep], values[keep])
            traces.append({"name": name, "meta": name, **looks[name].line(shape=shape), **drawn})
        charts.append(_over_time(title, symbol, traces, first.time, peaks(lines, symbol)))
    return ground + charts


def _ground(run: Run, number: int, most: int) -> Chart:
    record = run.records[number]
    keep = thinned(most, record.acceleration)
    trace = {
        "type": "scatter", "mode": "lines", "name": "ground",
        "line": {"color": "#555", "width": 1.2},
        **over(record.time[keep], record.acceleration[keep]),
    }  # fmt: skip
    directions = run.isolated.structure.directions
    along = f" along {directions[number]}" if len(directions) > 1 else ""
    summary = peaks({record.name: record.acceleration}, "m/s²")
    return _over_time(f"Ground acceleration{along} (m/s²)", "m/s²", [trace], run.time, summary)


def _over_time(
    title: str, unit: str, traces: list[dict[str, Any]], time: NDArray, summary: str,
    height: int = 215,
) -> Chart:  # fmt: skip
    axes = layout(
        "Time (s)", unit, xaxis={"range": [float(time[0]), float(time[-1])]}, hovermode="x"
    )
    return Chart(title, {"data": traces, "layout": axes}, summary, "time", height)


def loops(runs: Mapping[str, Run]) -> list[Gallery]:
    """Force over deformation of the isolators, coloured by their coil's current."""
    first = next(iter(runs.values()))
    names = [element_along(first, k) for k in range(len(first.isolated.structure.directions))]
    most = _POINTS_OF_LOOPS // (len(names) * len(runs))
    return [_loops(runs, name, most) for name in names]


def _loops(runs: Mapping[str, Run], element: str, most: int) -> Gallery:
    deformation = {n: 1e3 * columns(r, [element], "deformation_m")[:, 0] for n, r in runs.items()}
    force = {n: 1e-3 * columns(r, [element], "force_N")[:, 0] for n, r in runs.items()}
    channel = next(iter(runs.values())).isolated.element(element).channel
    currents = {n: _current(run, channel) for n, run in runs.items()}
    low, high = span(currents.values(), 0.0)
    axes = layout(
        "Deformation (mm)", "Force (kN)",
        xaxis={"range": span(deformation.values())}, yaxis={"range": span(force.values())},
        hovermode="closest",
    )  # fmt: skip
    bar = {"title": {"text": "A", "side": "top"}, "thickness": 12, "len": 0.9, "outlinewidth": 0}
    charts = []
    for name in runs:
        keep = thinned(most, deformation[name], force[name])
        trace = {
            "type": "scatter", "mode": "lines+markers", "meta": name,
            "x": numbers(deformation[name][keep]), "y": numbers(force[name][keep]),
            "line": {"color": "#a0a0a0", "width": 0.8},
            "marker": {
                "size": 3.5, "color": numbers(currents[name][keep]), "colorscale": _BY_CURRENT,
                "cmin": low, "cmax": high, "showscale": channel is not None, "colorbar": bar,
            },
            "hovertemplate": "%{x:.3g} mm, %{y:.4g} kN<br>%{marker.color:.3g} A<extra></extra>",
        }  # fmt: skip
        summary = (
            f"{peaks({'deformation': deformation[name]}, 'mm')} "
            f"{peaks({'force': force[name]}, 'kN')} Currents between "
            f"{currents[name].min():.3g} and {currents[name].max():.3g} A."
        )
        title = f"{name}, {element}"
        charts.append(Chart(title, {"data": [trace], "layout": axes}, summary, "loop", 300))
    return Gallery(tuple(charts))


def _current(run: Run, channel: int | None) -> NDArray:
    return np.zeros(len(run.time)) if channel is None else run.current[:, channel]


def envelopes(runs: Mapping[str, Run], looks: Mapping[str, Look]) -> Gallery:
    """Peak absolute acceleration and peak drift over the height."""
    structure = next(iter(runs.values())).isolated.structure
    levels = [structure.names[dof] for dof in level_dofs(structure)[:, 0]]
    storeys = [structure.storeys[row] for row in storey_rows(structure)[:, 0]]
    charts = []
    for title, unit, labels, values in (
        ("Peak absolute acceleration (m/s²)", "m/s²", levels,
         {name: run.peaks["floor_acceleration_m_s2"] for name, run in runs.items()}),
        ("Peak storey drift (mm)", "mm", storeys,
         {name: 1e3 * run.peaks["drift_m"] for name, run in runs.items()}),
    ):  # fmt: skip
        if not labels:
            continue
        height = np.arange(len(labels))
        traces = [
            {"name": name, "meta": name, **looks[name].line(),
             "x": each.tolist(), "y": height.tolist()}
            for name, each in values.items()
        ]  # fmt: skip
        every = -(-len(labels) // 12)
        ticks = {
            "tickvals": height[::every].tolist(),
            "ticktext": without_direction(labels, structure.directions)[::every],
            "range": [-0.4, len(labels) - 0.6],
        }
        axes = layout(
            title, "", yaxis=ticks, hovermode="closest", xaxis={"rangemode": "tozero"},
            margin={"l": 78},
        )  # fmt: skip
        figure = {"data": traces, "layout": axes}
        charts.append(Chart(title, figure, peaks(values, unit), height=340))
    return Gallery(tuple(charts))


def energies(runs: Mapping[str, Run]) -> tuple[Key, Gallery]:
    """Energy ledgers over time, a chart a run on the same axes."""
    supplied = {name: 1e-3 * supply(run.energy) for name, run in runs.items()}
    inputs = {name: 1e-3 * run.energy.input_J for name, run in runs.items()}
    limits = span([[0.0], *supplied.values(), *inputs.values()])
    dashed = {"color": "#D55E00", "dash": "6px,2px", "width": 2}
    solid = {"color": "#000000", "dash": "solid", "width": 2}
    charts = []
    for name, run in runs.items():
        ledger = run.energy
        drawn = instants_of(ledger)
        traces: list[dict[str, Any]] = [
            {
                "type": "scatter", "mode": "lines", "name": label, "stackgroup": "spent",
                "line": {"color": "#555", "width": 0.5},
                "fillcolor": _shade(shade),
                "fillpattern": {"shape": hatch[:1], "fgcolor": "#444", "bgcolor": _shade(shade),
                                "size": 7, "solidity": 0.15},
                **over(ledger.time[drawn], 1e-3 * getattr(ledger, sink)[drawn]),
            }
            for sink, label, shade, hatch in SINKS
        ]  # fmt: skip
        traces += [
            {"type": "scatter", "mode": "lines", "name": label, "line": line,
             **over(ledger.time[drawn], values[name][drawn])}
            for label, line, values in (
                ("input", solid, inputs), ("input + field work", dashed, supplied)
            )
        ]  # fmt: skip
        ends = ", ".join(
            f"{label} {1e-3 * getattr(ledger, sink)[-1]:.3g} kJ" for sink, label, *_ in SINKS
        )
        title = f"{name} (closure error {ledger.closure_error:.1g})"
        chart = _over_time(
            title, "Energy (kJ)", traces, ledger.time,
            f"At the end: input {inputs[name][-1]:.4g} kJ, field work "
            f"{1e-3 * ledger.field_work_J[-1]:.3g} kJ, {ends}.", 290,
        )  # fmt: skip
        chart.figure["layout"]["yaxis"]["range"] = limits
        charts.append(chart)
    areas = {label: (_shade(shade), hatch[:1]) for _, label, shade, hatch in SINKS}
    lines = {"input": Look("#000000", "", "", ""),
             "input + field work": Look("#D55E00", "6px,2px", "", "")}  # fmt: skip
    return Key(areas, lines), Gallery(tuple(charts))


def _shade(shade: str) -> str:
    """Colour as HTML writes it; matplotlib writes a grey as a number."""
    try:
        return f"rgb{(round(255 * float(shade)),) * 3}"
    except ValueError:
        return shade
