"""Corrected accelerograms of COSMOS and CSMIP (V2)."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ground_motions.argument_types import checked
from ground_motions.checks import positive
from ground_motions.component_names import Component
from ground_motions.errors import InputError, wrong_choice
from ground_motions.readers.lines import (
    AnotherQuantityError,
    excerpt,
    fixed_cells,
    numbers_in,
    parse_number,
    read_lines,
    require_count,
    require_two,
)
from ground_motions.record import Record
from ground_motions.units import UNITS, to_m_s2, unit_name

_FIRST = re.compile(r"\s*CORRECTED (?P<kind>ACCEL|DISPL)", re.IGNORECASE)
_OTHERS = re.compile(r"\s*(CORRECTED VELOC|RESPONSE SPECTR)", re.IGNORECASE)
# CSMIP: "  4000 points of accel data equally spaced at  .020 sec, in cm/sec2. (8f10.3)", and
# until about 1990 " 1138 POINTS OF ACCEL DATA EQUALLY SPACED AT  .020 SEC.  (UNITS: CM/SEC/SEC)"
_CSMIP = re.compile(
    r"\s*(?P<count>\d+)\s+points of (?P<kind>accel|displ) data equally spaced at\s+"
    r"(?P<dt>[\d.]+)\s*sec(?:,\s*in|\.\s*\(units\s*:)\s*"
    r"(?P<unit>[a-z]+(?:/[a-z0-9^*]+)*)(?P<format>.*)",
    re.IGNORECASE,
)
# COSMOS: "  4000 acceleration pts, approx  80 secs, units=cm/sec2 (04), Format=(8F10.5)"
_COSMOS = re.compile(
    r"\s*(?P<count>\d+)\s+(?P<kind>accel|displ)(?:eration|acement)\s+pts,\s*"
    r"approx\s+(?P<length>[\d.]+)\s*secs?,"
    r"\s*units\s*=\s*(?P<unit>[a-z]+(?:/[a-z0-9^*]+)*)\s*(?:\(\d+\))?\s*,?(?P<format>.*)",
    re.IGNORECASE,
)
_REALS = re.compile(r"\s*(?P<count>\d+)\s+Real-header values", re.IGNORECASE)
_FORMAT = re.compile(r"\(?\s*(?P<columns>\d+)\s*[EFG](?P<width>\d+)", re.IGNORECASE)
# "Chan  3: 90 Deg  (Sta Chn: 16)": of the recorder, and of the station, which may have several
_CHANNEL = re.compile(r"\bCHAN(?:NEL)?\s*(?P<channel>\d+)\b", re.IGNORECASE)
_STATION_CHANNEL = re.compile(r"\bSTA CHN\s*:\s*(?P<channel>\d+)", re.IGNORECASE)
# "Chan  3:  90 Deg" and "Location: Roof, north"; COSMOS also has both in one line:
# "Sta Chan  3: 90 deg (Rcrdr Chan  3) Location:Roof, north"
_DIRECTION = re.compile(
    r"\bCHAN(?:NEL)?\s*\d+\s*:\s*(?P<words>[^\s(]+(?: (?!LOCATION)[^\s(]+)*)", re.IGNORECASE
)
_LOCATION = re.compile(r"\bLOCATION\s*:\s*(?P<words>\S+(?: \S+)*)", re.IGNORECASE)
# the recording in "Corrected accelerogram   54730-F1275-06331.02   Chan  1: 110 Deg" (CSMIP), and
# in "Statn No: 37-000011 Code:AK-BMR" and "Rcrd start time: 2018/11/30 17:29:39.137" (COSMOS)
_RECORDING = (
    re.compile(r"^\s*CORRECTED ACCELEROGRAM\s+(?P<words>\d\S+)", re.IGNORECASE),
    re.compile(r"\bSTATN NO\s*:\s*(?P<words>\S+\s+CODE\s*:\s*\S+)", re.IGNORECASE),
    re.compile(r"\bRCRD START TIME\s*:\s*(?P<words>\S+ \S+)", re.IGNORECASE),
)
_USUAL = (8, 10)  # numbers of a line and their width, where CSMIP writes no format
_DT_PLACE = 62  # of the real header: sampling interval of this series, ms
_RAW_DT_PLACE = 34  # sampling interval of the record, s
_NULL = -999.0
_EXPECTED = "a corrected accelerogram (V2) of COSMOS or CSMIP"


@dataclass(frozen=True)
class Series:
    """Accelerations or displacements of a channel: where they begin, and what is said of them."""

    line: int  # Number of the heading, from 1
    channel: str  # Its number
    direction: str  # Of the sensor, as the header has it; empty if it has none
    location: str  # Of the sensor
    recording: str  # What the channels of one recorder have in common
    is_displacement: bool  # Whether the samples are displacements
    count: int  # Number of samples
    dt: float  # s
    unit: str  # Of the samples
    columns: int  # Numbers in a line
    width: int  # Characters of a number

    @property
    def words(self) -> str:
        """Direction and location of the sensor."""
        return f"{self.direction} {self.location}".strip()


@checked
def read_v2(path: str | Path, column: str | None = None) -> Record:
    """Read the accelerations of a channel of a corrected accelerogram.

    Parameters
    ----------
    path : str or Path
        File of volume 2 of CSMIP, or of the COSMOS format 1.20. Velocities and displacements
        behind the accelerations are not read.
    column : str, optional
        Number of the channel, where the file has several, such as ``"2"``.

    Returns
    -------
    Record
        The motion in m/s2, named after the file, with the channel where there are several.

    Raises
    ------
    InputError
        If the file is none of the two, or another volume; the channel is missing or unknown; the
        heading of the accelerations has no known unit, step or format; or there are fewer samples
        than it says.

    Notes
    -----
    A. F. Shakal and M. J. Huang, "Standard tape format for CSMIP strong-motion data tapes", Report
    OSMS 85-03, 1985; "COSMOS strong motion data format", version 1.20, 2001.
    """
    lines = read_lines(path)
    series = _accelerations(lines, path)
    channels = [each.channel for each in series]
    if column is None and len(series) > 1:
        named = (f"'{each.channel}'" + f" ({each.words})" * bool(each.words) for each in series)
        raise InputError(
            str(path), f"{len(series)} channels and no choice", f"column= one of {', '.join(named)}"
        )
    if column is not None and column not in channels:
        raise wrong_choice(f"{path}, column", column, channels)
    chosen = series[0 if column is None else channels.index(column)]
    samples = samples_of(lines, chosen, path)
    stem = Path(path).stem
    return Record(
        np.array(samples) * to_m_s2(chosen.unit),
        chosen.dt,
        name=stem if len(series) == 1 else f"{stem}_{chosen.channel}",
        source=f"{path}, channel {chosen.channel}",
        file_unit=chosen.unit,
    )


def channels_of(path: str | Path) -> dict[str, str]:
    """Directions of a file's channels by their numbers."""
    return {each.channel: each.words for each in _accelerations(read_lines(path), path)}


def component_of(path: str | Path) -> Component | None:
    """The component in a file; none if it has several."""
    series = _accelerations(read_lines(path), path)
    if len(series) > 1:
        return None
    (only,) = series
    return Component(only.recording, only.direction, only.location)


def _accelerations(lines: list[str], path: str | Path) -> list[Series]:
    found = [each for each in all_series(lines, path) if not each.is_displacement]
    if not found:
        raise AnotherQuantityError(f"{path}, line 1", excerpt(lines[0].strip()), _EXPECTED)
    return found


def all_series(lines: list[str], path: str | Path) -> list[Series]:
    """Accelerations and displacements of all channels."""
    first = _FIRST.match(lines[0])
    if first is None:
        kind = AnotherQuantityError if _OTHERS.match(lines[0]) else InputError
        raise kind(f"{path}, line 1", excerpt(lines[0].strip()), _EXPECTED)
    # behind accelerations, displacements have the header of these
    alone = first["kind"].lower() == "displ"
    series: list[Series] = []
    begin = 0
    for place, line in enumerate(lines):
        match = _CSMIP.match(line) or _COSMOS.match(line)
        if match is None:
            continue
        where = f"{path}, line {place + 1}"
        block = _block(match, where)
        if block["is_displacement"] and not alone:
            if not series:
                raise InputError(where, "displacements of no channel", "accelerations before them")
            series.append(replace(series[-1], line=place + 1, **block))
        else:
            header = lines[begin:place]
            number = sum(each.is_displacement == alone for each in series) + 1
            dt = _step(header, match, where, path)
            series.append(Series(line=place + 1, dt=dt, **block, **_channel(header, number)))
        begin = place + 1
    if not series:
        raise InputError(
            str(path), "no accelerations",
            f"{_EXPECTED}: a line such as '4000 points of accel data equally spaced at .005 sec, "
            "in cm/sec2. (8f10.3)'",
        )  # fmt: skip
    names = [each.channel for each in series if each.is_displacement == alone]
    if len(set(names)) < len(names):
        raise InputError(str(path), f"channels {', '.join(names)}", "different numbers")
    return series


def _block(match: re.Match[str], where: str) -> dict[str, Any]:
    """What the heading of a block of samples says of them."""
    moved = match["kind"].lower() == "displ"
    unit = match["unit"].lower() if moved else unit_name(match["unit"])
    if unit is None or (moved and unit not in UNITS["displacement"]):
        expected = "cm" if moved else "cm/sec2 or g"
        raise InputError(where, f"units {excerpt(match['unit'])}", expected)
    numbers = _FORMAT.search(match["format"])
    if numbers is None and (match.re is _COSMOS or "(" in match["format"]):
        raise InputError(where, excerpt(match[0].strip()), "a format at its end, such as (8f10.3)")
    columns, width = map(int, numbers.group("columns", "width") if numbers else _USUAL)
    return {
        "is_displacement": moved, "count": int(match["count"]), "unit": unit, "columns": columns,
        "width": width,
    }  # fmt: skip


def _channel(header: list[str], number: int) -> dict[str, Any]:
    """What the header above a block says of its channel; ``number`` if it has none."""
    own = _own_header(header)
    return {
        "channel": _first(own, _STATION_CHANNEL, _CHANNEL) or str(number),
        "direction": _first(own, _DIRECTION),
        "location": _first(own, _LOCATION),
        "recording": " ".join(filter(None, (_first(own, each) for each in _RECORDING))),
    }


def _own_header(header: list[str]) -> list[str]:
    """The header of a channel, behind the end of the last one."""
    ends = [k for k, line in enumerate(header) if re.match(r"\s*(/&|End-of-data)", line, re.I)]
    return header[ends[-1] + 1 if ends else 0 :]


def _first(header: list[str], *patterns: re.Pattern[str]) -> str:
    """What a header first has of the first pattern that it has; empty if there is none."""
    for pattern in patterns:
        for line in header:
            if match := pattern.search(line):
                return " ".join(match[1].split())
    return ""


def _step(header: list[str], heading: re.Match[str], where: str, path: str | Path) -> float:
    """Return the step in s of a block; in a COSMOS file it fits the duration in its heading."""
    if heading.re is _CSMIP:
        return positive(f"{where}, step (s)", heading["dt"])
    starts = [k for k, line in enumerate(header) if _REALS.match(line)]
    if not starts:
        raise InputError(where, "no real header above", "the real header of a COSMOS file")
    reals = header[starts[-1]]
    match, numbers = _REALS.match(reals), _FORMAT.search(reals)
    assert match is not None
    if numbers is None or int(match["count"]) < _DT_PLACE:
        raise InputError(
            f"{path}, {excerpt(reals.strip())}", f"{match['count']} values",
            f"{_DT_PLACE} or more with their format: number {_DT_PLACE} is the step in ms",
        )  # fmt: skip
    width, cells = int(numbers["width"]), []
    for line in header[starts[-1] + 1 :]:
        cells += fixed_cells(line, width)
        if len(cells) >= _DT_PLACE:
            break
    place = f"{path}, real header, value {_DT_PLACE} (ms)"
    dt = parse_number(cells[_DT_PLACE - 1], place) / 1000.0
    if dt == _NULL / 1000.0:
        place = f"{path}, real header, value {_RAW_DT_PLACE} (s)"
        dt = parse_number(cells[_RAW_DT_PLACE - 1], place)
    positive(place, dt)
    length = float(heading["length"])
    if abs(int(heading["count"]) * dt - length) > max(1.0, 0.02 * length):
        raise InputError(
            place,
            f"a step of {dt:g} s",
            f"one by which {heading['count']} points last {length:g} s",
        )
    return dt


def samples_of(lines: list[str], series: Series, path: str | Path) -> list[float]:
    """Samples of a channel, in its unit."""
    rows = -(-series.count // series.columns)
    block = range(series.line, min(series.line + rows, len(lines)))
    samples = numbers_in(
        lines,
        (row for row in block if not lines[row].lstrip().startswith(("/&", "End"))),
        path,
        series.width,
    )
    require_count(len(samples), series.count, f"{path}, line {series.line}", "number of points")
    require_two(len(samples), str(path))
    return samples
