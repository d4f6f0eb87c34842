"""Channels of several files at common times, and what is computed from them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ground_motions.readers.lines import uniform_step

from ....errors import InputError
from ....identification.raw_tests.channels import Channel as RawChannel
from ....identification.raw_tests.files import notes_of
from ....identification.raw_tests.samples import samples_of
from ..channels import BASE, GROUND, ISOLATOR, ROTATION, Channel
from .columns import Match
from .sensors import Samples, combine_sensors
from .settings import CURRENT, TIME

_APART = 0.1
"""Distance of two files' samples, in steps, up to which they are taken as simultaneous."""
_QUIET = 0.3
"""Motion in the quiet part over that of the whole record, both RMS, up to which it is quiet."""


class _Part(NamedTuple):
    """Channels of one file."""

    place: str
    time: NDArray
    step: float
    timed: bool  # Whether the file, or the settings, say when it starts
    values: dict[str, NDArray]


def merge(match: Match) -> Samples:
    """Samples of all channels: of one file, or of several at common times."""
    parts, own = [], []
    for name in dict.fromkeys(one.table for one in match.columns):
        part, text = _part(match, name)
        parts.append(part)
        own += [(match.file_of(name), text)] if text else []
    notes = notes_of(own) if len(match.tables) > 1 else [text for _, text in own]
    _check_starts(match, parts)
    if match.settings.resample_Hz is not None:
        step, start, values = _resample(parts, 1 / match.settings.resample_Hz, notes)
    else:
        step, start, values = _align(parts, notes)
    samples = Samples(step, start, values, notes)
    _remove_offsets(match, samples)
    combine_sensors(match.columns, samples)
    for key, entry in match.settings.sensors.items():
        if entry.is_none:
            samples.values.pop(key, None)  # a rotation that is not wanted
    _make_absolute(match, samples)
    _subtract_ground(samples)
    return samples


def _part(match: Match, name: str) -> tuple[_Part, str]:
    """Channels of a table, and what was changed in it."""
    table, settings = match.tables[name], match.settings
    columns = [one for one in match.columns if one.table == name]
    channels = {c.key: RawChannel(c.position, c.heading, c.unit, c.factor) for c in columns}
    data, own = samples_of(table, channels, settings.rate_Hz)
    names = (name, table.path.name)
    shift = next((s for file, s in settings.start_s.items() if file in names), None)
    time = data.pop(TIME) + (shift or 0.0)
    step = uniform_step(time.tolist(), table.lines, f"{table.place}, time")
    part = _Part(table.place, time, step, TIME in channels or shift is not None, data)
    return part, "; ".join([*table.notes, *own])


def _check_starts(match: Match, parts: list[_Part]) -> None:
    """Refuse starts of unknown files, and files of which nothing says when they start."""
    for file in match.settings.start_s:
        known = [one for name, table in match.tables.items() for one in (name, table.path.name)]
        if file not in known:
            names = ", ".join(map(match.file_of, match.tables))
            raise InputError(f"{match.settings.place}, start_s", repr(file), f"one of {names}")
    lengths = {len(part.time) for part in parts}
    if len(lengths) > 1 and not all(part.timed for part in parts):
        first = parts[0]
        other = next(part for part in parts if len(part.time) != len(first.time))
        raise InputError(
            other.place,
            f"{len(other.time)} samples, where {first.place} has {len(first.time)}, and no time "
            "in one of them",
            'as many samples, or start_s = { "FILE" = 0.35, ... } (s) of both in the settings',
        )


def _align(parts: list[_Part], notes: list[str]) -> tuple[float, float, dict[str, NDArray]]:
    """Samples at the times that all files have."""
    first = parts[0]
    step = first.step
    option = "resample_Hz = {:.6g} in the settings, which brings all files to one rate"
    for part in parts[1:]:
        longest = max(len(part.time), len(first.time))
        if abs(part.step - step) * longest > _APART * step:
            raise InputError(
                part.place,
                f"{1 / part.step:.6g} samples per second, where {first.place} has {1 / step:.6g}",
                "one rate, or " + option.format(min(1 / part.step, 1 / step)),
            )
        shift = (part.time[0] - first.time[0]) / step
        if abs(shift - round(shift)) > _APART:
            raise InputError(
                part.place,
                f"samples {1e3 * step * abs(shift - round(shift)):.3g} ms beside those of "
                f"{first.place}",
                "the same times, or " + option.format(1 / step),
            )
    offsets = [round((part.time[0] - first.time[0]) / step) for part in parts]
    start = max(offsets)
    stop = min(k + len(part.time) for k, part in zip(offsets, parts, strict=True))
    _check_common(parts, stop - start)
    values = {
        key: array[start - k : stop - k]
        for k, part in zip(offsets, parts, strict=True)
        for key, array in part.values.items()
    }
    begin = float(first.time[0] + start * step)
    _note_cut(parts, begin, begin + (stop - start - 1) * step, step, notes)
    return step, begin, values


def _resample(
    parts: list[_Part], step: float, notes: list[str]
) -> tuple[float, float, dict[str, NDArray]]:
    """Samples of all files at one rate; what is above half of it is filtered out first."""
    from scipy.interpolate import CubicSpline
    from scipy.signal import butter, sosfiltfilt

    start = max(float(part.time[0]) for part in parts)
    end = min(float(part.time[-1]) for part in parts)
    count = int(np.floor((end - start) / step + 1e-6)) + 1
    _check_common(parts, count)
    grid = np.minimum(start + step * np.arange(count), end)
    values = {}
    for part in parts:
        coarser = step > part.step * (1 + 1e-6)
        low_pass = butter(8, 0.4 / step, fs=1 / part.step, output="sos") if coarser else None
        for key, array in part.values.items():
            if key == CURRENT:
                values[key] = np.interp(grid, part.time, array)
                continue
            smooth = array if low_pass is None else sosfiltfilt(low_pass, array)
            values[key] = CubicSpline(part.time, smooth)(grid)
        if coarser:
            notes.append(
                f"{part.place}: {1 / part.step:.6g} samples per second, low-pass filtered at "
                f"{0.4 / step:.4g} Hz and resampled to {1 / step:.6g}"
            )
        elif abs(part.step / step - 1) > 1e-6:
            notes.append(
                f"{part.place}: {1 / part.step:.6g} samples per second, interpolated to "
                f"{1 / step:.6g}"
            )
    _note_cut(parts, start, end, step, notes)
    return step, start, values


def _check_common(parts: list[_Part], count: int) -> None:
    if count < 2:
        spans = ", ".join(f"{p.place} {p.time[0]:.6g} to {p.time[-1]:.6g} s" for p in parts)
        raise InputError(f"files of different times: {spans}; expected: times that all files have")


def _note_cut(parts: list[_Part], start: float, end: float, step: float, notes: list[str]) -> None:
    """Say what is lost if some files begin before or end after the others."""
    first = min(float(part.time[0]) for part in parts)
    last = max(float(part.time[-1]) for part in parts)
    if start - first > 0.5 * step or last - end > 0.5 * step:
        notes.append(
            f"the files have times from {first:.6g} to {last:.6g} s; all of them from {start:.6g} "
            f"to {end:.6g} s, which are used"
        )


def _remove_offsets(match: Match, samples: Samples) -> None:
    """Subtract the mean of the quiet part from each channel but the current."""
    length = match.settings.offset_s
    if length is None:
        return
    count = round(length / samples.step)
    place = f"{match.settings.place}, offset_s"
    total = len(next(iter(samples.values.values())))
    if not 8 <= count < total:
        whole = total * samples.step
        raise InputError(place, f"{length:g}", f"8 samples or more of the {whole:.4g} s")
    removed = []
    columns = {one.key: one for one in match.columns}
    for key, values in samples.values.items():
        if key == CURRENT:
            continue
        mean = float(np.mean(values[:count]))
        if np.std(values[:count]) > _QUIET * np.std(values):
            raise InputError(
                place,
                f"{length:g}, in which {key} ({columns[key].heading!r}) moves as in the whole "
                "record",
                "the time before the motion, s",
            )
        samples.values[key] = values - mean
        one = columns[key].channel
        removed.append(f"{key} {mean:.3g} {one.unit if one else ''}")
    samples.notes.append(f"the mean of the first {length:g} s is subtracted: {', '.join(removed)}")


def _make_absolute(match: Match, samples: Samples) -> None:
    """Add the ground's acceleration to accelerations that are relative to it."""
    if not match.settings.relative:
        return
    added = []
    for one in dict.fromkeys(column.channel for column in match.columns):
        if one is None or one.is_displacement or one.place == GROUND or one.axis == ROTATION:
            continue
        ground = samples.values[Channel(GROUND, one.axis, one.quantity).key]
        samples.values[one.key] = samples.values[one.key] + ground
        added.append(one.key)
    samples.notes.append(f"the ground's acceleration is added to {', '.join(added)}")


def _subtract_ground(samples: Samples) -> None:
    """Replace absolute displacements of base and ground by that of the isolators."""
    values: Mapping[str, NDArray] = samples.values
    for axis in ("", "x", "y"):
        base, ground, isolator = (
            Channel(place, axis, "displacement").key for place in (BASE, GROUND, ISOLATOR)
        )
        if base in values and ground in values:
            difference = samples.values.pop(base) - samples.values.pop(ground)
            if isolator not in values:
                samples.values[isolator] = difference
                samples.notes.append(f"{isolator} is {base} minus {ground}")
