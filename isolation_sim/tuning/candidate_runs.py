"""Runs of candidate controllers: in vector lanes if compiled, otherwise in several processes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import lru_cache
from itertools import pairwise
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np

from ground_motions import Record

from ..criterion import CRITERIA
from ..registry import CONTROLLERS, controller
from ..scenario import Scenario
from ..scenario.job import Job
from ..simulation.batch import Batch, Case, run_cases
from ..simulation.control import Control
from ..simulation.run import prepare_lane, simulate
from ..workers import Processes


class Candidate(NamedTuple):
    """A controller by its name and settings."""

    name: str
    settings: dict[str, Any]


class CandidateRun(NamedTuple):
    """A candidate and its ground motion, one record per direction."""

    candidate: Candidate
    records: tuple[Record, ...]


@dataclass(frozen=True)
class _Share:
    """Some runs for one worker process, which builds the plant from its scenario."""

    number: int
    scenario: str
    runs: tuple[CandidateRun, ...]

    def __call__(self) -> tuple[int, Batch]:
        return self.number, _batch(_job(self.scenario), self.runs, 1)

    def __str__(self) -> str:
        return f"runs of {self.runs[0].candidate.name}"


def run_candidates(
    job: Job, scenario: str, runs: Sequence[CandidateRun], processes: Processes
) -> Batch:
    """Run candidates."""
    name, workers = runs[0].candidate.name, processes.count
    further = job.options["criteria"]
    known_here = {*CONTROLLERS.only_here(), *CRITERIA.only_here()}
    here = not known_here.isdisjoint([name, *(one.name for one in further)])
    if workers == 1 or here or not (further or _in_python(job, runs[0])):
        return _batch(job, runs, workers)
    bounds = np.linspace(0, len(runs), min(4 * workers, len(runs)) + 1).astype(int)
    shares = (
        _Share(k, scenario, tuple(runs[low:high]))
        for k, (low, high) in enumerate(pairwise(bounds.tolist()))
    )
    return _concatenate([batch for _, batch in sorted(processes.run(shares), key=itemgetter(0))])


def _batch(job: Job, runs: Sequence[CandidateRun], threads: int) -> Batch:
    """Run in this process; runs of one candidate share its controller and its design."""
    built: dict[int, Control] = {}
    for run in runs:
        if id(run.candidate) not in built:
            built[id(run.candidate)] = controller(run.candidate.name, **run.candidate.settings)
    options = dict(job.options)
    nominal = options.pop("nominal", None)
    cases = [Case(job.isolated, run.records, built[id(run.candidate)], nominal) for run in runs]
    return run_cases(cases, threads=threads, **options)


def _in_python(job: Job, run: CandidateRun) -> bool:
    one = controller(run.candidate.name, **run.candidate.settings)
    options = job.options
    delays = options["sensors"].delay, options["computation_delay"]
    lane = prepare_lane(
        job.isolated, run.records, one, options.get("nominal"), options["driver"], delays,
        lambda other: simulate(job.isolated, run.records, other, **options),
    )  # fmt: skip
    return lane.schedule is None and lane.compiled is None


@lru_cache(maxsize=2)
def _job(scenario: str) -> Job:
    return Scenario.from_toml(scenario).build()


def _concatenate(parts: Sequence[Batch]) -> Batch:
    """Join batches; criteria are NaN for a batch without any result."""
    names = dict.fromkeys(name for part in parts for name in part.criteria)
    criteria = {
        name: np.concatenate([
            part.criteria.get(name, np.full(len(part.failure), np.nan)) for part in parts
        ])
        for name in names
    }  # fmt: skip
    rest = {
        field.name: np.concatenate([getattr(part, field.name) for part in parts])
        for field in fields(Batch)
        if field.name not in ("criteria", "failure")
    }
    return Batch(criteria, [reason for part in parts for reason in part.failure], **rest)
