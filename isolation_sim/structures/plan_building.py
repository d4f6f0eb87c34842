"""Shear buildings in plan: floors that move along x and y and rotate, on a rigid base slab."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ground_motions.argument_types import checked

from ..errors import InputError
from .checks import matrix, positive_numbers
from .matrices import from_fixed_base
from .shear_building import modal_damping
from .structure import Structure


@checked
def plan_building(
    masses: Sequence[float],
    stiffnesses_x: Sequence[float],
    stiffnesses_y: Sequence[float],
    *,
    base_mass: float,
    plan: tuple[float, float],
    isolator_positions: ArrayLike | None = None,
    eccentricity: tuple[float, float] = (0.0, 0.0),
    damping_ratio: float = 0.02,
    heights: Sequence[float] | None = None,
    name: str = "plan building",
) -> Structure:
    """Shear building with three dofs per floor, on a rigid base slab of the same plan.

    The dofs refer to the centre of the plan. The mass is uniform over the plan, apart from the
    eccentricity of its centre. Frames along the edges of the plan, each with half of the stiffness,
    resist the rotation of a storey.

    Parameters
    ----------
    masses : sequence of float, shape (n_storeys,), kg
        Floors above the base, from below.
    stiffnesses_x, stiffnesses_y : sequence of float, shape (n_storeys,), N/m
        Storeys along x and y, from below.
    base_mass : float, kg
        Mass of the base slab.
    plan : (float, float), m
        Sides of the plan along x and y.
    isolator_positions : array_like, shape (n_isolators, 2), optional, m
        Positions of the isolators from the centre of the plan; the four corners by default. An
        offset from the centre is the eccentricity of the isolation.
    eccentricity : (float, float), default (0, 0), m
        Centre of mass of every floor and of the slab from the centre of the plan.
    damping_ratio : float, default 0.02
        Ratio of critical damping of every fixed-base mode of the superstructure.
    heights : sequence of float, shape (n_storeys,), optional, m
        Storey heights, from below.
    name : str
        Name to print.

    Returns
    -------
    Structure
        Dofs ``base_x``, ``base_y``, ``base_rotation``, ``floor1_x``, …; directions ``x``, ``y``.

    Raises
    ------
    InputError
        If a number cannot be used; with its name.
    """
    m = positive_numbers("masses", masses, "kg")
    slab = float(positive_numbers("base_mass", base_mass, "kg")[0])
    sides = positive_numbers("plan", plan, "m")
    k_x = positive_numbers("stiffnesses_x", stiffnesses_x, "N/m")
    k_y = positive_numbers("stiffnesses_y", stiffnesses_y, "N/m")
    centre = matrix("eccentricity", eccentricity, (2,))
    n = m.size
    for what, row in (("stiffnesses_x", k_x), ("stiffnesses_y", k_y), ("heights", heights)):
        if row is not None and len(row) != n:
            raise InputError(f"{what} has {len(row)} numbers; expected: {n}, one per storey")
    if sides.size != 2:
        raise InputError(f"plan has {sides.size} numbers; expected: the sides along x and y, in m")
    if isolator_positions is None:
        corners = [(a, b) for a in (-0.5, 0.5) for b in (-0.5, 0.5)]
        isolator_positions = np.array(corners) * sides
    rotation = k_x * (sides[1] / 2) ** 2 + k_y * (sides[0] / 2) ** 2
    springs = np.stack([k_x, k_y, rotation], axis=1).ravel()
    drifts = np.kron(np.eye(n) - np.eye(n, k=-1), np.eye(3))
    stiffness = drifts.T @ np.diag(springs) @ drifts
    mass = np.kron(np.diag(m), _unit_mass(sides, centre))
    storey_heights = None
    if heights is not None:
        storey_heights = np.repeat(positive_numbers("heights", heights, "m"), 3)
    return from_fixed_base(
        mass,
        modal_damping(mass, stiffness, damping_ratio),
        stiffness,
        slab * _unit_mass(sides, centre),
        rigid_motion=np.tile(np.eye(3), (n, 1)),
        shaken=(0, 1),
        names=[
            f"{level}_{motion}"
            for level in ("base", *(f"floor{k + 1}" for k in range(n)))
            for motion in ("x", "y", "rotation")
        ],
        heights=storey_heights,
        isolator_positions=isolator_positions,
        name=name,
    )


def _unit_mass(sides: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Mass matrix of a rectangular floor of 1 kg, about the centre of the plan."""
    x, y = centre
    about = (sides @ sides) / 12 + centre @ centre
    return np.array([[1.0, 0.0, -y], [0.0, 1.0, x], [-y, x, about]])
