"""Rows that give the motion of the base and of the isolators from the displacements.

``Structure`` and ``IsolatedStructure`` import this module, so it does not import them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import InputError


def rows_of_base(structure: Any, name: str) -> dict[str, np.ndarray]:
    """Row of the base's motion per horizontal direction, (n,), by the element's name."""
    result = {}
    for column, label in zip(structure.influence.T, structure.horizontal, strict=False):
        row = np.zeros(structure.n_dofs)
        row[list(structure.base)] = column[list(structure.base)]
        result[name if len(structure.horizontal) == 1 else f"{name}_{label}"] = row
    return result


def plan_dofs(structure: Any) -> tuple[int, int, int]:
    """Dofs of the base along x, along y and in rotation."""
    moved = [tuple(structure.influence[dof, : len(structure.horizontal)]) for dof in structure.base]
    target = ((1.0, 0.0), (0.0, 1.0), (0.0, 0.0))
    if sorted(moved) != sorted(target):
        raise InputError(
            f"isolator_positions of {structure.name} need a base of three dofs, along x, along y "
            f"and in rotation, with ground motion along x and y; its influence there is {moved}"
        )
    x, y, rotation = (structure.base[moved.index(row)] for row in target)
    return x, y, rotation


def isolator_rows(structure: Any) -> np.ndarray:
    """Rows for the isolators' displacements along x and y, (n_isolators, 2, n)."""
    positions, foundation = structure.isolator_positions, list(structure.foundation)
    along_x, along_y, rotation = plan_dofs(structure)
    rows = np.zeros((len(positions), 2, structure.n_dofs))
    rows[:, 0, along_x] = rows[:, 1, along_y] = 1.0
    rows[:, 0, rotation] = -positions[:, 1]
    rows[:, 1, rotation] = positions[:, 0]
    rows[:, :, foundation] = -structure.influence[foundation, :2].T
    return rows


def base_rows(structure: Any) -> np.ndarray:
    """Rows for the displacement of the base over the foundation, (1, n_horizontal, n)."""
    count = len(structure.horizontal)
    rows = np.zeros((1, count, structure.n_dofs))
    for dofs, sign in ((list(structure.base), 1.0), (list(structure.foundation), -1.0)):
        rows[0][:, dofs] = sign * structure.influence[dofs, :count].T
    return rows
