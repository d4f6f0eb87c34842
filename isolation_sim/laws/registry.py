"""Laws and published parameter sets by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ground_motions.argument_types import checked
from ground_motions.registry import Registry

from ..errors import InputError, check_name
from .current_dependence import CurrentDependence
from .device import Device
from .law import Law
from .trace_check import check_traceable

LAWS: Registry[Law] = Registry(
    "isolation_sim.laws",
    "law",
    "an isolation_sim.laws.Law",
    lambda value: value if isinstance(value, Law) else None,
    lambda law: law.name,
    unit="isolation_sim.laws.fmu:of_file",
)
"""Every law by name, or by a place such as ``"my_laws.py:CUBIC"``."""

Coefficients = float | Sequence[float]


def available_laws() -> tuple[str, ...]:
    """Names of the laws.

    Returns
    -------
    tuple of str
    """
    return tuple(LAWS)


@checked
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
    return tuple(LAWS[name].sets)


@checked
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
    return tuple(LAWS[name].conditions)


def _published_device(law: Law, set_name: str | None) -> Device:
    if not law.sets:
        needed = ", ".join(law.parameter_names)
        raise InputError(f"{law.name} has no published set; parameters needed: {needed}")
    if set_name is None:
        set_name = next(iter(law.sets))
    sets = {**law.sets, **law.conditions}
    check_name(f"parameter set of {law.name}", set_name, sets)
    return sets[set_name]()


@checked
def law(
    name: str | Law,
    parameters: str | Mapping[str, Coefficients] | None = None,
    current_range: tuple[float, float] | None = None,
) -> Device:
    """Build a device from a law.

    Parameters
    ----------
    name : str or Law
        Name of the law, a place such as ``"my_laws.py:CUBIC"``, a functional mock-up unit,
        ``"my.fmu"``, or the law itself.
    parameters : str or mapping of str to float or sequence of float, optional
        Name of a published set or condition; or numbers in SI units, constants or ascending powers
        of the current in A. Numbers replace those of the default published set where the law has
        one, and keep its range; a law without one needs all of its parameters. The default
        published set if not given.
    current_range : (float, float), optional
        Currents for which the numbers hold, A; by default those of the published set, or all.

    Returns
    -------
    Device

    Raises
    ------
    InputError
        If a name is unknown, a parameter is missing, or a number is not usable.
    """
    result = name if isinstance(name, Law) else LAWS[name]
    check_traceable(result)
    if parameters is None or isinstance(parameters, str):
        return _published_device(result, parameters).with_parameters(current_range=current_range)
    if result.sets:
        return _published_device(result, None).with_parameters(
            current_range=current_range, **parameters
        )
    current = CurrentDependence.polynomial(parameters, result.parameter_names)
    return Device(result, current, current_range or (-np.inf, np.inf))
