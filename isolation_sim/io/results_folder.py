"""Results folders: written completely or not at all, with a list of their files."""

from __future__ import annotations

import itertools
import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ground_motions.files import UNFINISHED

from ..errors import InputError
from ..version import __version__
from .files import write_text


class ResultsFolder:
    """A new folder that appears when it is complete."""

    # Use it in a ``with`` block: write the files to ``unfinished``. Without an error the folder
    # gets its name at the end.

    def __init__(self, target: str | Path, overwrite: bool = False):
        self._target, self._overwrite = Path(target), overwrite
        if overwrite:
            _check_replaceable(self._target)
        self.path = self._free()  # Folder after the block
        self.unfinished = self.path.with_name(
            f".{self.path.name}.{os.getpid()}"
        )  # Folder to write to

    def _free(self) -> Path:
        target = self._target.absolute()
        return target if self._overwrite else _free_name(target)

    def __enter__(self) -> ResultsFolder:
        self._new_parents = _new_folders(self.path.parent)
        with writing_to(self._target):
            self.unfinished.mkdir(parents=True)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: object
    ) -> None:
        if kind is not None:
            _name_the_target(error, self.unfinished, self.path)
            shutil.rmtree(self.unfinished, ignore_errors=True)
            _remove_empty(self._new_parents)
            return
        # another run may have taken the name meanwhile
        self.path = self._free()
        old = self.unfinished.with_name(f"{self.unfinished.name}.old")
        if self._overwrite and self.path.exists():
            self.path.rename(old)
        self.unfinished.rename(self.path)
        if old.exists():
            _keep_own_files(old, self.path)


_WRITTEN_SUFFIXES = {".svg", ".png", ".csv", ".nc", ".npz", UNFINISHED}
"""Endings of the files in folders such as ``figures``; others there are the user's own."""

_RESULT_FILES = ("result.npz", "tuning.json", "manifest.json", "suite.json", "finding.txt")
"""Files by which a folder contains a saved result."""


@contextmanager
def writing_to(folder: str | Path) -> Iterator[None]:
    """Refuse a folder that cannot be written."""
    try:
        yield
    except OSError as error:
        raise InputError(
            f"{folder}: results cannot be written there ({error.strerror}); expected: a folder "
            "with write permission, on a disk with free space"
        ) from None


@contextmanager
def files_into(folder: str | Path, overwrite: bool) -> Iterator[Path]:
    """Yield a folder for the files of a result; none replaces another without ``overwrite``."""
    folder = Path(folder)
    for name in () if overwrite else _RESULT_FILES:
        if (folder / name).exists():
            raise InputError(
                f"{folder}: contains a saved result ({name}); expected: another folder, or "
                "overwrite=True to replace its files"
            )
    beside = folder / f".{os.getpid()}{UNFINISHED}"
    new = _new_folders(folder.absolute())
    try:
        beside.mkdir(parents=True)
        yield beside
        moves = {
            path: folder / path.relative_to(beside) for path in beside.rglob("*") if path.is_file()
        }
        for place in () if overwrite else moves.values():
            if place.exists():
                raise InputError(
                    f"{place}: exists; expected: another folder, or overwrite=True to replace it"
                )
        for path, place in moves.items():
            place.parent.mkdir(parents=True, exist_ok=True)
            path.replace(place)
    except OSError as error:
        _name_the_target(error, beside, folder)
        raise
    finally:
        shutil.rmtree(beside, ignore_errors=True)
        _remove_empty(new)


def _new_folders(folder: Path) -> list[Path]:
    """A folder and those above it that do not exist yet."""
    return list(itertools.takewhile(lambda each: not each.exists(), (folder, *folder.parents)))


def _name_the_target(error: BaseException | None, unfinished: Path, target: Path) -> None:
    """Let an error name the file to be: the temporary name would not help the user."""
    if isinstance(error, OSError) and error.filename:
        error.filename = str(error.filename).replace(str(unfinished), str(target))


def _remove_empty(folders: list[Path]) -> None:
    """Remove folders without files, as after an error."""
    for folder in folders:
        with suppress(OSError):  # another run may have written its results there
            folder.rmdir()


@contextmanager
def replace_results(folder: Path, overwrite: bool, resume: bool) -> Iterator[None]:
    """Move earlier results away during the work, and restore them after an error."""
    if overwrite and resume:
        raise InputError("--overwrite and --resume are both set; expected: at most one of them")
    if not overwrite or _is_free(folder):
        yield
        return
    _check_replaceable(folder)
    earlier = folder.with_name(f".{folder.name}.{os.getpid()}.old")
    folder.rename(earlier)
    try:
        yield
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        earlier.rename(folder)
        raise
    _keep_own_files(earlier, folder)


def _keep_own_files(earlier: Path, folder: Path) -> None:
    """Move the user's own files of an earlier folder into the new one, and remove the results."""
    for path in _own_files(earlier):
        place = folder / path.relative_to(earlier)
        place.parent.mkdir(parents=True, exist_ok=True)
        path.rename(_free_name(place))
    shutil.rmtree(earlier)


def _own_files(folder: Path) -> list[Path]:
    """Files and folders in a results folder that its ``README.txt`` does not list."""
    listed, own = _listed(folder), []
    for path in folder.iterdir():
        if path.name not in listed:
            own.append(path)
        elif path.is_dir() and is_results(path):
            own += _own_files(path)
        elif path.is_dir():
            files = (each for each in path.rglob("*") if each.is_file())
            own += [each for each in files if each.suffix not in _WRITTEN_SUFFIXES]
    return own


def _listed(folder: Path) -> set[str]:
    """Names in the ``README.txt`` of a results folder, with itself."""
    if not is_results(folder):
        return set()
    lines = (folder / "README.txt").read_text(encoding="utf-8").splitlines()[2:]
    return {"README.txt", ".lock", *(line.partition("  ")[0].rstrip("/") for line in lines)}


def _check_replaceable(folder: Path) -> None:
    """Refuse to replace a folder that contains other files than results."""
    if not _is_free(folder) and not is_results(folder):
        raise InputError(
            f"{folder}: is no results folder of isolation-sim; expected with --overwrite: a "
            "results folder"
        )


def check_free(folder: Path, resumable: bool = False, instead: str = "") -> None:
    """Refuse a file, and a folder that is not empty; ``instead`` is an option that accepts it."""
    if folder.is_file():
        raise InputError(f"{folder}: a file; expected: a new folder")
    if not _is_free(folder):
        instead = instead or ("--overwrite" if is_results(folder) else "")
        remedy = f", or {instead}" if instead else ""
        if resumable:
            remedy = ", --overwrite, or --resume to continue"
        raise InputError(f"{folder}: is not empty; expected: a new folder{remedy}")


def law_file(path: str | Path) -> Path:
    """The file of a law: of the folder of a diagnosis or of a fit, the one in it."""
    path = Path(path)
    if not path.is_dir():
        return path
    names = "extended_law.toml", "fitted.toml"
    for name in names:
        if (path / name).is_file():
            return path / name
    raise InputError(f"{path}: a folder without {' or '.join(names)}; expected: a file of a law")


def is_results(folder: Path) -> bool:
    """Whether a folder was written by `write_contents`."""
    return _title(folder) is not None


def _title(folder: Path) -> str | None:
    """Title of a results folder; None for another folder."""
    try:
        first = (folder / "README.txt").read_text(encoding="utf-8").partition("\n")[0]
    except (OSError, UnicodeDecodeError):
        return None
    title, by, _ = first.partition(", by isolation-sim ")
    return title if by else None


def _free_name(target: Path) -> Path:
    """The path, or with a number added if it is in use."""
    names = itertools.chain([target.name], (f"{target.name}-{k}" for k in itertools.count(2)))
    return next(path for name in names if _is_free(path := target.with_name(name)))


def _is_free(path: Path) -> bool:
    return not path.exists() or (path.is_dir() and not any(path.iterdir()))


_CONTENTS = {
    "report.html": "start here; opens in any browser without a network",
    "table.txt": "criteria and energies of each run, in engineering units",
    "criteria.csv": "the same in SI units, one line per run",
    "criteria.json": "the same as JSON",
    "scenario.toml": "the scenario; isolation-sim {command} scenario.toml runs it again",
    "finding.txt": "the finding, in a paragraph",
    "diagnosis.json": "the diagnosis as JSON, in SI units",
    "report.md": "the diagnosis step by step, as text",
    "extended_law.toml": "the extended law: the [isolator] section of a scenario",
    "extended_law.py": "the extended law with its equation: Python to read and edit",
    "*.py": "copy of the file of a law or an effect",
    "controller.toml": "the tuned controller: the [[controller]] section of a scenario",
    "tuning.json": "every trial of the search with its scores; --resume continues from it",
    "trials.csv": "settings and mean score of every trial",
    "sensitivity.csv": "mean score over the range of each setting; the others are tuned",
    "scores.csv": "scores by motion, before and after",
    "errors.csv": "relative RMS errors of each run, before and after",
    "causes.csv": "the identified causes, with their parameters",
    "chunks": "finished parts of an unfinished sweep; --resume continues it",
    "table.npz": "one row per run, one array per column, in SI units; isolation_sim.load reads it",
    "result.npz": "all data; isolation_sim.load returns the object",
    "law.csv": "the fitted law: polynomials of the current, by parameter",
    "parameters.csv": "the fitted numbers with their intervals",
    "loops_*.csv": "measured motion, current and force of a run, and the fitted force",
    "fitted.toml": "the fitted law: the [isolator] section of a scenario",
    "manifest.json": "the plan and state of the sweep",
    "statistics.csv": "mean, median, 84th percentile, maximum of every criterion, in SI units",
    "runs.csv": "every run, in SI units",
    "suite.json": "the motions of the suite and their scaling",
    "motions.csv": "the motions with their scale factors and processing",
    "spectra.csv": "spectra of the motions and of the target",
    "peak_floor_acceleration_m_s2.csv": "peaks of each level over the motions",
    "peak_drift_m.csv": "peak drifts of each storey over the motions",
    "peak_drift_ratio.csv": "the same over the storey heights",
    "floor_spectrum_m_s2.csv": "floor spectra over the motions, 5 % damping",
    "histories": "histories of the runs (netCDF); isolation_sim.read_run reads them",
    "motions": "the scaled motions",
    "sweep": "the sweep of the suite; isolation-sim sweep show reads it",
    "figures": "figures for publication, each as SVG and PNG",
    "*.svg": "figure for publication",
    "*.png": "the same as a picture",
    "*.nc": "histories of one run (netCDF, units inside); isolation_sim.read_run reads them",
    "results.mat": "all tables and histories for MATLAB: load results.mat",
    "results.xlsx": "all tables and histories as a workbook, one sheet per table",
    "results_csv": "all histories as CSV; a sweep's table too",
    "*.csv": "table; its headings give the units",
}


def write_contents(folder: str | Path, title: str, later: tuple[str, ...] = ()) -> Path:
    """Write ``README.txt``, a list of the files, to a results folder; ``later``: files to come."""
    # A second list does not add files that only a pattern describes: they are the user's own.
    folder = Path(folder)
    again, earlier = is_results(folder), _listed(folder)
    listed: dict[str, str] = {}
    for pattern, what in _CONTENTS.items():
        there = {path.name for path in folder.glob(pattern)} | ({pattern} & set(later))
        if again and "*" in pattern:
            there &= earlier
        listed |= dict.fromkeys(sorted(there - set(listed)), what)
    command = "suite" if "suite.json" in listed else "run"
    names = [name + "/" * (folder / name).is_dir() for name in listed]
    width = max(map(len, names), default=0) + 2
    lines = [f"{title}, by isolation-sim {__version__}", ""]
    lines += [
        f"{name:<{width}}{what.format(command=command)}"
        for name, what in zip(names, listed.values(), strict=True)
    ]
    return write_text("\n".join(lines) + "\n", folder / "README.txt")


@contextmanager
def removed_if_empty(folder: Path) -> Iterator[None]:
    """After an error, remove a folder that contains only its list of files."""
    try:
        yield
    except InputError:
        if [path.name for path in folder.iterdir()] == ["README.txt"]:
            shutil.rmtree(folder)
        raise


def update_contents(folder: Path) -> None:
    """Write the list of files of a results folder again, with those written since."""
    if (title := _title(folder)) is not None:
        write_contents(folder, title)


def file_name(name: str) -> str:
    """Convert a printed name to a file name."""
    return re.sub(r"[^\w.-]+", "_", name).strip(".") or "unnamed"
