"""The trajectory of one run: modes, currents, states and outputs over time, as xarray, too."""

from __future__ import annotations

import re
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ground_motions import Record
from ground_motions.argument_types import checked

from ..errors import check_name
from ..structures import IsolatedStructure
from .complex_modes import Modes, real_rows
from .grid import Grid
from .kernel.slots import CLAMPED, MISSED, STEPS
from .outputs import Outputs
from .workspace import ERROR_FACTOR

if TYPE_CHECKING:
    import xarray

    from .workspace import Workspace

__all__ = ["Trajectory"]

_ROTATION = re.compile(r"rocking_.*|.*_(rotation|r[xyz])")
"""Names of dofs that are rotations: of plan buildings, soil and OpenSees."""


class Trajectory:
    """Time histories of one run, computed on first use; see also `Run`."""

    def __init__(
        self,
        isolated: IsolatedStructure,
        records: tuple[Record, ...],
        controller: str,
        modes: Modes,
        outputs: Outputs,
        work: Workspace,
    ):
        self.isolated, self.records, self.controller = isolated, records, controller
        self.modes, self.outputs, self.work = modes, outputs, work
        self.grid: Grid = work.grid
        self.clamped = int(work.counts[CLAMPED].sum())
        self.steps = int(work.counts[STEPS, 0])
        self.unresolved = int(work.counts[MISSED, 0])
        self.accuracy = max(work.tolerance, float(work.missed[0]) / ERROR_FACTOR)

    @cached_property
    def time(self) -> NDArray:
        """Samples of the record, s, (n_samples,)."""
        return self.records[0].time

    @cached_property
    def modal(self) -> NDArray:
        """Modes at all grid points, (n_points, 2 n_modes): real parts, then imaginary."""
        n_points, n_modes = len(self.grid.time), self.modes.eigenvalues.size
        z = self.work.z.reshape(n_points + 2, 2, -1)[:n_points, :, :n_modes]
        return z.reshape(n_points, 2 * n_modes)

    @cached_property
    def grid_current(self) -> NDArray:
        """Coil currents at all grid points, just after any change, (n_points, n_channels), A."""
        return currents_at(self.work, self.isolated.n_channels, 0)

    @cached_property
    def current(self) -> NDArray:
        """Coil currents at the samples, (n_samples, n_channels), A."""
        return self.grid_current[self.grid.samples]

    @cached_property
    def command(self) -> NDArray:
        """Commands at the samples, (n_samples, n_channels), A."""
        work = self.work
        start = np.repeat(self.grid.segments[:-1, 0], self.grid.segments[:-1, 2])
        command = work.command[np.append(start, start[-1]), : self.isolated.n_channels, 0]
        return command[self.grid.samples]

    @cached_property
    def values(self) -> NDArray:
        """All outputs at the samples, (n_samples, n_outputs), in the order of ``outputs.names``."""
        return self._motion() @ self.outputs.rows.T

    def combined(self, columns: NDArray) -> NDArray:
        """Sums of outputs at the samples, without computing every output.

        Parameters
        ----------
        columns : numpy.ndarray, shape (n_outputs, n)
            Factors of the outputs, in the order of ``outputs.names``; with units as the sums need.

        Returns
        -------
        numpy.ndarray, shape (n_samples, n)
            ``values @ columns``.
        """
        return self._motion() @ (self.outputs.rows.T @ columns)

    def _motion(self) -> NDArray:
        """Modes, device forces and ground accelerations at the samples: the inputs of outputs."""
        samples = self.grid.samples
        modal = self.modal[samples]
        ground = self.work.ground[samples, :, 0]
        force = device_forces(self.isolated, self.modes, modal, self.states, self.current)
        return np.concatenate([modal, force, ground], axis=1)

    @cached_property
    def states(self) -> NDArray:
        """Internal states at the samples, (n_samples, n_elements, n_states), device units."""
        return self.work.states[self.grid.samples, :, :, 0]

    @checked
    def output(self, name: str) -> NDArray:
        """One output at the samples.

        Parameters
        ----------
        name : str
            Name such as ``"floor5_acceleration_m_s2"``; see ``outputs.names``.

        Returns
        -------
        (n_samples,) array

        Raises
        ------
        InputError
            If there is no such output.
        """
        names = self.outputs.names
        check_name("output", name, names)
        return self.values[:, names.index(name)]


def currents_at(work: Workspace, n_channels: int, lane: int, share: float = 0.0) -> NDArray:
    """Coil currents at all grid points, just after any change, (n_points, n_channels), A."""
    # share: of the interval behind each grid point, at which they are instead
    grid = work.grid
    segment = np.repeat(np.arange(len(grid.segments) - 1), grid.segments[:-1, 2])
    segment = np.append(segment, segment[-1])
    start = work.coil_history[segment, :n_channels, lane]
    lag, slew = work.driver[:n_channels, 0, lane], work.driver[:n_channels, 1, lane]
    if not lag.any() and not np.isfinite(slew).any():
        return start
    first = grid.segments[segment, 0]
    t = grid.time - grid.time[first] + share * np.append(grid.lengths, 0.0)
    return coil_current(start, work.command[first, :n_channels, lane], lag, slew, t[:, None])


def coil_current(
    start: NDArray, command: NDArray, lag: NDArray, slew: NDArray, t: NDArray
) -> NDArray:
    """Coil current at a time t after a command; the kernel's formula for arrays."""
    gap = command - start
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        fast = np.where(np.isfinite(slew), np.maximum(np.abs(gap) - slew * lag, 0) / slew, 0.0)
        ramped = np.where(fast > 0, np.sign(gap) * np.where(fast > 0, slew, 0.0) * fast, 0.0)
        decay = np.where(lag > 0, np.exp((fast - t) / np.where(lag > 0, lag, 1.0)), 0.0)
        ramping = start + np.sign(gap) * np.where(np.isfinite(slew), slew, 0.0) * t
    return np.where(t < fast, ramping, command - (gap - ramped) * decay)


def device_forces(
    isolated: IsolatedStructure, modes: Modes, modal: NDArray, states: NDArray, current: NDArray
) -> NDArray:
    """Device forces (device scale) from modes, states and currents, (n_times, n_elements), N."""
    forces = np.empty((len(modal), len(isolated.elements)))
    for group, law in zip(isolated.groups, isolated.group_laws, strict=True):
        element = isolated.elements[group[0]]
        rows = real_rows(modes.deformation[list(group)])
        x, v = np.einsum("gkm,tm->kgt", rows, modal)
        i = np.zeros(len(modal)) if element.channel is None else current[:, element.channel]
        s = tuple(states[:, group[0], k] for k in range(len(law.states)))
        along, _ = law.respond(tuple(x), tuple(v), s, element.device.parameters_at(i))
        for e, force in zip(group, along, strict=True):
            forces[:, e] = force
    return forces


def dataset(run: Trajectory) -> xarray.Dataset:
    """Histories at the record's samples."""
    import xarray

    structure, isolated = run.isolated.structure, run.isolated
    n, m = structure.n_dofs, len(isolated.elements)
    widths = [n, n, n, len(structure.storeys), m, m, m, len(structure.directions)]
    parts = np.split(run.values, np.cumsum(widths)[:-1], axis=1)
    quantities = [
        ("displacement", "dof", "m", "displacement relative to the ground"),
        ("velocity", "dof", "m/s", "velocity relative to the ground"),
        ("acceleration", "dof", "m/s^2", "absolute acceleration"),
        ("drift", "storey", "m", "storey drift"),
        ("deformation", "element", "m", "deformation of the element"),
        ("deformation_rate", "element", "m/s", "deformation velocity of the element"),
        ("force", "element", "N", "restoring force of the element"),
        ("ground_acceleration", "direction", "m/s^2", "ground acceleration"),
    ]
    variables: dict[str, tuple] = {
        name: (("time", axis), values, {"units": unit, "long_name": meaning})
        for (name, axis, unit, meaning), values in zip(quantities, parts, strict=True)
    }
    rotations = " ".join(filter(_ROTATION.fullmatch, structure.names))
    for name, unit in (("displacement", "rad"), ("velocity", "rad/s"), ("acceleration", "rad/s^2")):
        if rotations:
            variables[name][2].update(rotations=rotations, units_of_rotations=unit)
    for name, values, meaning in (
        ("current", run.current, "coil current"),
        ("command", run.command, "commanded current"),
    ):
        variables[name] = (("time", "channel"), values, {"units": "A", "long_name": meaning})
    devices = zip(isolated.device_names, isolated.groups, isolated.group_laws, strict=True)
    for name, (e, *_), law in devices:
        for k, state in enumerate(law.states):
            variables[f"{name}_{state.name}"] = (
                ("time",),
                run.states[:, e, k],
                {"units": state.unit, "long_name": f"{state.meaning}, in the device's scale"},
            )
    return xarray.Dataset(
        variables,
        coords={
            "time": ("time", run.time, {"units": "s"}),
            "dof": list(structure.names),
            "storey": list(structure.storeys),
            "element": list(isolated.element_names),
            "channel": np.arange(isolated.n_channels),
            "direction": list(structure.directions),
        },
        attrs={
            "structure": structure.name,
            "controller": run.controller,
            "ground_motion": ", ".join(r.name for r in run.records),
        },
    )
