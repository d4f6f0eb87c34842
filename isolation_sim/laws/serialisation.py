"""Devices to and from plain dictionaries, for TOML."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ground_motions.argument_types import checked

from ..errors import InputError, check_name, unknown_name
from .current_dependence import CurrentDependence
from .device import Device
from .law import Law
from .registry import LAWS

_KEYS = (
    "law parameters current_breaks current_range tested_deformation tested_current length "
    "force_scale source name"
).split()
_SCALARS = ("tested_deformation", "tested_current", "length", "force_scale", "source", "name")


@checked
def to_dict(device: Device) -> dict[str, Any]:
    """Describe a device by strings, numbers and lists alone.

    Parameters
    ----------
    device : Device
        Object to describe.

    Returns
    -------
    dict
        ``law`` (its name, or the place where it was found), ``name``, ``source``,
        ``current_range`` (A), ``tested_deformation`` (m), ``tested_current`` (A), ``length``,
        ``force_scale``, ``parameters`` (name to ascending powers of the current in A), and for
        piecewise dependences ``current_breaks`` (A), with one such list a piece.
    """
    dependence = device.current
    rows = np.moveaxis(dependence.coefficients, 1, 0)
    one_piece = len(dependence.coefficients) == 1
    data: dict[str, Any] = {
        "law": LAWS.called(device.law, device.law.name),
        "current_range": list(device.current_range),
        **{key: getattr(device, key) for key in _SCALARS},
    }
    if not one_piece:
        data["current_breaks"] = dependence.breaks[1:-1].tolist()
    data["parameters"] = {
        name: (row[0] if one_piece else row).tolist()
        for name, row in zip(dependence.names, rows, strict=True)
    }
    return data


@checked
def from_dict(data: Mapping[str, Any], laws: Mapping[str, Law] | None = None) -> Device:
    """Build a device from its plain description.

    Parameters
    ----------
    data : mapping
        As ``to_dict`` writes it; only ``law`` and ``parameters`` are needed.
    laws : mapping of str to Law, optional
        Where ``law`` is looked up; the registered laws by default.

    Returns
    -------
    Device

    Raises
    ------
    InputError
        If a key or a name is unknown or missing, or a number is not usable.
    """
    laws = LAWS if laws is None else laws
    for key in data:
        check_name("key of a device", key, _KEYS)
    for key in ("law", "parameters"):
        if key not in data:
            raise InputError(f"a device needs the key {key!r}; expected keys: {', '.join(_KEYS)}")
    if laws is not LAWS and data["law"] not in laws:
        raise unknown_name("law", str(data["law"]), laws)
    law = laws[str(data["law"])]
    if not isinstance(data["parameters"], Mapping):
        raise InputError(f"parameters of {law.name} must be a table of name = coefficients")
    if "current_breaks" in data:
        dependence = _piecewise(data["parameters"], data["current_breaks"])
    else:
        dependence = CurrentDependence.polynomial(data["parameters"], law.parameter_names)
    others = {key: data[key] for key in ("current_range", *_SCALARS) if key in data}
    return Device(law, dependence, **others)


def _piecewise(parameters: Mapping[str, Any], breaks: Any) -> CurrentDependence:
    try:
        coefficients = np.array(list(parameters.values()), dtype=float)
        inner = np.array(breaks, dtype=float)
    except (TypeError, ValueError):
        raise InputError(
            "with current_breaks every parameter needs one list of coefficients a piece, all of "
            "one length"
        ) from None
    if coefficients.ndim != 3 or inner.ndim != 1:
        raise InputError("with current_breaks every parameter needs a list of lists of numbers")
    return CurrentDependence(
        tuple(parameters),
        np.concatenate([[-np.inf], inner, [np.inf]]),
        np.moveaxis(coefficients, 0, 1),
    )
