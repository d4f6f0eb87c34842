"""Run a sweep: estimate the time, divide it into chunks, run them, and save their results."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ground_motions.argument_types import checked

from ..criterion import selected_criteria
from ..errors import InputError
from ..io.files import check_writable, free_space
from ..io.results_folder import file_name, write_contents
from ..registry import registry
from ..simulation.batch import LANES
from ..workers import connected, in_processes, in_this_process, on_cluster, processors
from .chunk import Chunk, Finished
from .design import Design
from .plan import SweepPlan
from .result import Sweep
from .store import STORED, Store

if TYPE_CHECKING:
    from distributed import Client

MOST_CASES = 15 * LANES
"""Cases per chunk: a multiple of the lanes; the engine's cache holds the plants of a chunk."""

_CHUNK_SECONDS = 5.0
_CHUNK_BYTES = 64e6
_PILOT_SECONDS = 1.0
"""Time of the runs of an estimate that is enough: a single case does not fill the vector lanes."""
_LONGEST_PILOT = 2.5
"""Longest expected time of the cases that are run together for an estimate, s."""


@dataclass(frozen=True)
class Estimate:
    """Time and disk space of a sweep.

    Attributes
    ----------
    n_cases, n_runs : int
        Numbers of cases and of runs (cases times controllers).
    seconds : float
        Time in one process, measured on a few cases, s.
    size : float
        Size on disk, bytes.
    cases_per_chunk : int
        Number of cases that are run and saved together.
    """

    n_cases: int
    n_runs: int
    seconds: float
    size: float
    cases_per_chunk: int


def estimate(design: Design) -> Estimate:
    """Run a few cases to estimate a sweep's time and size."""
    n = design.n_cases
    most, tried, expected = min(MOST_CASES, n), 1, 0.0
    while True:
        places = tuple(sorted({k * (n - 1) // max(tried - 1, 1) for k in range(tried)}))
        pilot = chunk_of(design, 0, places)
        finished, spent = _timed(pilot)
        # the first run of a law or of vector lanes compiles
        if spent > expected + _PILOT_SECONDS:
            spent = min(spent, _timed(pilot)[1])
        more = min(LANES * tried, most, int(_LONGEST_PILOT / spent * tried))
        if spent > _PILOT_SECONDS or more <= tried:
            break
        tried, expected = more, spent * more / tried
    seconds = spent / len(places)
    size = (len(finished.table) + sum(map(len, finished.histories.values()))) / len(places)
    histories = design.plan.histories
    if isinstance(histories, list):
        size = len(finished.table) / len(places)
    per_chunk = min(_CHUNK_SECONDS / seconds, _CHUNK_BYTES / size, MOST_CASES)
    return Estimate(n, design.n_runs, seconds * n, size * n, max(1, int(per_chunk)))


def _timed(chunk: Chunk) -> tuple[Finished, float]:
    """Run a chunk, and measure its time, s."""
    start = time.perf_counter()
    finished = chunk()
    return finished, time.perf_counter() - start


@checked
def sweep(
    plan: SweepPlan | dict[str, Any] | str | Path,
    out: str | Path | None = None,
    *,
    resume: bool = False,
    workers: int | None = None,
    scheduler: str | None = None,
    announce: Callable[[Estimate], None] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Sweep:
    """Run a plan; finished runs are saved and survive an interruption.

    Parameters
    ----------
    plan : SweepPlan, dict, str or pathlib.Path
        A plan, the contents of its file, or its file.
    out : str or pathlib.Path, optional
        Folder for the results; ``results/`` and the plan's name by default.
    resume : bool, default False
        Whether to continue an interrupted sweep in the folder. Runs with the status ``error``
        (neither a divergence nor unusable input) are run again.
    workers : int, optional
        Processes on this machine; one per processor by default.
    scheduler : str, optional
        Address of a Dask scheduler to run the chunks on its cluster instead.
    announce : callable, optional
        Called with an `Estimate` before the sweep starts.
    progress : callable, optional
        Called with the numbers of runs finished since the last call and of failed ones.

    Returns
    -------
    Sweep

    Raises
    ------
    InputError
        If the plan cannot be used, or the folder contains other files.
    OSError
        If results cannot be written, as on a full disk; ``resume`` continues the sweep.
    """
    source = str(plan) if isinstance(plan, str | Path) else ""
    if isinstance(plan, str | Path):
        plan = SweepPlan.read(plan)
    elif isinstance(plan, dict):
        plan = SweepPlan.from_dict(plan)
    return run_design(
        Design(plan, source), default_folder(plan) if out is None else out, resume=resume,
        workers=workers, scheduler=scheduler, announce=announce, progress=progress,
    )  # fmt: skip


def run_design(
    design: Design,
    out: str | Path,
    *,
    resume: bool = False,
    workers: int | None = None,
    scheduler: str | None = None,
    announce: Callable[[Estimate], None] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Sweep:
    """Run the cases of a plan; see `sweep`."""
    if processors(workers) > 1 or scheduler is not None:
        _check_workers_know(design)
    with connected(scheduler) as cluster:
        store = Store(out)
        content = design.content()
        if resume and store.exists():
            cases_per_chunk = store.check_same(content)
            if store.table.is_file() and not store.has_errors():
                store.tidy()
                return Sweep(store.folder)
        else:
            store.check_free()
            check_writable(store.folder)
            expected = estimate(design)
            if announce is not None:
                announce(expected)
            room = free_space(store.folder)
            if expected.size > room:
                raise InputError(
                    f"{store.folder}: the sweep needs about {expected.size / 1e9:.3g} GB; "
                    f"{room / 1e9:.3g} GB are free; expected: a larger disk, or fewer cases"
                )
            cases_per_chunk = expected.cases_per_chunk
            criteria = selected_criteria(design.base["simulation"]["criteria"])
            store.begin(content, cases_per_chunk, criteria)
            # marks the folder as results, even if the process is killed
            write_contents(store.folder, f"Sweep {design.plan.name}", STORED)
        with store.locked():
            store.remove_pages()
            if store.table.is_file():
                store.reopen(cases_per_chunk)
            done = store.finished()
            total = -(-design.n_cases // cases_per_chunk)
            if progress is not None and done:
                cases = sum(len(_places(design, k, cases_per_chunk)) for k in done)
                progress(cases * len(design.controllers), 0)
            left = (k for k in range(total) if k not in done)
            chunks = (chunk_of(design, k, _places(design, k, cases_per_chunk)) for k in left)
            for finished in _executor(workers, cluster, total - len(done))(chunks):
                store.put(finished)
                if progress is not None:
                    progress(finished.n_runs, finished.n_failed)
            store.close()
            write_contents(store.folder, f"Sweep {design.plan.name}")
        return Sweep(store.folder)


def _check_workers_know(design: Design) -> None:
    """Refuse names that are registered only in this process, since workers do not know them."""
    used = set(design.names())
    for kind in ("law", "effect", "controller", "criterion", "reader"):
        for name in registry(kind).only_here():
            if name in used:
                raise InputError(
                    f"{kind} {name!r} was registered in this process, and worker processes do not "
                    "know it; expected: workers=1, a place such as file.py:NAME, or an installed "
                    "package with an entry point"
                )


def default_folder(plan: SweepPlan) -> Path:
    """Return the default results folder of a plan."""
    return Path("results") / file_name(plan.name)


def _executor(
    workers: int | None, cluster: Client | None, n_chunks: int
) -> Callable[[Iterator[Chunk]], Iterator[Finished]]:
    if cluster is not None:
        return partial(on_cluster, client=cluster)
    processes = min(processors(workers), n_chunks)
    return in_this_process if processes <= 1 else partial(in_processes, count=processes)


def _places(design: Design, number: int, cases_per_chunk: int) -> range:
    start = number * cases_per_chunk
    return range(start, min(start + cases_per_chunk, design.n_cases))


def chunk_of(design: Design, number: int, cases: Iterable[int]) -> Chunk:
    """Build a chunk."""
    histories = design.plan.histories
    return Chunk(
        number=number,
        base=design.base,
        controllers=design.controllers,
        cases=tuple(design.case(k) for k in cases),
        parameters=design.parameters,
        energy=design.plan.energy,
        histories=histories if isinstance(histories, bool) else frozenset(histories),
        floors=design.plan.floors,
    )
