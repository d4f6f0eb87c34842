"""Criteria of finished runs, summed up in compiled code: of one run or of many side by side."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..structures import IsolatedStructure
from .plan import modes_for
from .workspace import Workspace

RESOLVED = 1.9
"""Angle through which a mode may turn between two grid points, whose values then show its peaks."""


def summary(plants: Sequence[IsolatedStructure], work: Workspace) -> dict[str, NDArray]:
    """Criteria of every lane of a finished block.

    A lane's criteria have the same bits in a block as in a single run.

    Parameters
    ----------
    plants : sequence of IsolatedStructure
        One a lane.
    work : Workspace
        Marched to the end.

    Returns
    -------
    dict of str to (n_lanes,) array
        Keys and units as in ``isolation_sim.criteria.criteria``, without J1 to J9.
    """
    quantities = _quantities(tuple(plants[: work.module.TABLE_LANES]))
    fast = np.flatnonzero(quantities.fastest * work.grid.longest > RESOLVED)
    ends = quantities.ends
    peak, total = work.summarise(
        quantities.rows, ends[-1], quantities.n_directions, fast, quantities.moduli[:, fast]
    )
    items = list(zip(quantities.names, ends[:-1], ends[1:], strict=True))
    found = {f"peak_{name}": peak[a:b].max(axis=0, initial=0.0) for name, a, b in items}
    for name, a, b in items:
        found[f"rms_{name}"] = np.sqrt(total[a:b].max(axis=0, initial=0.0))
    return found


class _Quantities(NamedTuple):
    """Quantities of some lanes' structures, as the kernel takes them.

    names, and the ends of each one's items in a row of all; rows: the kernel's blocks, flat;
    moduli: of the rows over the modes, (n_items, n_modes, lanes); fastest: angular frequency of
    each mode, of the lane where it is highest, rad/s.
    """

    names: tuple[str, ...]
    ends: list[int]
    n_directions: int
    rows: NDArray
    moduli: NDArray
    fastest: NDArray


@lru_cache(maxsize=256)
def _quantities(plants: tuple[IsolatedStructure, ...]) -> _Quantities:
    """Quantities of structures that go side by side."""
    per_lane = [_rows(plant) for plant in plants]
    names, sizes = per_lane[0][:2]
    rows, moduli = (np.stack([one[k] for one in per_lane], axis=-1) for k in (2, 3))
    speeds = [np.abs(modes_for(plant)[0].eigenvalues.imag) for plant in plants]
    ends = np.cumsum([0, *sizes]).tolist()
    n_directions = len(plants[0].structure.directions)
    return _Quantities(names, ends, n_directions, rows.ravel(), moduli, np.max(speeds, axis=0))


@lru_cache(maxsize=256)
def _rows(
    isolated: IsolatedStructure,
) -> tuple[tuple[str, ...], tuple[int, ...], NDArray, NDArray]:
    """Names of a structure's quantities, their numbers of items; rows, and moduli, of the items."""
    from ..criteria import quantity_rows

    modes, outputs = modes_for(isolated)
    named = quantity_rows(isolated, outputs.names)
    rows = np.concatenate(list(named.values())) @ outputs.rows
    # the kernel's forces are those beyond the reference springs and dashpots
    n = modes.eigenvalues.size
    deformation, velocity = np.moveaxis(_real(modes.deformation), 1, 0)
    reference = modes.stiffness[:, None] * deformation + modes.damping[:, None] * velocity
    rows[..., : 2 * n] += rows[..., 2 * n : 2 * n + len(reference)] @ reference
    moduli = np.hypot(rows[..., :n], rows[..., n : 2 * n]).sum(axis=1)
    return tuple(named), tuple(map(len, named.values())), _packed(rows), moduli


def _packed(rows: NDArray) -> NDArray:
    """Rows of quantities (n, n_directions, n_inputs), as the kernel's blocks of eight rows."""
    n, n_directions, n_inputs = rows.shape
    per_block = 8 // n_directions
    blocks = np.zeros((-(-n // per_block), 8, n_inputs))
    for k in range(n):
        at = (k % per_block) * n_directions
        blocks[k // per_block, at : at + n_directions] = rows[k]
    return blocks.transpose(0, 2, 1).ravel()


def _real(rows: NDArray) -> NDArray:
    """Complex rows over modes as rows over their real, then imaginary parts."""
    return np.concatenate([rows.real, -rows.imag], axis=-1)
