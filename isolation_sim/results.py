"""What a run leaves on disk: histories as netCDF, tables as CSV, whole or not at all."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .comparison import json_report
from .io.atomic_write import write_text
from .io.csv_table import write_table
from .io.netcdf import read_netcdf, write_netcdf
from .io.results_folder import file_name, write_contents
from .version import __version__

if TYPE_CHECKING:
    import xarray

    from .comparison import Comparison
    from .simulation.result import Run


def write_comparison(
    comparison: Comparison, folder: str | Path, scenario: str = "", figures: bool = True
) -> None:
    """Write everything that a comparison shows.

    Parameters
    ----------
    comparison : Comparison
        Runs to write.
    folder : str or pathlib.Path
        Where to; gets ``report.html``, ``<controller>.nc``, ``criteria.csv``, ``criteria.json``,
        ``table.txt``, ``scenario.toml``, ``figures/``, and ``README.txt``, which says what is what.
    scenario : str
        TOML of the scenario that produced it; no ``scenario.toml`` if empty.
    figures : bool, default True
        Whether to draw figures, each as SVG and PNG.
    """
    folder = Path(folder)
    for name, run in comparison.runs.items():
        write_run(run, folder / f"{file_name(name)}.nc", scenario)
    write_table(comparison.to_records(), folder / "criteria.csv")
    write_text(json_text(comparison), folder / "criteria.json")
    write_text(f"{comparison}\n", folder / "table.txt")
    if scenario:
        write_text(scenario, folder / "scenario.toml")
    if figures:
        _write_figures(comparison, folder / "figures")
    comparison.to_html(folder / "report.html", scenario)
    write_contents(folder, comparison.title)


def _write_figures(comparison: Comparison, folder: Path) -> None:
    from .reports.figures import save

    isolated = next(iter(comparison.runs.values())).isolated
    kinds = ["time_histories", "floor_envelopes", "energy"]
    kinds += ["loops"] * bool(isolated.elements) + ["currents"] * bool(isolated.n_channels)
    for kind in kinds:
        save(comparison.plot(kind), folder, kind)


def json_text(comparison: Comparison) -> str:
    """Report of a comparison as JSON.

    Parameters
    ----------
    comparison : Comparison
        Runs to report.

    Returns
    -------
    str
        `json_report`, with null for what is not a finite number: JSON has no word for it.
    """
    return json.dumps(_finite(json_report(comparison)), indent=2, allow_nan=False) + "\n"


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list):
        return [_finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write_run(run: Run, path: str | Path, scenario: str = "") -> Path:
    """Write a run's histories as netCDF.

    Parameters
    ----------
    run : Run
        A run.
    path : str or pathlib.Path
        File to write, replaced whole or not at all.
    scenario : str
        TOML of the scenario that produced it, kept with it.

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


def read_run(path: str | Path) -> xarray.Dataset:
    """Read what `write_run` wrote.

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
