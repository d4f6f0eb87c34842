"""Named outputs of an isolated structure, as rows over modes, device forces and ground motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..structures import IsolatedStructure
from .complex_modes import Modes, real_rows


@dataclass(frozen=True)
class Outputs:
    """All outputs of a structure in one set of modes."""

    # Name with unit, such as ``floor1_acceleration_m_s2``. Displacements and velocities are
    # relative to the ground, accelerations are absolute
    names: tuple[str, ...]
    # (n_outputs, 2 n_modes + n_elements + n_directions): Over the modes' real parts, their
    # imaginary parts, device forces (N, device scale) and ground accelerations (m/s^2)
    rows: NDArray


QUANTITIES = (
    "displacement_m", "velocity_m_s", "acceleration_m_s2", "drift_m", "deformation_m", "force_N",
)  # fmt: skip
"""Quantities of outputs: the end of their names."""


def output_names(isolated: IsolatedStructure) -> tuple[str, ...]:
    """Names of all outputs, in the order of ``Outputs.rows``."""
    structure = isolated.structure
    names = [f"{dof}_displacement_m" for dof in structure.names]
    names += [f"{dof}_velocity_m_s" for dof in structure.names]
    names += [f"{dof}_acceleration_m_s2" for dof in structure.names]
    names += [f"{storey}_drift_m" for storey in structure.storeys]
    names += [f"{element}_deformation_m" for element in isolated.element_names]
    names += [f"{element}_velocity_m_s" for element in isolated.element_names]
    names += [f"{element}_force_N" for element in isolated.element_names]
    if len(structure.directions) == 1:
        names.append("ground_acceleration_m_s2")
    else:
        names += [f"ground_{d}_acceleration_m_s2" for d in structure.directions]
    return tuple(names)


def outputs_of(isolated: IsolatedStructure, modes: Modes) -> Outputs:
    """Rows of all outputs."""
    structure, n = isolated.structure, isolated.structure.n_dofs
    n_modes, n_ground = modes.eigenvalues.size, len(structure.directions)
    scales = np.array([e.device.force_scale for e in isolated.elements])
    b = isolated.element_rows
    state = real_rows(modes.shapes)
    displacement, velocity = state[:n], state[n:]
    inverse = np.linalg.inv(structure.mass)
    inner = structure.damping @ velocity + structure.stiffness @ displacement

    def rows(on_state: NDArray, on_force: NDArray | None = None) -> NDArray:
        force = np.zeros((len(on_state), len(b))) if on_force is None else on_force
        return np.concatenate([on_state, force, np.zeros((len(on_state), n_ground))], axis=1)

    ground = np.zeros((n_ground, 2 * n_modes + len(b) + n_ground))
    ground[:, 2 * n_modes + len(b) :] = np.eye(n_ground)
    table = [
        rows(displacement),
        rows(velocity),
        rows(-inverse @ inner, -inverse @ (b.T * scales)),
        rows(structure.drift_rows @ displacement),
        rows(b @ displacement),
        rows(b @ velocity),
        rows(np.zeros((len(b), 2 * n_modes)), np.diag(scales)),
        ground,
    ]
    return Outputs(output_names(isolated), np.concatenate(table))
