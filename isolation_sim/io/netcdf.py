"""netCDF files of labelled arrays."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from ..errors import InputError
from .files import atomic_write

if TYPE_CHECKING:
    import xarray

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
