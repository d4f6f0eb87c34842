"""Panels of the figures: each function draws runs on existing axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..criteria import columns
from ..errors import unknown_name
from ..written_names import as_written
from . import chart
from .chart import Panel
from .style import line_styles

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..simulation.result import Run

MARKS_A_LINE = 14
"""Number of markers of a line over time."""

LABELS_A_HEIGHT = 12
"""Largest number of level names beside a panel."""


def named(runs: Run | Mapping[str, Run] | Sequence[Run]) -> dict[str, Run]:
    """Runs by the names to print."""
    if isinstance(runs, Mapping):
        return {as_written(name): run for name, run in runs.items()}
    result: dict[str, Run] = {}
    for run in runs if isinstance(runs, Sequence) else [runs]:
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
    if direction not in directions:
        raise unknown_name("direction", direction, directions)
    return directions.index(direction)


def ground_acceleration(axes: Axes, run: Run, direction: int = 0) -> None:
    """Draw the ground acceleration over time."""
    panel = chart.ground_acceleration(run, direction)
    ((time, acceleration),) = panel.lines.values()
    axes.plot(time, acceleration, color="0.3", linewidth=0.7)
    axes.set_xlim(time[0], time[-1])
    axes.set_ylabel(f"{panel.short} ({panel.unit})")


def over_time(axes: Axes, panel: Panel, names: Sequence[str]) -> None:
    """Draw lines over time; a name has the same look in every panel with these names."""
    styles = dict(zip(names, line_styles(len(names)), strict=True))
    drawstyle = "steps-post" if panel.steps else "default"
    for k, (name, (time, values)) in enumerate(panel.lines.items()):
        every = max(len(time) // MARKS_A_LINE, 1)
        # markers at different times, so that coinciding lines still show
        marks = (k * every // max(len(panel.lines), 1), every)
        look = {"linewidth": 0.8, "markevery": marks, **styles[name]}
        axes.plot(time, values, label=name, drawstyle=drawstyle, **look)
        axes.set_xlim(time[0], time[-1])
    if panel.steps:
        from_zero(axes)
    axes.set_ylabel(f"{panel.short} ({panel.unit})")


def from_zero(axes: Axes) -> None:
    """Extend the vertical axis to zero."""
    axes.update_datalim([(axes.get_xlim()[0], 0.0)])
    axes.autoscale_view(scalex=False)


def loop(axes: Axes, run: Run, element: str) -> None:
    """Draw the force of an element over its deformation."""
    panel = chart.loop({element: run}, element)
    axes.plot(*panel.lines[element], color="0.1", linewidth=0.6)
    axes.set_xlabel("Deformation (mm)")
    axes.set_ylabel(f"{panel.short} ({panel.unit})")


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
            axes.plot(peaks, height + shift, label=name, **look)
        largest = max(np.max(peaks, initial=0.0) for peaks, _ in panel.lines.values())
        axes.set_xlim(0, 1.06 * largest or 1)
        n = len(panel.levels)
        axes.set_ylim(-0.25, n - 0.75 + 2 * shift)
        every = -(-n // LABELS_A_HEIGHT) or 1
        axes.set_yticks((np.arange(n) + shift)[::every], panel.levels[::every])
        axes.set_xlabel(f"{panel.short} ({panel.unit})")
        axes.set_ylabel(f"{what} (-)")
