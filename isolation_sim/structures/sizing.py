"""Scale devices to a period, and add dashpots for a damping ratio.

``Structure`` and ``IsolatedStructure`` import this module, so it does not import them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import InputError
from ..laws.current_dependence import CurrentDependence
from ..laws.device import Device
from .modes import modal_facts, modes_of

DISPLACEMENT_PER_PERIOD = 0.04
"""Default design displacement over target period, m/s: 80 mm at 2 s, as for the reference
isolators."""


def middle_current(device: Device) -> float:
    """Middle of a device's tested currents, or of its range if it has none, A; 0 without a coil."""
    low, high = device.current_range
    high = max(low, min(high, device.tested_current))
    return (low + high) / 2 if np.isfinite(high - low) else 0.0


def scale_to_period(
    structure: Any,
    device: Device,
    target_period: float,
    displacement: float | None,
    biaxial: bool = False,
) -> Device:
    """Scale a device so that the first mode has the target period at the middle current."""
    from scipy.optimize import brentq

    if not (np.isfinite(target_period) and target_period > 0):
        raise InputError(f"target_period_s is {target_period!r}; expected: a number above 0")
    if displacement is not None and not (np.isfinite(displacement) and displacement > 0):
        raise InputError(f"design_displacement_m is {displacement!r}; expected: a number above 0")
    if displacement is None and device.length == 1.0:
        displacement = DISPLACEMENT_PER_PERIOD * target_period
    if displacement is not None and np.isfinite(device.tested_deformation):
        device = device.scaled(displacement / (device.length * device.tested_deformation))
    current = middle_current(device)

    def period(force: float) -> float:
        isolated = structure.on(device.scaled(force=force), biaxial=biaxial)
        return float(modes_of(isolated.linearised(current, 1 / target_period)).periods[0])

    # a rigid structure: total mass on the storage stiffness
    stiffness = device.linearised(current, 1 / target_period).real
    if not stiffness > 0:
        raise InputError(
            f"{device.name}: no stiffness at rest at {current:.3g} A; expected with "
            "target_period_s: a device with a stiffness"
        )
    rigid = structure.total_mass * (2 * np.pi / target_period) ** 2 / stiffness
    # with a flexible superstructure the isolators must be stiffer
    stiffest = 1e4 * rigid
    if period(stiffest) >= target_period:
        raise InputError(
            f"target_period_s is {target_period:g}; expected: above {period(stiffest):.3g} s, the "
            f"period of {structure.name} on nearly rigid isolators"
        )
    logarithm = brentq(
        lambda at: period(np.exp(at)) - target_period,
        np.log(0.5 * rigid), np.log(stiffest), xtol=1e-12,
    )  # fmt: skip
    return device.scaled(force=float(np.exp(logarithm)))


def with_damping(isolated: Any, device: Device, damping: float, name: str = "damping") -> Any:
    """Add dashpots between ground and base to reach a damping ratio of the first mode."""
    from ..laws.kelvin_voigt import LAW

    if not (np.isfinite(damping) and 0 <= damping < 1):
        raise InputError(f"{name} is {damping!r}; expected: a ratio, 0 or more and below 1")
    result = modal_facts(isolated, middle_current(device))
    own = float(result.damping_ratios[0])
    if damping < own:
        raise InputError(
            f"{name} is {damping:g}; expected: {own:.4g} or more, the ratio of building and "
            "isolators alone"
        )
    held = [e for e, along in zip(isolated.elements, isolated.holding, strict=True) if along.any()]
    moved = np.array([element.direction @ result.shapes[:, 0] for element in held])
    omega = 2 * np.pi / result.periods[0]
    coefficient = 2 * omega * (damping - own) / float(moved @ moved)
    for element in held:
        numbers = CurrentDependence.polynomial({"k": 0.0, "c": coefficient}, ("k", "c"))
        damper = Device(LAW, numbers, name="damper added for a damping ratio")
        name = element.name.replace("isolator", "damper")
        isolated = isolated.with_element(damper, element.direction, None, name)
    return isolated
