"""The reference building of this project and its isolators."""

from __future__ import annotations

import numpy as np

from ground_motions.argument_types import checked

from ..laws.device import Device
from ..laws.registry import law
from .shear_building import shear_building
from .structure import Structure

N_STOREYS = 5
FLOOR_MASS = 2.5e5
"""kg."""
BASE_MASS = 3e5
"""kg."""
FIXED_BASE_PERIOD = 0.5
"""First fixed-base period, s; it determines the storey stiffness."""
DAMPING_RATIO = 0.02
"""Damping ratio of the superstructure's first and third modes."""

LENGTH_SCALE = 10.0
"""Deformation of the isolation layer over that of the laboratory device."""
ISOLATED_PERIOD = 2.0
"""Period of the whole mass on the strain-stiffening isolators at 1.5 A, s."""
FORCE_SCALE = 3014.687322399704
"""Force of the isolation layer over that of the laboratory device: total mass * (2 pi / 2 s)^2 *
length scale / Re K*. The storage stiffness Re K* of the published strain-stiffening device at
1.5 A, for small vibrations at 0.5 Hz, then gives the total mass a period of 2 s."""


def reference_building() -> Structure:
    """Build the reference: five equal storeys on a base slab.

    Floors of 250 t on a slab of 300 t; equal storeys with a fixed-base period of 0.5 s; Rayleigh
    damping of 2 % at the first and third fixed-base modes.

    Returns
    -------
    Structure
        Dofs ``base``, ``floor1`` … ``floor5``.
    """
    # first frequency of n equal storeys: 2 sqrt(k / m) sin(pi / (4 n + 2))
    half = np.pi / FIXED_BASE_PERIOD / np.sin(np.pi / (4 * N_STOREYS + 2))
    return shear_building(
        masses=[FLOOR_MASS] * N_STOREYS,
        stiffnesses=[FLOOR_MASS * half**2] * N_STOREYS,
        base_mass=BASE_MASS,
        damping_ratio=DAMPING_RATIO,
        rayleigh_modes=(1, 3),
        name="reference building",
    )


@checked
def reference_isolators(device: Device | None = None) -> Device:
    """Scale a laboratory device to the reference building.

    Parameters
    ----------
    device : Device, optional
        Laboratory device; the published strain-stiffening one by default.

    Returns
    -------
    Device
        Device with the deformation scaled by 10 and the force by ``FORCE_SCALE``. All devices have
        the same scales, so that laws of one laboratory device remain comparable.
    """
    device = law("strain_stiffening") if device is None else device
    return device.scaled(length=LENGTH_SCALE, force=FORCE_SCALE)
