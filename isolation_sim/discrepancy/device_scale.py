"""Scale a tested device so that it carries a building, if no scale is given."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ground_motions import Record
from ground_motions.spectra import response_spectrum

from ..errors import InputError
from ..identification.sinusoidal import sinusoidal
from ..laws import Device
from ..structures import Structure
from ..structures.reference import ISOLATED_PERIOD

MOST_DAMPING = 0.5
"""Damping ratio up to which a device restores enough to carry a building by itself."""
# so many points that a spring-pot, which relaxes within a millisecond, is integrated stably
_CYCLES, _POINTS = 6, 2048


class Scale(NamedTuple):
    """How much larger a building's device is than the tested one."""

    # length, force: Factors on deformation and force
    length: float
    force: float
    words: str  # How they were found


def carrying(device: Device, structure: Structure, ground: Sequence[Record]) -> Scale:
    """Scale a device to a building and its ground motion."""
    # At its largest tested deformation and in the middle of its range of current its effective
    # stiffness is to give the whole mass a period of 2 s, and that deformation is to stand for what
    # the ground motion's response spectrum gives at that period and the device's damping.
    tested = device.tested_deformation
    if not np.isfinite(tested):
        raise InputError(f"{device.name} has no tested deformation; expected: one that is known")
    low, high = device.current_range if device.depends_on_current else (0.0, 0.0)
    current = (low + high) / 2
    frequency = 1 / ISOLATED_PERIOD
    motion = sinusoidal(device, tested, current, frequency, _CYCLES, _POINTS)
    loops = motion.measured(skip=_CYCLES // 2)
    stiffness, damping = loops.effective_stiffness.value, loops.damping_ratio.value
    if not (stiffness > 0 and damping < MOST_DAMPING):
        raise InputError(
            f"a device of {stiffness / 1e3:.3g} N/mm and a damping ratio of {damping:.2g} at "
            f"{1e3 * tested:.3g} mm damps more than it restores: it cannot carry a building by "
            "itself; expected: a scenario with length_scale and force_scale"
        )
    displacement = max(
        float(response_spectrum(record, [ISOLATED_PERIOD], max(damping, 0.0)).sd[0])
        for record in ground
    )
    length = displacement / tested
    force = structure.total_mass * (2 * np.pi * frequency) ** 2 * length / stiffness
    return Scale(
        length,
        float(force),
        f"The device was scaled to the building. Its largest tested deformation of "
        f"{1e3 * tested:.3g} mm becomes {1e3 * displacement:.3g} mm, the spectral displacement "
        f"of the ground motion at {ISOLATED_PERIOD:g} s and a damping ratio of {damping:.2g}. Its "
        f"force is multiplied by {force:.4g}, so that the effective stiffness at that deformation"
        + (f" and {current:.3g} A" if device.depends_on_current else "")
        + f" gives the whole mass a period of {ISOLATED_PERIOD:g} s.",
    )
