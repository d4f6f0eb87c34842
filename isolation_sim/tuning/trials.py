"""Scores of candidate controllers, relative to the best constant current."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..criteria import is_gain
from ..errors import Diverged, InputError, TestedRangeWarning, check_name
from ..registry import controller
from ..scenario import Scenario
from ..simulation.batch import Batch
from ..simulation.run import simulate
from ..workers import Processes, processors
from .candidate_runs import Candidate, CandidateRun, run_candidates
from .motions import MotionSet

CRITERIA = {"peak_base_displacement_m": 1.0, "peak_floor_acceleration_m_s2": 1.0}
"""Default weights of the criteria: J is the sum of both peaks, each over that without current."""

FAILED = 100.0
"""Score of a run that diverged or was refused; much larger than all others."""

_CURRENTS = 13
_REFINEMENTS = 3
"""Constant currents of the first scan; each refinement scans 7 currents between the best one's
neighbours, a quarter of the step apart."""


class Trials:
    """Runs on one set of motions, and their scores."""

    # A run's score is the weighted sum of its criteria, each over its value without current, minus
    # the smallest such sum of any constant current on the same motion.

    def __init__(
        self,
        scenario: Scenario,  # Plant and options
        motions: MotionSet,  # Ground motions
        criteria: Mapping[str, float],  # Weights by criterion
        # For decisions in plain Python, and as many threads for compiled ones; as many as there are
        # processors by default
        processes: Processes | None = None,
    ):
        self.motions, self.criteria = motions, criteria
        self._processes = processes or Processes(processors(None))
        self._job, self._scenario = scenario.build(), scenario.to_toml()
        off = self._run([Candidate("passive_off", {})] * len(motions.records))
        for name in criteria:
            check_name("criterion", name, off.criteria)
            if is_gain(name):
                raise InputError(
                    f"criterion {name}", "one whose larger value is better",
                    "one to minimise, such as its inverse",
                )  # fmt: skip
        for name, reason in zip(motions.names, off.failure, strict=True):
            if reason is not None:
                raise InputError(f"{name}: without current: {reason}")
        self._off = {name: off.criteria[name] for name in criteria}
        for name, values in self._off.items():
            if not np.all(values > 0):
                raise InputError(
                    f"criterion {name}", "0 or not finite without current", "a criterion above 0"
                )

    def _run(self, candidates: Sequence[Candidate]) -> Batch:
        """Run candidates on every motion, sorted by candidate and motion."""
        records = self.motions.records
        runs = [CandidateRun(one, records[k % len(records)]) for k, one in enumerate(candidates)]
        return run_candidates(self._job, self._scenario, runs, self._processes)

    def sums(self, candidates: Sequence[Candidate]) -> NDArray:
        """Weighted sums of criteria, each over its value without current."""
        n = len(self.motions.records)
        try:
            with warnings.catch_warnings():
                # warn once, for the runs without current
                warnings.simplefilter("ignore", TestedRangeWarning)
                batch = self._run(candidates)
        except (InputError, Diverged):
            # a failed design stops the other runs of the batch, too
            if len(candidates) > n:
                alone = (candidates[k : k + n] for k in range(0, len(candidates), n))
                return np.vstack([self._sums_or_failed(each) for each in alone])
            raise
        if len(candidates) == n and None not in batch.failure:
            raise InputError(f"every run fails; the first reason: {batch.failure[0]}")
        total = sum(
            weight * batch.criteria[name].reshape(-1, n) / self._off[name]
            for name, weight in self.criteria.items()
        )
        return np.where(np.isfinite(total), total, FAILED)

    def _sums_or_failed(self, candidates: Sequence[Candidate]) -> NDArray:
        try:
            return self.sums(candidates)
        except (InputError, Diverged):
            return np.full((1, len(candidates)), FAILED)

    def scores(self, candidates: Sequence[Candidate]) -> NDArray:
        """Scores of candidates on every motion."""
        every = [one for one in candidates for _ in self.motions.records]
        return self.sums(every) - self.constant[1]

    @cached_property
    def constant(self) -> tuple[NDArray, NDArray]:
        """Best constant current of each motion, A, and its weighted sum, (n_motions,) each."""
        low, high = self._current_range()
        n = len(self.motions.records)
        currents = np.repeat(np.linspace(low, high, _CURRENTS)[:, np.newaxis], n, axis=1)
        best, least = np.zeros(n), np.full(n, np.inf)
        step = (high - low) / (_CURRENTS - 1)
        for _ in range(1 + _REFINEMENTS):
            held = [Candidate("constant", {"amperes": i}) for i in currents.ravel().tolist()]
            sums = self.sums(held)
            k = np.argmin(sums, axis=0), np.arange(n)
            best, least = np.where(sums[k] < least, currents[k], best), np.minimum(least, sums[k])
            step /= 4
            steps = step * np.arange(-3.0, 4.0)[:, np.newaxis]
            currents = np.clip(best + steps, low, high)
        return best, least

    def _current_range(self) -> tuple[float, float]:
        """Currents of the controllers passive_off and passive_on, A."""
        limits = [
            simulate(
                self._job.isolated, self.motions.records[0], controller(name), **self._job.options
            ).command[-1]
            for name in ("passive_off", "passive_on")
        ]
        return float(limits[0].max()), float(limits[1].min())
