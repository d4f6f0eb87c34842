"""Checks of what users give to a simulation: types first, each with what to do instead."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ground_motions import Record

from ..errors import InputError
from ..laws.trace_check import check_traceable
from ..structures import IsolatedStructure, Structure

_NEEDED = ("prepare", "measures", "schedule", "reset")
"""Methods that a run calls of any controller."""


def checked_plant(given: Any, what: str = "isolated") -> IsolatedStructure:
    """Return an isolated structure, or say how to make one."""
    if isinstance(given, IsolatedStructure):
        for law in given.group_laws:
            check_traceable(law)
        return given
    if isinstance(given, Structure):
        raise InputError(
            f"{what} is {given.name!r} without isolators; expected: structure.on(device), or "
            "structure.with_element(...)"
        )
    raise InputError(
        f"{what} is {_shown(given)}; expected: an IsolatedStructure, such as "
        "reference_building().on(reference_isolators())"
    )


def checked_records(given: Any) -> tuple[Record, ...]:
    """Return the records, one a direction, or say how to read them."""
    if isinstance(given, Record):
        return (given,)
    if isinstance(given, str | Path):
        raise InputError(
            f"ground is the path {str(given)!r}; expected: a Record, such as "
            f"read_record({str(given)!r})"
        )
    if not isinstance(given, Sequence):
        raise InputError(
            f"ground is {_shown(given)}; expected: a Record, or one for each direction"
        )
    for k, each in enumerate(given):
        if not isinstance(each, Record):
            raise InputError(f"ground[{k}] is {_shown(each)}; expected: a Record")
    return tuple(given)


def checked_controller(given: Any) -> Any:
    """Return a controller, or say how to make one."""
    if isinstance(given, type):
        raise InputError(
            f"controller is the class {given.__name__}; expected: an instance, {given.__name__}()"
        )
    if not all(callable(getattr(given, name, None)) for name in _NEEDED):
        raise InputError(
            f"controller is {_shown(given)}; expected: controller(name), or an instance of a "
            "subclass of controllers.Controller"
        )
    return given


def _shown(given: Any) -> str:
    if given is None or isinstance(given, bool | int | float | str):
        return f"{given!r}"
    if isinstance(given, type):
        return f"the class {given.__name__}"
    return f"of type {type(given).__name__}"
