"""Panels of the figures: each function draws on existing axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from ..criteria import columns
from ..errors import InputError, check_name
from ..written_names import as_written
from . import chart
from .chart import Panel
from .style import BAND, DOUBLE_COLUMN, label_outer, legend, line_styles, new_figure, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

    from ..simulation.result import Run

MARKS_A_LINE = 14
"""Number of markers of a line over time."""

_TITLE = 126
"""Characters of a title across a page."""

_DECADES = 1e3
"""Ratio of the ends of a logarithmic axis from which on only decades have labels."""

LABELS_A_HEIGHT = 12
"""Largest number of level names beside a panel."""


def name_runs(runs: Run | Mapping[str, Run] | Sequence[Run]) -> dict[str, Run]:
    """Runs by the names to print."""
    if not isinstance(runs, Mapping | Sequence):
        runs = [runs]
    if not runs:
        raise InputError("a figure has no runs; expected: one run or more")
    if isinstance(runs, Mapping):
        return {as_written(name): run for name, run in runs.items()}
    result: dict[str, Run] = {}
    for run in runs:
        written, number = as_written(run.controller), 2
        name = written
        while name in result:
            name, number = f"{written} {number}", number + 1
        result[name] = run
    return result


def direction_number(run: Run, direction: str | None) -> int:
    """Find a horizontal direction of ground motion."""
    directions = run.isolated.structure.horizontal
    if direction is None:
        return 0
    check_name("direction", direction, directions)
    return directions.index(direction)


def draw(axes: Axes, panel: Panel, width: float = 0.7) -> None:
    """Draw a panel with its own looks; width of a line in points."""
    if panel.band is not None:
        axes.axvspan(*panel.band, color=BAND, zorder=0)
    named = set()
    for name, (x, y) in panel.lines.items():
        keys = panel.looks[name].print_keys(width)
        drawstyle = "steps-post" if panel.steps else "default"
        label = panel.groups.get(name, name)
        own = None if label in named else label
        axes.plot(x, y, label=own, drawstyle=drawstyle, **keys)
        named.add(label)
    if panel.log_x:
        axes.set_xscale("log")
        _label_decades(axes.xaxis)
    if panel.log_y:
        axes.set_yscale("log")
        _label_decades(axes.yaxis)
    if panel.rows:
        axes.set_yticks(np.arange(len(panel.rows)), panel.rows)
        axes.tick_params(axis="y", labelsize=6)
    if panel.limits is not None:
        axes.set_ylim(*panel.limits)
    if panel.reach is not None:
        axes.set_xlim(0.0, panel.reach)
    axes.set_xlabel(panel.x)
    axes.set_ylabel(panel.y)


def _label_decades(axis: Axis) -> None:
    """Label a logarithmic axis with plain numbers: 1, 2, 5, 10; with decades if it is long."""
    from matplotlib.ticker import LogLocator, NullFormatter

    low, high = axis.get_data_interval()
    short = high < _DECADES * low
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if short else (1.0,)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())


def grid(drawn: Sequence[Panel], across: int, height: float) -> Figure:
    """Draw panels side by side, of a height in inches, under their titles and one legend."""
    across = min(across, len(drawn))
    down = -(-len(drawn) // across)
    with style():
        figure = new_figure(DOUBLE_COLUMN, 0.5 + height * down)
        axes = figure.subplots(down, across, squeeze=False).ravel().tolist()
        for unused in axes[len(drawn) :]:
            unused.remove()
        axes = axes[: len(drawn)]
        for one, panel in zip(axes, drawn, strict=True):
            draw(one, panel)
            title = fill(panel.title, _TITLE // across)
            one.set_title(f"{title}\n{panel.note}".strip(), fontsize=6.5)
        # every panel has its own limits, and possibly its own quantities
        if len({(panel.x, panel.y) for panel in drawn}) == 1:
            label_outer(axes, across, ticks=False)
        legend(figure, axes[0], "outside upper center")
    return figure


def ground_acceleration(axes: Axes, run: Run, direction: int = 0) -> None:
    """Draw the ground acceleration over time."""
    panel = chart.ground_acceleration(run, direction)
    draw(axes, panel)
    ((time, _),) = panel.lines.values()
    axes.set_xlim(time[0], time[-1])
    axes.set_xlabel("")


def over_time(axes: Axes, panel: Panel, names: Sequence[str]) -> None:
    """Draw lines over time; a name has the same look in every panel with these names."""
    styles = dict(zip(names, line_styles(len(names)), strict=True))
    looks = {}
    for k, (name, (time, _)) in enumerate(panel.lines.items()):
        every = max(len(time) // MARKS_A_LINE, 1)
        # markers at different times, so that coinciding lines still show
        marks = (k * every // len(panel.lines), every)
        looks[name] = {"label": name, "linewidth": 0.8, "markevery": marks, **styles[name]}
    _over_time(axes, panel, looks)


def before_reference(axes: Axes, panel: Panel, reference: str) -> None:
    """Draw a line over time before that of a reference, which is wide and grey."""
    front = {"label": "run named above its row", "color": "0.0", "linewidth": 0.7}
    behind = {"label": f"reference: {reference}", "color": "0.72", "linewidth": 1.8}
    _over_time(axes, panel, {name: behind if name == reference else front for name in panel.lines})


def _over_time(axes: Axes, panel: Panel, looks: Mapping[str, dict[str, Any]]) -> None:
    """Draw each line over time with its keys of matplotlib."""
    drawstyle = "steps-post" if panel.steps else "default"
    for name, (time, values) in panel.lines.items():
        axes.plot(time, values, drawstyle=drawstyle, **looks[name])
        axes.set_xlim(time[0], time[-1])
    if panel.steps:  # the vertical axis reaches to zero
        axes.update_datalim([(axes.get_xlim()[0], 0.0)])
        axes.autoscale_view(scalex=False)
    axes.set_ylabel(panel.y)


def loop(axes: Axes, run: Run, element: str) -> None:
    """Draw the force of an element over its deformation."""
    panel = chart.loop({element: run}, element)
    axes.plot(*panel.lines[element], color="0.1", linewidth=0.6)
    axes.set_xlabel(panel.x)
    axes.set_ylabel(panel.y)


def orbit(axes: Axes, run: Run, elements: Sequence[str], quantity: str) -> None:
    """Draw the deformation and force of a device along y over those along x."""
    factor, label = {
        "deformation_m": (1e3, "Deformation along {} (mm)"),
        "force_N": (1e-3, "Force along {} (kN)"),
    }[quantity]
    x, y = factor * columns(run, list(elements), quantity).T
    axes.plot(x, y, color="0.1", linewidth=0.6)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(label.format("x"))
    axes.set_ylabel(label.format("y"))


def envelopes(left: Axes, right: Axes, runs: Mapping[str, Run]) -> None:
    """Draw the peak absolute acceleration over the levels and the peak drift over the storeys."""
    acceleration, drift = chart.envelopes(runs)
    # a storey lies between its two levels
    for axes, panel, what, shift in ((left, acceleration, "Level", 0.0),
                                     (right, drift, "Storey", 0.5)):  # fmt: skip
        styles = line_styles(len(panel.lines), markers=True)
        for look, (name, (peaks, height)) in zip(styles, panel.lines.items(), strict=True):
            if name in panel.looks:
                look = panel.looks[name].print_keys()
            axes.plot(peaks, height + shift, label=name, **look)
        axes.set_xlim(0, panel.reach or 1)
        n = len(panel.rows)
        axes.set_ylim(-0.25, n - 0.75 + 2 * shift)
        every = -(-n // LABELS_A_HEIGHT) or 1
        axes.set_yticks((np.arange(n) + shift)[::every], panel.rows[::every])
        axes.set_xlabel(panel.x)
        axes.set_ylabel(f"{what} (-)")
