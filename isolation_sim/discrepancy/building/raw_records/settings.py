"""Settings of an import: which column is which channel, and what is done with them."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ....errors import InputError, unknown_name
from ....io.files import read_toml
from ..channels import AXES, BASE, GROUND, ISOLATOR, ROTATION, Channel
from .headings import SENSOR_QUANTITIES

TIME, CURRENT = "time", "current"
_KEY = re.compile(
    r"(ground|base|isolator|floor[1-9]\d*)(?:_(x|y|rotation))?_(acceleration|displacement)"
)
_KEYS_EXPECTED = (
    "time, current, ground_acceleration, base_acceleration, floor1_acceleration, ..., "
    "isolator_displacement, or base_displacement and ground_displacement, each also with a "
    "direction, as base_x_acceleration"
)
_ENTRY_KEYS = ("column", "file", "unit", "sign", "scale", "position_m")


@dataclass(frozen=True)
class Entry:
    """The column of a channel."""

    column: str  # Its heading, or its number from 1; "none" for no column
    file: str = ""  # File or table; empty if the column is in one table only
    unit: str = ""  # Of the column; empty if its heading has one
    factor: float = 1.0  # Sign times scale
    position: tuple[float, float] | None = None  # In the plan, from the reference point, m


@dataclass(frozen=True)
class RecordSettings:
    """Choices of the caller; see `import_building_record`."""

    place: str = "settings"  # File, for errors
    # By key; the second sensor of a channel has the key and " 2"
    channels: dict[str, Entry] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)  # By key or quantity
    rate: float | None = None  # Of files without a column of time, Hz
    floors: int | None = None  # Number of floors above the base; the last one is the roof
    direction: str = ""  # The one that is imported of two
    directions: dict[str, str] = field(default_factory=dict)  # x or y by the word of the headings
    relative: bool | None = None  # Whether accelerations are relative to the ground
    offset: float | None = None  # Time from the start whose mean is subtracted, s
    resample: float | None = None  # Common rate of all files, Hz
    starts: dict[str, float] = field(default_factory=dict)  # Added to the times of a file, s


def read_settings(
    source: str | Path | Mapping[str, Any] | None,
    columns: Mapping[str, Sequence[str]],
    units: Mapping[str, str],
    rate: float | None,
) -> RecordSettings:
    """Read settings from a file or a mapping; ``columns``, ``units`` and ``rate`` go before."""
    if source is None or isinstance(source, Mapping):
        place, data = "settings", dict(source or {})
    else:
        place = str(source)
        data = read_toml(Path(source), "settings, such as --write-settings FILE writes")
    if set(data) - set(READERS):
        raise unknown_name(f"key in {place},", min(set(data) - set(READERS)), READERS)
    read = {
        name: reader(data[key], f"{place}, {key}")
        for key, (name, reader) in READERS.items()
        if key in data
    }
    for key in columns:
        check_key(key, "--column")
    channels = {k: e for k, e in read.pop("channels", {}).items() if k.split()[0] not in columns}
    for key, texts in columns.items():
        channels |= _of_sensors(key, [Entry(text) for text in texts], "--column")
    every_unit = {**read.pop("units", {}), **units}
    for key in units:
        check_unit_key(key, "--unit")
    if rate is not None:
        read["rate"] = _positive(rate, "--rate")
    return RecordSettings(place, channels=channels, units=every_unit, **read)


def channel_of(key: str) -> Channel | None:
    """The channel of a key; None for any other text."""
    match = _KEY.fullmatch(key)
    if match is None:
        return None
    channel = Channel(match[1], match[2] or "", match[3])
    if channel.is_displacement:
        turned = channel.axis == ROTATION
        known = channel.place == ISOLATOR or (channel.place in (GROUND, BASE) and not turned)
    else:
        known = channel.place != ISOLATOR and channel[:2] != (GROUND, ROTATION)
    return channel if known else None


def sensor_key(key: str, number: int) -> str:
    """Key of a sensor of a channel, from 1."""
    return key if number == 1 else f"{key} {number}"


def _of_sensors(key: str, entries: Sequence[Entry], place: str) -> dict[str, Entry]:
    """Entries of a channel by the keys of its sensors."""
    if len(entries) > 1:
        texts = ", ".join(repr(entry.column) for entry in entries)
        if key in (TIME, CURRENT):
            raise InputError(f"{place} {key}", texts, "one column")
        if any(entry.column.lower() == "none" for entry in entries):
            raise InputError(f"{place} {key}", texts, "columns, or none alone")
    return {sensor_key(key, k): entry for k, entry in enumerate(entries, 1)}


def check_key(key: str, place: str) -> None:
    """Refuse a key that is no channel."""
    if key not in (TIME, CURRENT) and channel_of(key) is None:
        raise InputError(place, repr(key), _KEYS_EXPECTED)


def check_unit_key(key: str, place: str) -> None:
    """Refuse a key that is neither a quantity nor a channel."""
    if key not in SENSOR_QUANTITIES and key not in (TIME, CURRENT) and channel_of(key) is None:
        raise InputError(place, repr(key), f"{', '.join(SENSOR_QUANTITIES)}, {_KEYS_EXPECTED}")


def _number(value: Any, place: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InputError(place, repr(value), "a number")
    return float(value)


def _positive(value: Any, place: str) -> float:
    number = _number(value, place)
    if number <= 0:
        raise InputError(place, f"{number:g}", "a positive number")
    return number


def _floors(value: Any, place: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise InputError(place, repr(value), "the number of floors above the base")
    return value


def _text(value: Any, place: str) -> str:
    if not isinstance(value, str) or not value.strip():
        raise InputError(place, repr(value), "text in quotes")
    return value.strip()


def _table(value: Any, place: str) -> dict[str, Any]:
    if not isinstance(value, Mapping):
        raise InputError(place, repr(value), "a table")
    return dict(value)


def _relative(value: Any, place: str) -> bool:
    if value not in ("absolute", "relative"):
        raise InputError(place, repr(value), '"absolute", or "relative" to the ground')
    return bool(value == "relative")


def _directions(value: Any, place: str) -> dict[str, str]:
    table = _table(value, place)
    if sorted(table) != ["x", "y"]:
        raise InputError(place, repr(table), '{ x = "EW", y = "NS" }, the words of the headings')
    return {_text(word, f"{place}.{axis}"): axis for axis, word in table.items()}


def _starts(value: Any, place: str) -> dict[str, float]:
    return {file: _number(time, f"{place}.{file}") for file, time in _table(value, place).items()}


def _units(value: Any, place: str) -> dict[str, str]:
    table = _table(value, place)
    for key in table:
        check_unit_key(key, place)
    return {key: _text(unit, f"{place}.{key}") for key, unit in table.items()}


def _channels(value: Any, place: str) -> dict[str, Entry]:
    result: dict[str, Entry] = {}
    for key, setting in _table(value, place).items():
        check_key(key, place)
        several = isinstance(setting, list)
        if setting == []:
            raise InputError(f"{place}.{key}", "[]", "a column, or several")
        entries = [
            _entry(one, key, f"{place}.{key}{f'[{k}]' if several else ''}")
            for k, one in enumerate(setting if several else [setting])
        ]
        result |= _of_sensors(key, entries, f"{place},")
    return result


def _entry(value: Any, key: str, place: str) -> Entry:
    data = dict(value) if isinstance(value, Mapping) else {"column": value}
    for each in data:
        if each not in _ENTRY_KEYS:
            raise unknown_name(f"key in {place},", each, _ENTRY_KEYS)
    column = data.get("column")
    if isinstance(column, bool) or not isinstance(column, int | str) or column in ("", "?"):
        raise InputError(f"{place}.column", repr(column), "a heading, its number, or none")
    sign = _number(data.get("sign", 1), f"{place}.sign")
    if abs(sign) != 1:
        raise InputError(f"{place}.sign", f"{sign:g}", "1 or -1; any other factor is a scale")
    unit = data.get("unit", "")
    if unit:
        _text(unit, f"{place}.unit")
    if unit == "?":
        raise InputError(f"{place}.unit", "'?'", "the unit of the column")
    file = data.get("file", "")
    if file:
        _text(file, f"{place}.file")
    scale = _number(data.get("scale", 1), f"{place}.scale")
    if scale == 0:
        raise InputError(f"{place}.scale", "0", "a number other than 0")
    at = _position(data["position_m"], key, place) if "position_m" in data else None
    return Entry(str(column), file, unit, sign * scale, at)


def _position(value: Any, key: str, place: str) -> tuple[float, float]:
    one, place = channel_of(key), f"{place}.position_m"
    if (
        one is None
        or one.axis not in AXES
        or one.place == GROUND
        or (one.place, one.quantity) == (BASE, "displacement")
    ):
        raise InputError(
            place, f"one of {key}",
            "that of an acceleration along x or y above the ground, or of the isolators' "
            "displacement",
        )  # fmt: skip
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise InputError(place, repr(value), "[x, y] in m, from the point of the structure's dofs")
    return _number(value[0], place), _number(value[1], place)


READERS: dict[str, tuple[str, Callable[[Any, str], Any]]] = {
    "channels": ("channels", _channels),
    "units": ("units", _units),
    "rate_Hz": ("rate", _positive),
    "floors": ("floors", _floors),
    "direction": ("direction", _text),
    "directions": ("directions", _directions),
    "accelerations": ("relative", _relative),
    "offset_s": ("offset", _positive),
    "resample_Hz": ("resample", _positive),
    "start_s": ("starts", _starts),
}
"""Field and reader by the key in the file."""
