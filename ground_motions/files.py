"""Files that appear complete or not at all."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

UNFINISHED = ".unfinished"
"""Ending of a file until it is complete; a kill may leave it."""


@contextmanager
def atomic_write(path: str | Path, *, durable: bool = False) -> Iterator[Path]:
    """Yield a path beside a file, which takes its place when it is complete."""
    # ``durable``: forced to the disk, so that it survives a power failure
    path = Path(path)
    own = f".{path.name}.{os.getpid()}.{threading.get_ident()}{UNFINISHED}"
    unfinished = path.with_name(own)
    try:
        yield unfinished
        if durable:
            with unfinished.open("r+b") as file:
                os.fsync(file.fileno())
        unfinished.replace(path)
        if durable and os.name == "posix":
            _sync_folder(path.parent)
    except OSError as error:
        if error.errno is None:
            raise
        # the temporary name would not help the user
        raise OSError(error.errno, error.strerror, str(path)) from None
    finally:
        with suppress(OSError):
            unfinished.unlink(missing_ok=True)


def _sync_folder(folder: Path) -> None:
    """Force a folder's file names to the disk."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
