"""The description of a chart, and the charts of runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..criteria import columns
from ..simulation.outputs import level_dofs, level_names, storey_names
from ..structures.element import moat_walls
from .style import Look

if TYPE_CHECKING:
    from ..simulation.result import Run


OVER_TIME = "Time (s)"
"""Horizontal axis of the panels that zoom together on a page."""


FIXED_BASE_LOOK = Look("#666666", (1.0, 1.2), "*")
"""Look of the building on a fixed base, beside controllers."""

_MOST_BEYOND = 3.0
"""Largest part of an axis that is for the building on a fixed base, over that of isolated ones."""


@dataclass(frozen=True)
class Panel:
    """Lines over one pair of axes, in the units of the axes; `panels` and `html.panels` draw it."""

    title: str  # Contents
    # x, y: Titles of the axes, with their units
    x: str
    y: str
    lines: Mapping[str, tuple[NDArray, NDArray]]  # Abscissas and ordinates by name
    looks: Mapping[str, Look] = field(default_factory=dict)  # Looks; of runs the figure chooses
    unit: str = ""  # Unit of the quantity
    note: str = ""  # Numbers for a second line of the title
    steps: bool = False  # Whether a value is constant until the next one
    rows: Sequence[str] = ()  # Names at the ordinates 0, 1, 2
    log_x: bool = False  # Whether the abscissas have a logarithmic axis
    log_y: bool = False  # Whether the ordinates have a logarithmic axis
    groups: Mapping[str, str] = field(default_factory=dict)  # Name that lines share in the legend
    band: tuple[float, float] | None = None  # Abscissas of a shaded band
    limits: tuple[float, float] | None = None  # Lower and upper end of the vertical axis
    reach: float | None = None  # Upper end of a horizontal axis from 0


def ground_acceleration(run: Run, direction: int) -> Panel:
    """Ground acceleration over time."""
    record = run.records[direction]
    lines = {"ground": (record.time, record.acceleration)}
    look = {"ground": Look("#4d4d4d")}
    return _over_time(
        f"Ground acceleration{_along(run, direction)}",
        f"Ground\nacc.{_behind(run, direction)}", "m/s²", lines, looks=look,
    )  # fmt: skip


def base_and_roof(runs: Mapping[str, Run], direction: int) -> tuple[Panel, Panel]:
    """Base displacement and absolute acceleration of the last level over time."""
    displacement, acceleration = {}, {}
    for name, run in runs.items():
        structure = run.isolated.structure
        levels = np.unique(level_dofs(structure))
        dofs = levels[structure.above_foundation[levels, direction] != 0]
        moved = [d for d in structure.base if structure.influence[d, direction]]
        base, roof = structure.names[moved[0] if moved else dofs[0]], structure.names[dofs[-1]]
        displacement[name] = run.time, 1e3 * columns(run, [base], "displacement_m")[:, 0]
        acceleration[name] = run.time, columns(run, [roof], "acceleration_m_s2")[:, 0]
    first = next(iter(runs.values()))
    along, behind = _along(first, direction), _behind(first, direction)
    relative, absolute = "Base displacement relative to the ground", "Absolute roof acceleration"
    return (
        _over_time(relative + along, f"Base\ndisp.{behind}", "mm", displacement),
        _over_time(absolute + along, f"Roof\nacc.{behind}", "m/s²", acceleration),
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
    return _over_time(title, "Coil\ncurrent", "A", lines, steps=True)


def coil_currents(run: Run) -> Panel:
    """Coil currents of all channels over time."""
    lines = {f"channel {k}": (run.time, current) for k, current in enumerate(run.current.T)}
    return _over_time("Coil currents", "Current", "A", lines, steps=True)


def loop(runs: Mapping[str, Run], element: str) -> Panel:
    """Force (kN) of an element over its deformation (mm)."""
    lines = {
        name: (
            1e3 * columns(run, [element], "deformation_m")[:, 0],
            1e-3 * columns(run, [element], "force_N")[:, 0],
        )
        for name, run in runs.items()
    }
    return Panel(element, "Deformation (mm)", "Force (kN)", lines)


def layer_loop(runs: Mapping[str, Run], direction: int) -> Panel:
    """Force (kN) of all elements at the base over the base's mean displacement (mm)."""
    lines = {}
    for name, run in runs.items():
        isolated, names = run.isolated, run.isolated.structure.names
        displacement = columns(run, names, "displacement_m")
        moved = displacement @ isolated.structure.isolation_rows[:, direction].mean(axis=0)
        force = columns(run, isolated.element_names, "force_N") @ isolated.holding[:, direction]
        lines[name] = 1e3 * moved, 1e-3 * force
    title = f"isolation layer{_along(next(iter(runs.values())), direction)}"
    return Panel(title, "Base displacement (mm)", "Force (kN)", lines)


def envelopes(runs: Mapping[str, Run]) -> tuple[Panel, Panel]:
    """Peak absolute acceleration over the levels, and peak drift over the storeys."""
    # a building on a fixed base has no level at the base, and far larger peaks
    isolated = {name: run for name, run in runs.items() if run.isolated.structure.base} or runs
    looks = {name: FIXED_BASE_LOOK for name in runs if name not in isolated}
    structure = next(iter(isolated.values())).isolated.structure

    def panel(title: str, x: str, unit: str, key: str, factor: float, names: list) -> Panel:
        peaks = {}
        for name, run in runs.items():
            values = factor * run.peaks[key]
            peaks[name] = values, np.arange(len(names))[len(names) - len(values) :]
        largest, most = (
            max(np.max(peaks[name][0], initial=0.0) for name in some) for some in (runs, isolated)
        )
        if largest > _MOST_BEYOND * most:
            x = f"{x}; {', '.join(looks)} to {largest:.3g}"
        reach = 1.06 * min(largest, _MOST_BEYOND * most) or None
        return Panel(f"{title} ({unit})", x, "", peaks, looks, unit, rows=names, reach=reach)

    levels, storeys = level_names(structure), storey_names(structure)
    acceleration = "Peak absolute acceleration", "Peak abs. acceleration (m/s²)", "m/s²"
    return (
        panel(*acceleration, "floor_acceleration_m_s2", 1.0, levels),
        panel("Peak storey drift", "Peak storey drift (mm)", "mm", "drift_m", 1e3, storeys),
    )


def touching(runs: Mapping[str, Run], wall: str) -> dict[str, Run]:
    """Runs in which a wall is touched."""
    return {name: run for name, run in runs.items() if run.contacts.get(wall)}


def floor_spectra(runs: Mapping[str, Run], direction: str | None, looks: Sequence[Look]) -> list:
    """Spectra of the absolute accelerations (m/s^2) of each level."""
    lines: dict[str, dict[str, tuple[NDArray, NDArray]]] = {}
    for name, run in runs.items():
        for level, spectrum in run.floor_spectra(direction=direction).items():
            lines.setdefault(level, {})[name] = spectrum.period, spectrum.sa
    by_name = dict(zip(runs, looks, strict=True))
    return [floor_spectrum(level, own, by_name) for level, own in lines.items()]


def floor_spectrum(title: str, lines: Mapping, looks: Mapping[str, Look]) -> Panel:
    """Spectra of the absolute acceleration (m/s^2) of a level over the periods (s)."""
    return Panel(title, "Period (s)", "Sa, 5 % (m/s²)", lines, looks, "m/s²", log_x=True)


def elements_along(runs: Mapping[str, Run], direction: int) -> list[str]:
    """One element of each kind at the base: isolators, bearings, and walls that are touched."""
    isolated = next(iter(runs.values())).isolated
    walls = [isolated.element_names[e] for e in moat_walls(isolated)]
    left_out = {name for name in walls if not touching(runs, name)}
    # the third element of a biaxial device is its axial load and has no force
    left_out |= {isolated.element_names[group[2]] for group in isolated.groups if len(group) > 2}
    kinds: dict[tuple, str] = {}
    for e in np.flatnonzero(isolated.holding[:, direction]).tolist():
        element = isolated.elements[e]
        if element.name not in left_out:
            kinds.setdefault((element.device.law, element.channel), element.name)
    return list(kinds.values())


def _over_time(title: str, short: str, unit: str, lines: Mapping, **more: Any) -> Panel:
    """A panel over time; the vertical axis has a short title."""
    return Panel(f"{title} ({unit})", OVER_TIME, f"{short} ({unit})", lines, unit=unit, **more)


def _along(run: Run, direction: int) -> str:
    directions = run.isolated.structure.directions
    return f" along {directions[direction]}" if len(directions) > 1 else ""


def _behind(run: Run, direction: int) -> str:
    """The direction behind an axis's short title, if there are several."""
    return _along(run, direction).replace(" along", "")
