"""Accelerograms of ESM, ITACA and AFAD (DYNA format)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ground_motions.argument_types import checked
from ground_motions.checks import positive
from ground_motions.component_names import Component
from ground_motions.errors import InputError, warn
from ground_motions.readers.lines import (
    AnotherQuantityError,
    excerpt,
    is_number,
    numbers_in,
    read_lines,
    require_count,
    require_two,
)
from ground_motions.record import Record
from ground_motions.units import to_m_s2, unit_name

_STEP, _COUNT, _UNIT, _KIND = "SAMPLING_INTERVAL_S", "NDATA", "UNITS", "DATA_TYPE"
_EXPECTED = f"a header of the DYNA format (ESM, ITACA, AFAD) with {_STEP}, {_COUNT} and {_UNIT}"


@checked
def read_esm(path: str | Path) -> Record:
    """Read an accelerogram of the Engineering Strong-Motion database, of ITACA or of AFAD.

    Parameters
    ----------
    path : str or Path
        One component, ``.asc``: a header of lines such as ``SAMPLING_INTERVAL_S: 0.005``, then
        one acceleration a line. A warning says so where the baseline is not removed.

    Returns
    -------
    Record
        The motion in m/s2, named after the file.

    Raises
    ------
    InputError
        If the header lacks step, number of samples or unit, or is one of velocities or
        displacements; the number of samples is another one; or a sample is not a finite number.

    Notes
    -----
    L. Luzi et al., "The Engineering Strong-Motion Database: a platform to access pan-European
    accelerometric data", Seismological Research Letters 87 (2016) 987-997.
    """
    lines = read_lines(path)
    header = _header(lines, path)
    for name in (_STEP, _COUNT, _UNIT):
        if name not in header:
            raise InputError(f"{path}, line 1", excerpt(lines[0].strip()), _EXPECTED)
    unit, place = header[_UNIT]
    factor, step = to_m_s2(unit, place), positive(header[_STEP][1], header[_STEP][0])
    samples = numbers_in(lines, range(len(header), len(lines)), path)
    announced = positive(header[_COUNT][1], header[_COUNT][0])
    require_count(len(samples), round(announced), str(path), _COUNT)
    require_two(len(samples), str(path))
    if "NOT REMOVED" in header.get("BASELINE_CORRECTION", ("", ""))[0].upper():
        warn(f"{path}: its baseline is not removed; baseline_corrected() removes it", UserWarning)
    station, stream = (header.get(name, ("", ""))[0] for name in ("STATION_CODE", "STREAM"))
    words = [f"station {station}"] if station else []
    words += [f"stream {stream}"] if stream else []
    return Record(
        np.array(samples) * factor,
        step,
        name=Path(path).stem,
        source=", ".join([str(path), *words]),
        file_unit=unit_name(unit) or unit,
    )


def component_of(path: str | Path) -> Component:
    """The component in a file, which its name tells; refused if it has no accelerations."""
    _header(read_lines(path), path)
    return Component("", "")


def _header(lines: list[str], path: str | Path) -> dict[str, tuple[str, str]]:
    """Values of a header and their places by their names; refused if it is of no accelerations."""
    header: dict[str, tuple[str, str]] = {}
    for number, line in enumerate(lines, start=1):
        name, colon, value = line.partition(":")
        if not colon or is_number(line.strip()):
            break
        header[name.strip().upper()] = value.strip(), f"{path}, line {number}, {name.strip()}"
    kind, place = header.get(_KIND, ("ACCELERATION", ""))
    if kind.upper() != "ACCELERATION":
        raise AnotherQuantityError(place, repr(kind), "ACCELERATION")
    return header
