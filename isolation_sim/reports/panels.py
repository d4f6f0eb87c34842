"""Panels that the figures are made of: each draws runs into given axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..criteria import columns
from ..errors import unknown_name
from ..simulation.quantities import level_dofs, storey_rows
from .names import as_written
from .style import line_styles

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..simulation.result import Run

MARKS_A_LINE = 14
"""Markers of a line over time."""

_LABELS_A_HEIGHT = 12


def named(runs: Run | Mapping[str, Run] | Sequence[Run]) -> dict[str, Run]:
    """Name runs for printing."""
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
    """Find a direction of ground motion."""
    directions = run.isolated.structure.directions
    if direction is None:
        return 0
    if direction not in directions:
        raise unknown_name("direction", direction, directions)
    return directions.index(direction)


def ground_acceleration(axes: Axes, run: Run, direction: int = 0) -> None:
    """Draw the ground acceleration over time."""
    record = run.records[direction]
    axes.plot(record.time, record.acceleration, color="0.3", linewidth=0.7)
    axes.set_xlim(record.time[0], record.time[-1])
    axes.set_ylabel("Ground\nacc. (m/s²)")


def base_displacement(axes: Axes, runs: Mapping[str, Run], direction: int = 0) -> None:
    """Draw the base displacement of each run over time."""
    _over_time(
        axes,
        runs,
        {
            name: 1e3 * columns(run, [base_dof(run, direction)], "displacement_m")[:, 0]
            for name, run in runs.items()
        },
    )
    axes.set_ylabel("Base\ndisp. (mm)")


def roof_acceleration(axes: Axes, runs: Mapping[str, Run], direction: int = 0) -> None:
    """Draw the absolute acceleration of the last level of each run over time."""
    _over_time(
        axes,
        runs,
        {
            name: columns(run, [roof_dof(run, direction)], "acceleration_m_s2")[:, 0]
            for name, run in runs.items()
        },
    )
    axes.set_ylabel("Roof\nacc. (m/s²)")


def coil_currents(axes: Axes, runs: Mapping[str, Run], channel: int = 0) -> None:
    """Draw the coil current of each run over time; runs without that channel are left out."""
    _over_time(
        axes,
        runs,
        {
            name: run.current[:, channel]
            for name, run in runs.items()
            if run.isolated.n_channels > channel
        },
        drawstyle="steps-post",
    )
    from_zero(axes)
    axes.set_ylabel("Coil\ncurrent (A)")


def from_zero(axes: Axes) -> None:
    """Widen the vertical axis so that it shows zero."""
    axes.update_datalim([(axes.get_xlim()[0], 0.0)])
    axes.autoscale_view(scalex=False)


def loop(axes: Axes, run: Run, element: str) -> None:
    """Draw the force of an element over its deformation."""
    deformation = columns(run, [element], "deformation_m")[:, 0]
    force = columns(run, [element], "force_N")[:, 0]
    axes.plot(1e3 * deformation, 1e-3 * force, color="0.1", linewidth=0.6)
    axes.set_xlabel("Deformation (mm)")
    axes.set_ylabel("Force (kN)")


def orbit(axes: Axes, run: Run, elements: Sequence[str], quantity: str) -> None:
    """Draw what a device does along y over what it does along x."""
    factor, label = {
        "deformation_m": (1e3, "Deformation along {} (mm)"),
        "force_N": (1e-3, "Force along {} (kN)"),
    }[quantity]
    x, y = factor * columns(run, list(elements), quantity).T
    axes.plot(x, y, color="0.1", linewidth=0.6)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(label.format("x"))
    axes.set_ylabel(label.format("y"))


def acceleration_envelope(axes: Axes, runs: Mapping[str, Run]) -> None:
    """Draw the peak absolute acceleration over the levels of each run."""
    structure = next(iter(runs.values())).isolated.structure
    dofs = level_dofs(structure)
    peaks = {name: run.peaks["floor_acceleration_m_s2"] for name, run in runs.items()}
    _envelope(axes, peaks, np.arange(len(dofs)))
    labels = [structure.names[dof] for dof in dofs[:, 0]]
    _height_ticks(axes, np.arange(len(dofs)), without_direction(labels, structure.directions))
    axes.set_xlabel("Peak abs. acceleration (m/s²)")
    axes.set_ylabel("Level (-)")


def drift_envelope(axes: Axes, runs: Mapping[str, Run]) -> None:
    """Draw the peak drift over the storeys of each run."""
    structure = next(iter(runs.values())).isolated.structure
    rows = storey_rows(structure)
    # a storey lies between the levels that it ties
    height = np.arange(len(rows)) + 0.5
    _envelope(axes, {name: 1e3 * run.peaks["drift_m"] for name, run in runs.items()}, height)
    labels = [structure.storeys[row] for row in rows[:, 0]]
    _height_ticks(axes, height, without_direction(labels, structure.directions))
    axes.set_ylim(-0.25, len(rows) + 0.25)
    axes.set_xlabel("Peak storey drift (mm)")
    axes.set_ylabel("Storey (-)")


def _envelope(axes: Axes, values: Mapping[str, NDArray], height: NDArray) -> None:
    styles = line_styles(len(values), markers=True)
    for style, (name, peaks) in zip(styles, values.items(), strict=True):
        axes.plot(peaks, height, label=name, **style)
    axes.set_xlim(0, 1.06 * max(np.max(peaks, initial=0.0) for peaks in values.values()) or 1)
    axes.set_ylim(-0.25, len(height) - 0.75)


def _height_ticks(axes: Axes, height: NDArray, labels: Sequence[str]) -> None:
    every = -(-len(labels) // _LABELS_A_HEIGHT) or 1
    axes.set_yticks(height[::every], labels[::every])


def _over_time(
    axes: Axes, runs: Mapping[str, Run], series: Mapping[str, NDArray], **options: Any
) -> None:
    # a run looks the same in every panel, also in one that leaves another run out
    styles = dict(zip(runs, line_styles(len(runs)), strict=True))
    for k, (name, values) in enumerate(series.items()):
        time = runs[name].time
        every = max(len(time) // MARKS_A_LINE, 1)
        # side by side, so that lines on top of each other still show
        marks = (k * every // max(len(series), 1), every)
        axes.plot(
            time, values, label=name, linewidth=0.8, markevery=marks, **styles[name], **options
        )
        axes.set_xlim(time[0], time[-1])


def base_dof(run: Run, direction: int) -> str:
    """Find the dof whose displacement is drawn as the base's."""
    structure = run.isolated.structure
    moved = [d for d in structure.base if structure.influence[d, direction]]
    return structure.names[moved[0] if moved else _dofs(run, direction)[0]]


def roof_dof(run: Run, direction: int) -> str:
    """Find the dof of the last level."""
    return run.isolated.structure.names[_dofs(run, direction)[-1]]


def element_along(run: Run, direction: int = 0) -> str:
    """Find the element whose loop is drawn for the isolators."""
    isolated = run.isolated
    along = isolated.holding[:, direction]
    return isolated.element_names[int(np.argmax(along != 0))]


def _dofs(run: Run, direction: int) -> NDArray:
    return np.flatnonzero(run.isolated.structure.above_foundation[:, direction])


def without_direction(labels: Sequence[str], directions: Sequence[str]) -> list[str]:
    """Take the direction off the names of levels or storeys."""
    ends = tuple(f"_{direction}" for direction in directions)
    return [label.rsplit("_", 1)[0] if label.endswith(ends) else label for label in labels]
