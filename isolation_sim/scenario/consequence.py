"""Run a scenario as a diagnosis found it, and with its extended law or corrected building."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ground_motions import Record
from ground_motions.spectra import response_spectrum

from ..comparison import UNCONTROLLED
from ..discrepancy.consequence import Consequence, consequence
from ..discrepancy.diagnosis import BuildingDiagnosis
from ..effects.extend import extend, separate
from ..errors import InputError
from ..identification.sinusoidal import sinusoidal
from ..laws import Device
from ..registry import controller
from ..structures import IsolatedStructure, Structure
from ..structures.reference import ISOLATED_PERIOD

if TYPE_CHECKING:
    from ..discrepancy.diagnosis import Diagnosis
    from .job import Job
    from .scenario import Scenario


MOST_DAMPING = 0.5
"""Damping ratio up to which a device restores enough to carry a building by itself."""
# so many points that a spring-pot, which relaxes within a millisecond, is integrated stably
_CYCLES, _POINTS = 6, 2048
_NOT_OF_THE_BUILDING = ("sensor_", "actuation_delay", "current_supply_limit")
"""Beginnings of the names of causes that leave structure and isolators as they are."""


def with_consequence(
    diagnosis: Diagnosis, scenario: Scenario, progress: Callable[[str], None] | None = None
) -> Diagnosis:
    """Add the consequence of the error in a scenario to a diagnosis."""
    of_building = isinstance(diagnosis, BuildingDiagnosis)
    unchanged = _NOT_OF_THE_BUILDING if of_building else ()
    if all(cause.name.startswith(unchanged) for cause in diagnosis.causes):
        return diagnosis
    job = scenario.build()
    scaling = ""
    if isinstance(diagnosis, BuildingDiagnosis):
        assert diagnosis.building is not None
        before, after = job.isolated, diagnosis.building
    else:
        assert diagnosis.nominal is not None and diagnosis.extended is not None
        try:
            old, new = _alike(diagnosis.nominal, _without_instruments(diagnosis.extended))
            scale = _explicit_scale(scenario) or carrying(new, job.isolated.structure, job.records)
        except InputError as error:
            reason = f"Not run: {error}."
            nothing = Consequence(job.isolated.structure.name, "", reason, {})
            return replace(diagnosis, consequence=nothing)
        before, after = (
            _on_device(job.isolated, device.scaled(scale.length, scale.force))
            for device in (old, new)
        )
        scaling = scale.words
    result = consequence(
        before, after, job.records, _controllers(job, after), options=job.options,
        scaling=scaling, subject="model" if of_building else "law", progress=progress,
    )  # fmt: skip
    return replace(diagnosis, consequence=result)


def _without_instruments(device: Device) -> Device:
    """A device without the effects in the measuring instruments."""
    base, applied = separate(device)
    own = [(effect, numbers) for effect, numbers in applied if effect.of_device]
    if len(own) == len(applied):
        return device
    return extend(base, own) if own else base


def _alike(old: Device, new: Device) -> tuple[Device, Device]:
    """Both devices with the current range that is valid for both."""
    low, high = (old.current_range, new.current_range)
    both = (max(low[0], high[0]), min(low[1], high[1]))
    return replace(old, current_range=both), replace(new, current_range=both)


def _explicit_scale(scenario: Scenario) -> Scale | None:
    section = scenario.isolator
    if section.length_scale is None or section.force_scale is None:
        return None
    force = section.count * section.force_scale
    return Scale(
        section.length_scale, force,
        f"The scenario scales the device: deformation by {section.length_scale:g}, force by "
        f"{force:g}.",
    )  # fmt: skip


def _on_device(isolated: IsolatedStructure, device: Device) -> IsolatedStructure:
    """The scenario's building on another device."""
    first, *others = isolated.elements
    return replace(isolated, elements=(replace(first, device=device), *others))


def _controllers(job: Job, isolated: IsolatedStructure) -> dict:
    """The scenario's controllers, those without current first; only these without a coil."""
    off = {UNCONTROLLED: controller(UNCONTROLLED)}
    if not any(element.device.depends_on_current for element in isolated.elements):
        return off
    return off | job.controllers


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
