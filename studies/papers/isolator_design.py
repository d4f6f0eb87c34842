"""Stiffness of the magnetorheological isolator by its design (Tao et al., Section 2).

In SI units. The paper prints no hardness, so that the moduli are not known. The shape factor of its
Eq 2 can be read as each of ``SHAPE_FACTORS``, and as raising the compression term alone or the
whole. Eqs 7 to 11, on the damper and the magnetic circuit, lack the numbers that they need.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from isolation_sim.errors import check_name

TABLE_1 = {
    "R2": 43.5e-3,
    "R3": 31e-3,
    "h": 139e-3,
    "h1": 58e-3,
    "alpha": float(np.deg2rad(7.5)),
}
"""Dimensions in m and rad: lower inner radius of the shell, outer radius of the sleeve, height,
height of the lower part, inclination."""

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


def hardness_of(E: float) -> float:
    """Shore A hardness of natural rubber of a Young's modulus: Eq 4 solved, E / 3 being its G."""
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
