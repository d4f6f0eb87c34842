"""Figures of a diagnosis: measured against simulated before and after, and the errors by run."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ..discrepancy.diagnosis import relative_error
from .style import DOUBLE_COLUMN, label_outer, legend, new_figure, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..discrepancy.diagnosis import Diagnosis, Trace

_SHOWN = 6
_SAMPLES = 1500


def overview(diagnosis: Diagnosis) -> Figure:
    """Loops of the runs with the largest errors, before and after."""
    return _by_run(diagnosis, _loop, across=3, height=2.3)


def residuals(diagnosis: Diagnosis) -> Figure:
    """Time histories of the residuals of the runs with the largest errors, before and after."""
    return _by_run(diagnosis, _residual, across=2, height=1.5)


def _by_run(
    diagnosis: Diagnosis, draw: Callable[[Axes, Trace], None], across: int, height: float
) -> Figure:
    """One panel of a height in inches for each of the runs with the largest errors."""
    traces = diagnosis.traces[:_SHOWN]
    across = min(across, len(traces))
    down = -(-len(traces) // across)
    with style():
        figure = new_figure(DOUBLE_COLUMN, 0.5 + height * down)
        panels = figure.subplots(down, across, squeeze=False).ravel().tolist()
        for panel in panels[len(traces) :]:
            panel.remove()
        panels = panels[: len(traces)]
        for panel, trace in zip(panels, traces, strict=True):
            draw(panel, trace)
        # every run has its own size
        if len({(trace.label, trace.across_label) for trace in traces}) == 1:
            label_outer(panels, across, ticks=False)
        legend(figure, panels[0], "outside upper center")
    return figure


def _loop(panel: Axes, trace: Trace) -> None:
    # the end of a run, where slow effects are fully developed
    shown = slice(-min(len(trace.time), _SAMPLES), None)
    x = trace.across[shown]
    panel.plot(x, trace.measured[shown], color="0.7", lw=1.6, label="measured")
    panel.plot(x, trace.before[shown], color="#D55E00", ls=(0, (4, 1.2)), lw=0.8, label="before")
    panel.plot(x, trace.after[shown], color="black", lw=0.7, label="after")
    panel.set_xlabel(heading(trace.across_label))
    panel.set_ylabel(heading(trace.label))
    held = ", held out" if trace.held_out else ""
    before, after = (100 * relative_error(trace, f) for f in (trace.before, trace.after))
    panel.set_title(f"{trace.name}{held}\n{before:.1f} % → {after:.1f} %", fontsize=6.5)


def _residual(panel: Axes, trace: Trace) -> None:
    before, after = trace.before - trace.measured, trace.after - trace.measured
    panel.plot(trace.time, before, color="0.65", lw=0.8, label="residual before")
    panel.plot(trace.time, after, color="black", lw=0.5, label="residual after")
    panel.set_xlabel("Time (s)")
    panel.set_ylabel(heading(trace.label))
    panel.set_title(trace.name + (", held out" if trace.held_out else ""), fontsize=6.5)


def errors_by_run(diagnosis: Diagnosis) -> Figure:
    """Error of every run before and after."""
    traces = diagnosis.traces[::-1]
    with style():
        figure = new_figure(DOUBLE_COLUMN, 0.9 + 0.16 * len(traces))
        panel = figure.subplots()
        rows = np.arange(len(traces))
        before = [100 * relative_error(t, t.before) for t in traces]
        after = [100 * relative_error(t, t.after) for t in traces]
        panel.hlines(rows, after, before, color="0.8", lw=1.0)
        panel.plot(before, rows, "o", color="#D55E00", mfc="white", label="before")
        panel.plot(after, rows, "o", color="black", label="after")
        floor = 100 * diagnosis.noise_floor
        if np.isfinite(floor) and floor > 0:
            panel.axvline(floor, color="0.4", ls=(0, (1, 1)), lw=0.9, label="noise floor, pooled")
        panel.set_yticks(rows, [t.name + (", held out" if t.held_out else "") for t in traces])
        panel.tick_params(axis="y", labelsize=6)
        panel.set_xscale("log")
        panel.xaxis.set_major_formatter("{x:g}")
        panel.set_xlabel("Residual over measured signal, RMS (%); * held out")
        legend(figure, panel, "outside upper center")
    return figure


def heading(label: str) -> str:
    """Format a trace's label as an axis title."""
    name, _, unit = label.partition(", ")
    return f"{name.capitalize()} ({unit})"
