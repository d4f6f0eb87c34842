"""One integration step in NumPy: a slow, readable version of the compiled kernel.

The kernel (``kernel``) makes the same step in complex
modes, for many runs in parallel. Simulations do not use this module; tests compare the two.

The method is exponential collocation with the three Gauss points of the step as nodes:

1. Each device's force is split into a reference spring and dashpot, which join the linear
   structure, and a residual force. The structure is then ``x' = A x + B f + G a_g``.
2. The residual forces are quadratics in time through their values at the nodes, the ground
   acceleration is linear between its samples. Under both, ``x`` is propagated exactly.
3. The devices' states are collocated at the same nodes: ``s_j = s_0 + h sum_k C_jk rate_k``.
4. Residual forces and states are iterated to a fixed point.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from ..structures import IsolatedStructure
from .kernel.collocation import COLLOCATION, END_FROM_NODES, NODES

MOST_ITERATIONS = 200


class StepState(NamedTuple):
    """Displacements and velocities of the dofs, shape (2 n,), and the states of each device."""

    x: NDArray
    devices: tuple[NDArray, ...]


def step(
    plant: IsolatedStructure,
    references: tuple[NDArray, NDArray],
    state: StepState,
    h: float,
    ground: NDArray,
    currents: NDArray,
) -> StepState:
    """State after a step of ``h`` seconds under constant currents."""
    # ``references`` are the stiffness and damping of each element's reference, ``ground`` the
    # ground acceleration at equal distances over the step, shape (n_samples, n_directions), and
    # ``currents`` those of each element.
    a, b, g = _linear_part(plant, *references)
    devices = [
        (list(group), law, plant.elements[group[0]].device.current.at(currents[group[0]]))
        for group, law in zip(plant.groups, plant.group_laws, strict=True)
    ]
    measure = plant.element_rows / np.array([[e.device.length] for e in plant.elements])
    collocation = np.array(COLLOCATION)

    def motion(x: NDArray) -> tuple[NDArray, NDArray]:
        """Deformation and velocity of every device."""
        return measure @ x[: len(x) // 2], measure @ x[len(x) // 2 :]

    def residual(k: int, x: NDArray, s: NDArray) -> NDArray:
        """Residual forces of device k along its directions: forces minus those of its reference."""
        group, law, parameters = devices[k]
        d, v = (row[group] for row in motion(x))
        forces, _ = law.respond(tuple(d), tuple(v), tuple(s), parameters)
        return np.array(forces) - references[0][group] * d - references[1][group] * v

    forces = np.zeros((len(plant.elements), 3))
    for k, (group, _, _) in enumerate(devices):
        forces[group] = residual(k, state.x, state.devices[k])[:, np.newaxis]
    states = [np.tile(s, (3, 1)) for s in state.devices]
    for _ in range(MOST_ITERATIONS):
        *nodes, end = _propagate(a, b, g, state.x, h, forces, ground)
        before = forces.copy()
        for k, (group, law, parameters) in enumerate(devices):
            rates = []
            for x, s in zip(nodes, states[k], strict=True):
                d, v = (row[group] for row in motion(x))
                rates.append(law.respond(tuple(d), tuple(v), tuple(s), parameters)[1])
            states[k] = state.devices[k] + h * collocation @ np.array(rates).reshape(3, -1)
            for j, x in enumerate(nodes):
                forces[group, j] = residual(k, x, states[k][j])
        if np.abs(forces - before).max() <= 1e-15 * np.abs(forces).max():
            break
    moved = zip(state.devices, states, strict=True)
    return StepState(end, tuple(s0 + np.array(END_FROM_NODES) @ (s - s0) for s0, s in moved))


def _linear_part(
    plant: IsolatedStructure, stiffness: NDArray, damping: NDArray
) -> tuple[NDArray, NDArray, NDArray]:
    """Matrices of x' = A x + B f + G a_g, the elements' references included."""
    s, rows, n = plant.structure, plant.element_rows, plant.structure.n_dofs
    length = np.array([e.device.length for e in plant.elements])
    force_scale = np.array([e.device.force_scale for e in plant.elements])
    scale = force_scale / length
    k = s.stiffness + rows.T @ np.diag(scale * stiffness) @ rows
    c = s.damping + rows.T @ np.diag(scale * damping) @ rows
    a = np.block(
        [
            [np.zeros((n, n)), np.eye(n)],
            [-np.linalg.solve(s.mass, k), -np.linalg.solve(s.mass, c)],
        ]
    )
    b = np.vstack([np.zeros((n, len(rows))), -np.linalg.solve(s.mass, rows.T * force_scale)])
    g = np.vstack([np.zeros_like(s.influence), -s.influence])
    return a, b, g


def _propagate(
    a: NDArray, b: NDArray, g: NDArray, x: NDArray, h: float, forces: NDArray, ground: NDArray
) -> list[NDArray]:
    """Response at the nodes and at the step's end, exact by a matrix exponential (Van Loan)."""
    powers = np.linalg.solve(np.vander(NODES, 3, increasing=True), forces.T)
    n_ground = len(ground) - 1
    corners = np.arange(n_ground + 1) / n_ground
    results, t = [], 0.0
    for end in sorted({*NODES, *corners[1:]}):
        middle = (t + end) / 2 * n_ground
        slope = (ground[int(middle) + 1] - ground[int(middle)]) * n_ground
        u = ground[int(middle)] + slope * (t - int(middle) / n_ground)
        # Taylor coefficients of the inputs at t, in units of the step
        force = (powers[0] + t * (powers[1] + t * powers[2]), powers[1] + 2 * t * powers[2])
        constant = b @ force[0] + g @ u
        linear = b @ force[1] + g @ slope
        quadratic = b @ powers[2]
        n = len(x)
        block = np.zeros((n + 3, n + 3))
        block[:n, :n] = a * h
        block[:n, n:] = h * np.stack([constant, linear, 2 * quadratic], axis=1)
        block[n:, n:] = np.diag([1.0, 1.0], -1)  # of 1, t and t^2 / 2
        x = (expm(block * (end - t)) @ np.concatenate([x, [1.0, 0.0, 0.0]]))[:n]
        if end in NODES or end == 1.0:
            results.append(x)
        t = float(end)
    return results
