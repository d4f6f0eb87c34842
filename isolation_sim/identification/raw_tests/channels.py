"""Headings of test files: which quantity a column holds, and in which unit."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from ground_motions.units import UNITS

from ...errors import InputError, unknown_name
from .rate import CLOCK_UNIT

NEEDED = ("time", "displacement", "force")
CHOSEN = (*NEEDED, "current")
"""Quantities for which a choice between two columns is asked for."""

_SAME = {
    "sec": "s", "secs": "s", "second": "s", "seconds": "s", "sek": "s", "sekunden": "s",
    "msec": "ms", "mikrometer": "um", "micron": "um", "inch": "in", "inches": "in", "lbs": "lbf",
    "kips": "kip", "amp": "A", "amps": "A", "ampere": "A", "degc": "C", "deg_c": "C", "deg": "C",
    "celsius": "C", "newton": "N", "newtons": "N", "kilonewton": "kN", "kilonewtons": "kN",
    "meter": "m", "meters": "m", "millimeter": "mm", "millimeters": "mm", "amperes": "A",
    CLOCK_UNIT: "s", "mm_s": "mm/s", "m_s": "m/s", "cm_s": "cm/s", "in_s": "in/s", "m_s2": "m/s2",
    "mm_s2": "mm/s2", "cm_s2": "cm/s2",
}  # fmt: skip
_SPELLINGS = {"²": "2", "^": "", "°": "deg", "µ": "u", "μ": "u", "/sec": "/s", " ": ""}
# "-1 kN" or "0.1667 A": what one in the file is
_MULTIPLE = re.compile(r"(?P<factor>[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?)\s*(?P<unit>\D.*)", re.I)
# "[mm]", "(mm)", "{mm}", "<mm>" at the end; what may stand before a unit without brackets
_BRACKETS = re.compile(r"(?P<name>.*?)\s*[\[({<]\s*(?P<unit>[^\[\](){}<>]*?)\s*[\])}>]\s*")
_QUOTES = re.compile(r"(?P<name>.*\S)\s*(?P<quote>[\"'])(?P<unit>[^\"']+)(?P=quote)\s*")
_BEFORE_UNIT = re.compile(r"\s+in\s+|\s*[,_/:]\s*|\s+")

# quantity -> whole words, and ends or beginnings of compound words
_WORDS = {
    "time": ({"time", "zeit"}, ("zeit",)),
    "displacement": (
        {"displacement", "displ", "disp", "position", "pos", "stroke", "lvdt", "extension", "weg",
         "hub", "verschiebung", "verformung", "deformation"}, ("weg", "verschiebung"),
    ),
    "force": (
        {"force", "load", "loadcell", "shear", "kraft", "last", "vertikallast", "axiallast",
         "normallast"}, ("kraft",),
    ),
    "current": ({"current", "curr", "strom"}, ("strom",)),
    "velocity": ({"velocity", "vel", "speed", "geschwindigkeit"}, ("geschwindigkeit",)),
    "acceleration": ({"acceleration", "accel", "acc", "beschleunigung"}, ("beschleunigung",)),
    "temperature": ({"temperature", "temp", "temperatur"}, ("temperatur",)),
}  # fmt: skip
_LETTERS = {"t": ("time", "temperature"), "x": ("displacement",), "f": ("force",),
            "i": ("current",), "v": ("velocity",)}  # fmt: skip
# such a column is used only if no other may have the quantity
_OTHER_DIRECTION = {"vertical", "vert", "vertikal", "axial", "normal", "normalkraft", "normallast"}
_OF_OTHER_DIRECTION = ("vertikal", "axial")  # beginnings of compound words
NOT_MEASURED = {
    "set", "setpoint", "command", "cmd", "demand", "target", "soll", "sollwert", "sollweg",
    "reference", "ref", "error", "max", "min", "peak", "mean", "pump", "motor",
}  # fmt: skip
_PARTS = re.compile(r"[A-ZÄÖÜ]?[a-zäöüß]+|[A-ZÄÖÜ]+(?![a-zäöüß])")


class Heading(NamedTuple):
    """Heading of a column."""

    text: str  # As in the file
    unit: str  # As in the file; empty if there is none
    quantities: tuple[str, ...]  # That the name may mean and the unit allows
    secondary: bool  # Whether the name is that of an axis that may not be the tested one
    name: str  # Without the unit


class Channel(NamedTuple):
    """A column that holds a quantity, or several sensors of it."""

    column: int  # From 0
    heading: str
    unit: str
    factor: float  # From the unit to SI
    others: tuple[Channel, ...] = ()  # Further sensors, which are added

    @property
    def columns(self) -> tuple[int, ...]:
        """Columns of all sensors."""
        return (self.column, *(one.column for one in self.others))


def unit_factor(quantity: str, unit: str) -> float | None:
    """What one of a unit is in SI; None if the quantity has no such unit."""
    known = UNITS[quantity]
    if unit in known:
        return known[unit]
    text = unit.strip().strip(".")
    for spelling, usual in _SPELLINGS.items():
        text = text.replace(spelling, usual)
    text = _SAME.get(text.lower(), text)
    # MN and mN differ by more than the case of a unit that is shouted
    same = [each for each in known if each.lower() == text.lower() and text.lower() != "mn"]
    return known.get(text) or (known[same[0]] if same else None)


def stated_factor(quantity: str, unit: str) -> float | None:
    """As ``unit_factor``, of a unit or a multiple of it that the caller gives."""
    multiple = _MULTIPLE.fullmatch(unit.strip())
    if multiple is None:
        return unit_factor(quantity, unit)
    one, factor = unit_factor(quantity, multiple["unit"]), float(multiple["factor"])
    return one * factor if one is not None and factor != 0 else None


def is_unit(text: str) -> bool:
    """Whether a cell, as of a row of units, is a unit of a quantity that is read."""
    bare = text.strip("[](){}<> ")
    return any(unit_factor(quantity, bare) is not None for quantity in UNITS)


def names_quantity(text: str) -> bool:
    """Whether a heading names a quantity that is read."""
    return bool(named_quantities(_split(text, "")[0]))


def heading_of(text: str, unit_below: str = "") -> Heading:
    """Read a heading, and the unit in the row below it."""
    name, unit = _split(text, unit_below)
    named = named_quantities(name)
    if _words(name) & NOT_MEASURED:
        return Heading(text, unit, (), False, name)
    fitting = tuple(q for q in named if not unit or unit_factor(q, unit) is not None)
    words = _words(name)
    secondary = words & _OTHER_DIRECTION or any(w.startswith(_OF_OTHER_DIRECTION) for w in words)
    return Heading(text, unit, fitting, bool(secondary), name)


def _words(name: str) -> set[str]:
    """Words of a heading's name."""
    return {word.lower() for word in _PARTS.findall(name)}


def find_channels(
    headings: Sequence[Heading],
    usable: Sequence[bool],
    columns: Mapping[str, str | Sequence[str]],
    units: Mapping[str, str],
    place: str,
) -> dict[str, Channel]:
    """Column of each quantity, chosen by the caller or recognised by name and unit.

    ``usable``: whether a column has numbers. ``columns``: headings or numbers by quantity, a list
    for several sensors; ``"none"`` for no column. ``units``: for columns whose heading has none,
    or a wrong one.
    """
    channels, unclear = {}, {}
    for quantity in UNITS:
        if quantity in columns:
            choices = columns[quantity]
            each = [choices] if isinstance(choices, str) else choices
            option = f"{place}, --column {quantity}"
            ks = [_by_choice(choice, headings, option) for choice in each]
            if len(set(ks)) < len(ks) or (len(ks) > 1 and None in ks):
                raise InputError(option, ", ".join(map(repr, each)), "different columns")
        else:
            ks = [_recognised(quantity, headings, usable, units, place)]
        sensors = []
        for k in ks:
            if k is None:
                continue
            # times are in s unless their heading says otherwise; slow ones are asked for
            stated = units.get(quantity, "")
            unit = stated or headings[k].unit or ("s" if quantity == "time" else "")
            factor = (stated_factor if stated else unit_factor)(quantity, unit)
            if factor is None:
                unclear[quantity] = headings[k].text
                continue
            # forces add; of any other quantity several sensors show the mean
            share = 1.0 if quantity == "force" else 1 / len(ks)
            shown = stated or headings[k].unit
            sensors.append(Channel(k, headings[k].text, shown, share * factor))
        if sensors:
            channels[quantity] = sensors[0]._replace(others=tuple(sensors[1:]))
    if unclear:
        texts = ", ".join(f"{text!r} ({quantity})" for quantity, text in unclear.items())
        options = (f"--unit {quantity}=UNIT ({', '.join(UNITS[quantity])})" for quantity in unclear)
        raise InputError(place, f"columns without a known unit, {texts}", ", ".join(options))
    return channels


def check_choices(columns: Mapping[str, Any], units: Mapping[str, str]) -> None:
    """Refuse unknown quantities and units of the caller."""
    of_columns, of_units = ([key.rpartition(":")[2] for key in keys] for keys in (columns, units))
    for option, quantities in (("--column", of_columns), ("--unit", of_units)):
        for quantity in quantities:
            if quantity not in UNITS:
                raise unknown_name(f"quantity of {option}", quantity, UNITS)
    for quantity, unit in zip(of_units, units.values(), strict=True):
        if stated_factor(quantity, unit) is None:
            usual = ", ".join(UNITS[quantity])
            multiple = f"'-0.5 {next(iter(UNITS[quantity]))}'"
            raise InputError(
                f"--unit {quantity}", repr(unit), f"{usual}, or a multiple such as {multiple}"
            )


def columns_named(choice: str, headings: Sequence[Heading]) -> list[int]:
    """Columns of a heading, of a heading's name without the unit, or of a number from 1."""
    name = choice.strip().lower()
    several: list[int] = []
    for texts in (
        [heading.text for heading in headings],
        [_split(heading.text, "")[0] for heading in headings],
        [str(k) for k in range(1, len(headings) + 1)],
    ):
        matches = [k for k, text in enumerate(texts) if text.strip().lower() == name]
        if len(matches) == 1:
            return matches
        several = several or matches
    return several


def listed(headings: Sequence[Heading]) -> str:
    """Headings as an error names them."""
    return ", ".join(repr(heading.text) for heading in headings)


def _split(text: str, unit_below: str) -> tuple[str, str]:
    """Name and unit of a heading; a unit without brackets must be a known one."""
    brackets = _BRACKETS.fullmatch(text)
    if brackets:
        return brackets["name"], brackets["unit"]
    quotes = _QUOTES.fullmatch(text)
    if quotes and is_unit(quotes["unit"].strip()):
        return quotes["name"].rstrip(" ,_/:"), quotes["unit"].strip()
    if unit_below.strip("[](){}<> -"):
        return text, unit_below.strip("[](){}<> ")
    for before in _BEFORE_UNIT.finditer(text):
        name, unit = text[: before.start()], text[before.end() :]
        if "/" in unit and is_unit(unit.split("/")[0]):
            return name, unit  # such as N/mm
        # "Sensor A" has no unit, "Current A" and "Sensor 3, A" have
        alone = len(unit) == 1 and "," not in before.group()
        one = alone and not any(unit_factor(q, unit) for q in named_quantities(name))
        if name and is_unit(unit) and not one:
            return name, unit
    # "Amps" or "mm" for a name; a letter may be one
    return text, text.strip() if len(text.strip()) > 1 and is_unit(text) else ""


def named_quantities(name: str) -> tuple[str, ...]:
    """Quantities that a name may mean."""
    words = [word.lower() for word in _PARTS.findall(name)]
    if len(words) == 1 and words[0] in _LETTERS:
        return _LETTERS[words[0]]
    return tuple(
        quantity
        for quantity, (whole, parts) in _WORDS.items()
        if any(w in whole or w.startswith(parts) or w.endswith(parts) for w in words)
    )


def _by_choice(choice: str, headings: Sequence[Heading], place: str) -> int | None:
    """Column that the caller names; None for ``"none"``."""
    if choice.lower() == "none":
        return None
    matches = columns_named(choice, headings)
    if len(matches) != 1:
        expected = f"one of {listed(headings)}, its number, or none"
        some = "--column 'PATTERN:QUANTITY=HEADING' for some tests"
        raise InputError(place, repr(choice), f"{expected}; or {some}")
    return matches[0]


def _recognised(
    quantity: str,
    headings: Sequence[Heading],
    usable: Sequence[bool],
    units: Mapping[str, str],
    place: str,
) -> int | None:
    named = [
        k for k, heading in enumerate(headings) if usable[k] and quantity in heading.quantities
        and (heading.unit or quantity in units or quantity in CHOSEN)
    ]  # fmt: skip
    first = [k for k in named if not headings[k].secondary]
    # a unit tells if no name does
    alone = [
        k for k, heading in enumerate(headings) if usable[k] and quantity in CHOSEN
        and heading.unit and not named_quantities(heading.name)
        and not _words(heading.name) & NOT_MEASURED
        and unit_factor(quantity, heading.unit) is not None
    ]  # fmt: skip
    candidates = first or [*dict.fromkeys([*named, *alone])]
    if len(candidates) > 1 and quantity in CHOSEN:
        texts = [headings[k].text for k in candidates]
        raise InputError(
            place,
            f"{len(candidates)} columns for the {quantity}, "
            f"{listed([headings[k] for k in candidates])}",
            f'one of them, such as --column {quantity}="{texts[0]}"; or several, whose '
            f"{'sum' if quantity == 'force' else 'mean'} is read, the option for each",
        )
    return candidates[0] if len(candidates) == 1 else None
