"""A device with its effects as an ``[isolator]`` section of a scenario."""

from __future__ import annotations

import numpy as np

from ground_motions.argument_types import checked
from ground_motions.registry import code_files

from ..errors import InputError
from ..laws.device import Device
from ..laws.serialisation import to_dict
from .extend import separate
from .registry import EFFECTS


def device_code(device: Device) -> dict[str, str]:
    """Files that a device's law and effects come from, each with its digest."""
    base, applied = separate(device)
    effects = (EFFECTS.called(effect, effect.cause) for effect, _ in applied)
    return code_files([to_dict(base)["law"], *effects])


@checked
def device_section(device: Device, *comments: str, law_place: str = "") -> str:
    """Write a device as the ``[isolator]`` section of a scenario.

    Effects of the instruments, which are none of the device's, are left out and named in a comment.

    Parameters
    ----------
    device : Device
        In the tested device's own scale; with effects or without.
    *comments : str
        Lines to put on top.
    law_place : str, optional
        Place of the law beside the section, such as ``"extended_law.py:LAW"``, in place of the one
        where it was found.

    Returns
    -------
    str
        TOML; the scales say that one device of the tested size carries the building, which is
        what to change. ``[code]`` has the SHA-256 of files of a user's own law and effects.

    Raises
    ------
    InputError
        If the parameters follow the current piecewise, which a scenario cannot say.
    """
    import tomlkit

    base, applied = separate(device)
    data = to_dict(base)
    if "current_breaks" in data:
        raise InputError(
            f"{base.name}: parameters are given piecewise in the current; expected in a scenario: "
            "one polynomial for all currents"
        )
    section = tomlkit.table()
    names = {effect: EFFECTS.called(effect, effect.cause) for effect, _ in applied}
    places = [*names.values()] if law_place else [data["law"], *names.values()]
    left_out = [effect.name for effect, _ in applied if not effect.of_device]
    if left_out:
        comments = (*comments, f"without the effects of the instruments: {', '.join(left_out)}")
    for line in comments:
        section.add(tomlkit.comment(line))
    section["law"] = law_place or data["law"]
    if np.isfinite(data["current_range"]).all():
        section["current_range_A"] = data["current_range"]
    if np.isfinite(data["tested_deformation"]):
        section["tested_deformation_m"] = data["tested_deformation"]
    if np.isfinite(data["tested_current"]):
        section["tested_current_A"] = data["tested_current"]
    section["length_scale"] = data["length"]
    section["force_scale"] = data["force_scale"]
    section["parameters"] = data["parameters"]
    tables = tomlkit.aot()
    for effect, values in applied:
        if effect.of_device:
            tables.append(tomlkit.item({"name": names[effect], "form": effect.form} | values))
    if tables:
        section["effect"] = tables
    document = tomlkit.document()
    document["isolator"] = section
    if code := code_files(places):
        document["code"] = tomlkit.item(code)
        document["code"].comment("SHA-256 of files of code; a change is told")
    return tomlkit.dumps(document)
