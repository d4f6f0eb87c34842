"""Reading all ground motions of a folder."""

from __future__ import annotations

from pathlib import Path

from ground_motions.errors import InputError
from ground_motions.readers.csv_file import acceleration_columns
from ground_motions.readers.dispatch import READERS, read
from ground_motions.record import Record


def read_folder(folder: str | Path) -> tuple[Record, ...]:
    """Read every ground motion of a folder.

    Parameters
    ----------
    folder : str or Path
        Its files with a suffix that `read` knows are read, the others passed over; of a CSV file
        every acceleration column is a motion.

    Returns
    -------
    tuple of Record
        In the order of the files' names.

    Raises
    ------
    InputError
        If there is no such folder, no motion in it, or one of its files is refused.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(str(folder), "no such folder", "a folder of ground motions")
    records: list[Record] = []
    for path in sorted(folder.iterdir()):
        suffix = path.suffix.lower()
        if suffix == ".csv":
            records += (read(path, column=column) for column in acceleration_columns(path))
        elif suffix.removeprefix(".") in READERS:
            records.append(read(path))
    if not records:
        known = ", ".join(f".{each}" for each in READERS)
        raise InputError(str(folder), "no ground motion in it", f"files such as {known}")
    return tuple(records)
