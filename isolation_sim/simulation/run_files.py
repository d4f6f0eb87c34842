"""Histories of a run as netCDF."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ground_motions.argument_types import checked

from ..io.files import read_netcdf, write_netcdf
from ..version import __version__

if TYPE_CHECKING:
    import xarray

    from .result import Run


@checked
def write_run(run: Run, path: str | Path, scenario: str = "") -> Path:
    """Write a run's histories as netCDF.

    Parameters
    ----------
    run : Run
        A run.
    path : str or pathlib.Path
        File to write; replaced completely or not at all.
    scenario : str
        TOML of the scenario of the run, saved with it.

    Returns
    -------
    pathlib.Path
        The file.
    """
    data = run.history.assign_attrs(
        scenario=scenario,
        software=f"isolation-sim {__version__}",
        **{f"criterion_{name}": value for name, value in run.criteria.items()},
    )
    return write_netcdf(data, path)


@checked
def read_run(path: str | Path) -> xarray.Dataset:
    """Read a file of `write_run`.

    Parameters
    ----------
    path : str or pathlib.Path
        netCDF file.

    Returns
    -------
    xarray.Dataset
        Histories with units; ``attrs["scenario"]`` is the scenario's TOML.

    Raises
    ------
    InputError
        If the file is missing or not netCDF.
    """
    return read_netcdf(path, "netCDF, as isolation-sim run writes it")
