"""Data for the prediction of a structure, its devices and coils over a horizon."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from isolation_sim.simulation.complex_modes import Modes, real_rows
from isolation_sim.simulation.outputs import quantity_rows
from isolation_sim.simulation.plan import modes_for
from isolation_sim.structures import IsolatedStructure

from .generated_jacobian import PredictionModel
from .prediction_kernel import predict

_POINTS = 40
"""Gauss points of the convolution with a mode; exact to rounding up to |eigenvalue| h = 30."""


@dataclass(frozen=True)
class Propagator:
    """Modes after a time t, from those at 0: z = decay z0 + force r + ground a."""

    # The modes are in real form: all real parts, then all imaginary ones.

    decay: NDArray  # (n, n): From the modes
    # (n, n_elements, n_nodes): From the difference of each device's force (N, device scale) and its
    # reference spring and dashpot, at equally spaced nodes of the interval
    force: NDArray
    # (n, n_directions, 2): From the ground acceleration (m/s^2) at the interval's two ends
    ground: NDArray


def propagator(modes: Modes, h: float, t: float, n_nodes: int) -> Propagator:
    """Propagate modes from the start of an interval to a time in it."""
    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
    at, weights = t * (nodes + 1) / 2, t * weights / 2
    kernel = weights * np.exp(np.multiply.outer(modes.eigenvalues, t - at))

    def convolved(columns: NDArray, n: int) -> NDArray:
        shapes = kernel @ _lagrange(at / h, n).T
        parts = columns.T[:, :, np.newaxis] * shapes[:, np.newaxis, :]
        return np.concatenate([parts.real, parts.imag])

    grown = np.exp(modes.eigenvalues * t)
    turned = np.diag(grown.imag)
    stretched = np.diag(grown.real)
    return Propagator(
        np.block([[stretched, -turned], [turned, stretched]]),
        convolved(modes.force, n_nodes),
        convolved(modes.ground, 2),
    )


def _lagrange(x: NDArray, n: int) -> NDArray:
    """Lagrange polynomials of n equally spaced nodes on [0, 1], (n, len(x))."""
    nodes = np.linspace(0, 1, n) if n > 1 else np.zeros(1)
    values = np.ones((n, x.size))
    for k in range(n):
        for j in range(n):
            if j != k:
                values[k] *= (x - nodes[j]) / (nodes[k] - nodes[j])
    return values


STABLE = 0.8
"""Largest product of step and fastest rate of a device state in Heun's rule."""


class Prediction:
    """Structure, devices and coils in the arrays of ``prediction_kernel``."""

    # nominal: The model to predict with.
    # coils: (n_channels, 5): Lag (s), slew (A/s), lowest, highest and initial current (A) of each
    # coil.
    # step: Length of a step of the horizon, s.
    # n_displacements, n_accelerations: Numbers of such outputs: the displacements of the bases (m),
    # then the absolute accelerations of all levels (m/s^2); the velocities of the bases (m/s)
    # follow.
    # along: (n_displacements, n_directions): Displacements of the bases that move with the ground,
    # per displacement of the ground.

    def __init__(
        self, nominal: IsolatedStructure, coils: NDArray, step: float,
        longest: float = np.inf,  # Longest substep of the integration, s
        others: IsolatedStructure | None = None,  # Whose laws come first in ``model``
    ):  # fmt: skip
        self.nominal, self.coils = nominal, coils
        modes, outputs = modes_for(nominal)
        before = [] if others is None else [element.device for element in others.elements]
        self.model = PredictionModel([*before, *(element.device for element in nominal.elements)])
        self.numbers = self.model.numbers.reshape(-1, self.model.n_numbers)[len(before) :]
        self.lengths = np.array([e.device.length for e in nominal.elements])
        channels = [-1 if e.channel is None else e.channel for e in nominal.elements]
        self.rows = np.ascontiguousarray(real_rows(modes.deformation))
        # (2 n_modes, 2 n_dofs): Modes from displacements and velocities
        shapes = real_rows(modes.shapes)
        self.to_modes = np.ascontiguousarray(np.linalg.inv(_square(shapes))[:, : len(shapes)])
        needed = max(step / longest - 1e-9, step * self._fastest() / STABLE)
        self.n_sub = max(1, int(np.ceil(needed)))  # Substeps of a step
        h = step / self.n_sub
        carried = propagator(modes, h, h, 2)
        grown = np.exp(modes.eigenvalues * h)
        decay = [np.exp(-h / lag) if lag > 0 else 0.0 for lag in coils[:, 0]]
        references = np.stack([modes.stiffness, modes.damping], axis=1)
        # each device's force over that of the nominal model is 1 unless it is changed
        self.plant = (
            np.stack([grown.real, grown.imag]),
            np.ascontiguousarray(carried.force.sum(axis=2).T),
            np.ascontiguousarray(carried.force[:, :, 1].T),
            np.ascontiguousarray(carried.ground.transpose(1, 2, 0)),
            self.rows, references, np.array(channels, dtype=float), self.numbers,
            np.ones(len(channels)), np.array([[k, self.n_sub, h] for k in decay]),
            *self._output_rows(outputs, modes),
        )  # fmt: skip

    def _output_rows(self, outputs: Any, modes: Any) -> tuple[NDArray, NDArray]:
        """Rows of the outputs over the modes and over the devices' forces beyond reference."""
        quantities = quantity_rows(self.nominal, outputs.names)
        displacement, acceleration = (
            rows[np.any(rows, axis=-1)] for rows in
            (quantities["base_displacement_m"], quantities["floor_acceleration_m_s2"])
        )  # fmt: skip
        self.n_displacements, self.n_accelerations = len(displacement), len(acceleration)
        n_dofs = self.nominal.structure.n_dofs
        self.along = displacement[:, :n_dofs] @ self.nominal.structure.above_foundation
        # an output's velocity follows its displacement by as many places as there are dofs
        velocity = np.roll(displacement, n_dofs, axis=1)
        rows = np.concatenate([displacement, acceleration, velocity]) @ outputs.rows
        n, m = 2 * modes.eigenvalues.size, len(self.nominal.elements)
        x, v = np.moveaxis(self.rows, 1, 0)
        by_force = rows[:, n : n + m]
        reference = modes.stiffness[:, np.newaxis] * x + modes.damping[:, np.newaxis] * v
        on_modes = rows[:, :n] + by_force @ reference
        return np.ascontiguousarray(on_modes), np.ascontiguousarray(by_force)

    def _fastest(self) -> float:
        """Fastest decay of a device state within the tested deformation, 1/s, by differences."""
        fastest = 0.0
        for element in self.nominal.elements:
            device, n = element.device, len(element.device.law.states)
            if not n:
                continue
            size = device.deformation_scale / device.length / 2
            low, high = device.current_range
            current = (low + high) / 2 if np.isfinite(high - low) else 0.0
            parameters = device.parameters_at(current)
            states = np.array(device.initial_states(), float) + size / 2
            base = np.array(device.law.rates(size, 5 * size, tuple(states), parameters))
            for k in range(n):
                moved = states.copy()
                moved[k] += 1e-6 * size
                rates = np.array(device.law.rates(size, 5 * size, tuple(moved), parameters))
                fastest = max(fastest, float(np.abs(rates - base).max() / (1e-6 * size)))
        return fastest

    def initial_states(self) -> NDArray:
        """States of the devices at rest, (n_devices, n_states)."""
        states = np.zeros((len(self.numbers), self.model.n_states))
        for row, element in zip(states, self.nominal.elements, strict=True):
            own = element.device.initial_states()
            row[: len(own)] = own
        return states

    def work(self, width: int) -> tuple[list[NDArray], list[NDArray], NDArray]:
        """Arrays in which to predict, with derivatives by ``width`` numbers."""
        n_devices, n_states = self.initial_states().shape
        shapes = [(self.rows.shape[-1],)] * 2 + [(n_devices, n_states)] * 2
        shapes += [(len(self.coils),)] * 2 + [(n_devices,)] * 2 + [(n_devices, n_states)] * 2
        return (
            [np.zeros(shape) for shape in shapes],
            [np.zeros((*shape, width)) for shape in shapes],
            np.zeros((n_states + 1) * (n_states + 4)),
        )

    def results(self, n_steps: int, width: int) -> list[NDArray]:
        """Arrays of the predicted quantities.

        Outputs, (n_steps + 1, n_outputs); their derivatives by the blocks of commands, per A, (...,
        width); derivatives of the coil currents at the steps' beginnings, and these currents (A),
        (n_steps, n_channels, width + 1); the first two just before the coils without lag take their
        next commands, empty where there are none. Without derivatives: the outputs alone.
        """
        n_outputs, n_channels = len(self.plant[-1]), len(self.coils)
        before = n_steps + 1 if width and np.any(self.coils[:, 0] == 0) else 0
        return [
            np.zeros((n_steps + 1, n_outputs)), np.zeros((n_steps + 1, n_outputs, width)),
            np.zeros((n_steps if width else 0, n_channels, width + 1)),
            np.zeros((before, n_outputs)), np.zeros((before, n_outputs, width)),
        ]  # fmt: skip

    def pulses(self, current: NDArray, reach: int) -> NDArray:
        """Acceleration response to a ground pulse from rest, at constant currents."""
        commands = np.tile(current, (reach, 1))
        rest, states = np.zeros(self.rows.shape[-1]), self.initial_states()
        n_directions, first, answers = len(self.plant[3]), self.n_displacements, []
        for d in range(n_directions):
            ground = np.zeros((n_directions, reach * self.n_sub + 1))
            at = np.arange(reach * self.n_sub + 1) / self.n_sub
            ground[d] = np.maximum(1.0 - np.abs(at - 1.0), 0.0)
            results = self.results(reach, 0)
            predict(
                reach, rest, states, current, commands, np.zeros(0), ground, 0, self.plant,
                self.work(0), tuple(results), self.model.device_side,
            )  # fmt: skip
            answers.append(results[0][1:, first : first + self.n_accelerations])
        return np.array(answers)


def growing_blocks(n_steps: int, n_blocks: int) -> NDArray:
    """Lengths of the blocks of commands: one step at first, then growing."""
    left = 1.0 - np.arange(n_steps) / n_steps
    blocks = np.round(n_blocks * (1.0 - left ** (n_steps / n_blocks))).astype(int)
    return np.minimum(blocks, n_blocks - 1)


def _square(rows: NDArray) -> NDArray:
    """Rows over the modes without the imaginary parts of real modes, which are zero."""
    # an overdamped mode's imaginary part is always zero: a unit row keeps the matrix invertible
    n, width = rows.shape
    if n == width:
        return rows
    empty = np.flatnonzero(~np.any(rows, axis=0))
    return np.concatenate([rows, np.eye(width)[empty]])
