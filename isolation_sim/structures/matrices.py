"""Structures from their matrices."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import ArrayLike

from ground_motions.argument_types import checked
from ground_motions.readers.mat_variables import mat_variables

from ..errors import InputError, PlausibilityWarning, near_name, warn
from .checks import matrix, numbers
from .plausibility import implausible_matrices
from .structure import Structure

_REQUIRED = ("M", "C", "K")
_OPTIONAL = ("influence", "base", "drift_rows")
_CONNECTED = 1e-9
"""Least stiffness between connected dofs, over the geometric mean of their own stiffnesses."""
_GEOMETRY = {"storey_heights_m": "heights", "isolator_positions_m": "isolator_positions"}


@checked
def from_matrices(
    mass: ArrayLike,
    damping: ArrayLike,
    stiffness: ArrayLike,
    influence: ArrayLike | None = None,
    base: int | Sequence[int] = 0,
    names: Sequence[str] | None = None,
    drift_rows: ArrayLike | None = None,
    storeys: Sequence[str] | None = None,
    directions: Sequence[str] | None = None,
    heights: ArrayLike | None = None,
    isolator_positions: ArrayLike | None = None,
    name: str = "structure",
) -> Structure:
    """Structure from matrices that include the base, in coordinates relative to the ground.

    Parameters
    ----------
    mass : array_like, shape (n, n), kg
        Symmetric, positive definite.
    damping : array_like, shape (n, n), N s/m
        Viscous damping.
    stiffness : array_like, shape (n, n), N/m
        Stiffness, without the isolators.
    influence : array_like, shape (n,) or (n, n_directions), optional
        Displacement of the dofs when the ground moves by one unit; ones by default.
    base : int or sequence of int, default 0
        Dofs of the isolated base; ``()`` for a structure fixed to the ground.
    names : sequence of str, optional
        Names of the dofs; by default ``base``, ``floor1``, … if the base is only dof 0,
        otherwise ``dof0``, ``dof1``, ….
    drift_rows : array_like, shape (n_storeys, n), optional
        ``drift_rows @ q`` are the storey drifts. By default the differences between neighbouring
        floors that the stiffness connects, if the base has the first dofs and all floors have the
        same number; otherwise none. Where there are storeys, a dof above the base that is in none
        of them, such as that of a mass damper, is no floor: criteria of floors leave it out.
    storeys : sequence of str, optional
        Names of the storeys, one per drift row.
    directions : sequence of str, optional
        Names of the directions of ground motion; ``x``, ``y``, ``z``, … by default.
    heights : array_like, shape (n_storeys,), optional, m
        Storey heights, one per drift row.
    isolator_positions : array_like, shape (n_isolators, 2), optional, m
        Plan positions x, y of the isolators, from the point of the slab to which the base's dofs
        refer: displacements along x and y, and rotation from x to y.
    name : str, default "structure"
        Name to print.

    Returns
    -------
    Structure

    Raises
    ------
    InputError
        If shapes disagree, a number is not finite, or the mass is not positive definite.

    Warns
    -----
    PlausibilityWarning
        If the first mode on a fixed base has a damping ratio above 1, as with C and K exchanged; if
        rigid motion has a stiffness or damping, as with a spring between base and ground; or if
        the stiffness does not connect neighbouring floors, so that they have no storey by default.

    Notes
    -----
    Matrices of a building on a fixed base, in displacements relative to it, get a base of mass
    ``m_b`` by ``T = np.hstack([-r, np.eye(n)])`` with ``r = np.ones((n, 1))`` in one direction:
    ``C`` and ``K`` become ``T.T @ C @ T`` and ``T.T @ K @ T``, and ``M`` becomes
    ``scipy.linalg.block_diag(m_b, M)``.
    """
    n = _size(mass)
    bases = tuple(int(i) for i in numbers("base", base).ravel())
    if names is None:
        alone = bases == (0,)
        names = [
            "base" if alone and i == 0 else f"{'floor' if alone else 'dof'}{i}" for i in range(n)
        ]
    influence = np.ones((n, 1)) if influence is None else numbers("influence", influence)
    if influence.ndim == 1:
        influence = influence[:, np.newaxis]
    if directions is None:
        count = influence.shape[-1]
        directions = list("xyz")[:count] if count <= 3 else [f"d{j + 1}" for j in range(count)]
    apart: list[tuple[int, int]] = []
    if drift_rows is None:
        stiffness = matrix("stiffness", stiffness, (n, n))
        drift_rows, default_storeys, apart = _neighbour_drifts(stiffness, bases)
    else:
        drift_rows = numbers("drift_rows", drift_rows)
        default_storeys = [f"storey{i + 1}" for i in range(len(drift_rows))]
    structure = Structure(
        mass=numbers("mass", mass),
        damping=numbers("damping", damping),
        stiffness=numbers("stiffness", stiffness),
        influence=influence,
        base=bases,
        names=tuple(names),
        drift_rows=drift_rows,
        storeys=tuple(default_storeys if storeys is None else storeys),
        directions=tuple(directions),
        heights=None if heights is None else numbers("heights", heights),
        isolator_positions=(
            None
            if isolator_positions is None
            else numbers("isolator_positions", isolator_positions)
        ),
        name=name,
    )
    for lower, upper in apart:
        warn(
            f"{structure.name}: no stiffness between {structure.names[lower]} and "
            f"{structure.names[upper]}, so that there is no storey; drift_rows give other storeys, "
            "and dofs in none of them are no floors",
            PlausibilityWarning,
        )
    for line in implausible_matrices(structure):
        warn(line, PlausibilityWarning)
    return structure


@checked
def from_fixed_base(
    mass: ArrayLike,
    damping: ArrayLike,
    stiffness: ArrayLike,
    base_mass: ArrayLike,
    rigid_motion: ArrayLike | None = None,
    shaken: Sequence[int] | None = None,
    *,
    names: Sequence[str] | None = None,
    drift_rows: ArrayLike | None = None,
    storeys: Sequence[str] | None = None,
    directions: Sequence[str] | None = None,
    heights: ArrayLike | None = None,
    isolator_positions: ArrayLike | None = None,
    name: str = "structure",
) -> Structure:
    """Structure from the fixed-base matrices of its superstructure, on a rigid base.

    The superstructure's matrices are relative to the base. Rigid motion of the whole has neither
    stiffness nor damping.

    Parameters
    ----------
    mass : array_like, shape (n, n), kg
        Mass of the superstructure.
    damping : array_like, shape (n, n), N s/m
        Damping of the superstructure.
    stiffness : array_like, shape (n, n), N/m
        Stiffness of the superstructure.
    base_mass : float or array_like, shape (n_base, n_base), kg
        Mass of the base.
    rigid_motion : array_like, shape (n, n_base), optional
        Displacement of the superstructure's dofs per unit displacement of a dof of the base; ones
        by default.
    shaken : sequence of int, optional
        Dofs of the base along the directions of ground motion; all by default.
    names, drift_rows, storeys, directions, heights, isolator_positions, name
        As in `from_matrices`, for the base's dofs followed by the superstructure's.

    Returns
    -------
    Structure

    Raises
    ------
    InputError
        If shapes disagree, a number is not finite, or the mass is not positive definite.
    """
    base_mass = np.atleast_2d(numbers("base_mass", base_mass))
    m = len(base_mass)
    base_mass = matrix("base_mass", base_mass, (m, m))
    n = _size(mass)
    rigid_motion = np.ones((n, 1)) if rigid_motion is None else rigid_motion
    rigid = matrix("rigid_motion", rigid_motion, (n, m))
    relative = np.hstack([-rigid, np.eye(n)])
    full_mass = np.zeros((m + n, m + n))
    full_mass[:m, :m] = base_mass
    full_mass[m:, m:] = matrix("mass", mass, (n, n))
    influence = np.vstack([np.eye(m), rigid])
    columns = list(range(m)) if shaken is None else list(shaken)
    if not columns or any(j not in range(m) for j in columns):
        raise InputError("shaken", f"{shaken}", f"numbers of base dofs, 0 to {m - 1}")
    return from_matrices(
        full_mass,
        relative.T @ matrix("damping", damping, (n, n)) @ relative,
        relative.T @ matrix("stiffness", stiffness, (n, n)) @ relative,
        influence=influence[:, columns],
        base=range(m),
        names=names,
        drift_rows=drift_rows,
        storeys=storeys,
        directions=directions,
        heights=heights,
        isolator_positions=isolator_positions,
        name=name,
    )


@checked
def read_matrices(
    path: str | Path,
    *,
    names: Sequence[str] | None = None,
    drift_rows: ArrayLike | None = None,
    storeys: Sequence[str] | None = None,
    directions: Sequence[str] | None = None,
    heights: ArrayLike | None = None,
    isolator_positions: ArrayLike | None = None,
    name: str | None = None,
) -> Structure:
    """Structure from a NumPy ``.npz`` or a MATLAB ``.mat`` file.

    Parameters
    ----------
    path : str or pathlib.Path
        File with the arrays ``M`` (kg), ``C`` (N s/m) and ``K`` (N/m), each (n, n), and optionally
        ``influence`` (n, n_directions), ``base`` (dof numbers), ``drift_rows`` (n_storeys, n),
        ``storey_heights_m`` (n_storeys) and ``isolator_positions_m`` (n_isolators, 2); see
        ``from_matrices``. Other arrays are ignored. A ``.mat`` file has the same variables (version
        7.3 needs the extra ``hdf5``); ``base`` counts dofs from 0 there, too.
    names, drift_rows, storeys, directions, heights, isolator_positions
        As in `from_matrices`; drift rows, heights and positions in place of the file's.
    name : str, optional
        Name to print; the file's by default.

    Returns
    -------
    Structure

    Raises
    ------
    InputError
        With the file, the array and the expected contents.
    """
    arrays = _read_mat(Path(path)) if Path(path).suffix == ".mat" else _read_npz(Path(path))
    accepted = (*_OPTIONAL, *_GEOMETRY)
    for key in _REQUIRED:
        if key not in arrays:
            raise InputError(
                f"{path}: array {key!r} is missing; needed: {', '.join(_REQUIRED)}, optional: "
                f"{', '.join(accepted)}; the file holds: {', '.join(sorted(arrays)) or 'nothing'}"
            )
    for key in arrays:
        near = near_name(key, accepted, surely=True)
        if near and near not in arrays:
            raise InputError(f"{path}: array {key!r} looks like {near!r} misspelt; rename it")
    for key, label in _GEOMETRY.items():
        if label in arrays and key not in arrays:
            raise InputError(f"{path}: array {label!r}; expected: {key!r}, in m; rename it")
    optional: dict[str, Any] = {key: arrays[key] for key in _OPTIONAL if key in arrays}
    optional |= {label: arrays[key] for key, label in _GEOMETRY.items() if key in arrays}
    for label, value in (
        ("drift_rows", drift_rows), ("heights", heights),
        ("isolator_positions", isolator_positions),
    ):  # fmt: skip
        if value is not None:
            optional[label] = value
    try:
        return from_matrices(
            arrays["M"], arrays["C"], arrays["K"], names=names, storeys=storeys,
            directions=directions, name=name or Path(path).stem, **optional,
        )  # fmt: skip
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _read_npz(path: Path) -> dict[str, np.ndarray]:
    try:
        with np.load(path, allow_pickle=False) as archive:
            return {key: archive[key] for key in archive.files}
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except (OSError, ValueError, TypeError, AttributeError, EOFError, BadZipFile):
        raise InputError(f"{path}: not a NumPy .npz file of plain number arrays") from None


def _read_mat(path: Path) -> dict[str, np.ndarray]:
    # MATLAB has no vectors: heights and base dofs are matrices of one row or column
    vectors = ("influence", "base", "storey_heights_m")
    return {
        key: value.ravel() if key in vectors and 1 in np.shape(value) else _full(value)
        for key, value in mat_variables(path, squeezed=False).items()
    }


def _full(value: Any) -> np.ndarray:
    """Array of a matrix that MATLAB may have saved as sparse."""
    from scipy.sparse import issparse

    return value.toarray() if issparse(value) else value


def _size(mass: ArrayLike) -> int:
    """Number of dofs of a mass matrix."""
    shape = numbers("mass", mass).shape
    if not shape:
        raise InputError("mass must be a square matrix in kg")
    return shape[0]


def _neighbour_drifts(
    stiffness: np.ndarray, base: tuple[int, ...]
) -> tuple[np.ndarray, list[str], list[tuple[int, int]]]:
    """Rows and names of the storeys between neighbouring floors, and those not connected."""
    n, m = len(stiffness), len(base)
    if base != tuple(range(m)) or m == 0 or n % m:
        return np.zeros((0, n)), [], []
    size = np.sqrt(np.abs(np.diag(stiffness)))
    axes = [""] if m == 1 else [f"_{'xyz'[j]}" if m <= 3 else f"_{j + 1}" for j in range(m)]
    rows, storeys, apart = [], [], []
    for upper in range(m, n):
        lower = upper - m
        if abs(stiffness[upper, lower]) <= _CONNECTED * size[upper] * size[lower]:
            apart.append((lower, upper))
            continue
        rows.append(np.eye(n)[upper] - np.eye(n)[lower])
        storeys.append(f"storey{upper // m}{axes[upper % m]}")
    return np.reshape(rows, (-1, n)), storeys, apart
