"""Elements of an isolated structure by device, by coil channel and by place."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..errors import InputError
from ..laws.law import Law
from .element import Element


def group_by_device(elements: Sequence[Element]) -> tuple[tuple[int, ...], ...]:
    """Indices of the elements of each device: one, or one per direction."""
    result: list[list[int]] = []
    for e, element in enumerate(elements):
        if element.follows and result:
            result[-1].append(e)
        else:
            result.append([e])
    return tuple(map(tuple, result))


def law_of_device(elements: Sequence[Element]) -> Law:
    """Law of a device for the number of directions of its elements."""
    law = elements[0].device.law
    if len(elements) == 1:
        return law
    return law.in_plan if len(elements) == 2 else law.under_axial_load


def check_devices(elements: Sequence[Element]) -> None:
    """Refuse elements that do not follow the first one of their device, or lack a direction."""
    leader = None
    for element in elements:
        if not element.follows:
            leader = element
        elif leader is None or leader.name != element.follows:
            raise InputError(
                f"element {element.name!r} follows {element.follows!r}; expected: the previous "
                "element, of the same device"
            )
    for group in group_by_device(elements):
        device = [elements[e] for e in group]
        if len(device) != law_of_device(device).directions:
            names = ", ".join(element.name for element in device)
            raise InputError(f"{names} are one device; expected: 2 or 3 directions")


def common_current_range(elements: Sequence[Element], channel: int) -> tuple[float, float]:
    """Lowest and highest current that every device on a channel accepts, A."""
    ranges = [e.device.current_range for e in elements if e.channel == channel]
    if not ranges:
        count = len({element.channel for element in elements} - {None})
        raise InputError(f"channel {channel} has no element; expected: 0 to {count - 1}")
    low, high = max(r[0] for r in ranges), min(r[1] for r in ranges)
    if low > high:
        raise InputError(f"the devices on channel {channel} have no current in common")
    return low, high


def common_tested_current(elements: Sequence[Element], channel: int) -> float:
    """Highest current that was tested for every device on a channel, A; inf if unknown."""
    tested = (
        element.device.tested_current
        for element in elements
        if element.channel == channel and element.device.depends_on_current
    )
    return min(tested, default=np.inf)


def isolation_elements(isolated: Any) -> list[int]:
    """Indices of the isolators: the elements at the base, without moat walls."""
    walls = moat_walls(isolated)
    return [e for e, held in enumerate(isolated.holding) if np.any(held) and e not in walls]


def base_devices(isolated: Any) -> list[int]:
    """Indices of the isolators with a coil; without any, of all elements at the base."""
    layer = isolation_elements(isolated)
    driven = [e for e in layer if isolated.elements[e].channel is not None]
    return driven or [*layer, *moat_walls(isolated)]


def moat_walls(isolated: Any) -> list[int]:
    """Indices of the moat walls."""
    return [e for e, name in enumerate(isolated.element_names) if name.startswith("moat_wall")]
