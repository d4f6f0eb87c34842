"""Names of a building record's columns: what was measured, where and along which direction."""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import NamedTuple

from ground_motions.units import column_units

GROUND, BASE, ISOLATOR = "ground", "base", "isolator"
AXES = ("x", "y")
ROTATION = "rotation"
_NAME = re.compile(
    r"(ground|base|isolator|floor[1-9]\d*)(?:_(x|y|rotation))?"
    r"_(acceleration|displacement)_(\w+)"
)
_UNITS = {
    ("acceleration", False): "m_s2",
    ("acceleration", True): "rad_s2",
    ("displacement", False): "m",
    ("displacement", True): "rad",
}


class Channel(NamedTuple):
    """A measured quantity of the ground or the building."""

    place: str  # ground, base, floor1, floor2, ... or isolator
    axis: str  # x, y or rotation; empty in a record of one direction
    quantity: str  # acceleration, or displacement of the isolators

    @property
    def name(self) -> str:
        """Column."""
        return f"{self.key}_{_UNITS[self.quantity, self.axis == ROTATION]}"

    @property
    def key(self) -> str:
        """Column without its unit, as the settings of an import name it."""
        axis = f"_{self.axis}" if self.axis else ""
        return f"{self.place}{axis}_{self.quantity}"

    @property
    def unit(self) -> str:
        """Unit to print."""
        return _UNITS[self.quantity, self.axis == ROTATION].replace("_", "/")

    @property
    def is_displacement(self) -> bool:
        """Whether it is the isolators' displacement."""
        return self.quantity == "displacement"

    @property
    def floor(self) -> int:
        """Number of the floor from below; 0 for the base."""
        return int(self.place.removeprefix("floor")) if self.place.startswith("floor") else 0

    @property
    def words(self) -> str:
        """Sensor in words, such as ``floor 3 x``."""
        place = f"floor {self.floor}" if self.floor else self.place
        return f"{place} {self.axis}" if self.axis else place


def channel(name: str) -> Channel | None:
    """Read a column's name in SI; None for any other name."""
    match = in_any_unit(name)
    return match[0] if match and match[0].name == name else None


def in_any_unit(name: str) -> tuple[Channel, float] | None:
    """Read a column's name, and what one of its unit is in SI; None for any other name."""
    match = _NAME.fullmatch(name)
    if match is None:
        return None
    result = Channel(match[1], match[2] or "", match[3])
    moved = result.is_displacement == (result.place == ISOLATOR)
    turned = (result.place, result.axis) == (GROUND, ROTATION)
    factor = accepted_units(result).get(match[4])
    return (result, factor) if factor and moved and not turned else None


def accepted_units(one: Channel) -> dict[str, float]:
    """Units as a column's name ends in them, and what one of each is in SI."""
    if one.axis == ROTATION:
        return {_UNITS[one.quantity, True]: 1.0}
    return column_units(one.quantity)


def required(axes: tuple[str, ...], given: Collection[str] = ()) -> tuple[Channel, ...]:
    """Channels that a record needs, whose directions are ``axes`` and whose keys are ``given``.

    One floor along each direction is needed: any that is given, else the first.
    """
    floors = {
        axis: next((f for key in sorted(given) if (f := _floor(key, axis))), "floor1")
        for axis in axes
    }
    return (
        *(Channel(place, axis, "acceleration") for place in (GROUND, BASE) for axis in axes),
        *(Channel(floors[axis], axis, "acceleration") for axis in axes),
        *(Channel(ISOLATOR, axis, "displacement") for axis in axes),
    )


def _floor(key: str, axis: str) -> str:
    """Floor whose acceleration along a direction a key names; empty if it names none."""
    place = key.split("_")[0]
    is_of_floor = place.startswith("floor") and key == Channel(place, axis, "acceleration").key
    return place if is_of_floor else ""


def order(name: str) -> tuple[float, str]:
    """Key that sorts channels: base, floors from below, displacement; x, y, rotation in each."""
    one = channel(name)
    assert one is not None
    axis = one.axis.replace(ROTATION, "z")
    return (float("inf") if one.is_displacement else one.floor), axis
