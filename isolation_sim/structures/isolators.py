"""The isolation layer: rows of its motion from the displacements, and its isolators.

``Structure`` and ``IsolatedStructure`` import this module, so it does not import them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import InputError
from ..laws.device import Device


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


def add_isolators(
    isolated: Any, device: Device, biaxial: bool, load_changes: np.ndarray | None
) -> Any:
    """Add the isolators between ground and base; ``device`` represents all of them."""
    channel = 0 if device.depends_on_current else None
    if biaxial:
        return _add_biaxial(isolated, device, channel, load_changes)
    if load_changes is not None:
        raise InputError(
            "overturning and vertical motion need biaxial isolators; expected: biaxial as well"
        )
    for name, row in rows_of_base(isolated.structure, "isolator").items():
        isolated = isolated.with_element(device, row, channel, name)
    return isolated


def _add_biaxial(
    isolated: Any, device: Device, channel: int | None, load_changes: np.ndarray | None
) -> Any:
    """Add a biaxial device at each isolator position, with equal shares."""
    structure = isolated.structure
    if len(structure.horizontal) != 2:
        raise InputError(
            f"{structure.name} has ground motion along {', '.join(structure.horizontal)}; expected "
            "for biaxial isolators: two directions"
        )
    places = structure.isolation_rows
    changes = [None] * len(places) if load_changes is None else list(load_changes)
    if len(changes) != len(places):
        raise InputError(
            f"load_changes has {len(changes)} rows; expected: {len(places)}, one per isolator"
        )
    share = device.scaled(force=1 / len(places))
    for k, (rows, change) in enumerate(zip(places, changes, strict=True)):
        name = "isolator" if len(places) == 1 else f"isolator{k + 1}"
        isolated = isolated.with_biaxial(share, rows, channel, name, change)
    return isolated
