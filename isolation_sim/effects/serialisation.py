"""A device with its effects as an ``[isolator]`` section of a scenario."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ground_motions.argument_types import checked
from ground_motions.registry import code_files

from ..errors import InputError
from ..laws.device import Device
from ..laws.registry import LAWS
from ..laws.registry import law as published
from .extend import separate
from .registry import EFFECTS


def device_places(device: Device) -> list[str]:
    """Names or places under which a device's law and effects were found."""
    base, applied = separate(device)
    effects = (EFFECTS.called(effect, effect.cause) for effect, _ in applied)
    return [LAWS.called(base.law, base.law.name), *effects]


def device_code(device: Device) -> dict[str, str]:
    """Files that a device's law and effects come from, each with its digest."""
    return code_files(device_places(device))


def _is_published(device: Device) -> bool:
    """Whether a device has the numbers of its law's default published set."""
    try:
        return published(device.law.name).current == device.current
    except InputError:
        return False


@checked
def device_section(device: Device, *comments: str, places: Mapping[str, str] | None = None) -> str:
    """Write a device as the ``[isolator]`` section of a scenario.

    Effects of the instruments, which are none of the device's, are in ``instrument``: they are not
    simulated, but ``evaluate`` compares measured forces with them.

    Parameters
    ----------
    device : Device
        In the tested device's own scale; with effects or without.
    *comments : str
        Lines to put on top.
    places : mapping of str to str, optional
        Places beside the section, such as ``"extended_law.py:LAW"``, of a law or effects in files,
        each by the place where it was found.

    Returns
    -------
    str
        TOML; the scales say that one device of the tested size carries the building, which is
        what to change. ``[code]`` has the SHA-256 of files of a user's own law and effects.

    Raises
    ------
    InputError
        If the parameters follow the current piecewise, and not as published, which a scenario
        cannot say.
    """
    import tomlkit

    base, applied = separate(device)
    is_piecewise = len(base.current.coefficients) > 1
    if is_piecewise and not _is_published(base):
        raise InputError(
            f"{base.name}: parameters are given piecewise in the current; expected in a scenario: "
            "one polynomial for all currents"
        )
    section = tomlkit.table()
    beside = places or {}
    origins = device_places(device)
    law, *names = [beside.get(name, name) for name in origins]
    for line in comments:
        section.add(tomlkit.comment(line))
    section["law"] = law
    if np.isfinite(base.current_range).all():
        section["current_range_A"] = list(base.current_range)
    if np.isfinite(base.tested_deformation):
        section["tested_deformation_m"] = base.tested_deformation
    if np.isfinite(base.tested_current):
        section["tested_current_A"] = base.tested_current
    section["length_scale"] = base.length
    section["force_scale"] = base.force_scale
    if not is_piecewise:
        rows = base.current.coefficients[0].tolist()
        section["parameters"] = dict(zip(base.current.names, rows, strict=True))
    for key, of_device in (("effect", True), ("instrument", False)):
        tables = tomlkit.aot()
        for name, (effect, values) in zip(names, applied, strict=True):
            if effect.of_device is of_device:
                tables.append(tomlkit.item({"name": name, "form": effect.form} | values))
        if tables:
            section[key] = tables
    document = tomlkit.document()
    document["isolator"] = section
    if code := code_files(name for name in origins if name not in beside):
        document["code"] = tomlkit.item(code)
        document["code"].comment("SHA-256 of code files; a change is warned of")
    return tomlkit.dumps(document)
