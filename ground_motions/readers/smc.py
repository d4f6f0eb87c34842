"""Accelerograms of the US Geological Survey (SMC)."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ground_motions.argument_types import checked
from ground_motions.checks import positive
from ground_motions.component_names import Component
from ground_motions.errors import InputError, warn
from ground_motions.readers.lines import (
    AnotherQuantityError,
    Corners,
    excerpt,
    numbers_in,
    read_lines,
    require_count,
    require_two,
)
from ground_motions.record import Record
from ground_motions.units import to_m_s2

_WIDTHS = {10: 8, 15: 5}  # characters of a number, and numbers of a line
_TEXT, _INTEGERS, _REALS = 11, 6, 10  # lines of the header
_NULL, _COMMENTS, _COUNT = 0, 15, 16  # places in the integer header
_NO_REAL, _RATE = 0, 1  # places in the real header; the rate is in Hz
_LOW_CUT, _HIGH_CUT, _CUT_ENDS = 32, 34, 35  # of the processing's filter, Hz
_CORRECTED, _UNCORRECTED = "2 CORRECTED ACCELEROGRAM", "1 UNCORRECTED ACCELEROGRAM"
_DISPLACEMENT = "4 DISPLACEMENT"
_OTHERS = ("3 VELOCITY", _DISPLACEMENT, "5 RESPONSE SPECTRA")
# "station = San Francisco, 1295 Shafter, F component=    360", below the day of the earthquake
_DAY_LINE, _STATION_LINE = 3, 5
_STATION = re.compile(
    r"\s*station\s*=(?P<station>.*?)component\s*=(?P<direction>.*)", re.IGNORECASE
)
# "|<loclbl=>Roof, east core<end>" among the comments of a structure
_LOCATION = re.compile(r"<loclbl=>(?P<location>.*?)<end>", re.IGNORECASE)


class _Header(NamedTuple):
    """The numbers of a header that say how the samples are to be read."""

    comments: int  # Lines between the header and the samples
    samples: int  # Their number
    rate: float | None  # Hz; none for pairs of time and acceleration
    corners: Corners | None  # As of `SmcChannel`


class SmcChannel(NamedTuple):
    """What a file has of a sensor."""

    quantity: str  # acceleration or displacement
    is_corrected: bool
    samples: list[float]  # cm/s2 or cm
    rate: float  # Samples per second, Hz
    station: str
    direction: str  # Azimuth in degrees, or Up
    location: str  # In a structure; empty where no comment names it
    corners: Corners | None  # Of the processing's filter; None where the header has none


@checked
def read_smc(path: str | Path) -> Record:
    """Read an accelerogram of the National Strong Motion Project of the US Geological Survey.

    Parameters
    ----------
    path : str or Path
        One component, ``.smc``, at a constant sampling rate, in cm/s2. A warning says so where
        the accelerogram is uncorrected.

    Returns
    -------
    Record
        The motion in m/s2, named after the file; the source has the station and the component.

    Raises
    ------
    InputError
        If the file has velocities, displacements or spectra, or samples at uneven times; the
        header is not one of an SMC file; there are fewer samples than it says; or a sample is not
        a finite number.

    Notes
    -----
    "SMC-format data files", National Strong Motion Project, US Geological Survey.
    """
    channel = read_channel(path)
    if not channel.is_corrected:
        warn(f"{path}: uncorrected; baseline_corrected() removes its baseline", UserWarning)
    return Record(
        np.array(channel.samples) * to_m_s2("cm/s2"),
        1.0 / channel.rate,
        name=Path(path).stem,
        source=f"{path}, station {channel.station}, component {channel.direction}",
        file_unit="cm/s2",
    )


def read_channel(path: str | Path, displacements: bool = False) -> SmcChannel:
    """Accelerations in a file, or where these are asked for its displacements."""
    lines = read_lines(path)
    moved = displacements and _first(lines).startswith(_DISPLACEMENT)
    is_corrected = moved or _is_corrected(lines, path)
    header = _header(lines, path)
    if header.rate is None:
        raise InputError(
            str(path), "no sampling rate: samples at uneven times",
            "the corrected accelerogram of this record",
        )  # fmt: skip
    begin = _TEXT + _INTEGERS + _REALS
    comments = " ".join(lines[begin : begin + header.comments])
    samples = numbers_in(lines, range(begin + header.comments, len(lines)), path, 10)
    require_count(len(samples), header.samples, str(path), "number of samples")
    require_two(len(samples), str(path))
    location = _LOCATION.search(comments)
    return SmcChannel(
        "displacement" if moved else "acceleration",
        is_corrected,
        samples,
        header.rate,
        *_station(lines),
        location["location"].strip() if location else "",
        header.corners if is_corrected else None,
    )


def component_of(path: str | Path) -> Component | None:
    """The component in a file; none if its header does not say, refused if of no accelerations."""
    lines = read_lines(path)
    _is_corrected(lines, path)
    station, direction = _station(lines)
    return Component(" ".join([*lines[_DAY_LINE].split(), station]), direction) if station else None


def _is_corrected(lines: list[str], path: str | Path) -> bool:
    """Whether an accelerogram is corrected; files of other kinds are refused."""
    first = _first(lines)
    if not first.startswith((_CORRECTED, _UNCORRECTED)):
        kind = AnotherQuantityError if first.startswith(_OTHERS) else InputError
        raise kind(f"{path}, line 1", excerpt(lines[0].strip()), repr(_CORRECTED))
    return first.startswith(_CORRECTED)


def _first(lines: list[str]) -> str:
    """The first line, which says what the samples are."""
    return " ".join(lines[0].split()).upper()


def _station(lines: list[str]) -> tuple[str, str]:
    """Station and direction of the component; empty if they are not told."""
    match = _STATION.match(lines[_STATION_LINE]) if len(lines) > _STATION_LINE else None
    if match is None:
        return "", ""
    return " ".join(match["station"].split()), " ".join(match["direction"].split())


def _header(lines: list[str], path: str | Path) -> _Header:
    integers = numbers_in(lines, range(_TEXT, _TEXT + _INTEGERS), path, 10)
    begin = _TEXT + _INTEGERS
    reals = numbers_in(lines, range(begin, begin + _REALS), path, 15)
    for name, cells, rows, width in (
        ("whole", integers, _INTEGERS, 10), ("real", reals, _REALS, 15),
    ):  # fmt: skip
        expected = rows * _WIDTHS[width]
        if len(cells) != expected:
            raise InputError(
                str(path),
                f"{len(cells)} {name} numbers in the header",
                f"{expected} on {rows} lines",
            )
    null, comments, count = (round(integers[k]) for k in (_NULL, _COMMENTS, _COUNT))
    rate = reals[_RATE]
    known = rate != reals[_NO_REAL]
    low, high, ends = (
        () if reals[k] in (reals[_NO_REAL], 0.0) else (reals[k],)
        for k in (_LOW_CUT, _HIGH_CUT, _CUT_ENDS)
    )
    return _Header(
        0 if comments == null else comments,
        count,
        positive(f"{path}, line {begin + 1}, sampling rate (Hz)", rate) if known else None,
        (low, high + ends) if low else None,
    )
