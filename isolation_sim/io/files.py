"""Files: written completely or not at all, with places checked first; TOML, JSON and netCDF."""

from __future__ import annotations

import json
import math
import os
import shutil
import tomllib
from collections.abc import Mapping
from dataclasses import is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from ground_motions.files import atomic_write

from ..errors import InputError

if TYPE_CHECKING:
    import xarray


def write_text(text: str, path: str | Path) -> Path:
    """Write a text file."""
    with atomic_write(path) as unfinished:
        unfinished.write_text(text, encoding="utf-8")
    return Path(path)


def read_toml(path: Path, accepted: str) -> dict[str, Any]:
    """Read a TOML file."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; expected: {accepted}") from None
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not UTF-8"
        raise InputError(f"{path}: cannot be read ({reason}); expected: {accepted}") from None
    return parse_toml(text, str(path))


def parse_toml(text: str, source: str = "") -> dict[str, Any]:
    """Read TOML from text."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        place = f"{source}: " if source else ""
        raise InputError(f"{place}not TOML: {error}; expected: TOML") from None


def json_text(value: Any, indent: int | None = 2, *, ensure_ascii: bool = True) -> str:
    """JSON text with null in place of NaN and infinity."""
    return json.dumps(plain(value), indent=indent, ensure_ascii=ensure_ascii, allow_nan=False)


def plain(value: Any) -> Any:
    """A value as JSON has it: a dataclass as a table of its fields, None for NaN and infinity."""
    if is_dataclass(value):
        value = vars(value)
    if isinstance(value, Mapping):
        return {key: plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value


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


# netCDF 3: SciPy writes it, and every netCDF reader reads it
_ENGINE: Literal["scipy"] = "scipy"


def write_netcdf(data: xarray.Dataset, path: str | Path) -> Path:
    """Write a dataset, completely or not at all; return the file."""
    # Without arrays of length 0, such as the currents of devices without coils: netCDF 3 writes
    # this length as an unlimited one, and SciPy does not read it.
    data = data.drop_dims([name for name, length in data.sizes.items() if length == 0])
    with atomic_write(path) as unfinished:
        data.to_netcdf(unfinished, engine=_ENGINE)
    return Path(path)


def read_netcdf(path: str | Path, accepted: str = "netCDF") -> xarray.Dataset:
    """Read a dataset into memory; ``accepted`` is the expected file, for errors."""
    import xarray

    if not Path(path).is_file():
        raise InputError(f"{path}: no such file; expected: {accepted}")
    try:
        return xarray.load_dataset(path, engine=_ENGINE)
    except (OSError, TypeError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise InputError(f"{path}: not a netCDF file ({reason}); expected: netCDF") from None
