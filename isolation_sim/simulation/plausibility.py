"""Plausibility of a run: its ground motion, its isolators and its end."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ground_motions import STANDARD_GRAVITY, Record

from ..laws.current_dependence import CurrentDependence
from ..laws.law import Law
from ..structures import IsolatedStructure
from ..structures.element import isolation_elements
from ..structures.plausibility import ISOLATED_PERIODS, implausible
from .complex_modes import Modes
from .workspace import Workspace, modal_motion

LARGEST_PGA = 2 * STANDARD_GRAVITY
"""Largest plausible acceleration of the ground, m/s^2; few records exceed it."""
LONGEST_STEP = 0.1
"""Longest plausible step of a ground motion, s; records have 0.005 to 0.02 s."""
SLOW_PERIOD = 100.0
"""Period of the cycle for the restoring stiffness, s: viscous forces are small."""
LAST = 2.0
"""Time before the end of a run at which its motion is checked, s: half a period of 4 s."""
INSTANTS = 400
"""Instants of a run at which its motion is checked, at least."""
STILL_MOVING = 0.1
"""Least kinetic energy at the end, over its peak, of a warning; 0.046 at most in the main job."""
DISPLACED = 0.1
"""Least displacement at the end, over its peak, of a warning; 0.053 at most in the main job."""


def implausible_motion(records: Sequence[Record]) -> list[str]:
    """Warnings about accelerations and steps that no record of an earthquake has."""
    lines = []
    for record in records:
        if record.pga > LARGEST_PGA:
            lines.append(
                f"ground motion {record.name} peaks at {record.pga:.3g} m/s^2, "
                f"{record.pga / STANDARD_GRAVITY:.3g} g; records rarely exceed 2 g: check its unit "
                "and scale"
            )
        if record.dt > LONGEST_STEP * (1 + 1e-9):
            lines.append(
                f"ground motion {record.name} has a step of {record.dt:.3g} s; records have 0.1 s "
                "at most: check dt"
            )
    return lines


@lru_cache(maxsize=256)
def not_restoring(isolated: IsolatedStructure) -> tuple[str, ...]:
    """Warnings about isolators that do not return the base, at the lowest and highest current."""
    structure = isolated.structure
    currents = [0.0]
    for channel in range(isolated.n_channels):
        low, high = isolated.current_range(channel)
        currents = [max(low, 0.0), min(high, isolated.tested_current(channel))]
    lines = []
    for column, name in enumerate(structure.horizontal if structure.base else ()):
        rigid = structure.above_foundation[:, column]
        least = (rigid @ structure.mass @ rigid) * (2 * np.pi / ISOLATED_PERIODS[1]) ** 2
        for current in dict.fromkeys(filter(np.isfinite, currents)):
            stiffness = rigid @ structure.stiffness @ rigid
            for e in isolation_elements(isolated):
                element = isolated.elements[e]
                amperes = 0.0 if element.channel is None else current
                device = element.device
                stiffness += (
                    isolated.holding[e, column] ** 2
                    * (device.force_scale / device.length)
                    * _slow_stiffness(
                        device.law, device.current, amperes,
                        device.deformation_scale / device.length,
                    )
                )  # fmt: skip
            if stiffness < least:
                at = f" at {current:.3g} A" if isolated.n_channels else ""
                remedy = (
                    "; scale bearings that yield by effective_period_s" if stiffness > 0 else ""
                )
                lines.append(
                    f"{structure.name}: the isolators have next to no restoring stiffness along "
                    f"{name}{at}: {stiffness:.3g} N/m in a slow cycle of large deformation, so "
                    "that nothing returns the base; the isolated period at rest is not its period"
                    f"{remedy}"
                )
    return tuple(lines)


@lru_cache(maxsize=256)
def _slow_stiffness(
    law: Law, dependence: CurrentDependence, current: float, amplitude: float
) -> float:
    """Slope of the mean of both branches of a slow loop, between half of its amplitudes, N/m."""
    from scipy.integrate import solve_ivp

    if law.unit or law.name == "measured_force":
        return np.inf  # unknown
    parameters, omega = dependence.at(current), 2 * np.pi / SLOW_PERIOD

    def motion(t: float | NDArray) -> tuple:
        return amplitude * np.sin(omega * t), amplitude * omega * np.cos(omega * t)

    # at half of the amplitude: downwards on both sides, then upwards
    instants = np.array([150.0, 210.0, 330.0, 390.0]) / 360 * SLOW_PERIOD
    states = np.zeros((0, instants.size))
    if law.states:
        states = solve_ivp(
            lambda t, s: law.rates(*motion(t), tuple(s), parameters),
            (0.0, instants[-1]), np.zeros(len(law.states)), "LSODA", t_eval=instants,
            rtol=1e-6, atol=1e-9, max_step=SLOW_PERIOD / 50,
        ).y  # fmt: skip
    if states.shape[1] < instants.size:
        return np.inf  # the law cannot follow this motion
    force = np.broadcast_to(law.force(*motion(instants), tuple(states), parameters), 4)
    return float(force @ [1, -1, -1, 1] / (2 * amplitude))


def overturned_by_more(isolated: IsolatedStructure) -> Iterator[str]:
    """A warning if elements in the storeys overturn the building, too, without changing a load."""
    structure = isolated.structure
    above = list(structure.superstructure)
    loads = [e for e in isolated.elements if e.name.endswith("_load") and e.direction[above].any()]
    others = [
        e.name for e in isolated.elements
        if e.direction[above].any() and not e.follows
    ]  # fmt: skip
    if loads and others:
        yield (
            f"{structure.name}: the overturning moment is that of the elastic storey forces; those "
            f"of {', '.join(others)} are not in it"
        )


def input_warnings(
    isolated: IsolatedStructure, modes: Modes, records: Sequence[Record]
) -> tuple[str, ...]:
    """Warnings about an implausible structure, its isolators and the ground motion."""
    values = modes.eigenvalues
    swinging = np.abs(values[np.abs(values.imag) > 1e-6 * np.abs(values)])
    period = 2 * np.pi / float(np.min(swinging, initial=np.inf))
    of_plant = implausible(isolated, period) or not_restoring(isolated)
    of_plant = *of_plant, *overturned_by_more(isolated)
    return *of_plant, *implausible_motion(records)


def end_state(
    isolated: IsolatedStructure, modes: Modes, work: Workspace, lane: int = 0
) -> tuple[bool, float]:
    """Whether a building still moves at the end, and its share of the peak displacement if not."""
    # modes are faster than all outputs
    grid = work.grid
    some = grid.samples[:: _every(len(grid.samples))]
    z = modal_motion(work, modes.eigenvalues.size, lane, some)
    motion = z.real @ modes.shapes.real.T - z.imag @ modes.shapes.imag.T
    return _end_state(isolated, grid.time[some] - grid.time[grid.samples[-1]], motion)


def saved_end_state(
    isolated: IsolatedStructure, time: NDArray, values: NDArray
) -> tuple[bool, float]:
    """The same from all outputs at the samples, of a run without its working memory."""
    some = slice(None, None, _every(len(time)))
    return _end_state(
        isolated, time[some] - time[-1], values[some, : 2 * isolated.structure.n_dofs]
    )


def _every(n_samples: int) -> int:
    """Step of the samples at which a run is checked: some are enough."""
    return max(n_samples // INSTANTS, 1)


def _end_state(isolated: IsolatedStructure, time: NDArray, motion: NDArray) -> tuple[bool, float]:
    """Judge displacements and velocities at times before the end."""
    structure, n = isolated.structure, isolated.structure.n_dofs
    last = time >= -LAST
    velocity = motion[:, n:]
    kinetic = np.sum(velocity @ structure.mass * velocity, axis=1)  # twice
    if np.max(kinetic[last]) > STILL_MOVING * np.max(kinetic):
        return True, 0.0
    rows = structure.isolation_rows
    base = motion[:, :n] @ rows.reshape(-1, n).T
    # the base oscillates about a point that is not zero
    aside = np.abs(base[last]).min(axis=0) * (np.ptp(np.sign(base[last]), axis=0) == 0)
    peak = np.max(np.abs(base), initial=0.0)
    return False, float(np.max(aside, initial=0.0) / peak) if peak else 0.0
