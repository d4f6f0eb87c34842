"""Columns that settings, headings and names of files take for channels."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from ground_motions.units import UNITS

from ....errors import InputError
from ....identification.raw_tests.channels import Heading, columns_named, find_channels, listed
from ....identification.raw_tests.raw_table import RawTable
from ..channels import AXES, ROTATION, Channel
from .columns import Column, OpenColumn
from .headings import (
    ROOF,
    SENSOR_QUANTITIES,
    VERTICAL,
    Reading,
    quantity_of,
    read_heading,
    read_name,
    sensor_factor,
    sensor_units,
)
from .settings import ABSENT, CURRENT, TIME, Entry, RecordSettings, channel_of, sensor_key


class Sensor(NamedTuple):
    """A column that a heading or the settings take for a channel."""

    table: str
    position: int
    heading: Heading
    channel: Channel  # Its axis may be another word for a direction, its place roof
    unit: str
    scale: float
    relative: bool
    prescribed: bool  # Whether by the settings
    number: int = 1  # Of several sensors of the channel that the settings name, from 1
    at: tuple[float, float] | None = None  # In the plan, m

    @property
    def key(self) -> str:
        """Key of the channel, and the sensor's number from 2."""
        return sensor_key(self.channel.key, self.number)


def columns_of_settings(
    tables: Mapping[str, RawTable], settings: RecordSettings
) -> list[tuple[str, int, str]]:
    """Table, column and key of each channel that the settings name."""
    result: list[tuple[str, int, str]] = []
    for key, entry in settings.sensors.items():
        if entry.is_none or key == TIME:
            continue
        place = f"{settings.place}, channels.{key}"
        within = _tables_of(entry.file, tables) if entry.file else list(tables)
        if not within:
            raise InputError(f"{place}.file", repr(entry.file), f"one of {', '.join(tables)}")
        matches = {
            name: ks
            for name in within
            if (ks := columns_named(entry.column, tables[name].headings))
        }
        if len(matches) > 1:
            files = ", ".join(matches)
            raise InputError(
                place, f"{entry.column!r}, a column of {files}", f'file = "{min(matches)}"'
            )
        (table, ks), *_ = matches.items() if matches else ((within[0], []),)
        if len(ks) != 1:
            headings = [heading for name in within for heading in tables[name].headings]
            choice = f"{entry.column!r}{', which is there twice' if ks else ''}"
            raise InputError(place, choice, f"one of {listed(headings)}, its number, or none")
        for other, k, earlier in result:
            if (other, k) == (table, ks[0]):
                raise InputError(
                    place, repr(entry.column), f"another column than that of {earlier}"
                )
        result.append((table, ks[0], key))
    return result


def find_times_and_currents(
    tables: Mapping[str, RawTable],
    settings: RecordSettings,
    prescribed: Sequence[tuple[str, int, str]],
) -> Iterator[Column]:
    """Column of time in each table, and of the current in one of them."""
    _check_time(tables, settings)
    currents = []
    for name, table in tables.items():
        taken = {k for other, k, key in prescribed if other == name and key != CURRENT}
        usable = [table.usable(k) and k not in taken for k in range(len(table.headings))]
        chosen = dict.fromkeys(UNITS, "none")
        for key in (TIME, CURRENT):
            entry = settings.sensors.get(key, ABSENT)
            elsewhere = entry.file and name not in _tables_of(entry.file, tables)
            there = entry.is_none or columns_named(entry.column, table.headings)
            if key == CURRENT and entry.column and (elsewhere or not there):
                continue
            if entry.column and not elsewhere and (there or len(tables) == 1):
                chosen[key] = entry.column
            else:
                del chosen[key]
        units = {
            key: unit for key in (TIME, CURRENT)
            if (unit := settings.sensors.get(key, ABSENT).unit or settings.units.get(key, ""))
        }  # fmt: skip
        for key, one in find_channels(table.headings, usable, chosen, units, table.place).items():
            factor = one.factor * settings.sensors.get(key, ABSENT).factor
            column = Column(name, one.column, one.heading, one.unit, factor, None, key)
            if key == TIME:
                yield column
            else:
                currents.append(column)
    if len(currents) > 1:
        raise InputError(
            f"{tables[currents[0].table].place} and {tables[currents[1].table].place}",
            f"a current in both, {currents[0].heading!r} and {currents[1].heading!r}",
            'one of them: current = { column = "...", file = "..." } in the settings',
        )
    yield from currents


def _check_time(tables: Mapping[str, RawTable], settings: RecordSettings) -> None:
    """Refuse a column of time that no table has."""
    entry = settings.sensors.get(TIME, Entry(column="none"))
    place = f"{settings.place}, channels.{TIME}"
    within = _tables_of(entry.file, tables) if entry.file else list(tables)
    if not within:
        raise InputError(f"{place}.file", repr(entry.file), f"one of {', '.join(tables)}")
    if entry.is_none:
        return
    if not any(columns_named(entry.column, tables[name].headings) for name in within):
        headings = [heading for name in within for heading in tables[name].headings]
        raise InputError(place, repr(entry.column), f"one of {listed(headings)}, or none")


def sensor_of_settings(
    tables: Mapping[str, RawTable], settings: RecordSettings, table: str, k: int, key: str
) -> Sensor:
    """The sensor of a column that the settings name."""
    name, _, number = key.partition(" ")
    one = channel_of(name)
    assert one is not None
    heading = tables[table].headings[k]
    entry = settings.sensors[key]
    unit = entry.unit or _unit(settings, one, heading)
    place = f"{settings.place}, channels.{key}"
    if not tables[table].usable(k):
        raise InputError(
            f"{tables[table].place}, column {heading.text}", "no numbers", f"the {key}"
        )
    if entry.unit and sensor_factor(one, unit) is None:
        raise InputError(f"{place}.unit", repr(unit), sensor_units(one))
    return Sensor(
        table, k, heading, one, unit, entry.factor, False, True, int(number or 1), entry.at
    )


def guess_sensors(
    tables: Mapping[str, RawTable], settings: RecordSettings, taken: set[tuple[str, int]]
) -> tuple[list[Sensor], list[tuple[str, int, str]], list[OpenColumn]]:
    """Columns that headings and names of files take for sensors; the unused and open others."""
    sensors, unused, open_ = [], [], []
    for name, table in tables.items():
        words = settings.words
        readings = {
            k: read_heading(heading.text, heading.name, heading.unit, words)
            for k, heading in enumerate(table.headings)
            if table.usable(k) and (name, k) not in taken
        }
        # names of sheets, variables and files stand for what no heading of the table says
        outer = [read_name(table.part, words), read_name(table.path.stem, words)]
        readings = _complete(readings, outer, table.headings)
        for k, one in readings.items():
            heading = table.headings[k]
            other = quantity_of(heading.unit)
            if not one.measured:
                unused.append((name, k, "a set point by its name"))
            elif other and other not in SENSOR_QUANTITIES:
                unused.append((name, k, "of another quantity"))
            elif one.axis == VERTICAL:
                unused.append((name, k, "vertical"))
            elif one.quantity == "displacement" and one.place.startswith(("floor", ROOF)):
                unused.append((name, k, "a displacement above the base"))
            elif one.quantity and one.place:
                channel = Channel(one.place, one.axis, one.quantity)
                unit = _unit(settings, channel, heading)
                sensors.append(Sensor(name, k, heading, channel, unit, 1.0, one.relative, False))
            else:
                unused.append((name, k, "without a place and a quantity that are recognised"))
                axis = f"_{one.axis}" if one.axis in AXES else ""
                quantity = one.quantity or "QUANTITY"
                unit = heading.unit or settings.units.get(one.quantity, "?")
                key = f"{one.place or 'PLACE'}{axis}_{quantity}"
                open_.append(OpenColumn(key.replace(ROOF, "floorN"), name, k, unit))
    return sensors, unused, open_


def _tables_of(file: str, tables: Mapping[str, RawTable]) -> list[str]:
    """Tables of a file's name, or of a table's name."""
    return [name for name, table in tables.items() if file in (name, table.path.name)]


def _unit(settings: RecordSettings, one: Channel, heading: Heading) -> str:
    """Unit of a column: that of the settings goes before that of the heading."""
    general = "" if one.axis == ROTATION else settings.units.get(one.quantity, "")
    return settings.units.get(one.key) or general or heading.unit


def _complete(
    readings: dict[int, Reading], outer: Sequence[Reading], headings: Sequence[Heading]
) -> dict[int, Reading]:
    """Readings with the place and axis of the file where no heading of the table has any."""
    place = next((one.place for one in outer if one.place), "")
    axis = next((one.axis for one in outer if one.axis), "")
    quantity = next((one.quantity for one in outer if one.quantity), "")
    if any(one.place for one in readings.values()):
        place = ""
    if any(one.axis for one in readings.values()):
        axis = ""
    return {
        k: one._replace(
            place=one.place or place,
            axis=one.axis or axis,
            quantity=one.quantity or ("" if quantity_of(headings[k].unit) else quantity),
            relative=one.relative or (bool(place) and any(each.relative for each in outer)),
        )
        for k, one in readings.items()
    }
