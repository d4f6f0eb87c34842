"""What a run leaves on disk: histories as netCDF, tables as CSV, whole or not at all."""

from __future__ import annotations

import csv
import itertools
import json
import math
import os
import re
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from . import __version__
from .comparison import json_report
from .errors import InputError
from .whole_file import replacing

if TYPE_CHECKING:
    import xarray

    from .comparison import Comparison
    from .simulation.result import Run

# netCDF 3: SciPy writes it, every reader of netCDF reads it
_ENGINE: Literal["scipy"] = "scipy"


class ResultsFolder:
    """A fresh folder that appears when everything is in it.

    Use it in a ``with`` block: files go to ``unfinished``, and without an error the folder takes
    its name at the end.

    Parameters
    ----------
    wanted : str or pathlib.Path
        Folder to make. One that holds something is left alone: a number is put after the name.

    Attributes
    ----------
    unfinished : pathlib.Path
        Where to write.
    path : pathlib.Path
        Where everything is after the block.

    Raises
    ------
    InputError
        If nothing can be written there.
    """

    def __init__(self, wanted: str | Path):
        self._wanted = Path(wanted)
        self.path = self._free()
        self.unfinished = self.path.with_name(f".{self.path.name}.{os.getpid()}")

    def _free(self) -> Path:
        wanted = self._wanted
        names = itertools.chain([wanted.name], (f"{wanted.name}-{k}" for k in itertools.count(2)))
        return next(path for name in names if _is_free(path := wanted.absolute().with_name(name)))

    def __enter__(self) -> ResultsFolder:
        self._made_parent = not self.path.parent.exists()
        try:
            self.unfinished.mkdir(parents=True)
        except OSError as error:
            raise InputError(
                f"{self._wanted}: results cannot be written there ({error.strerror}); accepted: a "
                "folder that you may write to"
            ) from None
        return self

    def __exit__(self, kind: type[BaseException] | None, *details: object) -> None:
        if kind is not None:
            shutil.rmtree(self.unfinished, ignore_errors=True)
            if self._made_parent:
                self.path.parent.rmdir()
            return
        # another run may have taken the name meanwhile
        self.path = self._free()
        self.unfinished.rename(self.path)


def _is_free(path: Path) -> bool:
    return not path.exists() or (path.is_dir() and not any(path.iterdir()))


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


_CONTENTS = {
    "report.html": "start here: opens in any browser, needs no network",
    "table.txt": "criteria and energies of each run, in engineering units",
    "criteria.csv": "the same in SI units, a line a run",
    "criteria.json": "the same as JSON",
    "scenario.toml": "what was run; isolation-sim run scenario.toml runs it again",
    "finding.txt": "what was found, in a paragraph",
    "diagnosis.json": "the diagnosis as JSON, in SI units",
    "report.md": "the diagnosis step by step, as text",
    "extended_law.toml": "the extended law: the [isolator] section of a scenario",
    "table.parquet": "a row a run, in SI units; isolation_sim.sweeps.Sweep reads it",
    "manifest.json": "what the sweep ran",
    "sweep": "the sweep behind it; isolation-sim sweep show reads it",
    "figures": "figures for publication, each as SVG and PNG",
    "*.svg": "figure for publication",
    "*.png": "the same as a picture",
    "*.nc": "histories of one run (netCDF, units inside); isolation_sim.read_run reads them",
    "*.csv": "table; its headings give the units",
}


def write_contents(folder: str | Path, title: str) -> Path:
    """Write ``README.txt`` into a folder of results: what each file in it is.

    Parameters
    ----------
    folder : str or pathlib.Path
        Folder with the results.
    title : str
        What the results are of.

    Returns
    -------
    pathlib.Path
        The file; results of a kind that is not known here are left out of it.
    """
    folder = Path(folder)
    lines = [f"{title}, by isolation-sim {__version__}", ""]
    told: set[Path] = set()
    for pattern, what in _CONTENTS.items():
        found = sorted(set(folder.glob(pattern)) - told)
        told.update(found)
        lines += [f"{path.name + '/' * path.is_dir():<24}{what}" for path in found]
    return write_text("\n".join(lines) + "\n", folder / "README.txt")


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


def file_name(name: str) -> str:
    """Turn a name to print into one for a file.

    Parameters
    ----------
    name : str
        Such as a controller's label.

    Returns
    -------
    str
        Letters, digits, dots, hyphens and underscores; never empty, never hidden.
    """
    return re.sub(r"[^\w.-]+", "_", name).strip(".") or "unnamed"


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
    with replacing(path) as unfinished:
        data.to_netcdf(unfinished, engine=_ENGINE)
    return Path(path)


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
    import xarray

    if not Path(path).is_file():
        raise InputError(f"{path}: no such file; accepted: netCDF, as isolation-sim run writes it")
    try:
        return xarray.load_dataset(path, engine=_ENGINE)
    except (OSError, TypeError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise InputError(f"{path}: not a netCDF file ({reason}); accepted: netCDF") from None


def write_table(records: Sequence[Mapping[str, Any]], path: str | Path) -> Path:
    """Write records as CSV, a column a key.

    Parameters
    ----------
    records : sequence of mapping
        Such as ``Comparison.to_records()``.
    path : str or pathlib.Path
        File to write, replaced whole or not at all.

    Returns
    -------
    pathlib.Path
        The file.
    """
    keys = list(dict.fromkeys(key for record in records for key in record))
    with replacing(path) as unfinished, unfinished.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, keys, restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows(records)
    return Path(path)


def write_text(text: str, path: str | Path) -> Path:
    """Write a text file.

    Parameters
    ----------
    text : str
        What to write.
    path : str or pathlib.Path
        File to write, replaced whole or not at all.

    Returns
    -------
    pathlib.Path
        The file.
    """
    with replacing(path) as unfinished:
        unfinished.write_text(text, encoding="utf-8")
    return Path(path)
