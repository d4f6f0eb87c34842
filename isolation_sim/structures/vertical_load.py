"""Effects of the weight on the isolators: P-delta and varying vertical loads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ground_motions import STANDARD_GRAVITY
from ground_motions.argument_types import checked
from ground_motions.checks import positive

from ..errors import InputError
from .structure import Structure


@checked
def with_p_delta(structure: Structure, height: float) -> Structure:
    """Add the P-delta effect of the isolators: a negative stiffness -W / h across them.

    Parameters
    ----------
    structure : Structure
        Structure with a base.
    height : float, m
        Height of a bearing between its hinges.

    Returns
    -------
    Structure
        Structure with the stiffness ``-W / h`` at the base along every direction of ground motion,
        or between the base and a foundation on soil; W is the weight above the isolators. With
        known isolator positions each isolator has a share of it, which also acts on the rotation of
        the base.

    Raises
    ------
    InputError
        If there is no base, or the height is not above zero.
    """
    positive("p_delta_height_m", height)
    if not structure.base:
        raise InputError(f"{structure.name} has no base; expected for P-delta: a building with one")
    weight = STANDARD_GRAVITY * structure.isolated_mass
    return add_p_delta(structure, weight / height / len(structure.isolation_rows))


def add_p_delta(structure: Structure, share: float) -> Structure:
    """Give each isolator a negative stiffness, N/m; a share below zero takes one away again."""
    flat = structure.isolation_rows.reshape(-1, structure.n_dofs)
    return replace(
        structure,
        stiffness=structure.stiffness - share * flat.T @ flat,
        p_delta=structure.p_delta + share,
    )


def dof_heights(structure: Structure) -> np.ndarray:
    """Heights of the dofs above the base, from the storeys' heights."""
    if structure.heights is None:
        raise InputError(
            f"{structure.name} has no storey heights; expected: storey_heights_m in [structure]"
        )
    result = np.full(structure.n_dofs, np.nan)
    result[list(structure.base)] = 0.0
    for row, height in zip(structure.drift_rows, structure.heights, strict=True):
        lower, upper = np.flatnonzero(row == -1.0), np.flatnonzero(row == 1.0)
        if len(lower) != 1 or len(upper) != 1 or np.isnan(result[lower[0]]):
            raise InputError(
                f"{structure.name}: heights of its dofs are unknown; expected: storeys from "
                "below, each the difference of two dofs"
            )
        result[upper[0]] = result[lower[0]] + height
    return np.nan_to_num(result)


@checked
def overturning_rows(structure: Structure) -> np.ndarray:
    """Rows for the change of each isolator's vertical load by overturning.

    The elastic forces of the storeys, equal to the floors' inertia forces but for the forces of
    structural damping and of elements in the storeys, overturn the building about the base. A rigid
    base distributes the moment over the isolators in proportion to their distance from their common
    centre.

    Parameters
    ----------
    structure : Structure
        Structure with storey heights and isolator positions.

    Returns
    -------
    numpy.ndarray, shape (n_isolators, n), 1/m
        Change over the mean load, W / n_isolators, per unit displacement.

    Raises
    ------
    InputError
        If heights or positions are unknown, or all isolators are on one line.
    """
    if structure.isolator_positions is None:
        raise InputError(
            f"{structure.name} has no isolator positions; expected for overturning: "
            "isolator_positions_m in [structure]"
        )
    arms = dof_heights(structure)[:, np.newaxis] * structure.influence[:, :2]
    moments = arms.T @ structure.stiffness  # moments of the inertia forces of the floors
    places = structure.isolator_positions - structure.isolator_positions.mean(axis=0)
    spread = places.T @ places
    if np.linalg.matrix_rank(spread) < 2:
        raise InputError("all isolators are on one line; expected for overturning: a plan")
    mean_load = structure.total_mass * STANDARD_GRAVITY / len(places)
    return places @ np.linalg.solve(spread, moments) / mean_load


@checked
def with_vertical_motion(
    structure: Structure, period: float, damping_ratio: float = 0.05
) -> Structure:
    """Add the vertical motion of the whole building on the isolators' vertical stiffness.

    Parameters
    ----------
    structure : Structure
        Structure with a base and only horizontal directions.
    period : float, s
        Period of the building, as a rigid mass, on the isolators' vertical stiffness.
    damping_ratio : float, default 0.05
        Damping ratio of this motion.

    Returns
    -------
    Structure
        Structure with one more dof, ``base_z``, and one more direction of ground motion, ``z``,
        upwards. The criteria do not include it.

    Raises
    ------
    InputError
        If the period is not above zero, or the structure has no base or already has vertical
        motion.
    """
    positive("vertical_period_s", period)
    if not structure.base or structure.vertical:
        raise InputError(
            f"{structure.name}: expected for vertical motion: a building with a base that moves "
            "horizontally"
        )
    n, mass, frequency = structure.n_dofs, structure.total_mass, 2 * np.pi / period

    def enlarge(inner: np.ndarray, last: float) -> np.ndarray:
        result = np.pad(inner, ((0, 1), (0, 1)))
        result[-1, -1] = last
        return result

    return replace(
        structure,
        mass=enlarge(structure.mass, mass),
        damping=enlarge(structure.damping, 2 * damping_ratio * frequency * mass),
        stiffness=enlarge(structure.stiffness, frequency**2 * mass),
        influence=enlarge(structure.influence, 1.0),
        names=(*structure.names, "base_z"),
        directions=(*structure.directions, "z"),
        drift_rows=np.pad(structure.drift_rows, ((0, 0), (0, 1))),
        vertical=(n,),
    )


@checked
def load_change_rows(structure: Structure, overturning: bool = False) -> np.ndarray:
    """Rows for the change of each isolator's vertical load from the displacements.

    Parameters
    ----------
    structure : Structure
        Structure; its vertical motion, if any, changes all loads equally.
    overturning : bool, default False
        Whether the inertia forces of the floors change the loads, too; see `overturning_rows`.

    Returns
    -------
    numpy.ndarray, shape (n_isolators, n), 1/m
        Change over the mean load, W / n_isolators, per unit displacement. Compression is positive.

    Raises
    ------
    InputError
        As `overturning_rows`.
    """
    rows = (
        overturning_rows(structure)
        if overturning
        else np.zeros((len(structure.isolation_rows), structure.n_dofs))
    )
    for dof in structure.vertical:
        rows[:, dof] -= structure.stiffness[dof, dof] / structure.mass[dof, dof] / STANDARD_GRAVITY
    return rows
