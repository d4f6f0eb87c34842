"""Criteria of finished runs in compiled code, for one run or many runs in parallel."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import chain
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..structures import IsolatedStructure
from .complex_modes import real_rows
from .kernel.arguments import Quantities
from .outputs import quantity_rows
from .plan import modes_for
from .workspace import Workspace

RESOLVED = 1.9
"""Largest |eigenvalue| times grid interval of a mode whose peaks show at the grid points."""


def criteria_of_lanes(plants: Sequence[IsolatedStructure], work: Workspace) -> dict[str, NDArray]:
    """Criteria of every lane of a finished block."""
    # A lane's criteria have the same bits in a block as in a single run.
    items, both = _summed(plants, work)
    # a criterion of no items, such as the drift of a building without storeys, is 0
    both = np.concatenate([both, np.zeros((2, 1, both.shape[-1]))], axis=1)
    of_items = [own or [-1] for _, own in items]
    first = np.cumsum([0, *map(len, of_items[:-1])])
    peak, total = np.maximum.reduceat(both[:, [*chain.from_iterable(of_items)]], first, axis=1)
    result = {f"peak_{name}": row for (name, _), row in zip(items, peak, strict=True)}
    rms = np.sqrt(total)
    return result | {f"rms_{name}": row for (name, _), row in zip(items, rms, strict=True)}


def item_peaks(isolated: IsolatedStructure, work: Workspace) -> dict[str, NDArray]:
    """Peaks of each item, such as a level or a storey, of a single finished run."""
    items, (peak, _) = _summed([isolated], work)
    return {name: peak[own, 0] for name, own in items}


def _summed(
    plants: Sequence[IsolatedStructure], work: Workspace
) -> tuple[tuple[tuple[str, list[int]], ...], NDArray]:
    """Criteria with their items' numbers; peaks and mean squares of items, (2, n_items, lanes)."""
    distinct = tuple(plants[: work.kernel.shape.table_lanes])
    items, quantities = _on_a_grid(distinct, work.grid.longest)
    return items, work.peaks_and_mean_squares(quantities)


def criteria_key(isolated: IsolatedStructure) -> tuple:
    """Return the properties that structures of one block share: names and items of criteria."""
    items = _rows(isolated)[0]
    return tuple((name, tuple(numbers)) for name, numbers in items)


class _Quantities(NamedTuple):
    """Quantities of some lanes' structures, in the kernel's form."""

    # items: each one's name and its items' numbers; rows: the kernel's blocks, flat; moduli: of the
    # rows over the modes, (n_items, n_modes, lanes); forced: most that a mode moves when an
    # element's force bends by 1 N and back, (n_modes, n_elements, lanes); follows: what a mode
    # follows, with its sign turned, per ground acceleration and force, and per rate of these,
    # (2, n_ground + n_elements, n_modes, lanes); fastest: modulus of each mode's eigenvalue, of the
    # lane where it is highest, 1/s.

    items: tuple[tuple[str, list[int]], ...]
    n_items: int
    n_directions: int
    rows: NDArray
    moduli: NDArray
    forced: NDArray
    follows: NDArray
    fastest: NDArray


@lru_cache(maxsize=256)
def _quantities(plants: tuple[IsolatedStructure, ...]) -> _Quantities:
    """Quantities of the structures of a block."""
    per_lane = [_rows(plant) for plant in plants]
    rows, moduli = (np.stack([one[k] for one in per_lane], axis=-1) for k in (1, 2))
    modes = [modes_for(plant)[0] for plant in plants]
    eigenvalues = np.array([one.eigenvalues for one in modes])
    inputs = np.array([np.vstack([one.ground, one.force]) for one in modes])
    static = inputs / eigenvalues[:, np.newaxis]
    follows = np.array([static, static / eigenvalues[:, np.newaxis]])
    # by parts: the force and its total variation, over the mode's speed
    forced = 3.0 * np.abs([one.force for one in modes] / eigenvalues[:, np.newaxis])
    return _Quantities(
        per_lane[0][0], len(moduli), len(plants[0].structure.directions), rows.ravel(), moduli,
        forced.T, follows.transpose(0, 2, 3, 1), np.abs(eigenvalues).max(axis=0),
    )  # fmt: skip


@lru_cache(maxsize=256)
def _on_a_grid(
    plants: tuple[IsolatedStructure, ...], longest: float
) -> tuple[tuple[tuple[str, list[int]], ...], Quantities]:
    """Criteria with their items' numbers; quantities with the modes that are fast on a grid."""
    own = _quantities(plants)
    fast = np.flatnonzero(own.fastest * longest > RESOLVED)
    moduli = own.moduli[:, fast]
    of_fast = (
        moduli, np.einsum("imt,met->iet", moduli, own.forced[fast]), own.follows[:, :, fast],
    )  # fmt: skip
    # of one layout: the kernel is compiled once more for another
    return own.items, Quantities(
        own.rows, own.n_items, own.n_directions, fast, *map(np.ascontiguousarray, of_fast)
    )


@lru_cache(maxsize=256)
def _rows(
    isolated: IsolatedStructure,
) -> tuple[tuple[tuple[str, list[int]], ...], NDArray, NDArray]:
    """Names of a structure's quantities with their items' numbers; rows, and moduli, of items."""
    modes, outputs = modes_for(isolated)
    named = quantity_rows(isolated, outputs.names)
    # an item of several quantities, such as a floor's acceleration, is computed once
    numbers: dict[bytes, int] = {}
    items = tuple(
        (name, [numbers.setdefault(item.tobytes(), len(numbers)) for item in own])
        for name, own in named.items()
    )
    shape = len(numbers), *named["drift_m"].shape[1:]
    rows = np.frombuffer(b"".join(numbers)).reshape(shape) @ outputs.rows
    # the kernel's forces are residual forces, without the reference springs and dashpots
    n = modes.eigenvalues.size
    deformation, velocity = np.moveaxis(real_rows(modes.deformation), 1, 0)
    reference = modes.stiffness[:, None] * deformation + modes.damping[:, None] * velocity
    rows[..., : 2 * n] += rows[..., 2 * n : 2 * n + len(reference)] @ reference
    moduli = np.hypot(rows[..., :n], rows[..., n : 2 * n]).sum(axis=1)
    return items, _packed(rows), moduli


def _packed(rows: NDArray) -> NDArray:
    """Rows of quantities (n, n_directions, n_inputs), as the kernel's blocks of eight rows."""
    n, n_directions, n_inputs = rows.shape
    per_block = 8 // n_directions
    blocks = np.zeros((-(-n // per_block), 8, n_inputs))
    for k in range(n):
        at = (k % per_block) * n_directions
        blocks[k // per_block, at : at + n_directions] = rows[k]
    return blocks.transpose(0, 2, 1).ravel()
