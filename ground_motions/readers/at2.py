"""PEER strong-motion files (AT2)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ground_motions.argument_types import checked
from ground_motions.checks import positive
from ground_motions.component_names import Component
from ground_motions.errors import InputError
from ground_motions.readers.lines import (
    excerpt,
    numbers_in,
    parse_number,
    read_lines,
    require_count,
    require_two,
)
from ground_motions.record import Record
from ground_motions.units import ACCELERATION_UNITS, to_m_s2, unit_name

_HEADER_LINES = 10
_OTHERS = [unit for unit in ACCELERATION_UNITS if unit != "g"]
# "NPTS=   5372, DT=   .0100 SEC," (NGA-West2) and "4000   0.0100   NPTS, DT" (1990s).
_NPTS = re.compile(r"\bNPTS\s*[=:]\s*(?P<npts>[^\s,]+)", re.IGNORECASE)
_DT = re.compile(r"\bDT\s*[=:]\s*(?P<dt>[^\s,]+?)(?:S|SEC)?(?=[\s,]|$)", re.IGNORECASE)
_BOTH = re.compile(r"^\s*(?P<npts>\d+)[\s,]+(?P<dt>[^\s,]+)[\s,]+NPTS\s*,\s*DT", re.IGNORECASE)
# "UNITS OF G", "units are (g)" and "Units: g" declare a unit, whatever it is; "UNITS G"
# does if the unit is known.
# "Unit 4 Power Plant" and "COMMUNITY" are parts of a station's name.
_DECLARED = re.compile(
    r"\bUNITS?\s*(?:\b(?:OF|IN|ARE)\b|:|=)\s*\(?(?P<unit>[A-Z/0-9*^]+)", re.IGNORECASE
)
_BARE = re.compile(r"\bUNITS\s+(?P<unit>[A-Z/0-9*^]+)", re.IGNORECASE)
_KNOWN = re.compile(r"G(?:/10)?|GALS?|(?:MM|CM|M|IN|FT)/S.*", re.IGNORECASE)
# "Northridge-05, 1/18/1994, Sylmar - County Hospital Grounds, 90": the direction is the last
_DIRECTION = re.compile(
    r"(?P<recording>.*\d.*),\s*(?P<direction>\d{1,3}|[NSEWV]|UP|DOWN|DWN|DN|VERT)\b[^,]*"
)
_OTHER_SERIES = re.compile(r"\b(?P<kind>VELOCITY|DISPLACEMENT)\s+TIME", re.IGNORECASE)


@checked
def read_at2(path: str | Path) -> Record:
    """Read a PEER acceleration file.

    Parameters
    ----------
    path : str or Path
        The file, UTF-8 or Latin-1: a header with the units and the line of NPTS and DT, in
        the NGA-West2 or the older form, then NPTS numbers in any number of columns. The units
        are declared as in ``UNITS OF G``, ``Units: g`` or ``UNITS OF CM/SEC/SEC``; a station's
        "Unit 4" declares none. Where the number of samples is within 1 % of NPTS, all samples
        there are used, with a warning.

    Returns
    -------
    Record
        The motion in m/s2 (1 g is 9.80665 m/s2), named after the file.

    Raises
    ------
    InputError
        If the file cannot be read; holds velocity (VT2) or displacement (DT2); has no units, or
        unknown ones, or no NPTS and DT; is cut off; or has a sample that is not a finite number.
    """
    accepted = f"a PEER acceleration file (AT2) in units of g, or of {', '.join(_OTHERS)}"
    if Path(path).suffix.lower() in (".vt2", ".dt2"):
        raise InputError(str(path), f"a {Path(path).suffix} file", accepted)
    lines = read_lines(path)
    after, npts, dt = _npts_and_dt(lines, path)
    unit = _unit(lines[:after], path, accepted)

    samples = numbers_in(lines, range(after, len(lines)), path)
    require_count(len(samples), npts, f"{path}, line {after}", "NPTS")
    require_two(len(samples), str(path))
    return Record(
        np.array(samples) * to_m_s2(unit),
        dt,
        name=Path(path).stem,
        source=f"{path}, {' '.join(lines[min(1, after - 1)].split())}",
        file_unit=unit,
    )


def component_of(path: str | Path) -> Component:
    """The component in a file, which its second line tells."""
    lines = read_lines(path)
    match = _DIRECTION.fullmatch(lines[1].strip()) if len(lines) > 1 else None
    return Component(match["recording"], match["direction"]) if match else Component("", "")


def _npts_and_dt(lines: list[str], path: str | Path) -> tuple[int, int, float]:
    """Return the number of header lines, NPTS, and DT in s."""
    for number, line in enumerate(lines[:_HEADER_LINES], start=1):
        match = _BOTH.search(line)
        count, step = (match, match) if match else (_NPTS.search(line), _DT.search(line))
        if count is None or step is None:
            continue
        place = f"{path}, line {number}"
        if not count["npts"].isdecimal():
            raise InputError(place, f"NPTS {excerpt(count['npts'])}", "a whole number")
        dt = parse_number(step["dt"], f"{place}, DT")
        return number, int(count["npts"]), positive(f"{place}, DT (s)", dt)
    raise InputError(
        f"{path}, lines 1 to {min(_HEADER_LINES, len(lines))}",
        "no number of points and step",
        "a header line such as 'NPTS= 4000, DT= .01000 SEC' or '4000 0.0100 NPTS, DT'",
    )


def _unit(header: list[str], path: str | Path, accepted: str) -> str:
    """Return the unit that a header declares; refuse an unknown one, none, or another series."""
    declared = []
    for number, line in enumerate(header, start=1):
        series = _OTHER_SERIES.search(line)
        if series:
            raise InputError(
                f"{path}, line {number}", f"a {series['kind'].lower()} time series", accepted
            )
        declared += [(number, match["unit"]) for match in _DECLARED.finditer(line)]
        declared += [
            (number, match["unit"])
            for match in _BARE.finditer(line)
            if _KNOWN.fullmatch(match["unit"])
        ]
    # "Fire Unit of Hollister" declares nothing where a unit stands elsewhere
    known = [(number, unit) for number, unit in declared if _KNOWN.fullmatch(unit)]
    units = {}
    for number, text in known or declared:
        name = unit_name(text)
        if name is None:
            raise InputError(f"{path}, line {number}", f"units {excerpt(text)}", accepted)
        units[name] = number
    if len(units) > 1:
        raise InputError(
            f"{path}, line {max(units.values())}", f"units {' and '.join(units)}", "one"
        )
    if not units:
        raise InputError(
            f"{path}, lines 1 to {len(header)}", "no units", "a header line with 'UNITS OF G'"
        )
    return next(iter(units))
