"""Named outputs of an isolated structure as rows over its modes, and the quantities of criteria."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..structures import IsolatedStructure, Structure
from ..structures.element import base_devices, isolation_elements, moat_walls
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


def quantity_rows(isolated: IsolatedStructure, names: Sequence[str]) -> dict[str, NDArray]:
    """Quantities that the criteria are taken of, as rows over a structure's outputs."""
    # Floor acceleration, base displacement and storey drift are vectors over the directions of
    # ground motion, at the dofs of these directions: the floors' centres. Rotations have an effect
    # only on forces and isolator displacements. The isolator force is that of the elements with a
    # coil between structure and ground; without any coil, of all elements between them. The
    # isolation force is that of all isolators and bearings, where some have no coil.
    structure = isolated.structure
    n_directions = len(structure.directions)
    index = {name: k for k, name in enumerate(names)}

    def pick(owners: Sequence[str], quantity: str) -> NDArray:
        rows = np.zeros((len(owners), len(names)))
        for row, owner in zip(rows, owners, strict=True):
            row[index[f"{owner}_{quantity}"]] = 1.0
        return rows

    def items(rows: NDArray) -> NDArray:
        missing = n_directions - rows.shape[1]
        return np.pad(rows, ((0, 0), (0, missing), (0, 0)))

    displacement = pick(structure.names, "displacement_m")
    acceleration = pick(structure.names, "acceleration_m_s2")
    drift = pick(structure.storeys, "drift_m")
    force = pick(isolated.element_names, "force_N")
    base = np.array(structure.base, dtype=int)
    slabs = base[_by_direction(structure.influence[base])]
    levels, storeys = level_dofs(structure), storey_rows(structure)
    above = np.isin(levels, structure.superstructure).any(axis=1)
    layer, walls = isolation_elements(isolated), moat_walls(isolated)
    devices = base_devices(isolated)

    def resultant(elements: Sequence[int]) -> NDArray:
        return (isolated.holding[elements].T @ force[elements])[np.newaxis]

    result = {
        "base_displacement_m": items(displacement[slabs]),
        "floor_acceleration_m_s2": items(acceleration[levels]),
        "superstructure_acceleration_m_s2": items(acceleration[levels[above]]),
        "drift_m": items(drift[storeys]),
        "base_shear_N": -(structure.base_shear_rows(above_base=False) @ acceleration)[np.newaxis],
        "structural_shear_N": -(structure.base_shear_rows(above_base=True) @ acceleration)[
            np.newaxis
        ],
        "isolator_force_N": resultant(devices),
    }
    if len(devices) < len(layer):
        result["isolation_force_N"] = resultant(layer)
    if walls:
        result["wall_force_N"] = resultant(walls)
    if structure.isolator_positions is not None:
        rows = structure.isolator_rows[_outermost(structure.isolator_positions)]
        result["isolator_displacement_m"] = items(rows @ displacement)
    if structure.heights is not None:
        by_height = drift / structure.heights[:, np.newaxis]
        result["drift_ratio"] = items(by_height[storeys])
    return result


def level_dofs(structure: Structure) -> NDArray:
    """Dofs of each level above the foundation in each direction of ground motion.

    Levels are the base and the ends of the storeys. Without storeys all dofs are levels.
    """
    moved = structure.above_foundation
    if structure.storeys:
        ends = np.any(structure.drift_rows, axis=0)
        ends[list(structure.base)] = True
        moved[~ends] = 0.0
    return _by_direction(moved)


def storey_rows(structure: Structure) -> NDArray:
    """Drift rows of each storey in each direction of ground motion, as `level_dofs`."""
    return _by_direction(np.abs(structure.drift_rows) @ np.abs(structure.influence))


def level_names(structure: Structure) -> list[str]:
    """Names of the levels, without the direction of their dofs."""
    return _without_direction(structure, structure.names, level_dofs(structure))


def storey_names(structure: Structure) -> list[str]:
    """Names of the storeys, without the direction of their drifts."""
    return _without_direction(structure, structure.storeys, storey_rows(structure))


def _without_direction(structure: Structure, names: Sequence[str], rows: NDArray) -> list[str]:
    ends = tuple(f"_{direction}" for direction in structure.directions)
    first = (names[row] for row in rows[:, 0])
    return [name.rsplit("_", 1)[0] if name.endswith(ends) else name for name in first]


def _by_direction(moved: NDArray) -> NDArray:
    moving = moved[:, moved.any(axis=0)] if moved.any() else moved
    columns = [np.flatnonzero(column) for column in moving.T]
    shared = np.any(np.count_nonzero(moved, axis=1) > 1)
    if shared or len({len(column) for column in columns}) > 1:
        return np.flatnonzero(moved.any(axis=1))[:, np.newaxis]
    return np.stack(columns, axis=1)


def _outermost(positions: NDArray) -> NDArray:
    """Corners of the convex hull; one of them has the largest displacement of a rigid slab."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return np.sort(ConvexHull(positions).vertices)
    except (QhullError, ValueError):  # on one line, or too few
        return np.arange(len(positions))
