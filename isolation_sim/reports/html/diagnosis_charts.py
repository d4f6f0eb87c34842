"""Charts of a diagnosis: measured and simulated runs before and after, and their errors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...discrepancy.diagnosis import relative_error
from ..diagnosis_figures import heading
from .charts import Look, layout, numbers, over, peaks, points, span, thinned
from .page import Block, Cell, Chart, Key, Row, Table

if TYPE_CHECKING:
    from ...discrepancy.diagnosis import Trace

LOOKS = {
    "measured": Look("#9a9a9a", "", "", ""),
    "before": Look("#D55E00", "6px,2px", "circle-open", ""),
    "after": Look("#000000", "", "circle", ""),
}
"""Looks of the lines, by name."""
_LOOPS, _HISTORIES = 6, 3
# the end of a run, where slow effects are fully developed
_POINTS_OF_LOOP, _POINTS_OVER_TIME = 1200, 4000


def loops(traces: Sequence[Trace]) -> tuple[Chart, ...]:
    """Loops of the first runs."""
    return tuple(_loop(trace) for trace in traces[:_LOOPS])


def _loop(trace: Trace) -> Chart:
    shown = slice(-min(len(trace.time), _POINTS_OF_LOOP), None)
    drawn = [
        {**_line(name), "x": numbers(trace.across[shown]), "y": numbers(values[shown])}
        for name, values in _lines(trace).items()
    ]  # fmt: skip
    axes = layout(heading(trace.across_label), heading(trace.label), hovermode="closest")
    return Chart(_title(trace), {"data": drawn, "layout": axes}, _summary(trace), height=290)


def over_time(traces: Sequence[Trace], residual: bool) -> tuple[Chart, ...]:
    """The first runs over time."""
    chosen = traces[:_HISTORIES]
    end = max(float(trace.time[-1]) for trace in chosen)
    charts = []
    for trace in chosen:
        lines = _lines(trace)
        if residual:
            measured = lines.pop("measured")
            lines = {name: values - measured for name, values in lines.items()}
        keep = thinned(_POINTS_OVER_TIME, *lines.values())
        drawn = [
            {**_line(name), **over(trace.time[keep], values[keep])}
            for name, values in lines.items()
        ]  # fmt: skip
        what = f"{'Residual' if residual else heading(trace.label)}, {_title(trace)}"
        unit = trace.label.partition(", ")[2]
        axes = layout(
            "Time (s)", f"Residual ({unit})" if residual else heading(trace.label),
            xaxis={"range": [0.0, end]}, yaxis={"range": span(lines.values())}, hovermode="x",
        )  # fmt: skip
        figure = {"data": drawn, "layout": axes}
        charts.append(Chart(what, figure, peaks(lines, unit), "time", 215))
    return tuple(charts)


def errors_by_run(traces: Sequence[Trace], floor: float) -> tuple[Block, ...]:
    """Error of every run before and after, beside the noise floor."""
    rows = np.arange(len(traces))
    names = [trace.name for trace in traces]
    drawn: list[dict[str, Any]] = [
        {**points(names, errors, rows, LOOKS[name]), "name": name, "meta": name}
        for name, errors in (
            ("before", [100 * relative_error(t, t.before) for t in traces]),
            ("after", [100 * relative_error(t, t.after) for t in traces]),
        )
    ]
    marks = {"before": Look("#D55E00", "0,99", "", "○"), "after": Look("#000000", "0,99", "", "●")}
    if np.isfinite(floor) and floor > 0:
        marks["noise floor, all runs together"] = Look("#555555", "2px,2px", "", "")
        drawn.append({
            "type": "scatter", "mode": "lines", "name": "noise floor", "hoverinfo": "skip",
            "line": {"color": "#555555", "dash": "2px,2px", "width": 1.5},
            "x": [100 * floor] * 2, "y": [-1, len(rows)],
        })  # fmt: skip
    axes = layout(
        "Error (%)", "", hovermode="closest",
        xaxis={"type": "log", "dtick": "D2", "tickformat": "~g"},
        yaxis={"tickvals": rows.tolist(), "ticktext": names, "range": [len(rows) - 0.4, -0.6],
               "automargin": True},
        margin={"l": 20},
    )  # fmt: skip
    chart = Chart(
        "Residual over measured signal, RMS, of each run (%)", {"data": drawn, "layout": axes},
        f"{names[0]} has the largest error; the table below gives the numbers.",
        height=90 + 20 * len(rows),
    )  # fmt: skip
    return Key({}, marks), chart


def runs_table(traces: Sequence[Trace]) -> Table:
    """Errors run by run, before and after."""
    rows = tuple(
        Row(trace.name, (
            Cell("held out" if trace.held_out else "fitted"),
            *(Cell(f"{100 * relative_error(trace, f):.2f}") for f in (trace.before, trace.after)),
        ))
        for trace in traces
    )  # fmt: skip
    return Table(
        caption="Residual over measured signal, both RMS",
        headings=("Run", "Used as", "Error before, %", "After, %"),
        rows=rows,
        filters=("Used as",) if len({trace.held_out for trace in traces}) > 1 else (),
    )


def _line(name: str) -> dict[str, Any]:
    # the measured line is wider, so that it shows on both sides of the simulated line
    wide = {"width": 3.5} if name == "measured" else {}
    return {**LOOKS[name].line(**wide), "mode": "lines", "name": name, "meta": name}


def _lines(trace: Trace) -> dict[str, NDArray]:
    return {name: getattr(trace, name) for name in LOOKS}


def _title(trace: Trace) -> str:
    before, after = (100 * relative_error(trace, f) for f in (trace.before, trace.after))
    held = ", held out" if trace.held_out else ""
    return f"{trace.name}{held}: {before:.1f} % → {after:.1f} %"


def _summary(trace: Trace) -> str:
    before, after = (100 * relative_error(trace, f) for f in (trace.before, trace.after))
    return (
        f"RMS error of the simulation: {before:.2g} % of the measured signal before, {after:.2g} % "
        "after."
    )
