"""Corrected accelerograms of GeoNet, New Zealand (V2A)."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from ground_motions.argument_types import checked
from ground_motions.checks import positive
from ground_motions.errors import InputError, wrong_choice
from ground_motions.readers.lines import excerpt, numbers_in, read_lines, require_two
from ground_motions.record import Record
from ground_motions.units import to_m_s2

_TEXT, _INTEGERS, _REALS = 16, 4, 6  # lines of the header of a component
_DIRECTION = 12  # its line, from 0
_COUNTS = 33, 34, 35  # accelerations, velocities, displacements: places in the integer header
_STEP = 25  # s: place in the real header
_COLUMNS, _WIDTH = 10, 8  # numbers of a line, and their width
_EXPECTED = "a corrected accelerogram of GeoNet (V2A)"


class _Component(NamedTuple):
    """Accelerations of one component."""

    direction: str  # As in the file: N76W, S14W or Up
    line: int  # The first of the accelerations, from 0
    n_samples: int
    step: float


@checked
def read_geonet(path: str | Path, column: str | None = None) -> Record:
    """Read the accelerations of a component of a corrected accelerogram of GeoNet.

    Parameters
    ----------
    path : str or Path
        File of volume 2, ``.v2a``. Velocities and displacements behind the accelerations are not
        read.
    column : str, optional
        Direction of the component, such as ``"N76W"`` or ``"Up"``, where the file has several.

    Returns
    -------
    Record
        The motion in m/s2, named after the file, with the direction where there are several.

    Raises
    ------
    InputError
        If the file is of another format, or cut off; the direction is missing or unknown; or a
        sample is not a finite number.

    Notes
    -----
    W. J. Cousins, "GNS accelerogram data files: standard format", GNS Science, 2008:
    www.geonet.org.nz/data/supplementary/strong_motion_file_formats.
    """
    lines = read_lines(path)
    components = _components(lines, path)
    names = [each.direction for each in components]
    if column is None and len(names) > 1:
        raise InputError(
            str(path),
            f"{len(names)} components and no choice",
            f"column= one of {', '.join(names)}",
        )
    if column is not None and column not in names:
        raise wrong_choice(f"{path}, column", column, names)
    chosen = components[0 if column is None else names.index(column)]
    rows = range(chosen.line, chosen.line + _rows(chosen.n_samples))
    samples = numbers_in(lines, rows, path, _WIDTH)
    if len(samples) != chosen.n_samples:
        place = f"{path}, lines {chosen.line + 1} to {rows[-1] + 1}"
        raise InputError(place, f"{len(samples)} samples", f"{chosen.n_samples}, as in the header")
    require_two(len(samples), str(path))
    stem = Path(path).stem
    return Record(
        np.array(samples) * to_m_s2("mm/s2"),
        chosen.step,
        name=stem if len(names) == 1 else f"{stem}_{chosen.direction}",
        source=f"{path}, component {chosen.direction}",
        file_unit="mm/s2",
    )


def directions_of(path: str | Path) -> dict[str, str]:
    """Directions of a file's components by their own names."""
    names = [each.direction for each in _components(read_lines(path), path)]
    return dict(zip(names, names, strict=True))


def _components(lines: list[str], path: str | Path) -> list[_Component]:
    first = lines[0].strip()
    if not first.lower().startswith("corrected accelerogram"):
        raise InputError(f"{path}, line 1", excerpt(first), _EXPECTED)
    components: list[_Component] = []
    at = 0
    while any(line.strip() for line in lines[at:]):
        begin = at + _TEXT + _INTEGERS + _REALS
        if len(lines) <= begin:
            place = f"{path}, line {at + 1}"
            raise InputError(place, f"{len(lines) - at} lines", f"a header of {begin - at} lines")
        # the axis of the instrument may follow: Component N10E  Longitudinal Accelerometer Axis
        word, direction, *_ = (*lines[at + _DIRECTION].split(), "", "")
        if word.lower() != "component" or not direction:
            place = f"{path}, line {at + _DIRECTION + 1}"
            raise InputError(place, excerpt(lines[at + _DIRECTION].strip()), "Component N76W")
        integers = _header(lines, at + _TEXT, _INTEGERS, max(_COUNTS), path)
        reals = _header(lines, at + _TEXT + _INTEGERS, _REALS, _STEP, path)
        counts = [round(integers[k]) for k in _COUNTS]
        step = positive(f"{path}, line {at + _TEXT + _INTEGERS + 3}, column 6 (s)", reals[_STEP])
        end = begin + sum(map(_rows, counts))
        if min(counts) < 0 or end > len(lines):
            raise InputError(
                str(path), f"{len(lines)} lines", f"{end} or more, by the header of {direction}"
            )
        components.append(_Component(direction, begin, counts[0], step))
        at = end
    names = [each.direction for each in components]
    if len(set(names)) < len(names):
        raise InputError(str(path), f"components {', '.join(names)}", "different directions")
    return components


def _header(lines: list[str], at: int, rows: int, last: int, path: str | Path) -> list[float]:
    """Numbers of a header up to a place."""
    cells = numbers_in(lines, range(at, at + rows), path, _WIDTH)
    if len(cells) <= last:
        place = f"{path}, lines {at + 1} to {at + rows}"
        raise InputError(place, f"{len(cells)} numbers", f"{rows * _COLUMNS}")
    return cells


def _rows(count: int) -> int:
    return -(-count // _COLUMNS)
