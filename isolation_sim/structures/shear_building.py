"""Shear buildings: one horizontal dof per floor, on a rigid base."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ground_motions.argument_types import checked

from ..errors import InputError, check_name
from .checks import positive_numbers
from .matrices import from_fixed_base
from .modes import undamped_modes
from .structure import Structure

_DAMPING = ("rayleigh", "modal")


@checked
def shear_building(
    masses: Sequence[float],
    stiffnesses: Sequence[float],
    *,
    base_mass: float,
    damping_ratio: float | Sequence[float] = 0.02,
    damping: str = "rayleigh",
    rayleigh_modes: tuple[int, int] = (1, 2),
    heights: Sequence[float] | None = None,
    name: str = "shear building",
) -> Structure:
    """Shear building of any number of storeys on a rigid base.

    Damping is that of the superstructure on a fixed base, in coordinates relative to the base.
    Rigid motion of the whole is undamped.

    Parameters
    ----------
    masses : sequence of float, shape (n_storeys,), kg
        Floors above the base, from below.
    stiffnesses : sequence of float, shape (n_storeys,), N/m
        Storeys, from below.
    base_mass : float, kg
        Mass of the base slab.
    damping_ratio : float or sequence of float, shape (n_storeys,), default 0.02
        Ratio of critical damping; one per mode only with ``damping="modal"``.
    damping : {"rayleigh", "modal"}
        Mass and stiffness proportional, with the ratio at two modes, or the ratio at every mode.
    rayleigh_modes : tuple of int, default (1, 2)
        The two modes, counted from 1.
    heights : sequence of float, shape (n_storeys,), optional, m
        Storey heights, from below.
    name : str
        Name to print.

    Returns
    -------
    Structure
        Dofs ``base``, ``floor1``, …, storeys ``storey1``, ….

    Raises
    ------
    InputError
        If a number cannot be used; with its name.
    """
    m = positive_numbers("masses", masses, "kg")
    k = positive_numbers("stiffnesses", stiffnesses, "N/m")
    slab = positive_numbers("base_mass", base_mass, "kg")
    if m.size != k.size:
        raise InputError(f"{m.size} masses, {k.size} stiffnesses; expected: one of each per storey")
    if heights is not None and len(heights) != m.size:
        raise InputError(f"heights has {len(heights)} numbers; expected: {m.size}, one per storey")
    if slab.size != 1:
        raise InputError(f"base_mass has {slab.size} values; expected: one, in kg")
    check_name("damping", damping, _DAMPING)
    above = np.append(k[1:], 0.0)
    stiffness = np.diag(k + above) - np.diag(k[1:], 1) - np.diag(k[1:], -1)
    mass = np.diag(m)
    ratio = _ratios(damping_ratio, m.size, damping)
    # with one mode, both kinds of damping are the same
    if damping == "modal" or m.size == 1:
        viscous = modal_damping(mass, stiffness, ratio)
    else:
        viscous = _rayleigh(mass, stiffness, ratio[0], rayleigh_modes)
    return from_fixed_base(mass, viscous, stiffness, slab[0], heights=heights, name=name)


def _ratios(ratios: Any, n: int, damping: str) -> np.ndarray:
    try:
        ratio = np.atleast_1d(np.array(ratios, dtype=float))
    except (TypeError, ValueError):
        ratio = np.array([np.nan])
    sizes = (1, n) if damping == "modal" else (1,)
    if ratio.ndim != 1 or ratio.size not in sizes or not np.all((ratio >= 0) & (ratio < 1)):
        accepted = "a number from 0 to 1"
        accepted += f", or {n} of them" if damping == "modal" else ' (one per mode needs "modal")'
        raise InputError("damping_ratio", repr(ratios), accepted)
    return np.broadcast_to(ratio, (n,))


def modal_damping(mass: np.ndarray, stiffness: np.ndarray, ratio: float | np.ndarray) -> np.ndarray:
    """Damping matrix with a ratio of critical damping at every mode."""
    frequencies, shapes = undamped_modes(mass, stiffness)
    weighted = mass @ shapes
    return (weighted * (2 * ratio * frequencies)) @ weighted.T


def _rayleigh(
    mass: np.ndarray, stiffness: np.ndarray, ratio: float, modes: tuple[int, int]
) -> np.ndarray:
    try:
        first, second = (int(mode) for mode in modes)
    except (TypeError, ValueError):
        first = second = 0
    n = len(mass)
    if first == second or not (1 <= first <= n and 1 <= second <= n):
        raise InputError("rayleigh_modes", repr(modes), f"two different modes, 1 to {n}")
    frequencies, _ = undamped_modes(mass, stiffness)
    a, b = frequencies[first - 1], frequencies[second - 1]
    return 2 * ratio / (a + b) * (a * b * mass + stiffness)
