"""Laws and published parameter sets by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..errors import InputError, unknown_name
from . import (
    bouc_wen,
    dahl,
    dynamic_stiffness,
    field_gap,
    four_parameter,
    hybrid,
    improved_bouc_wen,
    kelvin_voigt,
    linear,
    linearised_bouc_wen,
    lugre,
    maxwell,
    spring_pot,
    standard_solid,
    strain_stiffening,
    strain_stiffening_power,
)
from .current_dependence import CurrentDependence
from .device import Device
from .law import Law

# one line a law: its file holds LAW and SETS, the published sets by name, the default one first;
# and CONDITIONS where numbers were published for single loading conditions as well
_FILES = (
    strain_stiffening,
    hybrid,
    linear,
    kelvin_voigt,
    maxwell,
    standard_solid,
    four_parameter,
    strain_stiffening_power,
    field_gap,
    bouc_wen,
    improved_bouc_wen,
    linearised_bouc_wen,
    dynamic_stiffness,
    lugre,
    dahl,
    spring_pot,
)

LAWS: dict[str, Law] = {file.LAW.name: file.LAW for file in _FILES}
"""Every law by name."""

_SETS = {file.LAW.name: file.SETS for file in _FILES}
_CONDITIONS = {file.LAW.name: getattr(file, "CONDITIONS", {}) for file in _FILES}

Coefficients = float | Sequence[float]


def available_laws() -> tuple[str, ...]:
    """Names of the laws.

    Returns
    -------
    tuple of str
    """
    return tuple(LAWS)


def available_sets(name: str) -> tuple[str, ...]:
    """Names of a law's published parameter sets, the default one first.

    Parameters
    ----------
    name : str
        Name of the law.

    Returns
    -------
    tuple of str
        Empty where the law needs explicit numbers.

    Raises
    ------
    InputError
        If there is no such law.
    """
    if name not in LAWS:
        raise unknown_name("law", name, LAWS)
    return tuple(_SETS[name])


def available_conditions(name: str) -> tuple[str, ...]:
    """Names of a law's sets that were published for a single loading condition each.

    Parameters
    ----------
    name : str
        Name of the law.

    Returns
    -------
    tuple of str
        Such as ``2mm_1Hz_3A`` or ``0.4T_0.15mm_10Hz``; ``law`` takes them as it takes
        ``available_sets``. Empty for most laws.

    Raises
    ------
    InputError
        If there is no such law.
    """
    if name not in LAWS:
        raise unknown_name("law", name, LAWS)
    return tuple(_CONDITIONS[name])


def _published(name: str, set_name: str | None) -> Device:
    sets = available_sets(name)
    if not sets:
        needed = ", ".join(LAWS[name].parameter_names)
        raise InputError(f"{name} has no published set; parameters needed: {needed}")
    if set_name is None:
        set_name = sets[0]
    published = _SETS[name] | _CONDITIONS[name]
    if set_name not in published:
        raise unknown_name(f"parameter set of {name}", set_name, published)
    return published[set_name]()


def law(name: str, parameters: str | Mapping[str, Coefficients] | None = None) -> Device:
    """Build a device from a law's name.

    Parameters
    ----------
    name : str
        Name of the law.
    parameters : str or mapping of str to float or sequence of float, optional
        Name of a published set or condition; or numbers in SI units, constants or ascending powers
        of the current in A. Numbers replace those of the default published set where the law has
        one, and keep its range; a law without one needs all of its parameters. The default
        published set if not given.

    Returns
    -------
    Device

    Raises
    ------
    InputError
        If a name is unknown, a parameter is missing, or a number is not usable.
    """
    if parameters is None or isinstance(parameters, str):
        return _published(name, parameters)
    if available_sets(name):
        return _published(name, None).with_parameters(**parameters)
    order = LAWS[name].parameter_names
    return Device(LAWS[name], CurrentDependence.polynomial(parameters, order))
