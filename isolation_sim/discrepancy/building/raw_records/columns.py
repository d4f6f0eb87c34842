"""Columns of raw files and the channels that they hold; settings that say so."""

from __future__ import annotations

import json
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from ....errors import InputError
from ....identification.raw_tests.channels import columns_named
from ....identification.raw_tests.raw_table import RawTable
from ....rendering import Printed, render
from ..channels import BASE, GROUND, ISOLATOR, ROTATION, Channel, required
from .settings import TIME, RecordSettings

MOST_SHOWN = 8
"""Columns that a line names at most."""
_OPEN_AXIS = re.compile(r"_(?:DIRECTION|\d+deg)_")
"""A direction that the settings do not name yet, in the key of a channel."""
_BARE = re.compile(r"[A-Za-z0-9_-]+")


class Column(NamedTuple):
    """A column of a file that holds a channel."""

    table: str  # Name of the table
    position: int  # Of the column, from 0
    heading: str
    unit: str
    factor: float  # From the unit to SI, with sign and scale
    channel: Channel | None  # None for the time and the current
    key: str  # time, current, or that of the channel, with " 2" for its second sensor
    scale: float = 1.0  # Beside the unit's factor
    at: tuple[float, float] | None = None  # Sensor's position in the plan, m


class OpenColumn(NamedTuple):
    """A column of which the settings must say more."""

    key: str  # Of the channel, with PLACE, DIRECTION or QUANTITY for what is not known
    table: str
    position: int
    unit: str  # "?" if it is not known


@dataclass(frozen=True, eq=False)
class Match(Printed):
    """What each column of the files is taken for."""

    tables: dict[str, RawTable]  # By name
    settings: RecordSettings  # Choices of the caller
    columns: tuple[Column, ...]  # Columns that are used
    unclear: tuple[InputError, ...]  # What must be said before the record can be imported
    unused: tuple[tuple[str, int, str], ...]  # Table, column and reason
    notes: tuple[str, ...]  # What was assumed
    # Columns of which the settings must say more
    open: tuple[OpenColumn, ...] = ()

    def raise_unclear(self) -> None:
        """Raise the first of the errors; the others are counted."""
        if self.unclear:
            first, more = self.unclear[0], len(self.unclear) - 1
            text = (
                f" (and {more} more that {'is' if more == 1 else 'are'} not clear)" if more else ""
            )
            raise InputError(first.place, first.given, f"{first.expected}{text}")

    def without_unused_tables(self) -> Match:
        """The match with the tables alone from which something is read."""
        used = {one.table for one in self.columns if one.key != TIME}
        idle = [name for name in self.tables if name not in used]
        names = ", ".join(dict.fromkeys(self.file_of(name) for name in idle))
        notes = (*self.notes, *([f"no channel is read from {names}"] if idle and used else []))
        columns = tuple(one for one in self.columns if one.table in used)
        return replace(self, columns=columns, notes=notes)

    def file_of(self, table: str) -> str:
        """Name by which the settings find a table."""
        path = self.tables[table].path
        alone = sum(one.path.name == path.name for one in self.tables.values()) == 1
        return path.name if alone else table

    def _shown(self) -> Iterator[Any]:
        rows = [
            (one.key, one.heading, one.unit or "s, none given", self.file_of(one.table))
            for one in self.columns
        ]
        headings = ("read as", "heading", "unit", "file")
        if rows:
            yield render("tables:TextTable", "Columns", headings, rows)
        yield from (f"not clear: {error}" for error in self.unclear)
        yield from (f"note: {note}" for note in self.all_notes())

    def all_notes(self) -> Iterator[str]:
        """Notes, and the columns that are not used with the reason."""
        yield from self.notes
        reasons = defaultdict(list)
        for table, index, reason in self.unused:
            reasons[reason].append(repr(self.tables[table].headings[index].text))
        for reason, texts in reasons.items():
            more = f" and {len(texts) - MOST_SHOWN} more" if len(texts) > MOST_SHOWN else ""
            yield f"not used, {reason}: {', '.join(texts[:MOST_SHOWN])}{more}"

    def template(self) -> str:
        """Settings with every column that is known, and lines to complete for the others."""
        lines = ["# Settings of an import: isolation-sim import FILES --settings THIS_FILE", ""]
        lines += _general(self.settings)
        lines += [
            "",
            "# sign = -1, scale = 1.02 and position_m = [0, 4.5] may be added to a channel;",
        ]
        lines += ["# [{ column = ... }, { column = ... }] are two sensors.", "[channels]"]
        sensors = defaultdict(list)
        for one in self.columns:
            if one.key != TIME or len(self.tables) == 1:
                sensors[one.key.split()[0]].append(self._entry(*one[:2], one.unit))
        entries = {
            key: each[0] if len(each) == 1 else f"[{', '.join(each)}]"
            for key, each in sensors.items()
        }
        time = self.settings.sensors.get(TIME)
        if time is not None and len(self.tables) > 1 and not time.is_none:
            parts = {"column": time.column, "unit": time.unit, "file": time.file}
            entries = {TIME: _inline({key: text for key, text in parts.items() if text})} | entries
        lines += [f"{key} = {entry}" for key, entry in entries.items()]
        lines += [f'{key} = "none"' for key, entry in self.settings.sensors.items()
                  if entry.is_none]  # fmt: skip
        lacking = lacking_channels(self.tables, self.columns, self.open, self.settings)
        lines += [f'{key} = {{ column = "?" }}' for key in lacking]
        if self.open:
            lines += ["", "# Remove the # of those that are needed, and complete them:"]
            lines += [f"# {one.key} = {self._entry(*one[1:])}" for one in self.open]
        return "\n".join([*lines, ""])

    def _entry(self, table: str, index: int, unit: str) -> str:
        headings = self.tables[table].headings
        text = headings[index].text
        column: str | int = text if len(columns_named(text, headings)) == 1 else index + 1
        parts: dict[str, Any] = {"column": column, "unit": unit}
        if len(self.tables) > 1:
            parts["file"] = self.file_of(table)
        for one in self.columns:
            if one[:2] == (table, index):
                parts |= {"scale": one.scale} if one.scale != 1 else {}
                parts |= {"position_m": list(one.at)} if one.at is not None else {}
        return _inline({key: value for key, value in parts.items() if value != ""})


def places_of(tables: Iterable[RawTable]) -> str:
    """Files of an error: one or two by name, more by their number."""
    places = list(dict.fromkeys(table.place for table in tables))
    return " and ".join(places) if len(places) < 3 else f"{places[0]} and {len(places) - 1} more"


def lacking_channels(
    tables: Mapping[str, RawTable],
    columns: Sequence[Column],
    open_columns: Sequence[OpenColumn],
    settings: RecordSettings,
) -> list[str]:
    """Keys of required channels that no column is taken for, nor may be one that is not clear."""
    axes = sorted({one.channel.axis for one in columns if one.channel} - {"", ROTATION})
    keys = {one.key for one in columns}
    open_keys = {one.key.replace("floorN", "floor1") for one in open_columns}
    # where no direction is known yet, the channels have none
    keys |= open_keys if axes else {_OPEN_AXIS.sub("_", key) for key in open_keys}
    for axis in (*axes, ""):
        ground, base, isolator = (
            Channel(place, axis, "displacement").key for place in (GROUND, BASE, ISOLATOR)
        )
        keys |= {isolator} if {ground, base} <= keys else set()
    needed = [one.key for one in required(tuple(axes) or ("",), keys)]
    without_time = [TIME] if _without_time(tables, columns, settings) else []
    return [*without_time, *(key for key in needed if key not in keys)]


def _without_time(
    tables: Mapping[str, RawTable], columns: Sequence[Column], settings: RecordSettings
) -> bool:
    """Whether a table with channels, or any table without them, has neither times nor a rate."""
    timed = {one.table for one in columns if one.key == TIME}
    used = {one.table for one in columns if one.key != TIME} or set(tables)
    rated = {name for name in used if settings.rate_Hz is not None or tables[name].rate is not None}
    return not used <= timed | rated


def _general(settings: RecordSettings) -> list[str]:
    """Lines of a template for what is no channel; those that are not given are comments."""
    lines = []
    given = settings.model_dump(exclude={"channels"})
    if settings.filter is not None:
        given["filter"] = settings.filter.model_dump(exclude_defaults=True)
    for key, value in given.items():
        field = RecordSettings.model_fields[key]
        shown = value or (field.examples or [])[0]
        text = _inline(shown) if isinstance(shown, Mapping) else _toml(shown)
        lines.append(f"{'' if value else '# '}{key} = {text}  # {field.description}")
    return lines


def _inline(values: Mapping[str, Any]) -> str:
    """An inline table of TOML."""
    keys = (key if _BARE.fullmatch(key) else _toml(key) for key in values)
    texts = (f"{key} = {_toml(value)}" for key, value in zip(keys, values.values(), strict=True))
    return f"{{ {', '.join(texts)} }}"


def _toml(value: Any) -> str:
    """A text or a number as TOML, which writes both as JSON does."""
    return json.dumps(value, ensure_ascii=False)
