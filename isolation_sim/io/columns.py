"""Tables of columns in one file: a NumPy ``.npz`` with one array per column."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Iterable, Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import IO

import numpy as np

from ..errors import InputError

_DATE = (1980, 1, 1, 0, 0, 0)
"""Time stamp of every column, so that equal tables give equal files."""


def columns_bytes(columns: Mapping[str, np.ndarray]) -> bytes:
    """A table as the content of a file."""
    sink = BytesIO()
    write_columns(columns.items(), sink)
    return sink.getvalue()


def write_columns(columns: Iterable[tuple[str, np.ndarray]], file: IO[bytes]) -> None:
    """Write a table, column by column."""
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, column in columns:
            if column.dtype.kind == "U":  # as wide as the longest text
                column = column.astype(f"U{np.strings.str_len(column).max(initial=1)}")
            buffer = BytesIO()
            np.lib.format.write_array(buffer, column, allow_pickle=False)
            entry = zipfile.ZipInfo(f"{name}.npy", _DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, buffer.getvalue())


def read_columns(
    source: str | Path | IO[bytes], names: Sequence[str] | None = None
) -> dict[str, np.ndarray]:
    """Read some columns of a table, all by default; a damaged file is refused."""
    try:
        with np.load(source, allow_pickle=False) as archive:
            return {name: archive[name] for name in (archive.files if names is None else names)}
    except (
        OSError, EOFError, KeyError, TypeError, ValueError, zipfile.BadZipFile, zlib.error,
    ) as error:  # fmt: skip
        raise InputError(
            f"{source}: cannot be read as a table ({error}); expected: an .npz file with an array "
            "a column"
        ) from None


def column_names(path: str | Path) -> list[str]:
    """Names of the columns of a table."""
    with np.load(path, allow_pickle=False) as archive:
        return list(archive.files)
