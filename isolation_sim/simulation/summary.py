"""Criteria of finished runs, summed up in compiled code: of one run or of many side by side."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..structures import IsolatedStructure
from .modal import Modes
from .outputs import Outputs
from .plan import modes_for
from .workspace import Workspace


def summary(
    plants: Sequence[IsolatedStructure], modes: Sequence[Modes], work: Workspace
) -> dict[str, NDArray]:
    """Criteria of every lane of a finished block.

    A lane's criteria have the same bits in a block as in a single run.

    Parameters
    ----------
    plants : sequence of IsolatedStructure
        One a lane.
    modes : sequence of Modes
        Of each plant.
    work : Workspace
        Marched to the end.

    Returns
    -------
    dict of str to (n_lanes,) array
        Keys and units as in ``isolation_sim.criteria.criteria``, without ratios.
    """
    own = work.module.TABLE_LANES
    items, n_items, n_directions, _ = _quantities(plants[0])
    table = np.stack([_quantities(plant)[-1] for plant in plants[:own]], axis=-1)
    peak, total = np.zeros((2, n_items, len(plants)))
    work.summarise(_motion_rows(modes[:own]), table, n_directions, peak, total)
    return {
        f"{kind}_{name}": np.sqrt(np.max(squares[list(numbers)], axis=0, initial=0.0))
        for kind, squares in (("peak", peak), ("rms", total))
        for name, numbers in items
    }


def summary_key(isolated: IsolatedStructure) -> tuple:
    """Return what structures of one block must have in common: names and items of criteria."""
    return _quantities(isolated)[:2]


@lru_cache(maxsize=256)
def _quantities(
    isolated: IsolatedStructure,
) -> tuple[tuple[tuple[str, tuple[int, ...]], ...], int, int, NDArray]:
    """Criteria by name with their items' numbers, how many items, directions, the kernel's rows."""
    from ..criteria import quantity_rows

    outputs = modes_for(isolated)[1]
    rows = quantity_rows(isolated, outputs.names)
    # an item of several criteria, such as a floor's acceleration, is followed once
    numbers: dict[bytes, int] = {}
    items = tuple(
        (name, tuple(numbers.setdefault(item.tobytes(), len(numbers)) for item in own))
        for name, own in rows.items()
    )
    distinct = np.frombuffer(b"".join(numbers)).reshape(len(numbers), *rows["drift_m"].shape[1:])
    n_directions = len(isolated.structure.directions)
    return items, len(numbers), n_directions, _packed(distinct, outputs)


def _packed(rows: NDArray, outputs: Outputs) -> NDArray:
    """Rows of quantities (n, n_directions, n_outputs), as the kernel's blocks of eight rows."""
    n, n_directions, _ = rows.shape
    per_block = 8 // n_directions
    inputs = rows @ outputs.rows
    n_blocks = -(-n // per_block)
    blocks = np.zeros((n_blocks, 8, inputs.shape[2]))
    for k in range(n):
        at = (k % per_block) * n_directions
        blocks[k // per_block, at : at + n_directions] = inputs[k]
    return blocks.transpose(0, 2, 1).ravel()


def _motion_rows(lanes: Sequence[Modes]) -> NDArray:
    """Deformation and velocity of each device over the modes, in blocks of eight rows."""
    packed: list[NDArray] = []
    for modes in lanes:
        if packed and modes is lanes[0]:
            packed.append(packed[0])
            continue
        rows = modes.deformation.reshape(-1, modes.eigenvalues.size)
        real = np.concatenate([rows.real, -rows.imag], axis=1)
        blocks = np.zeros((-(-len(real) // 8) * 8, real.shape[1]))
        blocks[: len(real)] = real
        packed.append(blocks.reshape(-1, 8, real.shape[1]).transpose(0, 2, 1).ravel())
    return np.stack(packed, axis=-1)

