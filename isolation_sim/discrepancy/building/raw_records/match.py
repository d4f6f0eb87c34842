"""Columns of raw files matched with the channels of a building record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from ....identification.raw_tests.raw_table import RawTable
from ..channels import BASE, GROUND, ISOLATOR
from .columns import Column, Match
from .guess import columns_of_settings, find_times_and_currents, guess_sensors, sensor_of_settings
from .resolve import Resolver
from .settings import TIME, RecordSettings, channel_of


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


def drop_unused_tables(match: Match) -> Match:
    """The match with the tables alone from which something is read."""
    used = {one.table for one in match.columns if one.key != TIME}
    idle = [name for name in match.tables if name not in used]
    names = ", ".join(dict.fromkeys(match.file_of(name) for name in idle))
    notes = (*match.notes, *([f"no channel is read from {names}"] if idle and used else []))
    columns = tuple(one for one in match.columns if one.table in used)
    return replace(match, columns=columns, notes=notes)


def _order(one: Column) -> tuple[Any, ...]:
    """Key that sorts columns: time, ground, base, floors from below, displacements, current."""
    if one.channel is None:
        return (0 if one.key == TIME else 3, 0, "", one.table)
    place = {GROUND: -1, BASE: 0, ISOLATOR: 1000}.get(one.channel.place, one.channel.floor)
    return (2 if one.channel.is_displacement else 1, place, one.channel.axis, one.table)
