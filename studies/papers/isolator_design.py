"""Design formulas of the magnetorheological fluid-elastomer isolator (Tao et al., Section 2).

Plain functions in SI units. Where the paper contradicts itself or its typesetting leaves several
readings, the choice is an argument without a default:

- Eq 5 gives an upper radius R1 of 32.84 mm from Table 1's own numbers, which prints 32.5 mm;
- the lower part's height h1 is 43.5 mm (Figure 5) or 58 mm (Table 1);
- the damping channel is 40 mm long (Section 2.2) or 20 mm (Table 1);
- no hardness is printed, so the moduli are not known;
- Eq 2's shape factor can be read as each of ``SHAPE_FACTORS``, and as raising the compression
  term alone or the whole;
- Eq 7 divides by the radius of the piston rod, where the channel is at that of the piston, and by
  pi in the yield term, which the usual formula does not;
- Eq 11's path is printed with the symbol of the channel's length, where the flux crosses its width.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from isolation_sim.errors import InputError, check_name

TABLE_1 = {
    "r1": 4e-3,
    "r2": 25e-3,
    "w": 1e-3,
    "l": 20e-3,
    "R1": 32.5e-3,
    "R2": 43.5e-3,
    "R3": 31e-3,
    "h": 139e-3,
    "h1": 58e-3,
    "alpha": float(np.deg2rad(7.5)),
}
"""Main dimensions in m and rad: piston rod, piston, channel width and length, upper and lower inner
radius of the shell, outer radius of the sleeve, height, height of the lower part, inclination."""

HARDNESS_FACTOR = 1.05
"""m of Eq 2."""

PUBLISHED_STIFFNESS = 3e6
"""N/m: static stiffness that the paper states (3 kN at about 1 mm)."""

SHAPE_FACTORS: dict[str, Callable[[float, float, float], float]] = {
    "over_cos2": lambda height, wall, alpha: height / (2 * wall * np.cos(alpha) ** 2),
    "times_cos2": lambda height, wall, alpha: height * np.cos(alpha) ** 2 / (2 * wall),
    "squared": lambda height, wall, alpha: (height / (2 * wall * np.cos(alpha))) ** 2,
}
"""Readings of the factor of m in Eq 2, from upper height, wall thickness and inclination."""


def moduli(hardness: float) -> tuple[float, float]:
    """Young's and shear modulus of natural rubber (Eq 4)."""
    if not 0 <= hardness < 100:
        raise InputError(f"hardness {hardness!r}; expected: Shore A, 0 to below 100")
    E = 1e6 * (15.75 + 2.15 * hardness) / (100 - hardness)
    return E, E / 3


def hardness_of(E: float) -> float:
    """Shore A hardness of natural rubber of a Young's modulus: Eq 4 solved."""
    mega = E / 1e6
    return (100 * mega - 15.75) / (2.15 + mega)


def upper_radius(R2: float, h: float, h1: float, alpha: float) -> float:
    """Inner radius of the shell's upper end (Eq 5)."""
    return R2 - (h - h1) * np.tan(alpha)


def upper_stiffness(
    R1: float,
    R2: float,
    R3: float,
    h: float,
    h1: float,
    alpha: float,
    E: float,
    G: float,
    shape_factor: str,
    raises_shear: bool,
    m: float = HARDNESS_FACTOR,
) -> float:
    """Axial stiffness of the conical upper part (Eq 2)."""
    check_name("shape factor", shape_factor, SHAPE_FACTORS)
    stiffening = 1 + m * SHAPE_FACTORS[shape_factor](h - h1, R2 - R3, alpha)
    compression, shear = E * np.tan(alpha), G / np.tan(alpha)
    modulus = (
        stiffening * (compression + shear) if raises_shear else stiffening * compression + shear
    )
    return np.pi * (R2**2 - R1**2) / (R2 - R3) * modulus


def lower_stiffness(R2: float, R3: float, h1: float, G: float) -> float:
    """Axial stiffness of the cylindrical lower part, in shear (Eq 3)."""
    return 2 * np.pi * R2 * h1 * G / (R2 - R3)


def static_stiffness(
    R2: float,
    R3: float,
    h: float,
    h1: float,
    alpha: float,
    hardness: float,
    shape_factor: str,
    raises_shear: bool,
    R1: float | None,
    m: float = HARDNESS_FACTOR,
) -> float:
    """Axial stiffness of the elastomer: both parts side by side (Eqs 1 and 6)."""
    E, G = moduli(hardness)
    R1 = upper_radius(R2, h, h1, alpha) if R1 is None else R1
    upper = upper_stiffness(R1, R2, R3, h, h1, alpha, E, G, shape_factor, raises_shear, m)
    return upper + lower_stiffness(R2, R3, h1, G)


def piston_area(r1: float, r2: float) -> float:
    """Area of the piston that displaces fluid (Eq 8)."""
    return np.pi * (r2**2 - r1**2)


def damping_force(
    velocity: float | np.ndarray,
    r1: float,
    r2: float,
    w: float,
    l: float,  # noqa: E741
    viscosity: float,
    yield_stress: float,
    channel_radius: float,
    yield_divisor: float,
) -> float | np.ndarray:
    """Force of the damper in shear-valve mode: viscous and yield part (Eq 7)."""
    area = piston_area(r1, r2)
    viscous = 12 * viscosity * l * area**2 / (2 * np.pi * channel_radius * w**3)
    yielding = 3 * l * area * yield_stress / (w * yield_divisor)
    return viscous * velocity + yielding * np.sign(velocity)


def smallest_rod_radius(force: float, allowable_stress: float) -> float:
    """Radius at which the piston rod just carries the damper's largest force (Eq 9)."""
    return float(np.sqrt(force / (np.pi * allowable_stress)))


def smallest_flux_area(channel_field: float, channel_area: float, saturation_field: float) -> float:
    """Flux area that another part needs so that the channel saturates first (Eq 10)."""
    return channel_field * channel_area / saturation_field


def magnetomotive_force(channel_field: float, path_length: float, permeability: float) -> float:
    """Turns times current that a flux density in the channel needs, leakage neglected (Eq 11)."""
    return channel_field * path_length / permeability
