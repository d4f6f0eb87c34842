"""Writing a record to a CSV file that `read_csv` reads back."""

from __future__ import annotations

from pathlib import Path

from ground_motions.argument_types import checked
from ground_motions.errors import InputError
from ground_motions.files import atomic_write
from ground_motions.record import Record


@checked
def write_csv(record: Record, path: str | Path) -> Path:
    """Write a record as ``time_s, ground_acceleration_m_s2``; accelerations with every digit.

    Parameters
    ----------
    record : Record
        The motion.
    path : str or Path
        The file to write. It appears whole or not at all.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    path = Path(path)
    comments = [f"# {' '.join(text.split())}" for text in (record.name, record.source)]
    rows = (
        f"{time:.12g},{value!r}"
        for time, value in zip(record.time.tolist(), record.acceleration.tolist(), strict=True)
    )
    text = "\n".join([*comments, "time_s,ground_acceleration_m_s2", *rows, ""])
    try:
        with atomic_write(path) as unfinished:
            unfinished.write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise InputError(
            str(path), f"a file that cannot be written ({error.strerror})", "a writable place"
        ) from None
    return path
