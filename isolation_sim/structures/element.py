"""Nonlinear elements of a structure, and the devices that they belong to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ground_motions.argument_types import checked

from ..errors import InputError
from ..laws.device import Device
from ..laws.law import Law
from .checks import numbers


@checked
@dataclass(frozen=True, eq=False)
class Element:
    """Nonlinear element: a device along a direction of the structure.

    Its deformation is ``direction @ q``; its force on the dofs is ``-direction * F``. A biaxial
    device has one element per direction; the second one ``follows`` the first.

    Attributes
    ----------
    device : Device
        Law, numbers and scale.
    direction : numpy.ndarray, shape (n,)
        Deformation per unit of each displacement.
    channel : int or None
        Coil channel; None for an element without a coil.
    name : str
        Name to print.
    follows : str
        Name of the first element of the same device, if this element is a further direction;
        otherwise empty. See ``IsolatedStructure.with_biaxial``.

    Raises
    ------
    InputError
        If the device has a coil but no channel, or a channel or direction cannot be used.
    """

    device: Device
    direction: np.ndarray
    channel: int | None = None
    name: str = "element"
    follows: str = ""

    def __post_init__(self) -> None:
        if self.channel is None and self.device.depends_on_current:
            raise InputError(
                f"element {self.name!r} depends on the coil current but has no channel: "
                "give channel=0 or the number of its coil"
            )
        whole = isinstance(self.channel, (int, np.integer))
        if self.channel is not None and not (whole and self.channel >= 0):
            raise InputError(
                f"element {self.name!r} has channel {self.channel!r}; expected: 0, 1, 2"
            )
        direction = numbers(f"direction of element {self.name!r}", self.direction)
        object.__setattr__(self, "direction", direction)


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
