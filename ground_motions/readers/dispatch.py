"""Reading a file by its suffix."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ground_motions.errors import InputError
from ground_motions.readers.at2 import read_at2
from ground_motions.readers.csv_file import read_csv
from ground_motions.readers.text_file import read_text
from ground_motions.record import Record

# Suffix: reader, and the options that it takes.
_READERS: dict[str, tuple[Any, tuple[str, ...]]] = {
    ".at2": (read_at2, ()),
    ".vt2": (read_at2, ()),  # refused there, with the reason
    ".dt2": (read_at2, ()),
    ".csv": (read_csv, ("column",)),
    ".txt": (read_text, ("unit", "dt")),
    ".dat": (read_text, ("unit", "dt")),
}


def read(
    path: str | Path,
    *,
    column: str | None = None,
    unit: str | None = None,
    dt: float | None = None,
) -> Record:
    """Read a ground motion; the file's suffix says how.

    Parameters
    ----------
    path : str or Path
        ``.at2`` (see `read_at2`), ``.csv`` (see `read_csv`), ``.txt`` or ``.dat`` (see
        `read_text`).
    column : str, optional
        CSV only: name of the acceleration column.
    unit : str, optional
        Text only, and needed there: unit of the accelerations.
    dt : float, optional
        Text only: sampling step, s.

    Returns
    -------
    Record
        The motion in m/s2.

    Raises
    ------
    InputError
        If the suffix is unknown, an option does not belong to the format, or the file is refused
        by its reader.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in _READERS:
        raise InputError(
            str(path), f"suffix {suffix!r}", ".at2, .csv, .txt or .dat (or call a reader by name)"
        )
    reader, accepted = _READERS[suffix]
    options = {"column": column, "unit": unit, "dt": dt}
    given = {name: value for name, value in options.items() if value is not None}
    for name in given:
        if name not in accepted:
            raise InputError(
                f"{path}, option {name}",
                f"{given[name]!r}",
                f"for {suffix} files: {', '.join(accepted) or 'no options'}",
            )
    if "unit" in accepted and unit is None:
        raise InputError(
            f"{path}, option unit", "nothing", "the unit of the accelerations, for example unit='g'"
        )
    record: Record = reader(path, **given)
    return record
