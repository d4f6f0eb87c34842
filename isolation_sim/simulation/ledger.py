"""The energy ledger of a run: supplied, stored and dissipated energies.

Every term is integrated separately from the piecewise solution of the run. The modes are propagated
exactly to the Gauss points of each grid interval (or of each step, if steps are smaller), the
device states follow from their collocation polynomials, and the powers are summed there. The
balance

    input + field work = kinetic + strain + device's stored + structural damping + device's loss

therefore checks the integration. Its error is reported.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ground_motions.argument_types import checked

from ..laws.derivatives import energy_gradients
from ..laws.law import Law
from .kernel.collocation import NODES, WEIGHTS
from .pieces import Pieces
from .trajectory import coil_current, currents_at

if TYPE_CHECKING:
    from .trajectory import Trajectory

QUADRATURE_ERROR = 1e-10
"""Change of a piece's work over the input energy that requires another division into halves."""
MOST_HALVINGS = 12


@dataclass(frozen=True)
class Ledger:
    """Energies of a run over time, J; totals since the start, except for the three stored ones.

    Attributes
    ----------
    time : (n_samples,) array
        Time, s.
    input_J : (n_samples,) array
        Work of the ground on the structure, relative motion: -int q'^T M r a_g dt.
    kinetic_J, strain_J : (n_samples,) array
        Present kinetic energy of the relative motion and strain energy of the structure.
    structural_damping_J : (n_samples,) array
        Energy lost in the structure's damping.
    device_stored_J : (n_samples,) array
        Present stored energy of the devices.
    device_dissipation_J : (n_samples,) array
        Energy lost in the devices.
    field_work_J : (n_samples,) array
        Work of changes of the current on the devices' stored energy.
    control_device_work_J : (n_samples,) array
        Work of the structure on its control devices: int sum_k F_k v_k dt. These are the elements
        with a coil; without any coil, all elements between structure and ground.
    absolute_input_J : (n_samples,) array
        Work of the ground on the structure, absolute motion: int V_0^T v_g dt with the base shear
        V_0. It equals ``input_J`` when the ground is at rest.
    closure_error : float
        Largest mismatch of the balance over the peak of the input.
    """

    time: NDArray
    input_J: NDArray
    kinetic_J: NDArray
    strain_J: NDArray
    structural_damping_J: NDArray
    device_stored_J: NDArray
    device_dissipation_J: NDArray
    field_work_J: NDArray
    control_device_work_J: NDArray
    absolute_input_J: NDArray
    closure_error: float

    @property
    def final(self) -> dict[str, float]:
        """Values at the end of the run, J."""
        return {
            name: float(getattr(self, name)[-1])
            for name in self.__dataclass_fields__
            if name.endswith("_J")
        }


@checked
def ledger(run: Trajectory) -> Ledger:
    """Energy ledger of a run.

    Parameters
    ----------
    run : Trajectory
        A run with its stored steps.

    Returns
    -------
    Ledger
    """
    pieces = _Works(run)
    structure = run.isolated.structure
    n = structure.n_dofs
    shapes = run.modes.shapes
    n_points = len(run.grid.time)
    work = np.zeros((5, len(pieces.first)))
    for low, high in pieces.stretches():
        part = np.flatnonzero(high > low)
        some = pieces.select(part)
        work[:, part] += some.work(low[part], high[part])
    totals = np.zeros((5, n_points))
    for k, values in enumerate(work):
        totals[k, 1:] = np.cumsum(np.bincount(pieces.interval, values, minlength=n_points - 1))
    stored, jumps = _stored(run)
    totals[4] += np.cumsum(jumps)
    state = run.modal @ np.concatenate([shapes.real, -shapes.imag], axis=1).T
    q, v = state[:, :n], state[:, n:]
    kinetic = 0.5 * np.einsum("td,td->t", v @ structure.mass, v)
    strain = 0.5 * np.einsum("td,td->t", q @ structure.stiffness, q)
    total_in, damping, loss, on_controls, field = totals
    mismatch = total_in + field - (kinetic + strain + stored + damping + loss)
    samples = run.grid.samples
    return Ledger(
        time=run.time,
        input_J=total_in[samples],
        kinetic_J=kinetic[samples],
        strain_J=strain[samples],
        structural_damping_J=damping[samples],
        device_stored_J=stored[samples],
        device_dissipation_J=loss[samples],
        field_work_J=field[samples],
        control_device_work_J=on_controls[samples],
        absolute_input_J=total_in[samples] + _carried(run, v[samples]),
        closure_error=float(np.abs(mismatch).max() / max(np.abs(total_in).max(), 1e-300)),
    )


def _carried(run: Trajectory, velocity: NDArray) -> NDArray:
    """Kinetic energy of the absolute motion minus that of the relative motion, J."""
    structure = run.isolated.structure
    inertia = structure.mass @ structure.influence
    ground = np.stack([record.velocity for record in run.records], axis=1)
    momentum = velocity @ inertia + 0.5 * ground @ (structure.influence.T @ inertia)
    return np.einsum("td,td->t", momentum, ground)


def _device_powers(
    element, law: Law, x: tuple, v: tuple, states: tuple, current: NDArray, rate: NDArray
) -> tuple[NDArray, NDArray, NDArray]:
    """Total, dissipated and field power of one device, in the structure's scale, W."""
    device = element.device
    i = current[:, element.channel] if element.channel is not None else np.zeros_like(x[0])
    di = rate[:, element.channel] if element.channel is not None else np.zeros_like(x[0])
    parameters = device.parameters_at(i)
    scale = device.force_scale * device.length
    forces, rates = law.respond(x, v, states, parameters)
    power = sum(f * along for f, along in zip(forces, v, strict=True))
    if law.stored_energy is None:
        return scale * power, scale * power, np.zeros_like(x[0])
    by_x, by_states, by_current = energy_gradients(law, device.current, x, states, i)
    stored_rate = sum(g * r for g, r in zip((*by_x, *by_states), (*v, *rates), strict=True))
    field = by_current * di
    loss = power - stored_rate
    if law.field_power is not None:
        within = law.field_power(x[0], states, parameters)
        field, loss = field + within, loss + within
    return scale * power, scale * loss, scale * field


def _stored(run: Trajectory) -> tuple[NDArray, NDArray]:
    """Devices' stored energy at the grid points, and the work of current jumps there, J."""
    n_points = len(run.grid.time)
    stored, jumps = np.zeros(n_points), np.zeros(n_points)
    before = _currents_before(run)
    states = run.work.states[:n_points, :, :, 0]
    isolated = run.isolated
    for group, law in zip(isolated.groups, isolated.group_laws, strict=True):
        element = isolated.elements[group[0]]
        device, channel = element.device, element.channel
        if law.stored_energy is None:
            continue
        rows = run.modes.deformation[list(group), 0]
        x = np.concatenate([rows.real, -rows.imag], axis=1) @ run.modal.T
        x = x[0] if law.directions == 1 else tuple(x)
        s = tuple(states[:, group[0], k] for k in range(len(law.states)))
        now, then = (
            (np.zeros(n_points),) * 2
            if channel is None
            else (run.grid_current[:, channel], before[:, channel])
        )
        scale = device.force_scale * device.length
        energy = scale * law.stored_energy(x, s, device.parameters_at(now))
        stored += energy
        if np.any(now != then):
            jumps += energy - scale * law.stored_energy(x, s, device.parameters_at(then))
    return stored, jumps


def _currents_before(run: Trajectory) -> NDArray:
    """Coil currents at the grid points, just before any change there, A."""
    work, grid = run.work, run.grid
    n_channels = run.isolated.n_channels
    before = currents_at(work, n_channels, 0).copy()
    first, span = grid.segments[:-1, 0], grid.spans[grid.segments[:-1, 1]]
    ends = coil_current(
        work.coil_history[:, :n_channels, 0],
        work.command[first, :n_channels, 0],
        work.driver[:n_channels, 0, 0],
        work.driver[:n_channels, 1, 0],
        span[:, None],
    )
    before[first[1:]] = ends[:-1]
    before[0] = run.grid_current[0]
    return before


class _Works(Pieces):
    """The works on the smooth pieces of a run."""

    def work(self, low: NDArray, high: NDArray) -> NDArray:
        """The five works, J, between fractions of every piece."""
        # Input, dissipation in structure and in devices, total work on the control devices, field
        # work. While a current changes, the pieces are halved until the works converge, because
        # the stored energy may depend strongly on the field.
        total = self._integral(low, high)
        start = self.run.work.coil_history[self.segment, :, 0]
        moves = np.any(self.run.work.command[self.first, :, 0] != start, axis=1)
        if any(e.device.law.field_power is not None for e in self.run.isolated.elements):
            moves[:] = True
        moving = np.flatnonzero(moves)
        if len(moving):
            allowed = QUADRATURE_ERROR * np.abs(total[0]).sum()
            some = self.select(moving)
            total[:, moving] = some._halved(
                low[moving], high[moving], total[:, moving], allowed, MOST_HALVINGS
            )
        return total

    def _halved(
        self, low: NDArray, high: NDArray, whole: NDArray, allowed: float, left: int
    ) -> NDArray:
        mid = (low + high) / 2
        halves = [(low, mid), (mid, high)]
        parts = [self._integral(*half) for half in halves]
        total = parts[0] + parts[1]
        off = np.flatnonzero(np.abs(total - whole).max(axis=0) > allowed)
        if left and len(off):
            some = self.select(off)
            total[:, off] = sum(
                some._halved(a[off], b[off], part[:, off], allowed, left - 1)
                for (a, b), part in zip(halves, parts, strict=True)
            )
        return total

    def _integral(self, low: NDArray, high: NDArray) -> NDArray:
        """The same by three Gauss points."""
        structure, shapes = self.run.isolated.structure, self.run.modes.shapes
        inertia = structure.mass @ structure.influence
        controls = self.run.isolated.control_devices
        total = np.zeros((5, len(low)))
        for node, weight in zip(NODES, WEIGHTS, strict=True):
            z, states, current, rate, ground = self.at(low + (high - low) * node)
            velocity = (z @ shapes[structure.n_dofs :].T).real
            total[0] -= weight * np.einsum("td,td->t", velocity @ inertia, ground)
            total[1] += weight * np.einsum("td,td->t", velocity @ structure.damping, velocity)
            isolated = self.run.isolated
            pairs = zip(isolated.groups, isolated.group_laws, states, strict=True)
            for group, law, own in pairs:
                rows = self.run.modes.deformation[list(group)]
                x, v = (rows.swapaxes(0, 1) @ z.T).real
                whole, loss, field = _device_powers(
                    isolated.elements[group[0]], law, tuple(x), tuple(v), own, current, rate
                )
                total[2] += weight * loss
                total[3] += weight * whole * controls[group[0]]
                total[4] += weight * field
        return total * (high - low) * self.length
