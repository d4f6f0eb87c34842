"""Charts of a diagnosis: measured against simulated before and after, and the errors by run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..discrepancy.diagnosis import groups_in_turn, relative_error, worst_first
from .chart import OVER_TIME, Panel
from .loops_fitted import strong_end
from .panels import draw, grid
from .style import DOUBLE_COLUMN, Look, legend, new_figure, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..discrepancy.diagnosis import Diagnosis, Trace

LOOKS = {
    # each line shows on both sides of the next one where they coincide
    "measured": Look("#b0b0b0", width=3.4),
    "before": Look("#D55E00", (2, 0.6), width=2.0),
    "after": Look("#000000", width=0.8),
}
_ERRORS = {
    "before": Look("#D55E00", marker="o", joined=False, filled=False),
    "after": Look("#000000", marker="X", joined=False),
    "noise floor, all fitted runs": Look("#555555", (1.3, 1.3)),
}
_SHOWN = 6
STRONGEST = 8.0
"""Seconds of a run over time that stand in place of a loop."""
_FAR_BELOW = 4.0
"""Ratio of the smallest error to the noise floor from which on the floor has no line, and of the
largest to the smallest one from which on the axis is logarithmic."""


def overview(diagnosis: Diagnosis) -> Figure:
    """Loops of the runs with the largest errors, before and after."""
    return grid(loops(groups_in_turn(diagnosis.traces)), across=3, height=2.3)


def residuals(diagnosis: Diagnosis) -> Figure:
    """Time histories of the residuals of the runs with the largest errors, before and after."""
    shown = groups_in_turn(diagnosis.traces)[:_SHOWN]
    return grid(histories(shown, residual=True), across=2, height=1.5)


def errors_by_run(diagnosis: Diagnosis) -> Figure:
    """Error of every run before and after."""
    panel = errors(diagnosis)
    (before, rows), (after, _) = panel.lines["before"], panel.lines["after"]
    with style():
        figure = new_figure(DOUBLE_COLUMN, 0.9 + 0.16 * len(rows))
        axes = figure.subplots()
        axes.hlines(rows, after, before, color="0.8", lw=1.0)
        draw(axes, panel)
        legend(figure, axes, "outside upper center")
    return figure


def loops(traces: Sequence[Trace]) -> list[Panel]:
    """Loops of the first runs, with the errors before and after."""
    panels = []
    for trace in traces[:_SHOWN]:
        # the end of a run, where slow effects are fully developed, unless it is quiet
        shown = _strongest(trace) if over_time(trace) else strong_end(trace.measured, trace.across)
        lines = {name: _line(trace, name, trace.across, shown) for name in LOOKS}
        panels.append(Panel(
            _name(trace), _heading(trace.across_label), _heading(trace.label), lines, LOOKS,
            note=_change(trace),
        ))  # fmt: skip
    return panels


def histories(traces: Sequence[Trace], residual: bool = False) -> list[Panel]:
    """Measured and simulated signal of each run over time, or simulated minus measured."""
    panels = []
    for trace in traces:
        unit = trace.label.partition(", ")[2]
        title = y = _heading(trace.label)
        lines = {name: _line(trace, name, trace.time) for name in LOOKS}
        if residual:
            title, y = "Residual", f"Residual ({unit})"
            del lines["measured"]
            lines = {name: (time, signal - trace.measured[-len(signal) :])
                     for name, (time, signal) in lines.items()}  # fmt: skip
        panels.append(Panel(f"{title}, {_name(trace)}", OVER_TIME, y, lines, LOOKS, unit,
                            note=_change(trace)))  # fmt: skip
    return panels


def _line(
    trace: Trace, name: str, across: NDArray, shown: slice = slice(None)
) -> tuple[NDArray, NDArray]:
    """Abscissas and values of a line; a simulation is drawn from where it counts."""
    first, last, step = shown.indices(len(across))
    if name != "measured" and first < trace.settled < last:
        shown = slice(trace.settled, last, step)
    return across[shown], getattr(trace, name)[shown]


def over_time(trace: Trace) -> bool:
    """Whether a run is drawn over time in place of a loop."""
    return trace.across is trace.time or np.array_equal(trace.across, trace.time)


def _strongest(trace: Trace) -> slice:
    """The samples of the strongest seconds of a run."""
    n = len(trace.time)
    length = min(n, int(STRONGEST * (n - 1) / (trace.time[-1] - trace.time[0])) + 1)
    energy = np.append(0.0, np.cumsum(trace.measured**2))
    start = int(np.argmax(energy[length:] - energy[:-length]))
    return slice(start, start + length)


def errors(diagnosis: Diagnosis) -> Panel:
    """Error of every run before and after, the largest at the top, beside the noise floor.

    A line of a floor far below all errors would leave little room for them: its value is written.
    """
    traces = worst_first(diagnosis.traces)
    rows, floor = np.arange(len(traces)), 100 * diagnosis.noise_floor
    lines = {
        name: (np.array([100 * relative_error(t, getattr(t, name)) for t in traces]), rows)
        for name in ("before", "after")
    }
    x = "Residual / signal, RMS (%)"
    both = np.concatenate([values for values, _ in lines.values()])
    least = float(np.min(both[both > 0], initial=np.inf))
    if 0 < _FAR_BELOW * floor < least < np.inf:
        x = f"Residual / signal, RMS (%); noise floor of all fitted runs {floor:.2g} %"
    elif np.isfinite(floor) and floor > 0:
        lines["noise floor, all fitted runs"] = np.full(2, floor), np.array([-1, len(rows)])
    return Panel(
        "Residual over measured signal, RMS, of each run (%)",
        x, "", lines,
        {name: look for name, look in _ERRORS.items() if name in lines},
        rows=[_name(trace) for trace in traces], log_x=float(np.max(both)) > _FAR_BELOW * least,
        limits=(len(rows) - 0.4, -0.6),
    )  # fmt: skip


def _name(trace: Trace) -> str:
    return trace.name + (", held out" if trace.held_out else "")


def _change(trace: Trace) -> str:
    """Error before and after."""
    before, after = (100 * relative_error(trace, f) for f in (trace.before, trace.after))
    return f"{before:.1f} % → {after:.1f} %"


def _heading(label: str) -> str:
    """Format a trace's label as an axis title."""
    name, _, unit = label.partition(", ")
    return f"{name.capitalize()} ({unit})"
