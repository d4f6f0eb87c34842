"""Folders of results: named once, complete or absent, with a list of what is in them."""

from __future__ import annotations

import itertools
import os
import re
import shutil
from pathlib import Path

from ..errors import InputError
from ..version import __version__
from .atomic_write import write_text


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
    "statistics.csv": "mean, median, 84th percentile, maximum of every criterion, in SI units",
    "runs.csv": "every run of the suite, in SI units",
    "suite.json": "the motions of the suite and what was done to them",
    "motions": "the motions as they shake the building",
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
