"""Peaks of each level and storey of a run, and spectra of its floors, for many runs together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .outputs import level_dofs, level_names, storey_names

if TYPE_CHECKING:
    import xarray

    from .result import Run

PEAKS = {"floor_acceleration_m_s2": "level", "drift_m": "storey", "drift_ratio": "storey"}
"""Quantities whose peaks are computed, and what each of their values belongs to."""
SPECTRA = "floor_spectrum_m_s2"
"""Absolute acceleration of an oscillator of 5 % damping on a floor."""
_AXES: dict[str, tuple[str, ...]] = {SPECTRA: ("direction", "level", "period_s")}
_AXES |= {f"peak_{name}": (place,) for name, place in PEAKS.items()}


def floor_response(run: Run) -> dict[str, NDArray]:
    """Peaks and spectra of one run, with the coordinates of their axes."""
    structure = run.isolated.structure
    directions = structure.horizontal[: level_dofs(structure).shape[1]]
    spectra = [list(run.floor_spectra(direction=one).values()) for one in directions]
    coordinates = {
        "direction": directions, "level": level_names(structure),
        "storey": storey_names(structure), "period_s": spectra[0][0].period,
    }  # fmt: skip
    values = {SPECTRA: np.array([[floor.sa for floor in floors] for floors in spectra])}
    # a building without storeys has no drifts
    peaks = {name: run.peaks[name] for name in PEAKS if name in run.peaks}
    values |= {f"peak_{name}": peak for name, peak in peaks.items() if peak.size}
    return {name: np.asarray(value) for name, value in {**coordinates, **values}.items()}


def of_runs(
    responses: Sequence[Sequence[dict[str, NDArray] | None]], outer: dict[str, Sequence]
) -> xarray.Dataset:
    """Put the runs of cases and controllers together; NaN where a run has no result."""
    import xarray

    first = next(one for row in responses for one in row if one is not None)
    axes = {name: own for name, own in _AXES.items() if name in first}
    inner = {axis: first[axis] for own in axes.values() for axis in own}
    for row in responses:
        for one in row:
            if one is not None and any(one[axis].shape != inner[axis].shape for axis in inner):
                raise InputError("floors", "structures with other levels", "equal ones")
    values = {}
    for name, own in axes.items():
        missing = np.full_like(first[name], np.nan)
        filled = [[missing if one is None else one[name] for one in row] for row in responses]
        values[name] = (*outer, *own), np.array(filled)
    return xarray.Dataset(values, {**outer, **inner})
