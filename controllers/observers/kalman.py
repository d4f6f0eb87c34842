"""Kalman filter on the linear structure, the devices' forces as known inputs."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ground_motions.argument_types import checked

from ..compiled import Decision
from ..force_tracking import MOTION, coil_current, device_force, follow_device
from .nominal_linear_model import sampled, structure_and_ground
from .observer import N_DOFS, N_ELEMENTS, N_Y, N_Z, Estimate, Observer

# settings: every observer's; where the force tracking begins; the instant in the interval at which
# currents jump, -1 where they change steadily; the step's matrices; those of the
# measurements; the filter's gain and the innovations' inverse root; elements' directions; the
# force tracking
TRACKING, JUMP, HEAD = 4, 5, 6
# memory: whether it has begun; z, each element's force, innovations, scratch; the force tracking


def kalman_memory(settings: NDArray) -> int:
    """First place of the force tracking in a Kalman filter's memory."""
    n_z, n_y, m = int(settings[N_Z]), int(settings[N_Y]), int(settings[N_ELEMENTS])
    return 1 + 2 * n_z + m + 2 * n_y


def kalman_update(
    t: float, measured: NDArray, settings: NDArray, memory: NDArray, combined_force: Callable,
    state_rates: Callable,
) -> None:  # fmt: skip
    """Predict to the present instant and correct by the measurements."""
    n, n_z, n_y = int(settings[N_DOFS]), int(settings[N_Z]), int(settings[N_Y])
    m, at = int(settings[N_ELEMENTS]), HEAD
    transition = settings[at : at + n_z * n_z]
    at += n_z * n_z
    at_start, at_end = settings[at : at + n_z * m], settings[at + n_z * m : at + 2 * n_z * m]
    at += 2 * n_z * m
    on_state, on_force = settings[at : at + n_y * n_z], settings[at + n_y * n_z :]
    at += n_y * (n_z + m)
    gain, root = settings[at : at + n_z * n_y], settings[at + n_z * n_y :]
    at += (n_z + n_y) * n_y
    rows = settings[at : at + m * n]
    tracking = settings[int(settings[TRACKING]) :]
    z, at = memory[1 : 1 + n_z], 1 + n_z
    force, at = memory[at : at + m], at + m
    normalised, innovation = memory[at : at + n_y], memory[at + n_y : at + 2 * n_y]
    predicted = memory[at + 2 * n_y : at + 2 * n_y + n_z]
    devices = memory[kalman_memory(settings) :]

    h = t - devices[0]
    devices[0] = t
    begun = memory[0] == 1.0
    memory[0] = 1.0
    currents = measured[n_y:]
    for i in range(n_z):
        predicted[i] = z[i]
    if begun:
        if settings[JUMP] >= 0.0:
            # the force that jumps has the impulse of one that is linear over the interval
            for e in range(m):
                amperes = coil_current(e, tracking, currents)
                jumped = device_force(e, amperes, tracking, devices, combined_force)
                force[e] = jumped + 2.0 * settings[JUMP] * (force[e] - jumped)
        for i in range(n_z):
            predicted[i] = 0.0
            for j in range(n_z):
                predicted[i] += transition[i * n_z + j] * z[j]
            for e in range(m):
                predicted[i] += (at_start[i * m + e] + at_end[i * m + e]) * force[e]
    for e in range(m):
        v = 0.0
        for i in range(n):
            v += rows[e * n + i] * predicted[n + i]
        x = measured[n + e]
        follow_device(e, x, v, h, tracking, devices, currents, state_rates)
        amperes = coil_current(e, tracking, currents)
        present = device_force(e, amperes, tracking, devices, combined_force)
        if begun:
            for i in range(n_z):
                predicted[i] += at_end[i * m + e] * (present - force[e])
        force[e] = present
    correct_at_once(
        measured, predicted, force, on_state, on_force, gain, root, z, innovation, normalised
    )


def correct_at_once(
    measured: NDArray, predicted: NDArray, force: NDArray, on_state: NDArray, on_force: NDArray,
    gain: NDArray, root: NDArray, z: NDArray, innovation: NDArray, normalised: NDArray,
) -> None:  # fmt: skip
    """Correct the prediction by the measurements, whose innovations are normalised as well."""
    n_z, n_y, m = len(z), len(innovation), len(force)
    for k in range(n_y):
        innovation[k] = measured[k]
        for j in range(n_z):
            innovation[k] -= on_state[k * n_z + j] * predicted[j]
        for e in range(m):
            innovation[k] -= on_force[k * m + e] * force[e]
    for k in range(n_y):
        normalised[k] = 0.0
        for j in range(k + 1):
            normalised[k] += root[k * n_y + j] * innovation[j]
    for i in range(n_z):
        z[i] = predicted[i]
        for k in range(n_y):
            z[i] += gain[i * n_y + k] * innovation[k]


def kalman_row(
    t: float, measured: NDArray, settings: NDArray, memory: NDArray, command: NDArray,
    combined_force: Callable, state_rates: Callable,
) -> None:  # fmt: skip
    """Update, and write estimate, device states and innovations."""
    kalman_update(t, measured, settings, memory, combined_force, state_rates)
    n_z, n_y, m = int(settings[N_Z]), int(settings[N_Y]), int(settings[N_ELEMENTS])
    first = kalman_memory(settings) + MOTION + 5 * m
    n_states = len(command) - n_z - n_y
    for i in range(n_z):
        command[i] = memory[1 + i]
    for i in range(n_states):
        command[n_z + i] = memory[first + i]
    for k in range(n_y):
        command[n_z + n_states + k] = memory[1 + n_z + m + k]


@checked
class KalmanFilter(Observer):
    """Kalman filter of constant gain on the structure, the devices' forces as known inputs.

    Its nominal law, with states integrated along the measured deformation at the measured
    current, says what force a device gives; the noise of the measured deformation, through the
    device's stiffness, is part of the noise that the filter expects. The structure is propagated
    exactly between measurements, the forces linear in time.

    References
    ----------
    Kalman 1960; Simon 2006, Optimal State Estimation, chapters 5 and 7.
    """

    tracking_at = TRACKING

    @cached_property
    def design(self) -> dict[str, NDArray]:
        """Matrices of the filter, by name.

        ``transition``, ``at_start`` and ``at_end`` of ``sampled``; ``on_state`` and ``on_force`` of
        the measurements; ``gain``; ``prior`` and ``posterior`` covariance; ``innovation``
        covariance and its inverse ``root``.
        """
        from scipy.linalg import solve_discrete_are

        rows, n = self.nominal.element_rows, self.nominal.structure.n_dofs
        a, b, g, c, d = structure_and_ground(self.nominal.structure, rows, self.ground)
        density = self.ground.density * g @ g.T
        transition, at_start, at_end, added = sampled(a, b, density, self.period)
        on_ground = self.ground_rows()
        on_state = np.vstack([c, np.pad(rows, ((0, 0), (0, len(a) - n))), on_ground])
        on_force = np.pad(d, ((0, len(rows) + len(on_ground)), (0, 0)))
        forces = self._force_noise()
        added += (at_start * forces) @ (at_start * forces).T
        added += (at_end * forces) @ (at_end * forces).T
        accelerations, deformations = self.noise.acceleration**2, self.noise.deformation**2
        noise = np.diag(
            [accelerations] * n + [deformations] * len(rows) + [accelerations] * len(on_ground)
        )
        noise += (on_force * forces) @ (on_force * forces).T
        # measurements made independent and of unit variance keep the Riccati equation well scaled
        scaled = np.linalg.solve(np.linalg.cholesky(noise), on_state)
        prior = solve_discrete_are(transition.T, scaled.T, added, np.eye(len(scaled)))
        innovation = on_state @ prior @ on_state.T + noise
        gain = np.linalg.solve(innovation, on_state @ prior).T
        return {
            "transition": transition, "at_start": at_start, "at_end": at_end,
            "on_state": on_state, "on_force": on_force, "gain": gain, "prior": prior,
            "posterior": prior - gain @ innovation @ gain.T, "innovation": innovation,
            "root": np.linalg.inv(np.linalg.cholesky(innovation)),
        }  # fmt: skip

    def _force_noise(self) -> NDArray:
        """Standard deviation of each element's force, from noise in its deformation, N."""
        deviations = []
        for element in self.nominal.elements:
            amperes = 0.0 if element.channel is None else float(self.reference[element.channel])
            # noise has high frequencies: the stiffness is that at half the sampling frequency
            stiffness = element.device.linearised(amperes, 0.5 / self.period)
            deviations.append(abs(stiffness) * self.noise.deformation)
        return np.array(deviations)

    def decision(self) -> Decision:
        """Filter and devices in one array."""
        design, rows, tracking = self.design, self.nominal.element_rows, self.tracking
        n_y, n_z = design["on_state"].shape
        names = ("transition", "at_start", "at_end", "on_state", "on_force", "gain", "root")
        own = np.concatenate([*(design[name].ravel() for name in names), rows.ravel()])
        m, n = rows.shape
        settings = np.concatenate(
            [[n, n_z, n_y, m, HEAD + len(own), self.jump], own, tracking.settings]
        )
        memory = np.zeros(1 + 2 * n_z + m + 2 * n_y + len(tracking.memory))
        return Decision(kalman_row, settings, memory, tracking.model)

    def width(self) -> int:
        """Length of a row."""
        n_y, n_z = self.design["on_state"].shape
        return n_z + len(self.nominal.elements) * self.tracking.model.n_states + n_y

    def estimate(self, time: NDArray, rows: NDArray) -> Estimate:
        """Unpack a row; the covariance is that of the steady state."""
        n, n_z = self.nominal.structure.n_dofs, len(self.design["transition"])
        m, n_states = len(self.nominal.elements), self.tracking.model.n_states
        q, p, ground, states, innovations = np.split(
            rows, [n, 2 * n, n_z, n_z + m * n_states], axis=1
        )
        posterior = self.design["posterior"]
        return Estimate(
            time, q, p, ground, states.reshape(len(rows), m, n_states), innovations,
            np.broadcast_to(posterior, (len(rows), *posterior.shape)),
        )  # fmt: skip
