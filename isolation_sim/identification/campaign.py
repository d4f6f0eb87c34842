"""A campaign: a folder of measured runs, read and written.

The folder holds ``campaign.toml`` and one CSV file per run::

    name = "MR damper, sinusoidal tests"
    source = "laboratory, year"

    [[run]]
    file = "10mm_1Hz_0A.csv"

    [[run]]
    file = "10mm_1Hz_1A.csv"
    hold_out = true
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ground_motions.argument_types import checked

from ..errors import InputError, did_you_mean, unknown_name
from ..io.files import read_toml
from ..io.results_folder import ResultsFolder, writing_to
from .measured.run_table import TestRun, read_run

__all__ = ["Campaign", "TestRun", "read_campaign", "read_run", "write_campaign"]

FILE_NAME = "campaign.toml"
_KEYS = ("name", "source", "run")
_RUN_KEYS = ("file", "hold_out")


@checked
@dataclass(frozen=True, eq=False)
class Campaign:
    """Measured runs of one device.

    Attributes
    ----------
    name : str
        Name to print.
    source : str
        Where the data come from.
    runs : tuple of TestRun
        In the order of ``campaign.toml``.

    Raises
    ------
    InputError
        If no run is left to fit, two runs share a name, or some runs have a current and others
        none.
    """

    name: str
    source: str
    runs: tuple[TestRun, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "runs", tuple(self.runs))
        if not self.fitted:
            held = f"{len(self.runs)} runs, all with hold_out = true" if self.runs else "no run"
            raise InputError(f"{self.name}: {held}; expected: one run or more left to fit")
        names = [run.name for run in self.runs]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise InputError(f"{self.name}: run {twice[0]!r} twice; expected: different names")
        lacking = [run.name for run in self.runs if not run.current_measured]
        if 0 < len(lacking) < len(self.runs):
            raise InputError(
                f"{self.name}: no current_A in {lacking[0]!r}; expected: a current in all runs or, "
                "of a device without coil, in none"
            )

    def __repr__(self) -> str:
        held = len(self.held_out)
        return f"Campaign({self.name!r}, {len(self.runs)} runs, {held} held out)"

    @property
    def column_notes(self) -> list[str]:
        """What the columns of the runs lack, and which are not used."""
        notes = []
        if not self.runs[0].current_measured:
            notes.append("no column current_A: the device counts as one without coil")
        ignored = Counter(name for run in self.runs for name in run.ignored_columns)
        if ignored:
            names = ", ".join(f"{name} ({n})" for name, n in ignored.items())
            notes.append(f"columns that are not used (runs that have them): {names}")
        return notes

    @property
    def fitted(self) -> tuple[TestRun, ...]:
        """Runs to fit."""
        return tuple(run for run in self.runs if not run.hold_out)

    @property
    def held_out(self) -> tuple[TestRun, ...]:
        """Runs that are not fitted and validate the fit."""
        return tuple(run for run in self.runs if run.hold_out)


@checked
def read_campaign(folder: str | Path) -> Campaign:
    """Read a campaign folder.

    Parameters
    ----------
    folder : str or pathlib.Path
        The folder, or its ``campaign.toml``. Nothing in it is modified.

    Returns
    -------
    Campaign
        Arrays in SI, read-only; each column converted by the unit in its own name.

    Raises
    ------
    InputError
        If the folder, ``campaign.toml`` or a run's file is missing or not usable; one line that
        names the file, the place, what was given and what is accepted.
    """
    folder = Path(folder)
    if folder.name == FILE_NAME:
        folder = folder.parent
    path = folder / FILE_NAME
    data = _read_toml(folder, path)
    _check_keys(data, _KEYS, f"key in {path}")
    name, source = (_text(data, key, path) for key in ("name", "source"))
    tables = data.get("run", [])
    if not (isinstance(tables, list) and tables and all(isinstance(t, dict) for t in tables)):
        raise InputError(f"{path}: no run; expected: one [[run]] a test, with file = '….csv'")
    entries = [_entry(path, k, table) for k, table in enumerate(tables, start=1)]
    files = [file for file, _ in entries]
    for k, file in enumerate(files):
        if file in files[:k]:
            raise InputError(f"{path}, run {k + 1}: file {file!r} again; expected: a file once")
    if all(hold_out for _, hold_out in entries):
        raise InputError(
            f"{path}: hold_out = true in all {len(entries)} runs; expected: one run or more left "
            "to fit"
        )
    runs = tuple(read_run(folder / file, hold_out) for file, hold_out in entries)
    return Campaign(name or folder.resolve().name, source, runs)


@checked
def write_campaign(campaign: Campaign, folder: str | Path) -> Path:
    """Write a campaign to a folder that `read_campaign` reads back with every digit.

    Parameters
    ----------
    campaign : Campaign
        Campaign to write; a velocity or current that was not measured is left out.
    folder : str or pathlib.Path
        Folder to make; it must not exist. It takes its name when everything is in it.

    Returns
    -------
    pathlib.Path
        The folder.

    Raises
    ------
    InputError
        If the folder exists or cannot be written, or a run's name cannot name a file.
    """
    import tomlkit

    folder = Path(folder)
    if folder.exists():
        raise InputError(f"{folder}: exists already; expected: a folder to be made")
    document: dict[str, Any] = {"name": campaign.name, "source": campaign.source, "run": []}
    for run in campaign.runs:
        if Path(run.name).name != run.name:
            raise InputError(f"run {run.name!r}; expected: a name without / that can name a file")
        held: dict[str, Any] = {"hold_out": True} if run.hold_out else {}
        document["run"].append({"file": f"{run.name}.csv", **held})
    with writing_to(folder), ResultsFolder(folder) as made:
        for run in campaign.runs:
            _write_run(run, made.unfinished / f"{run.name}.csv")
        text = tomlkit.dumps(document)
        (made.unfinished / FILE_NAME).write_text(text, encoding="utf-8", newline="\n")
    return folder


def _write_run(run: TestRun, path: Path) -> None:
    columns: dict[str, np.ndarray | None] = {
        "time_s": run.time,
        "displacement_m": run.displacement,
        "velocity_m_s": run.velocity if run.velocity_measured else None,
        "acceleration_m_s2": run.acceleration,
        "current_A": run.current if run.current_measured else None,
        "force_N": run.force,
        "temperature_C": run.temperature,
    }
    measured = {name: column.tolist() for name, column in columns.items() if column is not None}
    rows = zip(*measured.values(), strict=True)
    lines = [",".join(measured), *(",".join(map(repr, row)) for row in rows), ""]
    path.write_text("\n".join(lines), encoding="utf-8", newline="\n")


def _read_toml(folder: Path, path: Path) -> dict[str, Any]:
    accepted = (
        f"a folder with {FILE_NAME} and one CSV file per run, which isolation-sim import makes of "
        "test files"
    )
    if not folder.is_dir():
        what = "a file" if folder.exists() else "a folder that does not exist"
        raise InputError(f"{folder}: {what}; expected: {accepted}")
    if not path.exists():
        raise InputError(f"{folder}: no {FILE_NAME} in it; expected: {accepted}")
    return read_toml(path, accepted)


def _check_keys(table: Mapping[str, Any], accepted: tuple[str, ...], kind: str) -> None:
    for key in table:
        if key not in accepted:
            raise unknown_name(kind, key, accepted)


def _text(data: Mapping[str, Any], key: str, path: Path) -> str:
    value = data.get(key, "")
    if not isinstance(value, str):
        raise InputError(f"{path}, {key}: {value!r}; expected: text in quotes")
    return value


def _entry(path: Path, number: int, table: Mapping[str, Any]) -> tuple[str, bool]:
    place = f"{path}, run {number}"
    _check_keys(table, _RUN_KEYS, f"key in {place},")
    file, hold_out = table.get("file"), table.get("hold_out", False)
    if not (isinstance(file, str) and file):
        file_text = "no file" if file is None else f"file = {file!r}"
        raise InputError(
            f"{place}: {file_text}; expected: file = 'name of a CSV file in the folder'"
        )
    if not (path.parent / file).exists():
        hint = did_you_mean(file, (each.name for each in path.parent.iterdir()))
        raise InputError(f"{place}: no file {file!r};{hint} expected: a CSV file in the folder")
    if not isinstance(hold_out, bool):
        raise InputError(f"{place}, hold_out: {hold_out!r}; expected: true or false")
    return file, hold_out
