"""Masses, periods, damping and tested currents of an isolated structure in words."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .element import base_devices
from .modes import modal_facts, translational_mode


def facts(isolated: Any) -> dict[str, str]:
    """Masses, periods and tested range as texts, as far as they can be computed."""
    structure = isolated.structure
    result = {"Mass": f"{1e-3 * structure.total_mass:.5g} t"}
    if structure.base and structure.superstructure:
        with suppress(InputError):
            modes = isolated.fixed_base().modes()
            result["Fixed-base period"] = f"{modes.periods[0]:.3g} s"
            result["Damping on a fixed base"] = _damping_text(modes.damping_ratios)
    currents = [0.0]
    for channel in range(isolated.n_channels):
        low, high = isolated.current_range(channel)
        currents = [max(low, 0.0), min(high, isolated.tested_current(channel))]
    sentences = []
    for current in dict.fromkeys(currents):
        with suppress(InputError, ArithmeticError, ValueError):
            modes = modal_facts(isolated, current, translational=True)
            k = translational_mode(structure, modes.shapes)
            at = f" at {current:.3g} A" if isolated.n_channels else ""
            torsion = f"; torsion {modes.periods[0]:.3g} s" if k else ""
            sentences.append(
                f"{modes.periods[k]:.3g} s{at} (damping {100 * modes.damping_ratios[k]:.2g} %"
                f"{torsion})"
            )
    if sentences and structure.base:
        result["Isolated period at rest"] = ", ".join(sentences)
    tested = [
        f"{element.name} {1e3 * element.device.length * element.device.tested_deformation:.3g} mm"
        for element in isolated.elements
        if np.isfinite(element.device.tested_deformation)
    ]
    if tested:
        result["Tested deformation"] = ", ".join(tested)
    amperes = [
        f"{isolated.tested_current(channel):.3g} A"
        for channel in range(isolated.n_channels)
        if np.isfinite(isolated.tested_current(channel))
    ]
    if amperes:
        result["Tested current"] = ", ".join(amperes)
    if isolated.n_channels and len(base_devices(isolated)) < len(isolated.elements):
        result["Control devices"] = _control_devices_text(isolated)
    return result


def _control_devices_text(isolated: Any) -> str:
    """Control devices, and the elements that J6 and J9 leave out."""
    names, controls = np.array(isolated.element_names), isolated.control_devices
    at_base = np.zeros(len(names), bool)
    at_base[base_devices(isolated)] = True
    counted = {"J6 and the control device force": at_base, "J9": controls}
    if np.array_equal(at_base, controls):
        counted = {"J6, J9 and the control device force": controls}
    texts = [", ".join(names[controls])]
    for what, those in counted.items():
        if not those.all():
            texts.append(f"left out of {what}: {', '.join(names[~those])}")
    return "; ".join(texts)


def _damping_text(ratios: NDArray) -> str:
    """Damping ratios of the first modes."""
    texts = [f"{100 * ratio:.3g} %" for ratio in ratios]
    if len(set(texts)) == 1 and len(texts) > 1:
        return f"{texts[0]} in every mode"
    return ", ".join(f"{text} in mode {k}" for k, text in enumerate(texts[:3], 1))
