"""The energy ledger of a run: supplied, stored and dissipated energies.

Every term is integrated separately from the piecewise solution of the run. The modes are propagated
exactly to the Gauss points of each grid interval (or of each step, if steps are smaller), the
device states follow from their collocation polynomials, and the powers are summed there. The
balance

    input + field work = kinetic + strain + device's stored + structural damping + device's loss

therefore checks the integration. Its error is reported.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ground_motions.argument_types import checked

from ..laws.derivatives import energy_gradients
from ..laws.law import Law
from .kernel.collocation import NODES, WEIGHTS
from .kernel.slots import STEP
from .trajectory import coil_current, currents_at

if TYPE_CHECKING:
    from .trajectory import Trajectory

QUADRATURE_ERROR = 1e-10
"""Change of a piece's work over the input energy that requires another division into halves."""
MOST_HALVINGS = 12
_ARRAYS = "length interval first from_window offset size tau0 tau1 window z elements".split()
"""Arrays with one entry per piece."""


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
    pieces = _Pieces(run)
    structure = run.isolated.structure
    n = structure.n_dofs
    shapes = run.modes.shapes
    n_points = len(run.grid.time)
    work = np.zeros((5, len(pieces.first)))
    for low, high in pieces.stretches():
        part = np.flatnonzero(high > low)
        some = pieces.taken(part)
        work[:, part] += some.work(low[part], high[part])
    totals = np.zeros((5, n_points))
    for k, values in enumerate(work):
        totals[k, 1:] = np.cumsum(np.bincount(pieces.interval, values, minlength=n_points - 1))
    stored, jumps = _stored(run)
    totals[4] += np.cumsum(jumps)
    state = run.modal @ np.concatenate([shapes.real, -shapes.imag], axis=1).T
    q, v = state[:, :n], state[:, n:]
    kinetic = 0.5 * np.einsum("ti,ij,tj->t", v, structure.mass, v)
    strain = 0.5 * np.einsum("ti,ij,tj->t", q, structure.stiffness, q)
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
    first, span = grid.windows[:-1, 0], grid.spans[grid.windows[:-1, 1]]
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


class _Pieces:
    """The run's smooth pieces: grid intervals, or steps if they are smaller."""

    # On a piece the ground is linear, the elements' forces on the structure are quadratics and the
    # device states cubics.

    def __init__(self, run: Trajectory):
        self.run = run
        grid, work = run.grid, run.work
        windows, kinds = grid.windows[:-1, 0], grid.windows[:-1, 1]
        intervals = grid.windows[:-1, 2]
        span = grid.spans[kinds]
        # one row per step
        steps = work.steps[: work.step_count[0]]
        window, begin, length, _ = steps[:, -STEP:].T
        window = window.astype(int)
        step_start = begin * intervals[window]  # in grid intervals
        step_size = length * intervals[window]
        # one row per piece
        per_step = np.maximum(np.round(step_size), 1).astype(int)
        step = np.repeat(np.arange(len(window)), per_step)
        within = np.arange(per_step.sum()) - np.repeat(np.cumsum(per_step) - per_step, per_step)
        start = step_start[step] + within
        piece_size = np.minimum(step_size[step], 1.0)
        w = window[step]
        delta = (span / intervals)[w]
        self.length = piece_size * delta
        self.interval = (windows[w] + np.floor(start + 1e-9)).astype(int)
        self.first = windows[w]
        self.from_window = start * delta
        self.offset = start - np.floor(start + 1e-9)  # in the grid interval
        self.size = piece_size
        self.tau0 = within / np.maximum(step_size[step], 1.0)
        self.tau1 = piece_size / step_size[step]
        self.window = w
        self._read_steps(step, within)

    def _read_steps(self, step: NDArray, within: NDArray) -> None:
        run, n_elements = self.run, self.run.work.kernel.shape.n_elements
        n_modes = run.modes.eigenvalues.size
        steps = run.work.steps[: run.work.step_count[0]]
        width = 4 + 4 * run.work.elements.n_states
        n_pad = (steps.shape[1] - n_elements * width - STEP) // 2
        z = steps[:, :n_modes] + 1j * steps[:, n_pad : n_pad + n_modes]
        inner = run.modal[:, :n_modes] + 1j * run.modal[:, n_modes:]
        self.z = np.where((within == 0)[:, None], z[step], inner[self.interval])
        # an element's numbers: forces at the nodes, states at the nodes, states at the start
        numbers = steps[step, 2 * n_pad : -STEP]
        numbers = numbers.reshape(len(step), n_elements, width)
        self.elements = numbers[:, :, 1:]

    def taken(self, which: NDArray) -> _Pieces:
        """Some of the pieces."""
        some = copy.copy(self)
        for name in _ARRAYS:
            setattr(some, name, getattr(self, name)[which])
        return some

    def work(self, low: NDArray, high: NDArray) -> NDArray:
        """The five works, J, between fractions of every piece."""
        # Input, dissipation in structure and in devices, total work on the control devices, field
        # work. While a current changes, the pieces are halved until the works converge, because
        # the stored energy may depend strongly on the field.
        total = self._integral(low, high)
        start = self.run.work.coil_history[self.window, :, 0]
        moves = np.any(self.run.work.command[self.first, :, 0] != start, axis=1)
        if any(e.device.law.field_power is not None for e in self.run.isolated.elements):
            moves[:] = True
        moving = np.flatnonzero(moves)
        if len(moving):
            allowed = QUADRATURE_ERROR * np.abs(total[0]).sum()
            some = self.taken(moving)
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
            some = self.taken(off)
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
            damped = np.einsum("ti,ij,tj->t", velocity, structure.damping, velocity)
            total[1] += weight * damped
            isolated = self.run.isolated
            pairs = zip(isolated.groups, isolated.group_laws, states, strict=True)
            for group, law, own in pairs:
                rows = self.run.modes.deformation[list(group)]
                x, v = np.einsum("gkm,tm->kgt", rows, z).real
                whole, loss, field = _device_powers(
                    isolated.elements[group[0]], law, tuple(x), tuple(v), own, current, rate
                )
                total[2] += weight * loss
                total[3] += weight * whole * controls[group[0]]
                total[4] += weight * field
        return total * (high - low) * self.length

    def stretches(self) -> Iterator[tuple[NDArray, NDArray]]:
        """Fractions of every piece between which its current has no kink."""
        # It has a kink at the end of a slew limit, and between two polynomials of a device's
        # dependence on the current.
        inner = (self._bends() - self.from_window[:, None]) / self.length[:, None]
        inside = np.any((inner > 0) & (inner < 1), axis=0)
        one = np.ones((len(self.length), 1))
        cuts = np.sort(
            np.concatenate([0 * one, np.clip(inner[:, inside], 0, 1), one], axis=1), axis=1
        )
        yield from zip(cuts.T[:-1], cuts.T[1:], strict=True)

    def _bends(self) -> NDArray:
        """Times from each piece's window to the kinks of a current, s, (n_pieces, n_bends)."""
        # Infinite for kinks that the current does not reach.
        work, elements = self.run.work, self.run.isolated.elements
        times = [np.empty((len(self.window), 0))]
        for channel in range(self.run.isolated.n_channels):
            start = work.coil_history[self.window, channel, 0]
            gap = work.command[self.first, channel, 0] - start
            lag, slew = work.driver[channel, :2, 0]
            ramped = np.maximum(np.abs(gap) - slew * lag, 0.0) if np.isfinite(slew) else 0 * gap
            ramp = ramped / slew
            times.append(np.where(ramp > 0, ramp, np.inf)[:, None])
            breaks = np.unique(
                [b for e in elements if e.channel == channel for b in e.device.current.breaks[1:-1]]
            )
            with np.errstate(divide="ignore", invalid="ignore"):
                # way to the break, along the way to the command
                way = (breaks - start[:, None]) * np.sign(gap)[:, None]
                left = (np.abs(gap) - ramped)[:, None] / (np.abs(gap)[:, None] - way)
                on_ramp = way / slew
                at = np.where(way <= ramped[:, None], on_ramp, ramp[:, None] + lag * np.log(left))
            times.append(np.where((way > 0) & (way < np.abs(gap)[:, None]), at, np.inf))
        return np.concatenate(times, axis=1)

    def at(self, c: NDArray) -> tuple:
        """Modes, states, currents, their rates and the ground at a fraction c of every piece."""
        run, modes = self.run, self.run.modes
        t = c * self.length
        phi = _phi(modes.eigenvalues * t[:, None])
        integral = [
            t[:, None] * phi[1],
            (c * t)[:, None] * phi[2],
            2 * (c * c * t)[:, None] * phi[3],
        ]
        a0 = run.work.ground[self.interval, :, 0]
        slope = run.work.ground[self.interval + 1, :, 0] - a0
        low = a0 + slope * self.offset[:, None]
        rise = slope * self.size[:, None]
        z = self.z * phi[0]
        z += (low @ modes.ground) * integral[0] + (rise @ modes.ground) * integral[1]
        p = np.linalg.inv(np.vander(NODES, increasing=True))
        for e in range(len(modes.force)):
            f0, f1, f2 = (p @ self.elements[:, e, :3].T)[:, :, None]
            a, b = self.tau0[:, None], self.tau1[:, None]
            push = (
                (f0 + f1 * a + f2 * a * a) * integral[0]
                + (f1 + 2 * f2 * a) * b * integral[1]
                + f2 * b * b * integral[2]
            )
            z = z + push * modes.force[e]
        tau = self.tau0 + c * self.tau1
        states = self._states(tau)
        current, rate = self._currents(self.from_window + t)
        return z, states, current, rate, low + c[:, None] * rise

    def _states(self, tau: NDArray) -> list[tuple]:
        nodes = np.array([0.0, *NODES])
        weights = np.array(
            [np.prod([(tau - b) / (a - b) for b in nodes if b != a], axis=0) for a in nodes]
        )
        result = []
        isolated = self.run.isolated
        for (e, *_), law in zip(isolated.groups, isolated.group_laws, strict=True):
            n = len(law.states)
            numbers = self.elements[:, e, 3:]
            result.append(
                tuple(
                    weights[0] * numbers[:, 3 * n + k]
                    + np.einsum("tj,jt->t", numbers[:, 3 * k : 3 * k + 3], weights[1:])
                    for k in range(n)
                )
            )
        return result

    def _currents(self, t: NDArray) -> tuple[NDArray, NDArray]:
        work, n = self.run.work, self.run.isolated.n_channels
        start = work.coil_history[self.window, :n, 0]
        command = work.command[self.first, :n, 0]
        lag, slew = work.driver[:n, 0, 0], work.driver[:n, 1, 0]
        current = coil_current(start, command, lag, slew, t[:, None])
        gap = command - current
        with np.errstate(divide="ignore", invalid="ignore"):
            rate = np.where(lag > 0, gap / lag, np.sign(gap) * np.inf)
        return current, np.where(gap == 0, 0.0, np.clip(rate, -slew, slew))


def _phi(z: NDArray) -> list[NDArray]:
    """phi_k(z) = sum_n z^n / (n + k)! for k = 0..3."""
    small = np.abs(z) < 1.0
    s = np.where(small, z, 0.0)
    term = np.full(z.shape, 1 / 6, complex)
    third = term.copy()
    for n in range(1, 21):
        term = term * s / (n + 3)
        third += term
    large = np.where(small, 1.0, z)
    exact = np.exp(large)
    one = (exact - 1) / large
    two = (one - 1) / large
    three = np.where(small, third, (two - 0.5) / large)
    two = np.where(small, 0.5 + s * third, two)
    one = np.where(small, 1 + s * two, one)
    return [np.where(small, 1 + s * one, exact), one, two, three]
