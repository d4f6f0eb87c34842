"""Prediction over a horizon, compiled for the nominal laws."""

from __future__ import annotations

from functools import lru_cache
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from isolation_sim.generated import load_text
from isolation_sim.laws.law import Law
from isolation_sim.simulation.modal import real_rows
from isolation_sim.simulation.plan import modes_for
from isolation_sim.simulation.quantities import quantity_rows
from isolation_sim.structures import IsolatedStructure

from ..compiled import collect
from ..device_model import FORCE_SCALE, DeviceModel, first_coefficient, polynomial
from ..device_states import follow_states
from .active_set import solve
from .condense_kernel import condense
from .generated_jacobian import generated_jacobian
from .ground_kernel import drive, extrapolate, forecast_deviation, learn
from .interval import propagator
from .prediction_kernel import nominal_forces, predict

_HEADER = '''"""Written by controllers.predictive.prediction; do not edit."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

OPTIONS = dict(error_model="numpy", fastmath={"contract", "reassoc"})
plain = njit(**OPTIONS)'''

_ENTRY = """@njit(cache=True, **OPTIONS)
def run(z, s, i, commands, block, ground, plant, work, results):
    y, dy, past, y_before, dy_before = results
    predict(z, s, i, commands, block, ground, plant, work, y, dy, past, y_before, dy_before)


@njit(cache=True, **OPTIONS)
def forces(z, s, i, plant, side, force):
    nominal_forces(z, s, i, plant, side, force)


@njit(cache=True, **OPTIONS)
def programme(
    prediction, commands, before, block, coils, step, sizes, units, levels, margins, weights,
    resting, out,
):
    return condense(
        prediction, commands, before, block, coils, step, sizes, units, levels, margins, weights,
        resting, out,
    )


@njit(cache=True, error_model="numpy")
def optimum(hessian, gradient, rows, upper, lower, x, work):
    return solve(hessian, gradient, rows, len(rows), upper, lower, x, work)


@njit(cache=True, **OPTIONS)
def forecast(
    known, motion, end, returning, drives, past, coefficients, covariance, gain, noise, ground,
    pulses, shape, strays,
):
    for d in range(len(past)):
        now = drive(ground[0, d], motion[d], returning)
        learn(now, past[d], coefficients[d], covariance[d], gain, noise[d])
        end[d] = motion[d]
        extrapolate(known, coefficients[d], past[d], ground[:, d], end[d], returning, drives)
    forecast_deviation(coefficients, noise, pulses, shape, strays)


@njit(cache=True, **OPTIONS)
def follow(before, after, h, s, i, lengths, numbers, work):
    for e in range(len(s)):
        follow_states(
            e, (before[e, 0] * lengths[e], before[e, 1] * lengths[e]),
            (after[e, 0] * lengths[e], after[e, 1] * lengths[e]),
            h, s[e], i[e], numbers[e], work,
        )"""

STABLE = 0.8
"""Largest product of step and a device state's fastest rate that Heun's rule is given."""


class Prediction:
    """Structure, devices and coils as the prediction's compiled loop sees them."""

    # nominal: The model to predict with.
    # coils: (n_channels, 5): Lag (s), slew (A/s), lowest, highest and initial current (A) of each
    # coil.
    # step: Length of a step of the horizon, s.
    # block: of int, shape (n_steps,): Block of each step's command, from 0, not decreasing;
    # commands of a block move together.
    # n_displacements, n_accelerations: Numbers of such outputs.
    # along: (n_displacements, n_directions): Displacements of the bases that move with the ground,
    # per displacement of the ground.

    def __init__(
        self, nominal: IsolatedStructure, coils: NDArray, step: float, block: NDArray,
        longest: float = np.inf,  # Longest substep of the integration, s
    ):  # fmt: skip
        self.nominal, self.block = nominal, np.ascontiguousarray(block, dtype=np.int64)
        modes, outputs = modes_for(nominal)
        self.model = DeviceModel([element.device for element in nominal.elements])
        n_devices, n_states = len(nominal.elements), self.model.n_states
        self.numbers = self.model.numbers.reshape(n_devices, -1)
        self.lengths = np.array([e.device.length for e in nominal.elements])
        channels = [-1 if e.channel is None else e.channel for e in nominal.elements]
        self.channels = np.array(channels, dtype=np.int64)
        self.rows = np.ascontiguousarray(real_rows(modes.deformation))
        self._to_modes = np.linalg.inv(_square(real_rows(modes.shapes)))
        needed = max(step / longest - 1e-9, step * self._fastest() / STABLE)
        self.n_sub = max(1, int(np.ceil(needed)))  # Substeps of a step
        h = step / self.n_sub
        carried = propagator(modes, h, h, 2)
        m = modes.eigenvalues.size
        grown = np.exp(modes.eigenvalues * h)
        decay = [np.exp(-h / lag) if lag > 0 else 0.0 for lag in coils[:, 0]]
        coil_decay = np.array([[k, self.n_sub, h] for k in decay])
        # (n_devices,): Each device's force over that of the nominal model; 1 unless it is changed
        self.strength = np.ones(n_devices)
        self._references = references = np.stack([modes.stiffness, modes.damping], axis=1)
        self.plant = (
            np.stack([grown.real, grown.imag]),
            np.ascontiguousarray(carried.force.sum(axis=2).T),
            np.ascontiguousarray(carried.force[:, :, 1].T),
            np.ascontiguousarray(carried.ground.transpose(1, 2, 0)),
            self.rows, references, self.channels, self.numbers, self.strength, coil_decay,
            self._output_rows(outputs, modes),
        )  # fmt: skip
        n_steps, width = len(block), int((self.block[-1] + 1) * len(coils))
        n_outputs = len(self.plant[-1][0])
        shapes = [(2 * m,)] * 2 + [(n_devices, n_states)] * 2 + [(len(coils),)] * 2
        shapes += [(n_devices,)] * 2 + [(n_devices, n_states)] * 2
        self.work = (
            tuple(np.zeros(shape) for shape in shapes),
            tuple(np.zeros((*shape, width)) for shape in shapes),
            np.zeros((n_states + 1) * (n_states + 4)),
        )
        # (n_steps + 1, n_outputs): Outputs predicted last: the displacements of the bases (m), the
        # absolute accelerations of all levels (m/s^2), then the velocities of the bases (m/s)
        self.y = np.zeros((n_steps + 1, n_outputs))
        # (n_steps + 1, n_outputs, n_blocks * n_channels): Their derivatives by the commands, per A
        self.dy = np.zeros((n_steps + 1, n_outputs, width))
        # (n_steps, n_channels, n_blocks * n_channels + 1): Derivatives of the coil currents at the
        # steps' beginnings, and these currents (A)
        self.past = np.zeros((n_steps, len(coils), width + 1))
        n_before = n_steps + 1 if np.any(coils[:, 0] == 0) else 0
        before = np.zeros((n_before, n_outputs)), np.zeros((n_before, n_outputs, width))
        # ``y``, ``dy``, ``past``, and the first two just before the coils without lag take their
        # next commands, empty where there are none
        self.results = (self.y, self.dy, self.past, *before)
        self._scratch = np.zeros(5 * max(n_states, 1))
        self.module = _module(self.model.laws, n_states)

    def _output_rows(self, outputs: Any, modes: Any) -> tuple[NDArray, NDArray]:
        """Rows of the outputs over the modes and over the devices' forces beyond reference."""
        quantities = quantity_rows(self.nominal, outputs.names)
        displacement, acceleration = (
            rows[np.any(rows, axis=-1)] for rows in
            (quantities["base_displacement_m"], quantities["floor_acceleration_m_s2"])
        )  # fmt: skip
        self.n_displacements, self.n_accelerations = len(displacement), len(acceleration)
        n_dofs = self.nominal.structure.n_dofs
        self.along = displacement[:, :n_dofs] @ self.nominal.structure.influence
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
        for row, device in zip(states, self.model.devices, strict=True):
            own = device.initial_states()
            row[: len(own)] = own
        return states

    def modes_of(self, displacement: NDArray, velocity: NDArray) -> NDArray:
        """Modes of a measured motion."""
        return self._to_modes @ np.concatenate([displacement, velocity])

    def follow(
        self, before: NDArray, after: NDArray, h: float, states: NDArray, i: NDArray
    ) -> None:
        """Carry the device states along measured motion, in place."""
        current = np.where(self.channels < 0, 0.0, i[self.channels])
        self.module.follow(
            self.rows @ before, self.rows @ after, h, states, current, self.lengths, self.numbers,
            self._scratch,
        )  # fmt: skip

    def predict(
        self, z: NDArray, states: NDArray, i: NDArray, commands: NDArray, ground: NDArray
    ) -> None:
        """Predict and differentiate; see ``y``, ``dy`` and ``past``."""
        assert len(ground) == len(self.block) * self.n_sub + 1
        self.module.run(
            z, states, i, commands, self.block, ground, self.plant, self.work, self.results
        )

    def between(self, samples: NDArray) -> NDArray:
        """Ground acceleration at the substeps' ends, on lines from one sample to the next."""
        if self.n_sub == 1:
            return samples
        n = len(samples) - 1
        at = np.arange(n * self.n_sub + 1) / self.n_sub
        return np.stack([np.interp(at, np.arange(n + 1), one) for one in samples.T], axis=1)

    def carried(
        self, z: NDArray, states: NDArray, i: NDArray, commands: NDArray, ground: NDArray
    ) -> tuple[NDArray, NDArray, NDArray]:
        """State at the end of the horizon."""
        self.predict(z, states, i, commands, ground)
        z, _, states, _, i, *_ = self.work[0]
        return z.copy(), states.copy(), i.copy()

    def forces(self, z: NDArray, states: NDArray, i: NDArray) -> NDArray:
        """Forces of the devices as the law has them, without their ``strength``."""
        force = np.zeros(len(states))
        self.module.forces(z, states, i, self.plant, self.work[-1], force)
        return force * self.numbers[:, FORCE_SCALE]

    def outputs(self, z: NDArray, states: NDArray, i: NDArray) -> NDArray:
        """Outputs of one instant, as the columns of ``y``."""
        on_modes, on_force = self.plant[-1]
        force = self.forces(z, states, i) / self.numbers[:, FORCE_SCALE] * self.strength
        force -= (self._references * (self.rows @ z)).sum(axis=1)
        return on_modes @ z + on_force @ force

    def pulses(self, current: NDArray, reach: int) -> NDArray:
        """Accelerations that answer to a pulse of the ground's, from rest, at held currents."""
        commands = np.tile(current, (len(self.block), 1))
        rest, states = np.zeros(self.rows.shape[-1]), self.initial_states()
        n_directions, first, answers = len(self.plant[3]), self.n_displacements, []
        for pulse in np.eye(n_directions):
            ground = np.zeros((len(commands) + 1, n_directions))
            ground[1] = pulse
            self.predict(rest, states, current, commands, self.between(ground))
            answers.append(self.y[1 : reach + 1, first : first + self.n_accelerations].copy())
        return np.array(answers)


def growing_blocks(n_steps: int, n_blocks: int) -> NDArray:
    """Blocks of commands: one step long at first, where a plan matters most, and growing."""
    left = 1.0 - np.arange(n_steps) / n_steps
    blocks = np.round(n_blocks * (1.0 - left ** (n_steps / n_blocks))).astype(int)
    return np.minimum(blocks, n_blocks - 1)


def _square(rows: NDArray) -> NDArray:
    """Rows over the modes without the imaginary parts of real modes, which are no unknowns."""
    # an overdamped mode's imaginary part is always zero: a unit row keeps the matrix invertible
    n, width = rows.shape
    if n == width:
        return rows
    empty = np.flatnonzero(~np.any(rows, axis=0))
    return np.concatenate([rows, np.eye(width)[empty]])


@lru_cache(maxsize=16)
def _module(laws: tuple[Law, ...], n_states: int) -> ModuleType:
    parts: dict[str, str] = {}
    collect(first_coefficient, parts)
    collect(polynomial, parts)
    parts["devices of the laws"] = DeviceModel.text(laws)
    collect(follow_states, parts, ("state_rates",))
    for function in (
        nominal_forces,
        predict,
        condense,
        drive,
        learn,
        extrapolate,
        forecast_deviation,
        solve,
    ):
        collect(function, parts)
    parts["device_side"] = generated_jacobian(laws, n_states)
    text = "\n\n\n".join([_HEADER, *parts.values(), _ENTRY]) + "\n"
    notice = "compiling the prediction for this law (once; about 15 s) ..."
    return load_text("prediction", text, notice)
