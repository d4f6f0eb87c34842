"""Criteria of sampled responses in NumPy: the oracle of the compiled criteria."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from isolation_sim.simulation.outputs import quantity_rows
from isolation_sim.simulation.result import Run

QUANTITIES = {
    "base_displacement": "base_displacement_m",
    "floor_acceleration": "floor_acceleration_m_s2",
    "superstructure_acceleration": "superstructure_acceleration_m_s2",
    "drift": "drift_m",
    "base_shear": "base_shear_N",
    "structural_shear": "structural_shear_N",
    "isolator_force": "isolator_force_N",
    "isolator_displacement": "isolator_displacement_m",
    "drift_ratio": "drift_ratio",
    "isolation_force": "isolation_force_N",
    "wall_force": "wall_force_N",
}
"""Names of the criteria by the attribute of `Response`."""

_RESULTANTS = ("base_shear", "structural_shear", "isolator_force", "isolation_force", "wall_force")
"""Attributes with a single column."""


@dataclass(frozen=True, eq=False)
class Response:
    """Sampled responses, with any leading axes; norms over the directions of ground motion."""

    time: NDArray
    base_displacement: NDArray
    floor_acceleration: NDArray
    superstructure_acceleration: NDArray
    drift: NDArray
    base_shear: NDArray
    structural_shear: NDArray
    isolator_force: NDArray
    isolator_displacement: NDArray | None = None
    drift_ratio: NDArray | None = None
    isolation_force: NDArray | None = None
    wall_force: NDArray | None = None


def response_criteria(response: Response) -> dict[str, NDArray]:
    """Peaks, and RMS values by the trapezoidal rule."""
    time = np.asarray(response.time)
    duration = time[-1] - time[0]
    peaks, rms = {}, {}
    for name, key in QUANTITIES.items():
        values = getattr(response, name)
        if values is None:
            continue
        if name in _RESULTANTS:
            values = np.asarray(values)[..., np.newaxis]
        peaks[f"peak_{key}"] = np.max(np.abs(values), axis=(-2, -1), initial=0.0)
        mean_square = np.trapezoid(np.square(values), time, axis=-2) / duration
        rms[f"rms_{key}"] = np.sqrt(np.max(mean_square, axis=-1, initial=0.0))
    return peaks | rms


def response_of(run: Run) -> Response:
    """Sampled responses of a run."""
    names = run.outputs.names
    moved = {
        name: _norm(np.tensordot(run.values, rows, axes=(1, 2)))
        for name, rows in quantity_rows(run.isolated, names).items()
    }
    arrays = {
        name: moved[key][:, 0] if name in _RESULTANTS else moved[key]
        for name, key in QUANTITIES.items()
        if key in moved
    }
    return Response(time=run.time, **arrays)


def _norm(vectors: NDArray) -> NDArray:
    # with one direction the sign is kept for figures
    return vectors[..., 0] if vectors.shape[-1] == 1 else np.linalg.norm(vectors, axis=-1)
