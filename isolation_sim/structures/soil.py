"""Soil under an isolated building: the frequency-independent cone model of Wolf."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ground_motions.argument_types import checked
from ground_motions.checks import positive

from ..errors import InputError
from .element import Element
from .structure import IsolatedStructure
from .vertical_load import add_p_delta, dof_heights


@checked
@dataclass(frozen=True)
class Cones:
    """Springs, dashpots and trapped mass of a rigid disk on a homogeneous half-space.

    Attributes
    ----------
    sway_stiffness, sway_damping : float, N/m and N s/m
        Along a horizontal direction.
    rocking_stiffness, rocking_damping : float, N m and N m s
        About a horizontal axis.
    trapped_inertia : float, kg m^2
        Mass moment of inertia of the soil that moves with the foundation in rocking; not zero for
        nearly incompressible soil, with a Poisson's ratio above 1/3.
    """

    sway_stiffness: float
    sway_damping: float
    rocking_stiffness: float
    rocking_damping: float
    trapped_inertia: float


@checked
def cones(radius: float, shear_wave_velocity: float, density: float, poisson: float) -> Cones:
    """Cone model of a disk foundation.

    A truncated cone is a rod with a section that grows with the depth. Its opening angle is chosen
    so that its static stiffness is that of a disk on a half-space.

    Parameters
    ----------
    radius : float, m
        Radius of a disk with the area of the foundation.
    shear_wave_velocity : float, m/s
        Shear wave velocity of the soil at the strains of the earthquake.
    density : float, kg/m^3
        Density of the soil.
    poisson : float
        Poisson's ratio of the soil, 0 to 0.5.

    Returns
    -------
    Cones

    Raises
    ------
    InputError
        If a number is out of range.

    Notes
    -----
    J. P. Wolf, "Foundation vibration analysis using simple physical models", Prentice Hall 1994,
    Table 2-3A, and J. P. Wolf and A. J. Deeks, "Foundation vibration analysis: a strength-of-
    materials approach", 2004. The rocking dashpot is that of the high-frequency limit, without the
    internal degree of freedom of the exact cone.
    """
    for what, value in (
        ("radius_m", radius), ("shear_wave_velocity_m_s", shear_wave_velocity),
        ("density_kg_m3", density),
    ):  # fmt: skip
        positive(what, value)
    if not 0.0 <= poisson <= 0.5:
        raise InputError("poisson_ratio", repr(poisson), "0 to 0.5")
    area, inertia = np.pi * radius**2, np.pi * radius**4 / 4
    compressible = poisson <= 1 / 3
    # nearly incompressible soil: twice the shear wave velocity, and a trapped mass
    speed = shear_wave_velocity * (
        np.sqrt(2 * (1 - poisson) / (1 - 2 * poisson)) if compressible else 2.0
    )
    sway_depth = np.pi / 8 * (2 - poisson) * radius
    rocking_depth = 9 * np.pi / 32 * (1 - poisson) * (speed / shear_wave_velocity) ** 2 * radius
    soil_inertia = 0.0 if compressible else 0.3 * np.pi * (poisson - 1 / 3) * density * radius**5
    return Cones(
        sway_stiffness=float(density * shear_wave_velocity**2 * area / sway_depth),
        sway_damping=float(density * shear_wave_velocity * area),
        rocking_stiffness=float(3 * density * speed**2 * inertia / rocking_depth),
        rocking_damping=float(density * speed * inertia),
        trapped_inertia=float(soil_inertia),
    )


@checked
def on_soil(
    isolated: IsolatedStructure,
    soil: Cones,
    foundation_mass: float,
    foundation_inertia: float = 0.0,
) -> IsolatedStructure:
    """Put an isolated building's foundation on soil springs.

    Parameters
    ----------
    isolated : IsolatedStructure
        The building on its isolators. Its elements to the ground are moved to the foundation.
    soil : Cones
        Springs and dashpots of the soil.
    foundation_mass : float, kg
        Mass below the isolators.
    foundation_inertia : float, default 0, kg m^2
        Its mass moment of inertia about a horizontal axis; with storey heights, for rocking.

    Returns
    -------
    IsolatedStructure
        Structure with one dof ``foundation_…`` per direction, and ``rocking_…`` if the storey
        heights are known.

    Raises
    ------
    InputError
        If a mass is not above zero.
    """
    # the weight pushes the base away from the foundation, not from the ground
    p_delta = isolated.structure.p_delta
    structure = add_p_delta(isolated.structure, -p_delta)
    n, axes = structure.n_dofs, structure.horizontal
    m = len(axes)
    rocks = structure.heights is not None
    positive("foundation_mass_kg", foundation_mass)
    inertia = foundation_inertia + soil.trapped_inertia
    if rocks and not inertia > 0:
        raise InputError("foundation_inertia_kg_m2 is 0; expected for rocking: a number above 0")
    added = m * (1 + rocks)
    # deformation of the structure: its motion minus the rigid rocking motion
    relative = np.hstack([np.eye(n), np.zeros((n, added))])
    if rocks:
        relative[:, n + m :] = -dof_heights(structure)[:, np.newaxis] * structure.influence[:, :m]
    new = np.repeat([True, False][: 1 + rocks], m)  # sway, then rocking
    spring = np.where(new, soil.sway_stiffness, soil.rocking_stiffness)
    dashpot = np.where(new, soil.sway_damping, soil.rocking_damping)
    own_mass = np.where(new, foundation_mass, inertia)

    def enlarge(inner: np.ndarray, on_new: np.ndarray) -> np.ndarray:
        return inner + np.diag(np.concatenate([np.zeros(n), on_new]))

    vertical = len(structure.vertical)
    sways = np.pad(np.eye(m), ((0, added - m), (0, vertical)))
    carried = np.vstack([structure.influence, sways])
    bare = np.hstack([np.eye(n), np.zeros((n, added))])
    on_ground = replace(
        structure,
        mass=enlarge(bare.T @ structure.mass @ bare, own_mass),
        damping=enlarge(relative.T @ structure.damping @ relative, dashpot),
        stiffness=enlarge(relative.T @ structure.stiffness @ relative, spring),
        influence=carried,
        foundation=tuple(range(n, n + added)),
        names=(
            *structure.names,
            *(f"foundation_{axis}" for axis in axes),
            *(f"rocking_{axis}" for axis in axes if rocks),
        ),
        drift_rows=structure.drift_rows @ relative,
    )
    elements = []
    for element, held in zip(isolated.elements, isolated.holding, strict=True):
        row = element.direction @ relative
        row[n : n + m] -= held[:m]
        elements.append(
            Element(element.device, row, element.channel, element.name, element.follows)
        )
    return IsolatedStructure(add_p_delta(on_ground, p_delta), tuple(elements))
