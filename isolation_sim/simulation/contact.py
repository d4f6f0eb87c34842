"""Contacts with moat walls and end stops."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..effects import separate
from ..structures import IsolatedStructure
from .complex_modes import Modes
from .workspace import Workspace, motion_by_steps


class Stop(NamedTuple):
    """Element with a stop."""

    element: int  # Its number
    # low, high: Deformations at which the stop begins, m, in the structure's scale
    low: float
    high: float


@lru_cache(maxsize=256)
def stops(isolated: IsolatedStructure) -> tuple[Stop, ...]:
    """Elements that are walls, or have an end stop."""
    result = []
    for e, element in enumerate(isolated.elements):
        for effect, values in separate(element.device)[1]:
            if effect.cause == "end_stop":
                length, gap = element.device.length, values.get("gap", 0.0)
                low, high = values.get("behind", gap), values.get("ahead", gap)
                result.append(Stop(e, -length * low, length * high))
    return tuple(result)


def contacts_of_outputs(
    isolated: IsolatedStructure, names: tuple[str, ...], values: NDArray
) -> dict[str, int]:
    """Contacts with each stop by the element's name, from all outputs at the samples."""
    result = {}
    for stop in stops(isolated):
        name = isolated.element_names[stop.element]
        result[name] = _entries(stop, values[:, names.index(f"{name}_deformation_m")])
    return result


def contacts_of_lane(
    isolated: IsolatedStructure, modes: Modes, work: Workspace, lane: int = 0
) -> dict[str, int]:
    """Contacts with each stop by the element's name, in one lane of a finished block."""
    result: dict[str, int] = {}
    all_stops = stops(isolated)
    if not all_stops:
        return result
    motion = motion_by_steps(work, modes.eigenvalues.size, lane)
    for stop in all_stops:
        length = isolated.elements[stop.element].device.length
        deformation = length * (motion @ modes.deformation[stop.element, 0]).real
        result[isolated.element_names[stop.element]] = _entries(stop, deformation)
    return result


def _entries(stop: Stop, deformation: NDArray) -> int:
    """Number of times that a deformation comes to a stop."""
    beyond = (deformation < stop.low) | (deformation > stop.high)
    return int(np.count_nonzero(np.diff(beyond.astype(int), prepend=0) == 1))
