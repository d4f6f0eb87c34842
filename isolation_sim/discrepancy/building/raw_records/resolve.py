"""Columns of raw files matched with the channels of a building record."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ....errors import InputError
from ....identification.raw_tests.channels import listed, unit_factor
from ....identification.raw_tests.raw_table import RawTable
from ..channels import AXES, BASE, GROUND, ISOLATOR, ROTATION, Channel
from .columns import MOST_SHOWN, Column, Match, OpenColumn, lacking_channels, places_of
from .guess import (
    Sensor,
    columns_of_settings,
    find_times_and_currents,
    guess_sensors,
    sensor_of_settings,
)
from .headings import ROOF, degrees, read_name, sensor_factor, sensor_units
from .settings import TIME, RecordSettings, channel_of

_ORDINAL = re.compile(r"\d(?:st|nd|rd|th)\b", re.IGNORECASE)


@dataclass
class Resolver:
    """Sensors become columns; what is not clear is collected."""

    tables: Mapping[str, RawTable]  # By name
    settings: RecordSettings  # Choices of the caller
    notes: list[str]  # What was assumed
    unused: list[tuple[str, int, str]]  # Table, column and reason
    open: list[OpenColumn]  # Columns of which the settings must say more
    unclear: list[InputError] = field(default_factory=list)  # What is not clear

    def resolve(self, sensors: Sequence[Sensor]) -> list[Column]:
        """Columns of all sensors that are clear."""
        sensors = self._drop_prescribed(sensors)
        sensors = self._number_roofs(sensors)
        sensors = self._drop_prescribed(self._choose_direction(sensors))
        sensors = self._adopt_lone_displacement(sensors)
        sensors = self._pair_displacements(sensors)
        sensors = self._refuse_duplicates(sensors)
        self._check_reference(sensors)
        self._note_floors_without_a_first(sensors)
        return [column for one in sensors if (column := self._make_column(one))]

    def check_complete(self, columns: Sequence[Column]) -> None:
        """Say which channels are lacking."""
        axes = [a for a in AXES if any(one.channel and one.channel.axis == a for one in columns)]
        lacking = lacking_channels(self.tables, columns, self.open, self.settings)
        if lacking:
            used = {(one.table, one.position) for one in columns}
            rest = [
                heading for name, table in self.tables.items()
                for k, heading in enumerate(table.headings) if (name, k) not in used
            ]  # fmt: skip
            shown = listed(rest[:MOST_SHOWN]) + (" ..." if len(rest) > MOST_SHOWN else "")
            columns_shown = f"{'further ' if used else ''}columns {shown or 'none'}"
            options = f"--column {lacking[0]}=HEADING (or its number), or [channels] in --settings"
            if lacking[0] == TIME:
                options += ", or --rate 200 (samples per second) without a time"
            if len(axes) == 2:
                options += f', or direction = "{axes[0]}" for one of the directions'
            self.unclear.append(
                InputError(
                    places_of(self.tables.values()),
                    f"{columns_shown}; not recognised: {', '.join(lacking)}",
                    options,
                )
            )

    def _add(self, one: Sensor | None, place: str, given: str, expected: str) -> None:
        self.unclear.append(InputError(place, given, expected))
        if one is not None:
            self._open(one)

    def _open(self, one: Sensor, axis: str | None = None) -> None:
        """Offer a sensor in the template."""
        key = one.channel._replace(axis=one.channel.axis if axis is None else axis).key
        unit = one.unit or "?"
        self.open.append(OpenColumn(key.replace(ROOF, "floorN"), one.table, one.position, unit))

    def _place(self, *sensors: Sensor) -> str:
        return " and ".join(dict.fromkeys(self.tables[one.table].place for one in sensors))

    def _drop_prescribed(self, sensors: Sequence[Sensor]) -> list[Sensor]:
        """Leave out guesses of channels that the settings give or exclude."""
        result = []
        for one in sensors:
            if not one.prescribed and one.channel.key in self.settings.sensors:
                none = self.settings.sensors[one.channel.key].is_none
                reason = "as the settings say" if none else f"another column is {one.channel.key}"
                self.unused.append((one.table, one.position, reason))
            else:
                result.append(one)
        return result

    def _number_roofs(self, sensors: Sequence[Sensor]) -> list[Sensor]:
        """Give a roof the number of the last floor."""
        result = []
        for one in sensors:
            if one.channel.place != ROOF:
                result.append(one)
            elif self.settings.floors is not None:
                place = f"floor{self.settings.floors}"
                result.append(one._replace(channel=one.channel._replace(place=place)))
            else:
                axis = f"_{one.channel.axis}" if one.channel.axis in AXES else ""
                self._add(
                    one, f"{self._place(one)}, column {one.heading.text!r}",
                    "a roof of a building whose number of floors is not known",
                    f"floors = 5 in the settings, or --column floor5{axis}_acceleration="
                    f'"{one.heading.text}"',
                )  # fmt: skip
        return result

    def _choose_direction(self, sensors: Sequence[Sensor]) -> list[Sensor]:
        """Choose the direction that is asked for; drop the name of a single one."""
        direction = read_name(self.settings.direction).axis or self.settings.direction.lower()
        sensors = self._align_azimuths(sensors, direction)
        if direction:
            other = [one for one in sensors if one.channel.axis not in ("", direction)]
            self.unused += [(one.table, one.position, "of another direction") for one in other]
            sensors = [one for one in sensors if one not in other]
        axes = {one.channel.axis for one in sensors} - {"", ROTATION}
        if len(axes) <= 1:
            if axes and not direction:
                self.notes.append(f"all along {axes.copy().pop()}: a record of one direction")
            turned = [one for one in sensors if one.channel.axis == ROTATION]
            self.unused += [(one.table, one.position, "a rotation") for one in turned]
            return [
                one._replace(channel=one.channel._replace(axis=""))
                for one in sensors
                if one not in turned
            ]
        if axes != set(AXES):
            words = sorted(axes)
            some = [one for one in sensors if one.channel.axis in axes]
            self._add(
                None, self._place(*some), f"directions {', '.join(words)}",
                f'directions = {{ x = "{words[0].upper()}", y = "{words[1].upper()}" }} or '
                f'direction = "{words[0].upper()}" in the settings',
            )  # fmt: skip
            for one in some:
                self._open(one, "DIRECTION")
            return [one for one in sensors if one not in some]
        return self._refuse_without_axis(sensors)

    def _align_azimuths(self, sensors: Sequence[Sensor], direction: str) -> list[Sensor]:
        """Read azimuths opposite to another one along it, with the other sign."""
        named = {
            azimuth: axis
            for word, axis in self.settings.words.items()
            if (azimuth := degrees(word)) is not None
        }
        found = [degrees(one.channel.axis) for one in sensors]
        counts = Counter(azimuth for azimuth in found if azimuth is not None)
        axes = {a: one.channel.axis for a, one in zip(found, sensors, strict=True)} | named
        result = []
        for one, azimuth in zip(sensors, found, strict=True):
            if azimuth is None:
                result.append(one)
                continue
            opposite = (azimuth + 180) % 360
            ranks = [
                (each in named, each == degrees(direction), counts[each], -each)
                for each in (azimuth, opposite)
            ]
            turned = (opposite in counts or opposite in named) and ranks[1] > ranks[0]
            axis = axes[opposite if turned else azimuth]
            if turned:
                self.notes.append(
                    f"{one.heading.text!r} is read with the sign -1: its azimuth is opposite to "
                    f"{opposite} degrees"
                )
            scale = -one.scale if turned else one.scale
            result.append(one._replace(channel=one.channel._replace(axis=axis), scale=scale))
        return result

    def _refuse_without_axis(self, sensors: Sequence[Sensor]) -> list[Sensor]:
        """Refuse sensors without a direction beside those of x and y."""
        result = []
        for one in sensors:
            if one.channel.axis:
                result.append(one)
                continue
            key = one.channel._replace(axis="x").key
            self._add(
                one, f"{self._place(one)}, column {one.heading.text!r}",
                "no direction, beside columns along x and y",
                f'--column {key}="{one.heading.text}", or --column {one.channel.key}=none',
            )  # fmt: skip
        return result

    def _adopt_lone_displacement(self, sensors: Sequence[Sensor]) -> list[Sensor]:
        """Take the only displacement of a record of one direction for that of the isolators."""
        axes = {one.channel.axis for one in sensors}
        there = any(one.channel.is_displacement for one in sensors)
        # x may be the name of the displacement
        names = ("PLACE_displacement", "PLACE_x_displacement")
        alone = [one for one in self.open if one.key in names]
        excluded = Channel(ISOLATOR, "", "displacement").key in self.settings.sensors
        if there or excluded or len(alone) != 1 or axes != {""}:
            return list(sensors)
        _, table, k, unit = alone[0]
        if unit_factor("displacement", unit) is None:
            return list(sensors)
        self.open.remove(alone[0])
        self.unused = [one for one in self.unused if one[:2] != (table, k)]
        heading = self.tables[table].headings[k]
        self.notes.append(f"{heading.text!r}, the only displacement, is taken for the isolators'")
        one = Channel(ISOLATOR, "", "displacement")
        return [*sensors, Sensor(table, k, heading, one, unit, 1.0, False, False)]

    def _pair_displacements(self, sensors: Sequence[Sensor]) -> list[Sensor]:
        """Leave out absolute displacements beside those of the isolators, or without a partner."""
        there = {one.channel for one in sensors}
        result = []
        for one in sensors:
            place = one.channel.place
            if not one.channel.is_displacement or place == ISOLATOR:
                result.append(one)
                continue
            partner = one.channel._replace(place=GROUND if place == BASE else BASE)
            isolator = one.channel._replace(place=ISOLATOR)
            if isolator in there and not one.prescribed:
                self.unused.append(
                    (one.table, one.position, "the isolators' displacement is there")
                )
            elif partner in there:
                result.append(one)
            elif place == GROUND:
                self.unused.append((one.table, one.position, "a displacement of the ground alone"))
            else:
                self._add(
                    one, f"{self._place(one)}, column {one.heading.text!r}",
                    "a displacement of the base without one of the ground",
                    f'--column {isolator.key}="{one.heading.text}" if it is relative to the '
                    f"ground, or --column {partner.key}=HEADING",
                )  # fmt: skip
        return result

    def _refuse_duplicates(self, sensors: Sequence[Sensor]) -> list[Sensor]:
        """Refuse two columns for a channel."""
        groups = defaultdict(list)
        for one in sensors:
            groups[one.channel].append(one)
        result = []
        for which, group in groups.items():
            if len(group) == 1 or all(one.prescribed for one in group):
                result += group
                continue
            texts = ", ".join(repr(one.heading.text) for one in group)
            same = len({one.heading.text for one in group}) < len(group)
            by_option = f'--column {which.key}="{group[0].heading.text}"'
            by_file = f'{which.key} = {{ column = "{group[0].heading.text}", file = "..." }}'
            self._add(
                None, self._place(*group), f"{len(group)} columns for {which.key}, {texts}",
                f"one of them, as {f'{by_file} in the settings' if same else by_option}, or the "
                "option for each, whose mean is read",
            )  # fmt: skip
            for one in group:
                self._open(one)
        return result

    def _check_reference(self, sensors: Sequence[Sensor]) -> None:
        """Ask about accelerations that are relative by their names."""
        relative = [
            one for one in sensors
            if one.relative and not one.channel.is_displacement and one.channel.place != GROUND
        ]  # fmt: skip
        if relative and self.settings.relative is None:
            headings = listed([one.heading for one in relative])
            self._add(
                None, self._place(*relative), f"relative accelerations by their names, {headings}",
                'accelerations = "relative" (to the ground) or "absolute" in the settings',
            )  # fmt: skip

    def _note_floors_without_a_first(self, sensors: Sequence[Sensor]) -> None:
        """Say how floors such as the 2nd one are counted, where none is the first."""
        numbers = {one.channel.floor for one in sensors if one.channel.floor}
        ordinal = [
            one for one in sensors if not one.prescribed and _ORDINAL.search(one.heading.text)
        ]
        if ordinal and 1 not in numbers:
            one = min(ordinal, key=lambda one: one.channel.floor)
            below = one.channel._replace(place=f"floor{one.channel.floor - 1}")
            self.notes.append(
                f"{one.heading.text!r} is read as floor {one.channel.floor} above the base; where "
                f"the base is the 1st floor, give each floor its own: --column "
                f'{below.key}="{one.heading.text}"'
            )

    def _make_column(self, one: Sensor) -> Column | None:
        """The column of a sensor; None if its unit is not clear."""
        place = f"{self._place(one)}, column {one.heading.text!r}"
        factor = sensor_factor(one.channel, one.unit) if one.unit else None
        key, quantity = one.channel.key, one.channel.quantity
        if factor is None:
            self._add(
                one, place, f"{f'the unit {one.unit!r}' if one.unit else 'no unit'} for {key}",
                f"--unit {key}=UNIT, --unit {quantity}=UNIT ({sensor_units(one.channel)})"
                + ("" if one.prescribed else f", or --column {key}=none"),
            )  # fmt: skip
            return None
        return Column(
            one.table,
            one.position,
            one.heading.text,
            one.unit,
            factor * one.scale,
            one.channel,
            one.key,
            one.scale,
            one.at,
        )


def match_columns(
    tables: dict[str, RawTable], settings: RecordSettings, notes: Sequence[str] = ()
) -> Match:
    """Find the column of each channel, by the settings, the headings and the names of files."""
    chosen = columns_of_settings(tables, settings)
    columns = [*find_times_and_currents(tables, settings, chosen)]
    taken = {(table, k) for table, k, _ in chosen} | {(one.table, one.position) for one in columns}
    sensors = [
        sensor_of_settings(tables, settings, *one)
        for one in chosen if channel_of(one[2].split()[0])
    ]  # fmt: skip
    guessed, unused, open_ = guess_sensors(tables, settings, taken)
    sensors += guessed
    resolver = Resolver(tables, settings, notes=list(notes), unused=unused, open=open_)
    columns += resolver.resolve(sensors)
    resolver.check_complete(columns)
    columns.sort(key=_order)
    return Match(
        tables, settings, tuple(columns), tuple(resolver.unclear), tuple(resolver.unused),
        tuple(resolver.notes), tuple(resolver.open),
    )  # fmt: skip


def _order(one: Column) -> tuple[Any, ...]:
    """Key that sorts columns: time, ground, base, floors from below, displacements, current."""
    if one.channel is None:
        return (0 if one.key == TIME else 3, 0, "", one.table)
    place = {GROUND: -1, BASE: 0, ISOLATOR: 1000}.get(one.channel.place, one.channel.floor)
    return (2 if one.channel.is_displacement else 1, place, one.channel.axis, one.table)
