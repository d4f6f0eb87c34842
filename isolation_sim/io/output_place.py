"""Checks of output files and folders before the work."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from ..errors import InputError


def check_new_files(force: bool, *paths: Path | None) -> None:
    """Refuse existing files without ``force``, and places without write permission."""
    places = [path for path in paths if path is not None]
    for path in places:
        if path.is_dir():
            raise InputError(f"{path}: a folder; expected: a file")
        if path.exists() and not force:
            raise InputError(f"{path}: exists; expected: a new name, or --force to replace it")
        check_writable(path.parent)


def check_writable(folder: Path) -> None:
    """Refuse a folder that cannot be written or created."""
    there = _nearest(folder)
    if not there.is_dir():
        raise InputError(f"{folder}: {there} is a file; expected: a folder")
    if not os.access(there, os.W_OK | os.X_OK):
        raise InputError(f"{folder}: cannot be written; expected: a folder with write permission")


def free_space(folder: Path) -> float:
    """Free bytes on the disk of a folder, which need not exist."""
    return float(shutil.disk_usage(_nearest(folder)).free)


def _nearest(folder: Path) -> Path:
    """The folder, or its nearest existing parent."""
    folder = folder.absolute()
    return next(place for place in (folder, *folder.parents) if place.exists())
