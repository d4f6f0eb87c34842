"""The smooth pieces of a run: its response at any instant, not at samples alone."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from .kernel.collocation import NODES
from .kernel.slots import STEP
from .trajectory import coil_current, device_forces

if TYPE_CHECKING:
    from .trajectory import Trajectory

_ARRAYS = "length interval first from_segment offset size tau0 tau1 segment z elements".split()


class Pieces:
    """The run's smooth pieces: grid intervals, or steps if they are smaller."""

    # On a piece the ground is linear, the elements' forces on the structure are quadratics and the
    # device states cubics.

    def __init__(self, run: Trajectory):
        self.run = run
        grid, work = run.grid, run.work
        segments, kinds = grid.segments[:-1, 0], grid.segments[:-1, 1]
        intervals = grid.segments[:-1, 2]
        span = grid.spans[kinds]
        # one row per step
        steps = work.steps[: work.step_count[0]]
        segment, begin, length, _ = steps[:, -STEP:].T
        segment = segment.astype(int)
        step_start = begin * intervals[segment]  # in grid intervals
        step_size = length * intervals[segment]
        # one row per piece
        per_step = np.maximum(np.round(step_size), 1).astype(int)
        step = np.repeat(np.arange(len(segment)), per_step)
        within = np.arange(per_step.sum()) - np.repeat(np.cumsum(per_step) - per_step, per_step)
        start = step_start[step] + within
        piece_size = np.minimum(step_size[step], 1.0)
        w = segment[step]
        delta = (span / intervals)[w]
        self.length = piece_size * delta
        self.interval = (segments[w] + np.floor(start + 1e-9)).astype(int)
        self.first = segments[w]
        self.from_segment = start * delta
        self.offset = start - np.floor(start + 1e-9)  # in the grid interval
        self.size = piece_size
        self.tau0 = within / np.maximum(step_size[step], 1.0)
        self.tau1 = piece_size / step_size[step]
        self.segment = w
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

    def select(self, which: NDArray) -> Self:
        """Some of the pieces."""
        some = copy.copy(self)
        for name in _ARRAYS:
            setattr(some, name, getattr(self, name)[which])
        return some

    def stretches(self) -> Iterator[tuple[NDArray, NDArray]]:
        """Fractions of every piece between which its current has no kink."""
        # It has a kink at the end of a slew limit, and between two polynomials of a device's
        # dependence on the current.
        inner = (self._bends() - self.from_segment[:, None]) / self.length[:, None]
        inside = np.any((inner > 0) & (inner < 1), axis=0)
        one = np.ones((len(self.length), 1))
        cuts = np.sort(
            np.concatenate([0 * one, np.clip(inner[:, inside], 0, 1), one], axis=1), axis=1
        )
        yield from zip(cuts.T[:-1], cuts.T[1:], strict=True)

    def _bends(self) -> NDArray:
        """Times from each piece's segment to the kinks of a current, s, (n_pieces, n_bends)."""
        # Infinite for kinks that the current does not reach.
        work, elements = self.run.work, self.run.isolated.elements
        times = [np.empty((len(self.segment), 0))]
        for channel in range(self.run.isolated.n_channels):
            start = work.coil_history[self.segment, channel, 0]
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
        # most pieces are whole intervals of one grid
        different, same = np.unique(t, return_inverse=True)
        phi = [each[same] for each in _phi(modes.eigenvalues * different[:, None])]
        integral = [
            t[:, None] * phi[1],
            (c * t)[:, None] * phi[2],
            2 * (c * c * t)[:, None] * phi[3],
        ]
        a0 = run.work.ground[self.interval, :, 0]
        slope = run.work.ground[self.interval + 1, :, 0] - a0
        low = a0 + slope * self.offset[:, None]
        rise = slope * self.size[:, None]
        p = np.linalg.inv(np.vander(NODES, increasing=True))
        f0, f1, f2 = np.moveaxis(self.elements[:, :, :3] @ p.T, 2, 0)
        a, b = self.tau0[:, None], self.tau1[:, None]
        # ground and forces as polynomials of the fraction
        pushes = [
            low @ modes.ground + (f0 + f1 * a + f2 * a * a) @ modes.force,
            rise @ modes.ground + ((f1 + 2 * f2 * a) * b) @ modes.force,
            (f2 * b * b) @ modes.force,
        ]
        z = self.z * phi[0]
        for push, part in zip(pushes, integral, strict=True):
            z += push * part
        tau = self.tau0 + c * self.tau1
        states = self._states(tau)
        current, rate = self._currents(self.from_segment + t)
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
        start = work.coil_history[self.segment, :n, 0]
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
        term *= s
        term /= n + 3
        third += term
        if np.abs(term).max(initial=0.0) < 1e-18:  # no digit of the sum, which is about 1/6
            break
    large = np.where(small, 1.0, z)
    exact = np.exp(large)
    one = (exact - 1) / large
    two = (one - 1) / large
    three = np.where(small, third, (two - 0.5) / large)
    two = np.where(small, 0.5 + s * third, two)
    one = np.where(small, 1 + s * two, one)
    return [np.where(small, 1 + s * one, exact), one, two, three]


def refined_displacements(run: Trajectory, n: int) -> NDArray:
    """Displacements of all dofs, as ``refined_outputs``."""
    names = [f"{dof}_displacement_m" for dof in run.isolated.structure.names]
    return refined_outputs(run, names, n)


def refined_outputs(run: Trajectory, names: list[str], n: int) -> NDArray:
    """Some outputs at ``n`` equal steps a sample, ((n_samples - 1) n + 1, n_names).

    Where an output jumps, with a current, it has the mean of both sides.
    """
    pieces, isolated = Pieces(run), run.isolated
    rows = run.outputs.rows[[run.outputs.names.index(name) for name in names]]
    begin = run.grid.time[pieces.first] + pieces.from_segment
    time, values = [], []
    for c in np.linspace(0.0, 1.0, n + 1):
        z, own, current, _, ground = pieces.at(np.full(len(begin), c))
        states = np.zeros((len(begin), *run.work.states.shape[1:3]))
        for group, each in zip(isolated.groups, own, strict=True):
            for k, state in enumerate(each):
                states[:, group[0], k] = state
        modal = np.concatenate([z.real, z.imag], axis=1)
        force = device_forces(isolated, run.modes, modal, states, current)
        time.append(begin + c * pieces.length)
        values.append(np.concatenate([modal, force, ground], axis=1) @ rows.T)
    at = np.concatenate(np.transpose(time))
    columns = np.concatenate(np.transpose(values, (1, 0, 2)))
    dt = run.records[0].dt
    instants = np.arange((len(run.records[0].acceleration) - 1) * n + 1) * (dt / n)
    sides = [
        np.interp(instants + side, at, column) for column in columns.T for side in (-1e-9, 1e-9)
    ]
    return np.mean(np.reshape(sides, (len(names), 2, -1)), axis=1).T
