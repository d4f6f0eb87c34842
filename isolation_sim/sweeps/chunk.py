"""Chunks of a sweep: some cases, run in sequence or in vector lanes; no side effects."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..criterion import selected_criteria
from ..errors import Diverged, InputError
from ..io.columns import columns_bytes
from ..io.results_folder import file_name
from ..scenario import Scenario
from ..simulation.batch import Case, run_cases
from ..simulation.floors import floor_response
from ..simulation.run import simulate
from ..simulation.run_files import write_run
from ..simulation.validity import Validity, validity_of
from .design import CaseSpec
from .rows import Row, energy_record, table_columns

if TYPE_CHECKING:
    from ..simulation.result import Run

FLOORS = "_floors.npz"
"""End of the names of the files of floors."""


@dataclass(frozen=True)
class Chunk:
    """Cases to run, with all their inputs."""

    number: int  # Place in the plan
    base: dict[str, Any]  # Data of the base scenario
    controllers: tuple[str, ...]  # Labels of the scenario's controllers
    cases: tuple[CaseSpec, ...]  # The cases
    parameters: dict[str, type]  # Columns of the varied quantities
    energy: bool = False  # Whether to compute every run's energy ledger
    histories: bool | frozenset[int] = False  # Whether to save histories, or of which cases
    floors: bool = False  # Whether to save peaks and spectra of the floors

    def __str__(self) -> str:
        return f"cases {self.cases[0].number} to {self.cases[-1].number}"

    def saves_histories(self, case: int) -> bool:
        """Whether a case's histories are saved."""
        return self.histories if isinstance(self.histories, bool) else case in self.histories

    def __call__(self) -> Finished:
        """Run its cases."""
        # A row does not depend on other rows. Size and order of the chunks therefore do not change
        # the results, to the last bit.
        cache: dict[tuple[str, ...], Any] = {}
        rows = [row for case in self.cases for row in _rows(self, case, cache)]
        histories: dict[str, bytes] = {}
        alike: dict[str, list[Row]] = {}
        for row in rows:
            if row.job is None:
                continue
            saves_history = self.saves_histories(row.case.number)
            if self.energy or self.floors or saves_history:
                run = alone(row)
                if run is not None and self.energy:
                    row.energy = energy_record(run)
                if run is not None and saves_history:
                    name = history_name(row.case.number, row.controller)
                    histories[name] = _history(run, self, row)
                if run is not None and self.floors:
                    histories |= floors_of(run, row)
            else:
                options = {key: value for key, value in row.job.options.items() if key != "nominal"}
                alike.setdefault(repr(options), []).append(row)
        for group in alike.values():
            side_by_side(group, threads=1)
        failed = sum(row.status != "ok" for row in rows)
        names = [entry["name"] for entry in self.base["controller"]]
        selection = self.base.get("simulation", {}).get("criteria", ())
        further = [one.name for one in selected_criteria(selection)]
        table = columns_bytes(table_columns(rows, self.parameters, names, self.energy, further))
        return Finished(self.number, table, len(rows), failed, histories)


@dataclass
class Finished:
    """Results of a chunk."""

    number: int  # Place of the chunk in the plan
    table: bytes  # Content of a file of columns, one row per run
    # n_runs, n_failed: Numbers of runs and of failed runs
    n_runs: int
    n_failed: int
    histories: dict[str, bytes] = field(default_factory=dict)  # Files beside the table, by name


def history_name(case: int, controller: str, end: str = ".nc") -> str:
    """Return the file name of a run's histories, or with ``FLOORS`` of its floors."""
    return f"case_{case:07d}_{file_name(controller)}{end}"


def floors_of(run: Run, row: Row) -> dict[str, bytes]:
    """The floors of a run, by the name of their file."""
    name = history_name(row.case.number, row.controller, FLOORS)
    return {name: columns_bytes(floor_response(run))}


def _rows(chunk: Chunk, case: CaseSpec, cache: dict[tuple[str, ...], Any]) -> list[Row]:
    """Build a case; parts in common with other cases are built once."""
    rows = [Row(case, label) for label in chunk.controllers]
    try:
        data = case.data(chunk.base)
    except InputError as error:
        for row in rows:
            row.fail(error)
        return rows
    entries = data["controller"]
    try:
        jobs = [Scenario(**data).build(cache)] * len(rows)
    except InputError:
        # other controllers may have valid settings
        jobs = []
    for k, row in enumerate(rows):
        try:
            row.job = jobs[k] if jobs else Scenario(**{**data, "controller": [entries[k]]}).build()
            row.control = list(row.job.controllers.values())[k if jobs else 0]
        except Exception as error:
            row.fail(error)
    return rows


def alone(row: Row) -> Run | None:
    """Run in sequence, like ``isolation-sim run``."""
    assert row.job is not None and row.control is not None
    try:
        run = simulate(row.job.isolated, row.job.records, row.control, **row.job.options)
        row.criteria, row.validity = run.criteria, validity_of(run)
    except Exception as error:
        row.fail(error)
        return None
    return run


def side_by_side(
    rows: Sequence[Row], threads: int | None, progress: Callable[[int], None] | None = None
) -> None:
    """Run cases with equal driver, sensors and options in vector lanes."""
    cases, options = [], {}
    for row in rows:
        assert row.job is not None and row.control is not None
        options = dict(row.job.options)
        nominal = options.pop("nominal", None)
        cases.append(Case(row.job.isolated, row.job.records, row.control, nominal))
    try:
        batch = run_cases(cases, threads=threads, progress=progress, **options)
    except Exception:
        # a case that cannot start stops its whole batch: find this case
        for row in rows:
            alone(row)
        return
    validity = zip(*(getattr(batch, name).tolist() for name in Validity._fields), strict=True)
    for k, (row, each) in enumerate(zip(rows, validity, strict=True)):
        row.validity = Validity(*each)
        reason = batch.failure[k]
        if reason is None:
            row.criteria = {name: float(values[k]) for name, values in batch.criteria.items()}
        else:
            row.fail(Diverged(reason) if batch.diverged[k] else InputError(reason))


def _history(run: Run, chunk: Chunk, row: Row) -> bytes:
    """Histories as a netCDF file, with the scenario for `isolation-sim run`."""
    data = row.case.data(chunk.base)
    entry = data["controller"][chunk.controllers.index(row.controller)]
    scenario = Scenario(**{**data, "controller": [entry]}).to_toml()
    with tempfile.TemporaryDirectory() as folder:
        return write_run(run, Path(folder) / "run.nc", scenario).read_bytes()
