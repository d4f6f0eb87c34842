"""Criteria that a scenario, ``compare`` or ``tune`` may select beside peaks and RMS values."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .criterion import Criterion
from .simulation.outputs import quantity_rows
from .simulation.pieces import refined_displacements
from .simulation.plausibility import LAST
from .simulation.trajectory import currents_at
from .structures import load_change_rows

if TYPE_CHECKING:
    from .simulation.result import Run

_PARTS = 4
"""Parts of a sampling interval in which peaks are looked for."""
_SWING = 0.01
"""Largest swing of a base that stays, over its peak displacement."""


def _travel(run: Run) -> float:
    """Length of the path of the base over the ground, of the slab that travels furthest, m."""
    # the base turns between the samples
    path = _base_path(run, refined_displacements(run, _PARTS))
    return float(np.linalg.norm(np.diff(path, axis=0), axis=-1).sum(axis=0).max())


def _base_path(run: Run, displacements: NDArray) -> NDArray:
    """Displacements of the slabs from those of all dofs, (n_instants, n_slabs, n_directions)."""
    rows = quantity_rows(run.isolated, run.outputs.names)["base_displacement_m"]
    return np.tensordot(displacements, rows[..., : displacements.shape[1]], axes=(1, 2))


def _residual(run: Run) -> float:
    """Displacement at which the base stays, of the furthest slab, m; NaN while it moves."""
    last = run.time >= run.time[-1] - LAST
    path = _base_path(run, run.values[last, : run.isolated.structure.n_dofs])
    low, high = path.min(axis=0), path.max(axis=0)
    swing = np.linalg.norm(high - low, axis=-1).max() / 2
    if run.end[0] or swing > _SWING * run.criteria["peak_base_displacement_m"]:
        return float("nan")
    return float(np.linalg.norm(low + high, axis=-1).max() / 2)


def _rms_current(run: Run) -> float:
    """RMS current of the coil with the largest one, A; 0 without coils."""
    # Gauss's rule between grid points: commands change between the record's samples, too
    nodes, weights = np.polynomial.legendre.leggauss(5)
    n_channels, lengths = run.isolated.n_channels, run.grid.lengths
    within = [currents_at(run.work, n_channels, 0, 0.5 + 0.5 * node)[:-1] for node in nodes]
    squares = weights / 2 @ [lengths @ np.square(each) for each in within] / lengths.sum()
    return float(np.sqrt(squares.max(initial=0.0)))


def _load_changes(run: Run) -> NDArray:
    """Changes of the isolators' vertical loads, over the static load."""
    rows = load_change_rows(run.isolated.structure, overturning=True)
    return refined_displacements(run, _PARTS) @ rows.T


def _unloading(run: Run) -> float:
    """Largest loss of an isolator's vertical load, over the static load."""
    return float(-_load_changes(run).min())


def _overload(run: Run) -> float:
    """Largest gain of an isolator's vertical load, over the static load."""
    return float(_load_changes(run).max())


ISOLATOR_TRAVEL = Criterion("isolator_travel_m", "travel of the isolators", _travel)
"""Accumulated path of the base over the ground: wear and heat of sliding and rubber bearings."""

RESIDUAL = Criterion("residual_base_displacement_m", "residual base displacement", _residual)
"""Displacement at which the base stays in the last 2 s; NaN while it swings by 1 % of its peak.

Quiet time after the motion lets it come to rest: ``quiet_after_s``, ``Record.padded(after=)``.
"""

RMS_CURRENT = Criterion("rms_current_A", "RMS coil current", _rms_current)
"""Effort of control: the heat in a coil grows with its square."""

UNLOADING = Criterion(
    "isolator_unloading_ratio",
    "isolator unloading over static load",
    _unloading,
)
"""Largest loss of vertical load by overturning, and by vertical motion; uplift or tension above 1.

Of a rigid base on equal isolators; see `isolation_sim.structures.overturning_rows`.
"""

OVERLOAD = Criterion(
    "isolator_overload_ratio",
    "isolator overload over static load",
    _overload,
)
"""Largest gain of vertical load, as ``UNLOADING``."""
