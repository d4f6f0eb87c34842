"""Samples of a raw test at a constant step, without repeated rows and gaps."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ground_motions.readers.lines import uniform_step

from ...errors import InputError
from ..measured.gaps import LONGEST, fill_gaps, gap_note
from .channels import Channel
from .raw_table import RawTable

_MOST_REPEATED = 0.01
"""Share of rows whose time may repeat that of the row before."""
_SLOWEST = 2.0
"""Sampling rate, Hz, below which times without a unit are not taken as seconds."""


def samples_of(
    table: RawTable, channels: Mapping[str, Channel], rate: float | None
) -> tuple[dict[str, NDArray], list[str]]:
    """Channels in SI at a constant step, and notes of what was changed."""
    data = {
        what: np.sum([c.factor * table.numbers(c.column) for c in (one, *one.others)], axis=0)
        for what, one in channels.items()
    }
    lines = np.array(table.lines)
    headings = {what: channel.heading for what, channel in channels.items()}
    notes: list[str] = []
    if "time" not in data:
        if rate is None and table.rate is not None:
            notes.append(f"{table.rate:.6g} samples per second, as the file says")
        data["time"] = np.arange(len(lines)) / (rate or table.rate or 1.0)

    def fill(what: str) -> None:
        place = table.place, lines.tolist(), headings.get(what, what)
        data[what], missing = fill_gaps(data[what], *place)
        if missing.size:
            notes.append(gap_note(what, missing.size, data["time"][missing[0]]))

    def keep(rows: NDArray | slice) -> None:
        nonlocal data, lines
        data, lines = {what: values[rows] for what, values in data.items()}, lines[rows]

    keep(_complete_ends(data, notes))
    fill("time")
    _check_unit(data["time"], channels, table.place)
    keep(_increasing(data["time"], lines, table.place, notes))
    for what in data:
        fill(what)
    keep(_longest_part(data["time"], notes))
    return _uniform(data, notes), notes


def _complete_ends(data: Mapping[str, NDArray], notes: list[str]) -> slice:
    """Rows from the first to the last that has all numbers."""
    complete = np.flatnonzero(np.all([np.isfinite(values) for values in data.values()], axis=0))
    size = len(next(iter(data.values())))
    rows = slice(complete[0], complete[-1] + 1) if complete.size else slice(0, size)
    cut = size - (rows.stop - rows.start)
    if cut:
        notes.append(f"{cut} incomplete {_rows(cut)} at the ends left out")
    return rows


def _check_unit(time: NDArray, channels: Mapping[str, Channel], place: str) -> None:
    """Refuse a time without a unit that is too slow for seconds."""
    step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    if "time" in channels and not channels["time"].unit and step * _SLOWEST > 1:
        raise InputError(
            f"{place}, column {channels['time'].heading!r}",
            f"no unit, and steps of {step:.4g}",
            "--unit time=s or --unit time=ms",
        )


def _increasing(time: NDArray, lines: NDArray, place: str, notes: list[str]) -> NDArray:
    """Rows whose time is not that of the row before."""
    steps = np.diff(time)
    back = np.flatnonzero(steps < 0)
    if back.size:
        k = back[0] + 1
        raise InputError(
            f"{place}, line {lines[k]}", f"a time of {time[k]:.10g} s after {time[k - 1]:.10g} s",
            "times that increase, or --test-column HEADING of the column that tells tests apart",
        )  # fmt: skip
    again = np.flatnonzero(steps == 0) + 1
    if again.size > max(_MOST_REPEATED * len(time), 1):
        raise InputError(
            f"{place}, line {lines[again[0]]}", f"the first of {again.size} times that repeat",
            "times that increase, or --column time=none --rate 200 (samples per second)",
        )  # fmt: skip
    if again.size:
        notes.append(f"{again.size} {_rows(again.size)} of a repeated time left out")
    return np.delete(np.arange(len(time)), again)


def _longest_part(time: NDArray, notes: list[str]) -> slice:
    """Rows between breaks that are too long to interpolate."""
    steps = np.diff(time)
    far = np.flatnonzero(steps > (LONGEST + 1.5) * np.median(steps))
    if not far.size:
        return slice(0, len(time))
    ends = [0, *(far + 1), len(time)]
    k = int(np.argmax(np.diff(ends)))
    part = time[ends[k] : ends[k + 1]]
    notes.append(
        f"no samples from {time[far[0]]:.4g} to {time[far[0] + 1]:.4g} s"
        f"{f' and in {far.size - 1} further places' if far.size > 1 else ''}; used from "
        f"{part[0]:.4g} to {part[-1]:.4g} s"
    )
    return slice(ends[k], ends[k + 1])


def _uniform(data: dict[str, NDArray], notes: list[str]) -> dict[str, NDArray]:
    """The channels at a constant step."""
    from scipy.interpolate import PchipInterpolator

    time = data["time"]
    try:
        uniform_step(time.tolist(), range(len(time)), "time")
    except InputError:
        steps = np.diff(time)
        usual = float(np.mean(steps[steps < 1.5 * np.median(steps)]))
        count = round(np.ptp(time) / usual) + 1
        grid = np.linspace(time[0], time[-1], count)
        notes.append(
            f"steps of {1e3 * steps.min():.4g} to {1e3 * steps.max():.4g} ms resampled to "
            f"{1e3 * (grid[1] - grid[0]):.4g} ms"
        )
        return {what: PchipInterpolator(time, values)(grid) for what, values in data.items()}
    return data


def _rows(number: int) -> str:
    return "row" if number == 1 else "rows"
