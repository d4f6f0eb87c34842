"""Places for output, checked before the work that fills them."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from ..errors import InputError


def check_new_files(force: bool, *paths: Path | None) -> None:
    """Refuse files that exist, unless ``force`` is given, and places that cannot be written."""
    existing = [path for path in paths if path is not None]
    for path in existing:
        if path.is_dir():
            raise InputError(f"{path}: a folder; expected: a file")
        if path.exists() and not force:
            raise InputError(f"{path}: exists; expected: a new name, or --force to replace it")
        check_writable(path.parent)


def check_writable(folder: Path) -> None:
    """Refuse a folder that cannot be written, or cannot be made."""
    there = _nearest(folder)
    if not there.is_dir():
        raise InputError(f"{folder}: {there} is a file; expected: a folder")
    if not os.access(there, os.W_OK | os.X_OK):
        raise InputError(f"{folder}: cannot be written; expected: a folder that you may write to")


def free_space(folder: Path) -> float:
    """Bytes that are free on the disk of a folder, which need not exist."""
    return float(shutil.disk_usage(_nearest(folder)).free)


def _nearest(folder: Path) -> Path:
    """The folder, or the nearest one above it that exists."""
    folder = folder.absolute()
    return next(place for place in (folder, *folder.parents) if place.exists())
