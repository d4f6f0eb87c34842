"""Headings of loggers: where a sensor stands, its direction, and what it measures."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

from ground_motions.units import UNITS

from ....identification.raw_tests.channels import NOT_MEASURED, named_quantities, unit_factor
from ..channels import BASE, GROUND, ISOLATOR, ROTATION, Channel, in_any_unit

ROOF = "roof"
VERTICAL = "vertical"
SENSOR_QUANTITIES = ("acceleration", "displacement")
ROTATION_UNITS = {"acceleration": "rad/s2", "displacement": "rad"}

_PLACES = {
    GROUND: {
        "ground", "gnd", "table", "shaketable", "tisch", "rütteltisch", "platform", "foundation",
        "fundament", "boden", "freefield", "ag", "ug",
    },
    BASE: {"base", "slab", "basis", "basemat", "raft", "bodenplatte", "sohle", "ab", "ub"},
    ISOLATOR: {
        "isolator", "isolators", "isolation", "iso", "isol", "bearing", "bearings", "lager", "lrb",
    },
    ROOF: {"roof", "rooftop", "dach", "top"},
}  # fmt: skip
_FLOOR = r"(?:floor|flr|fl|level|lvl|storey|story|stockwerk|stock|etage|geschoss|og)"
_NUMBERED = (
    re.compile(rf"(?<![a-z]){_FLOOR}[\s_.#-]*0*(\d+)"),
    re.compile(rf"(?<![a-z\d])0*(\d+)(?:st|nd|rd|th|\.)[\s_.-]*{_FLOOR}(?![a-z])"),
    re.compile(r"(?<![a-z])f0*(\d+)(?!\d)"),
)
_BESIDE_ISOLATORS = re.compile(
    r"(?<![a-zäöü])(?:(above|over|oberhalb|über)|(below|under|beneath|underneath|unterhalb|unter))"
    r"\s+(?:of\s+)?(?:the\s+|der\s+|den\s+)?(?:base[\s-]+)?(?:isolat|bearing|lager|lrb)"
)
"""A place beside the isolators, whose displacement is not theirs."""
_FREE_FIELD = re.compile(r"free[\s_-]field")
_GROUND_FLOOR = re.compile(rf"(?<![a-z])(?:ground|gnd)[\s_.-]*{_FLOOR}(?![a-z])")
"""It may be the base or the first floor."""
_AXES = {
    "x": "x", "ax": "x", "dx": "x", "ux": "x", "y": "y", "ay": "y", "dy": "y", "uy": "y",
    "z": VERTICAL, "az": VERTICAL, "uz": VERTICAL, "dz": VERTICAL, "ud": VERTICAL,
    "vertical": VERTICAL, "vert": VERTICAL, "vertikal": VERTICAL, "up": VERTICAL,
    "rotation": ROTATION, "rot": ROTATION, "torsion": ROTATION, "yaw": ROTATION, "rz": ROTATION,
    "ew": "ew", "we": "ew", "ns": "ns", "sn": "ns", "long": "long", "longitudinal": "long",
    "längs": "long", "trans": "trans", "transverse": "trans", "lateral": "trans", "quer": "trans",
}  # fmt: skip
_COMPASS = re.compile(r"(?<![a-z])(?:(e)-?(w)|(n)-?(s))(?![a-z])", re.IGNORECASE)
_AZIMUTH = re.compile(r"(?<![\d.])0*(\d{1,3})\s*deg(?![a-z])", re.IGNORECASE)
"""Such as ``90 Deg`` of CSMIP and COSMOS."""
_RELATIVE = {"rel", "relative", "relativ"}
_LETTERS = {
    **dict.fromkeys(("a", "ag", "ab", "ax", "ay", "az"), "acceleration"),
    **dict.fromkeys(("d", "dx", "dy", "u", "ux", "uy", "laser", "temposonic"), "displacement"),
}
_WORD = re.compile(r"[A-ZÄÖÜ]?[a-zäöüß]+|[A-ZÄÖÜ]+(?![a-zäöüß])")


class Reading(NamedTuple):
    """What a name or a heading says about a sensor; empty texts where it says nothing."""

    place: str  # ground, base, isolator, roof, or floor and its number
    axis: str  # x, y, rotation or vertical, or another word for a direction, such as ew
    quantity: str  # acceleration or displacement, by the unit or by the name
    relative: bool  # Whether it is called relative
    measured: bool  # Whether it is no set point


def read_name(name: str, directions: Mapping[str, str] | None = None) -> Reading:
    """Read a name without a unit. ``directions``: further words for x and y."""
    plain = _COMPASS.sub(lambda match: "".join(filter(None, match.groups())), name)
    words = [_without_axis(word.lower()) for word in _WORD.findall(plain)]
    parts = [part for word in words for part in word]
    relative = bool(_RELATIVE & set(parts))
    named = [quantity for quantity in named_quantities(name) if quantity in SENSOR_QUANTITIES]
    named += [_LETTERS[part] for part in parts if part in _LETTERS]
    quantity = named[0] if len(set(named)) == 1 else ""
    own = {word.lower(): axis for word, axis in (directions or {}).items()}
    tokens = re.findall(r"\w+", name.lower().replace("_", " "))
    azimuths = _azimuth(name)
    own |= {azimuth: axis for word, axis in own.items() for azimuth in _azimuth(word)}
    axes = {own[token] for token in [*parts, *tokens, *azimuths] if token in own}
    axes = axes or {_AXES[part] for part in parts if part in _AXES} or set(azimuths)
    place = _place(plain.lower(), set(parts), relative, quantity)
    measured = not set(parts) & NOT_MEASURED
    return Reading(place, axes.pop() if len(axes) == 1 else "", quantity, relative, measured)


def _azimuth(word: str) -> list[str]:
    """An azimuth as an axis is called: 90deg of ``90 Deg``."""
    return [f"{number}deg" for number in _AZIMUTH.findall(word)]


def degrees(word: str) -> int | None:
    """The azimuth in a word or a heading, 0 to 359; None without one."""
    found = _AZIMUTH.findall(word)
    return int(found[0]) % 360 if len(found) == 1 else None


def read_heading(
    text: str, name: str, unit: str, directions: Mapping[str, str] | None = None
) -> Reading:
    """Read a heading, whose name is without its unit; the unit decides over the name."""
    known = in_any_unit(text)
    if known:
        place, axis, quantity = known[0]
        return Reading(place, axis, quantity, False, True)
    reading = read_name(name, directions)
    by_unit = quantity_of(unit)
    if by_unit in SENSOR_QUANTITIES:
        axis = ROTATION if unit.lower().startswith("rad") else reading.axis
        place = _place(name.lower(), _parts(name), reading.relative, by_unit)
        return reading._replace(quantity=by_unit, axis=axis, place=place)
    # a unit of another quantity, such as kN, or none that is known, such as V
    return reading._replace(quantity="") if by_unit else reading


def quantity_of(unit: str) -> str:
    """The quantity that has a unit; empty if none has."""
    if not unit:
        return ""
    for quantity in (*SENSOR_QUANTITIES, *UNITS):
        if unit_factor(quantity, unit) is not None:
            return quantity
    return next((q for q in SENSOR_QUANTITIES if _is_rotation_unit(q, unit)), "")


def sensor_factor(channel: Channel, unit: str) -> float | None:
    """What one of a unit is in SI; None if the channel's quantity has no such unit."""
    if channel.axis == ROTATION:
        return 1.0 if _is_rotation_unit(channel.quantity, unit) else None
    return unit_factor(channel.quantity, unit)


def sensor_units(channel: Channel) -> str:
    """Units of a channel, as an error lists them."""
    if channel.axis == ROTATION:
        return ROTATION_UNITS[channel.quantity]
    return ", ".join(UNITS[channel.quantity])


def _is_rotation_unit(quantity: str, unit: str) -> bool:
    bare = unit.lower().replace("²", "2").replace("^", "").replace("_", "/").replace(" ", "")
    return bare == ROTATION_UNITS[quantity]


def _parts(name: str) -> set[str]:
    return {part for word in _WORD.findall(name) for part in _without_axis(word.lower())}


def _without_axis(word: str) -> list[str]:
    """A word, and the direction at its end, as in ``basex``."""
    stem, last = word[:-1], word[-1]
    if last in "xyz" and any(stem in words for words in _PLACES.values()):
        return [stem, last]
    return [word]


def _place(name: str, parts: set[str], relative: bool, quantity: str) -> str:
    """The place that a name in small letters says."""
    name = _AZIMUTH.sub(" ", name)  # "1st floor 90 deg" is no floor 90
    for pattern in _NUMBERED:
        numbers = {int(number) for number in pattern.findall(name)}
        if len(numbers) == 1:
            return f"floor{number}" if (number := numbers.pop()) else BASE
    joined = {"freefield"} if _FREE_FIELD.search(name) else set()
    named = [place for place, words in _PLACES.items() if (parts | joined) & words]
    beside = _BESIDE_ISOLATORS.search(name)
    if beside and ROOF not in named:
        # a foundation above the isolators is the base
        named = [BASE if beside[1] else GROUND]
    elif named == [GROUND] and _GROUND_FLOOR.search(name):
        return ""
    if ROOF in named:
        # of a slab, but neither the top of an isolator nor that of a table
        return ROOF if set(named) <= {ROOF, BASE} else ""
    if ISOLATOR in named:
        # "base isolation": of displacements that of the isolators
        others = [place for place in named if place != ISOLATOR]
        return (BASE if BASE in others else "") if quantity == "acceleration" else ISOLATOR
    if BASE in named and relative and quantity == "displacement":
        return ISOLATOR
    return named[0] if len(named) == 1 else ""
