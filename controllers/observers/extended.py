"""Extended Kalman filter on structure, ground and the devices' internal states."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ground_motions.argument_types import checked

from ..compiled import Decision
from ..force_tracking import COILS, coil_current
from .nominal_linear_model import structure_and_ground
from .observer import N_DOFS, N_ELEMENTS, N_Y, N_Z, Estimate, Observer
from .small_matrices import conjugate, step_matrices
from .tangent import TangentModel

# settings: every observer's; these; the linear equations; the noise; the measured ground
# accelerations; elements' directions; how many states each device has; the force tracking.
# JUMP: the instant in the interval at which currents jump; -1 where they change steadily
EACH, WIDTH, PERIOD, ACCELERATION, DEFORMATION, DEVICES, JUMP, FIRST = range(4, 12)
# memory: whether it has begun; the state, the rates, the last currents; normalised innovations;
# covariance, dynamics, transition, added covariance; rows of the measurements; a tangent; scratch


def equations(
    z: NDArray, currents: NDArray, settings: NDArray, dynamics: NDArray, rates: NDArray,
    work: NDArray, tangent: Callable,
) -> None:  # fmt: skip
    """Rates of the whole state and their exact derivatives."""
    n, n_z, m = int(settings[N_DOFS]), int(settings[N_Z]), int(settings[N_ELEMENTS])
    each, width = int(settings[EACH]), int(settings[WIDTH])
    n_all = n_z + m * each
    size = n_all + 1
    at = FIRST
    a, on_force = settings[at : at + n_z * n_z], settings[at + n_z * n_z :]
    at += n_z * (n_z + m) + n_all * n_all + (int(settings[N_Y]) - n - m) * n_z
    rows, counts = settings[at : at + m * n], settings[at + m * n : at + m * (n + 1)]
    tracking = settings[int(settings[DEVICES]) :]
    numbers = tracking[COILS + m :]
    for i in range(size * size):
        dynamics[i] = 0.0
    for i in range(n_all):
        rates[i] = 0.0
    for i in range(n_z):
        for j in range(n_z):
            dynamics[i * size + j] = a[i * n_z + j]
            rates[i] += a[i * n_z + j] * z[j]
    for e in range(m):
        x = v = 0.0
        for j in range(n):
            x += rows[e * n + j] * z[j]
            v += rows[e * n + j] * z[n + j]
        first, own = n_z + e * each, int(counts[e])
        tangent(
            e, x, v, z[first : first + each], coil_current(e, tracking, currents),
            numbers[e * width : (e + 1) * width], work,
        )  # fmt: skip
        # the force acts on velocities; the rates of the device's states follow
        for k in range(1 + own):
            entry = work[k * (3 + own) : (k + 1) * (3 + own)]
            begin, end = (n, 2 * n) if k == 0 else (first + k - 1, first + k)
            for i in range(begin, end):
                factor = on_force[i * m + e] if k == 0 else 1.0
                rates[i] += factor * entry[0]
                for j in range(n):
                    dynamics[i * size + j] += factor * entry[1] * rows[e * n + j]
                    dynamics[i * size + n + j] += factor * entry[2] * rows[e * n + j]
                for j in range(own):
                    dynamics[i * size + first + j] += factor * entry[3 + j]
    for i in range(n_all):
        dynamics[i * size + n_all] = rates[i]


def extended_update(
    t: float, measured: NDArray, settings: NDArray, memory: NDArray, tangent: Callable
) -> None:
    """Predict to the present instant and correct by the measurements, one after another."""
    n, n_z, n_y = int(settings[N_DOFS]), int(settings[N_Z]), int(settings[N_Y])
    m, each, h = int(settings[N_ELEMENTS]), int(settings[EACH]), settings[PERIOD]
    n_all = n_z + m * each
    size, area = n_all + 1, (n_all + 1) * (n_all + 1)
    n_coils = len(measured) - n_y
    at = FIRST + n_z * (n_z + m)
    noise, at = settings[at : at + n_all * n_all], at + n_all * n_all
    n_ground = n_y - n - m
    on_ground, rows = settings[at : at + n_ground * n_z], settings[at + n_ground * n_z :]
    z, rates, at = memory[1 : 1 + n_all], memory[1 + n_all : 1 + 2 * n_all], 1 + 2 * n_all
    currents, at = memory[at : at + n_coils], at + n_coils
    innovations, at = memory[at : at + n_y], at + n_y
    p, dynamics = memory[at : at + area], memory[at + area : at + 2 * area]
    transition = memory[at + 2 * area : at + 3 * area]
    added = memory[at + 3 * area : at + 4 * area]
    at += 4 * area
    on_state, at = memory[at : at + n_y * n_all], at + n_y * n_all
    work = memory[at:]

    if memory[0] == 1.0:
        # both halves of the interval, with the current at the middle of each: a quarter, then two
        # thirds of the way left to the present one. A field that lags by less than an interval
        # needs them.
        for half in range(2):
            way = 1.0 / 4.0 + half * (2.0 / 3.0 - 1.0 / 4.0)
            if settings[JUMP] >= 0.0:
                # the part of this half, and of that before, with the present current
                way = min(max(1.0 + half - 2.0 * settings[JUMP], 0.0), 1.0)
            for c in range(n_coils):
                currents[c] += way * (measured[n_y + c] - currents[c])
            equations(z, currents, settings, dynamics, rates, work, tangent)
            predict_linearised(h / 2, noise, dynamics, transition, added, z, p, work)
    memory[0] = 1.0
    for c in range(n_coils):
        currents[c] = measured[n_y + c]
    equations(z, currents, settings, dynamics, rates, work, tangent)
    for k in range(n_y):
        innovations[k] = measured[k]
        for i in range(n_all):
            on_state[k * n_all + i] = 0.0
    for k in range(n):
        # the absolute acceleration does not contain the output of the ground filter
        innovations[k] -= rates[n + k]
        for i in range(n_all):
            on_state[k * n_all + i] = dynamics[(n + k) * size + i]
        for i in range(2 * n, n_z):
            innovations[k] += dynamics[(n + k) * size + i] * z[i]
            on_state[k * n_all + i] = 0.0
    for e in range(m):
        for i in range(n):
            innovations[n + e] -= rows[e * n + i] * z[i]
            on_state[(n + e) * n_all + i] = rows[e * n + i]
    for g in range(n_ground):
        for i in range(n_z):
            innovations[n + m + g] -= on_ground[g * n_z + i] * z[i]
            on_state[(n + m + g) * n_all + i] = on_ground[g * n_z + i]
    for k in range(n_y):
        deviation = settings[DEFORMATION] if n <= k < n + m else settings[ACCELERATION]
        correct_by_one(k, deviation * deviation, on_state, innovations, z, p, rates)


def predict_linearised(
    h: float, noise: NDArray, dynamics: NDArray, transition: NDArray, added: NDArray, z: NDArray,
    p: NDArray, work: NDArray,
) -> None:  # fmt: skip
    """Advance state and covariance by linearised dynamics, whose last column is the rates."""
    n_all = len(z)
    size, area = n_all + 1, (n_all + 1) * (n_all + 1)
    density = work[3 * area : 4 * area]
    for i in range(area):
        dynamics[i] *= h
        density[i] = 0.0
    for i in range(n_all):
        for j in range(n_all):
            density[i * size + j] = h * noise[i * n_all + j]
    step_matrices(size, dynamics, density, transition, added, work)
    for i in range(n_all):
        z[i] += transition[i * size + n_all]
        transition[i * size + n_all] = 0.0
    conjugate(size, transition, p, p, work)
    for i in range(area):
        p[i] += added[i]


def correct_by_one(
    k: int, variance: float, on_state: NDArray, innovations: NDArray, z: NDArray, p: NDArray,
    moved: NDArray,
) -> None:  # fmt: skip
    """Correct state and covariance by one measurement of a variance, and normalise its innovation.

    ``moved``: scratch, for the covariance of the state with the measurement.
    """
    n_all, n_y = len(z), len(innovations)
    size = n_all + 1
    row = on_state[k * n_all : (k + 1) * n_all]
    for i in range(n_all):
        moved[i] = 0.0
        for j in range(n_all):
            moved[i] += p[i * size + j] * row[j]
        variance += row[i] * moved[i]
    miss = innovations[k]
    # the next measurements use the state corrected by this one
    for other in range(k + 1, n_y):
        change = 0.0
        for i in range(n_all):
            change += on_state[other * n_all + i] * moved[i]
        innovations[other] -= change * miss / variance
    for i in range(n_all):
        z[i] += moved[i] * miss / variance
        for j in range(n_all):
            p[i * size + j] -= moved[i] * moved[j] / variance
    innovations[k] = miss / variance**0.5


def extended_row(
    t: float, measured: NDArray, settings: NDArray, memory: NDArray, command: NDArray,
    combined_force: Callable, state_rates: Callable, tangent: Callable,
) -> None:  # fmt: skip
    """Update, and write estimate, innovations and covariance."""
    extended_update(t, measured, settings, memory, tangent)
    n_y = int(settings[N_Y])
    n_all = int(settings[N_Z]) + int(settings[N_ELEMENTS]) * int(settings[EACH])
    innovations = 1 + 2 * n_all + len(measured) - n_y
    for i in range(n_all):
        command[i] = memory[1 + i]
        for j in range(n_all):
            entry = memory[innovations + n_y + i * (n_all + 1) + j]
            command[n_all + n_y + i * n_all + j] = entry
    for k in range(n_y):
        command[n_all + k] = memory[innovations + k]


@checked
class ExtendedKalmanFilter(Observer):
    """Extended Kalman filter on structure, ground and the devices' internal states.

    Between measurements, the equations are linearised at the estimate by the exact derivatives of
    the laws, and solved exactly as such (exponential Rosenbrock-Euler method), so that the linear
    structure is propagated exactly. Measurements are taken one after another.

    References
    ----------
    Jazwinski 1970; Simon 2006, Optimal State Estimation, chapter 13; Hochbruck and Ostermann 2010,
    Exponential integrators.
    """

    devices: ClassVar[type[TangentModel]] = TangentModel
    tracking_at = DEVICES

    @cached_property
    def linear(self) -> tuple[NDArray, NDArray, NDArray]:
        """Dynamics of structure and ground, the influence of forces, and the noise density.

        The noise acts on the whole state. The device states follow a random walk: the filter then
        does not become certain of them.
        """
        structure, rows = self.nominal.structure, self.nominal.element_rows
        a, b, g, _, _ = structure_and_ground(structure, rows, self.ground)
        n_z, each = len(a), self.tracking.model.n_states
        noise = np.zeros((n_z + len(rows) * each,) * 2)
        noise[:n_z, :n_z] = self.ground.density * g @ g.T
        for e, element in enumerate(self.nominal.elements):
            device = element.device
            for k, state in enumerate(device.law.states):
                scale = device.deformation_scale / device.length if state.unit == "m" else 1.0
                noise[n_z + e * each + k, n_z + e * each + k] = (self.noise.states * scale) ** 2
        return a, b, noise

    def decision(self) -> Decision:
        """Equations and devices in one array."""
        (a, b, noise), rows, tracking = self.linear, self.nominal.element_rows, self.tracking
        model, (m, n) = tracking.model, rows.shape
        counts = [len(element.device.law.states) for element in self.nominal.elements]
        on_ground = self.ground_rows()
        arrays = (a, b, noise, on_ground, rows)
        own = np.concatenate([*(array.ravel() for array in arrays), counts])
        n_all, n_y = len(a) + m * model.n_states, n + m + len(on_ground)
        head = [
            n, len(a), n_y, m, model.n_states, model.n_numbers, self.period,
            self.noise.acceleration, self.noise.deformation, FIRST + len(own), self.jump,
        ]  # fmt: skip
        widest = (1 + model.n_states) * (3 + model.n_states)
        size = 1 + 2 * n_all + self.nominal.n_channels + n_y + n_y * n_all
        memory = np.zeros(size + 4 * (n_all + 1) ** 2 + max(4 * (n_all + 1) ** 2, widest))
        return Decision(extended_row, np.concatenate([head, own, tracking.settings]), memory, model)

    def _sizes(self) -> tuple[int, int]:
        n_all = len(self.linear[0]) + len(self.nominal.elements) * self.tracking.model.n_states
        return n_all, len(self.outputs) - self.nominal.n_channels

    def width(self) -> int:
        """Length of a row."""
        n_all, n_y = self._sizes()
        return n_all + n_y + n_all**2

    def estimate(self, time: NDArray, rows: NDArray) -> Estimate:
        """Unpack a row."""
        n, n_z, (n_all, n_y) = self.nominal.structure.n_dofs, len(self.linear[0]), self._sizes()
        q, p, ground, states, innovations, covariance = np.split(
            rows, [n, 2 * n, n_z, n_all, n_all + n_y], axis=1
        )
        shape = (len(rows), len(self.nominal.elements), self.tracking.model.n_states)
        return Estimate(
            time, q, p, ground, states.reshape(shape), innovations,
            covariance.reshape(-1, n_all, n_all),
        )  # fmt: skip
