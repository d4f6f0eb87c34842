"""Reading a file by its suffix."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ground_motions.argument_types import checked
from ground_motions.errors import InputError, warn
from ground_motions.readers.at2 import read_at2
from ground_motions.readers.csv_file import has_units
from ground_motions.readers.geonet import read_geonet
from ground_motions.readers.v2 import read_v2
from ground_motions.record import Record
from ground_motions.registry import Registry
from ground_motions.units import STANDARD_GRAVITY

READERS: Registry[Callable[..., Record]] = Registry(
    "ground_motions.readers",
    "reader",
    "a function of a path that returns a Record",
    lambda loaded: loaded if callable(loaded) else None,
)
"""Every reader by the suffix of its files, without the dot."""

WEAKEST, STRONGEST = 1e-4, 3.0
"""Peaks that a file may have without a warning, g. The strongest horizontal record has 2.75 g
(Tohoku 2011, MYG004); instruments are triggered by 1e-3 g or more."""

LONGEST_STEP = 0.1
"""Sampling step that a file may have without a warning, s; a longer one is that of ms."""

TEXT = frozenset({".txt", ".dat", ".acc"})
"""Suffixes of text, whose headings may have units as those of a CSV file."""

ARCHIVES = (".zip", ".gz", ".tgz", ".tar", ".bz2", ".xz", ".7z")
"""Suffixes of archives, as databases send them."""

_REFUSED: dict[str, Callable[..., Record]] = {
    "raw": read_v2,
    "vt2": read_at2,
    "dt2": read_at2,
    "v1": read_v2,
    "v1a": read_geonet,
    "v1c": read_v2,
}
"""PEER velocities and displacements, and uncorrected files: their readers say why not."""


@checked
def read(
    path: str | Path,
    *,
    column: str | None = None,
    unit: str | None = None,
    dt: float | None = None,
    reader: str | None = None,
) -> Record:
    """Read a ground motion; the file's suffix says how.

    Parameters
    ----------
    path : str or Path
        ``.at2`` (see `read_at2`), ``.asc`` (`read_esm`), ``.csv`` (`read_csv`), ``.ns``, ``.ew`` or
        ``.ud`` (`read_knet`), ``.smc`` (`read_smc`), ``.txt``, ``.dat`` or ``.acc`` (`read_text`),
        ``.mat`` (`read_mat`), ``.v2`` or ``.v2c`` (`read_v2`), ``.v2a`` (`read_geonet`), or a
        suffix for which a package brings a reader.
    column : str, optional
        Name of the acceleration column (CSV) or variable (MAT), number of the channel (V2) or of
        the column (text, times first), or direction (V2A).
    unit : str, optional
        Unit of the accelerations: needed for text, and for CSV and MAT without one.
    dt : float, optional
        Sampling step, s, of text and MAT without times.
    reader : str, optional
        Another reader than the suffix's: its name, or a place such as ``"my_reader.py:read"``.

    Returns
    -------
    Record
        The motion in m/s2. A warning says so if its peak or its step is beyond what instruments
        record, as with a wrong unit.

    Raises
    ------
    InputError
        If the suffix is unknown, an option does not belong to the format, the file is refused by
        its reader, or the reader raises an error or returns something other than a `Record`.
    """
    suffix = Path(path).suffix.lower()
    name = reader or suffix.removeprefix(".")
    if suffix in TEXT and not (reader or dt or (column or "").isdecimal()) and has_units(path):
        name = "csv"
    if reader is None and suffix in ARCHIVES and name not in READERS:
        raise InputError(str(path), f"an archive {suffix}", "the files in it, unpacked")
    if READERS and reader is None and name not in (*READERS, *_REFUSED):
        known = ", ".join(f".{each}" for each in READERS)
        others = "; of other formats a CSV file of the accelerations, or a reader of your own"
        raise InputError(str(path), f"suffix {suffix!r}", f"{known}{others}")
    chosen = _REFUSED.get(name) or READERS[name]
    accepted = inspect.signature(chosen).parameters
    options = {"column": column, "unit": unit, "dt": dt}
    specified = {name: value for name, value in options.items() if value is not None}
    for option, value in specified.items():
        if option not in accepted:
            taken = ", ".join(each for each in ("column", "unit", "dt") if each in accepted)
            raise InputError(
                f"{path}, option {option}",
                f"{value!r}",
                f"for {reader or suffix} files: {taken or 'no options'}",
            )
    if "unit" in accepted and accepted["unit"].default is inspect.Parameter.empty and not unit:
        raise InputError(
            f"{path}, option unit", "nothing", "the unit of the accelerations, for example unit='g'"
        )
    try:
        record: Any = chosen(path, **specified)
    except (InputError, OSError):
        raise
    except Exception as error:
        raise InputError(
            f"reader {name!r}",
            f"{type(error).__name__}: {' '.join(str(error).split())}",
            f"a Record of {path}",
        ) from error
    if not isinstance(record, Record):
        raise InputError(
            f"reader {name!r}",
            f"a {type(record).__name__} of {path}",
            "a Record, such as Record(acceleration_m_s2, dt_s)",
        )
    _warn_of_size(record, path)
    return record


def _warn_of_size(record: Record, path: str | Path) -> None:
    """Warn of a peak or a step that is hardly that of an earthquake's record."""
    if record.dt > LONGEST_STEP * (1 + 1e-9):
        warn(
            f"{path}: the step is {record.dt:.3g} s; records have {LONGEST_STEP:g} s at most: "
            "check the unit of the times",
            UserWarning,
        )
    peak = record.pga / STANDARD_GRAVITY
    if not WEAKEST <= peak <= STRONGEST:
        warn(
            f"{path}: the peak is {peak:.3g} g, read in {record.file_unit}; earthquakes have "
            f"{WEAKEST:g} to {STRONGEST:g} g: check the unit",
            UserWarning,
        )
