"""Yielding storeys: replace elastic storeys of a shear building by Bouc-Wen elements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ground_motions.argument_types import checked

from ..errors import InputError
from ..laws import Device, law
from .structure import IsolatedStructure, Structure

_SHEAR_BUILDING = 1e-9  # largest part of the stiffness that is not from storeys, as a share


def storey_stiffnesses(structure: Structure) -> np.ndarray:
    """Return the stiffness of each storey of a shear building."""
    rows = structure.drift_rows
    storeys = np.array([np.outer(row, row).ravel() for row in rows]).T
    matrix = structure.stiffness
    result = np.linalg.lstsq(storeys, matrix.ravel(), rcond=None)[0] if len(rows) else rows[:, 0]
    left = np.abs(storeys @ result - matrix.ravel()).max(initial=0.0)
    if not len(rows) or left > _SHEAR_BUILDING * np.abs(matrix).max() or np.any(result <= 0.0):
        raise InputError(
            f"{structure.name}: its stiffness is not that of a shear building; expected for "
            "yielding storeys: a shear building"
        )
    return result


@checked
def yielding_storeys(
    isolated: IsolatedStructure,
    yield_shear: float | Sequence[float],
    hardening_ratio: float = 0.05,
    smoothness: float = 5.0,
) -> IsolatedStructure:
    """Replace the storeys' stiffness above hardening by Bouc-Wen elements.

    Parameters
    ----------
    isolated : IsolatedStructure
        A shear building with or without isolators.
    yield_shear : float or sequence of float, N
        Storey shear at yield, one for all or one per storey from below.
    hardening_ratio : float, default 0.05
        Stiffness after yielding over elastic stiffness.
    smoothness : float, default 5
        Exponent of the Bouc-Wen law; a large value gives a sharp corner.

    Returns
    -------
    IsolatedStructure
        Structure with the same stiffness at small drifts, the same damping matrix, and one element
        ``..._hysteresis`` per storey.

    Raises
    ------
    InputError
        If the structure is no shear building, or a number is out of range.

    Notes
    -----
    Y. K. Wen, "Method for random vibration of hysteretic systems", Journal of the Engineering
    Mechanics Division 102 (1976) 249-263. Beyond yielding the storey shear approaches
    ``r k d + (1 - r) V_y``, with the ratio r, the elastic stiffness k and the drift d.
    """
    structure = isolated.structure
    stiffness = storey_stiffnesses(structure)
    try:
        shear = np.broadcast_to(np.array(yield_shear, dtype=float), stiffness.shape)
    except ValueError:
        raise InputError(
            "yield_shear", repr(yield_shear), f"a number or {len(stiffness)}, in N"
        ) from None
    if not (np.all(np.isfinite(shear)) and np.all(shear > 0.0)):
        raise InputError("yield_shear", repr(yield_shear), "numbers above 0, in N")
    if not 0.0 <= hardening_ratio < 1.0:
        raise InputError("hardening_ratio", f"{hardening_ratio:g}", "0 to below 1")
    if not smoothness >= 1.0:
        raise InputError("smoothness", f"{smoothness:g}", "1 or above")
    soft = (1.0 - hardening_ratio) * stiffness
    rows = structure.drift_rows
    softened = replace(structure, stiffness=structure.stiffness - rows.T * soft @ rows)
    built = replace(isolated, structure=softened)
    for k, storey in enumerate(structure.storeys):
        device = storey_hysteresis(soft[k], shear[k] / stiffness[k], smoothness)
        description = (
            f"yield shear {1e-3 * shear[k]:.4g} kN, elastic stiffness "
            f"{1e-6 * stiffness[k]:.4g} kN/mm, hardening ratio {hardening_ratio:g}"
        )
        device = replace(device, name=description)
        built = built.with_element(device, storey, name=f"{storey}_hysteresis")
    return built


def storey_hysteresis(stiffness: float, yield_drift: float, smoothness: float) -> Device:
    """The hysteretic part of a storey, N/m and m."""
    share = 0.5 / yield_drift**smoothness
    return law("bouc_wen", {
        "k": 0.0, "c": 0.0, "alpha": float(stiffness), "A": 1.0, "beta": float(share),
        "gamma": float(share), "n": float(smoothness), "F0": 0.0,
    })  # fmt: skip
