"""Scale devices to a period, and add dashpots for a damping ratio.

``Structure`` and ``IsolatedStructure`` import this module, so it does not import them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ground_motions.checks import positive

from ..errors import InputError
from ..laws.current_dependence import CurrentDependence
from ..laws.device import Device
from .isolation_loop import effective
from .modes import modal_facts, modes_of

DISPLACEMENT_PER_PERIOD = 0.04
"""Default design displacement over target period, m/s: 80 mm at 2 s, as for the reference
isolators."""


@dataclass(frozen=True)
class Sizing:
    """Period and damping ratio that isolators are to give a building; see ``Structure.on``."""

    target_period_s: float | None  # Of the first mode for small vibrations
    effective_period_s: float | None  # On the effective stiffness at the design displacement
    design_displacement_m: float | None  # At the largest tested deformation of the device
    damping: float | None  # Ratio of the first mode, or effective one with an effective period

    def gives_period(self, *others: str) -> bool:
        """Whether it has a period; ``others`` are the names of scales that are set beside it."""
        periods = ("target_period_s", "effective_period_s")
        chosen = [key for key in periods if getattr(self, key) is not None]
        if chosen and len(both := [*others, *chosen]) > 1:
            raise InputError(f"{both[0]} and {both[1]} are both set; expected: one of the two")
        if self.design_displacement_m is not None and not chosen:
            raise InputError(
                "design_displacement_m is set without target_period_s or effective_period_s; "
                "expected: one of them, too"
            )
        return bool(chosen)

    def scale(self, structure: Any, device: Device, biaxial: bool) -> Device:
        """Scale a device so that the structure has the period on it."""
        if self._cycle is not None:
            return _to_cycle(structure, device, self._cycle, biaxial)
        assert self.target_period_s is not None
        displacement = self.design_displacement_m
        return _to_period(structure, device, self.target_period_s, displacement, biaxial)

    def add_dashpots(self, isolated: Any, device: Device, key: str) -> Any:
        """Add dashpots between ground and base that give the damping ratio; ``key`` is its name.

        It is that of the first mode, or the effective damping with an effective period.
        """
        from ..laws.kelvin_voigt import LAW

        damping, cycle = self.damping, self._cycle
        if damping is None:
            return isolated
        if not (np.isfinite(damping) and 0 <= damping < 1):
            raise InputError(key, repr(damping), "a ratio, 0 or more and below 1")
        at_base = isolated.holding.any(axis=1)
        held = [element for element, at in zip(isolated.elements, at_base, strict=True) if at]
        if cycle is None:
            result = modal_facts(isolated, middle_current(device))
            own, omega = float(result.damping_ratios[0]), 2 * np.pi / result.periods[0]
            moved = np.array([element.direction @ result.shapes[:, 0] for element in held])
            size = omega / float(moved @ moved)
        else:
            stiffness, own, _ = effective(isolated, *cycle, middle_current(device))
            moved = isolated.holding[at_base, 0]
            size = stiffness * cycle[1] / (2 * np.pi) / float(moved @ moved)
        if damping < own:
            raise InputError(
                key,
                f"{damping:g}",
                f"{own:.4g} or more, the ratio of building and isolators alone",
            )
        coefficient = 2 * size * (damping - own)
        for element in held:
            numbers = CurrentDependence.polynomial({"k": 0.0, "c": coefficient}, ("k", "c"))
            damper = Device(LAW, numbers, name="damper added for a damping ratio")
            name = element.name.replace("isolator", "damper")
            isolated = isolated.with_element(damper, element.direction, None, name)
        return isolated

    @property
    def _cycle(self) -> tuple[float, float] | None:
        """Displacement, m, and period, s, at which a device has its effective period."""
        if self.effective_period_s is None:
            return None
        positive("effective_period_s", self.effective_period_s)
        if self.design_displacement_m is None:
            raise InputError("effective_period_s needs design_displacement_m; expected: both")
        positive("design_displacement_m", self.design_displacement_m)
        return self.design_displacement_m, self.effective_period_s


def middle_current(device: Device) -> float:
    """Middle of a device's tested currents, or of its range if it has none, A; 0 without a coil."""
    low, high = device.current_range
    high = max(low, min(high, device.tested_current))
    return (low + high) / 2 if np.isfinite(high - low) else 0.0


def _to_period(
    structure: Any, device: Device, target_period: float, displacement: float | None, biaxial: bool
) -> Device:
    """Scale a device so that the first mode has the target period at the middle current."""
    from scipy.optimize import brentq

    positive("target_period_s", target_period)
    if displacement is None and device.length == 1.0:
        displacement = DISPLACEMENT_PER_PERIOD * target_period
    if displacement is not None:
        device = _to_displacement(device, displacement)
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
            "target_period_s",
            f"{target_period:g}",
            f"above {period(stiffest):.3g} s, the period of {structure.name} on nearly rigid "
            "isolators",
        )
    softest = 0.5 * rigid
    if period(softest) <= target_period:
        raise InputError(
            "target_period_s",
            f"{target_period:g}",
            f"below {period(softest):.3g} s, the period of {structure.name} on soft isolators, or "
            "a structure that is free without them; matrices of a fixed-base building lack the "
            "base's row and column",
        )
    logarithm = brentq(
        lambda at: period(np.exp(at)) - target_period,
        np.log(softest), np.log(stiffest), xtol=1e-12,
    )  # fmt: skip
    return device.scaled(force=float(np.exp(logarithm)))


def _to_cycle(structure: Any, device: Device, cycle: tuple[float, float], biaxial: bool) -> Device:
    """Scale a device so that its effective period in a cycle is the cycle's, at the middle current.

    ``cycle``: displacement, m, and period, s.
    """
    device = _to_displacement(device, cycle[0])
    isolated = structure.on(device, biaxial=biaxial)
    rigid = structure.above_foundation[:, 0]
    without = float(rigid @ structure.stiffness @ rigid)  # such as that of P-delta
    stiffness = effective(isolated, *cycle, middle_current(device)).stiffness - without
    required = structure.isolated_mass * (2 * np.pi / cycle[1]) ** 2 - without
    if not required > 0:
        longest = 2 * np.pi * np.sqrt(structure.isolated_mass / without)
        raise InputError(
            "effective_period_s",
            f"{cycle[1]:g}",
            f"below {longest:.3g} s, the period of {structure.name} without isolators",
        )
    return device.scaled(force=required / stiffness)


def _to_displacement(device: Device, displacement: float) -> Device:
    """Scale a device so that its largest tested deformation is the design displacement."""
    positive("design_displacement_m", displacement)
    if not np.isfinite(device.tested_deformation):
        return device
    return device.scaled(displacement / (device.length * device.tested_deformation))
