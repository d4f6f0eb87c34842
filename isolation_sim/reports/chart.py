"""Contents of the charts of runs, drawn by `panels` for print and by `html` for a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..criteria import columns
from ..simulation.quantities import level_dofs, storey_rows

if TYPE_CHECKING:
    from ..simulation.result import Run


@dataclass(frozen=True)
class Panel:
    """Lines over one pair of axes, in the units of the axes."""

    title: str  # Quantity
    short: str  # Quantity, abbreviated for an axis
    unit: str  # Unit of the quantity
    lines: Mapping[str, tuple[NDArray, NDArray]]  # Abscissas and ordinates by run
    steps: bool = False  # Whether a value is constant until the next one
    levels: Sequence[str] = ()  # Names of the levels or storeys at the ordinates 0, 1, 2


def ground_acceleration(run: Run, direction: int) -> Panel:
    """Ground acceleration over time."""
    record = run.records[direction]
    title = f"Ground acceleration{_along(run, direction)}"
    lines = {record.name: (record.time, record.acceleration)}
    return Panel(title, "Ground\nacc.", "m/s²", lines)


def base_and_roof(runs: Mapping[str, Run], direction: int) -> tuple[Panel, Panel]:
    """Base displacement and absolute acceleration of the last level over time."""
    displacement, acceleration = {}, {}
    for name, run in runs.items():
        structure = run.isolated.structure
        dofs = np.flatnonzero(structure.above_foundation[:, direction])
        moved = [d for d in structure.base if structure.influence[d, direction]]
        base, roof = structure.names[moved[0] if moved else dofs[0]], structure.names[dofs[-1]]
        displacement[name] = run.time, 1e3 * columns(run, [base], "displacement_m")[:, 0]
        acceleration[name] = run.time, columns(run, [roof], "acceleration_m_s2")[:, 0]
    along = _along(next(iter(runs.values())), direction)
    relative = f"Base displacement relative to the ground{along}"
    return (
        Panel(relative, "Base\ndisp.", "mm", displacement),
        Panel(f"Absolute roof acceleration{along}", "Roof\nacc.", "m/s²", acceleration),
    )


def coil_current(runs: Mapping[str, Run], channel: int) -> Panel:
    """Coil current over time, for the runs that have this channel."""
    several = next(iter(runs.values())).isolated.n_channels > 1
    lines = {
        name: (run.time, run.current[:, channel])
        for name, run in runs.items()
        if run.isolated.n_channels > channel
    }
    title = f"Coil current, channel {channel}" if several else "Coil current"
    return Panel(title, "Coil\ncurrent", "A", lines, steps=True)


def loop(runs: Mapping[str, Run], element: str) -> Panel:
    """Force (kN) of an element over its deformation (mm)."""
    lines = {
        name: (
            1e3 * columns(run, [element], "deformation_m")[:, 0],
            1e-3 * columns(run, [element], "force_N")[:, 0],
        )
        for name, run in runs.items()
    }
    return Panel(element, "Force", "kN", lines)


def envelopes(runs: Mapping[str, Run]) -> tuple[Panel, Panel]:
    """Peak absolute acceleration over the levels, and peak drift over the storeys."""
    structure = next(iter(runs.values())).isolated.structure
    ends = tuple(f"_{direction}" for direction in structure.directions)

    def panel(title: str, short: str, unit: str, key: str, factor: float, names: list) -> Panel:
        labels = [name.rsplit("_", 1)[0] if name.endswith(ends) else name for name in names]
        peaks = {
            name: (factor * run.peaks[key], np.arange(len(names))) for name, run in runs.items()
        }
        return Panel(title, short, unit, peaks, levels=labels)

    levels = [structure.names[dof] for dof in level_dofs(structure)[:, 0]]
    storeys = [structure.storeys[row] for row in storey_rows(structure)[:, 0]]
    acceleration = "Peak absolute acceleration", "Peak abs. acceleration", "m/s²"
    return (
        panel(*acceleration, "floor_acceleration_m_s2", 1.0, levels),
        panel("Peak storey drift", "Peak storey drift", "mm", "drift_m", 1e3, storeys),
    )


def element_along(run: Run, direction: int = 0) -> str:
    """Find the element whose loop represents the isolators."""
    along = run.isolated.holding[:, direction]
    return run.isolated.element_names[int(np.argmax(along != 0))]


def _along(run: Run, direction: int) -> str:
    directions = run.isolated.structure.directions
    return f" along {directions[direction]}" if len(directions) > 1 else ""
