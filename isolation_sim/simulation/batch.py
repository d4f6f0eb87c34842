"""Many runs: side by side in vector lanes, and on several threads."""

from __future__ import annotations

import os
import threading
from collections import defaultdict
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ground_motions import Record

from ..errors import Diverged, InputError
from ..structures import IsolatedStructure
from . import kernel
from .control import CoilDriver, Control, Sensors
from .plan import Lane, Plan, kernel_for
from .result import Run
from .run import check_options, prepared, simulate
from .summary import summary

LANES = 16
"""Runs that go through the kernel side by side: two vectors of eight."""

_memory = threading.local()
"""A thread's large arrays, used for one block after another."""


@dataclass(frozen=True)
class Case:
    """One of many runs.

    Attributes
    ----------
    isolated : IsolatedStructure
        The plant.
    ground : Record or sequence of Record
        Ground acceleration, m/s^2, one record a direction.
    controller : Control
        Sets the coil currents.
    belief : IsolatedStructure or None
        The model that the controller reasons with; None for the plant.
    """

    isolated: IsolatedStructure
    ground: Record | Sequence[Record]
    controller: Control
    belief: IsolatedStructure | None = None


@dataclass(frozen=True)
class Batch:
    """What became of many runs.

    Attributes
    ----------
    criteria : dict of str to (n_cases,) array
        Peaks and RMS values as in ``isolation_sim.criteria``; not a number where a run failed.
    failure : list of str or None
        Why a run failed, and when; None if it did not.
    diverged : (n_cases,) bool array
        Whether it failed because the response left the range of numbers or of the law.
    clamped : (n_cases,) int array
        Commands that were clamped to the driver's limits.
    """

    criteria: dict[str, NDArray]
    failure: list[str | None]
    diverged: NDArray
    clamped: NDArray


def simulate_many(
    cases: Sequence[Case],
    *,
    driver: CoilDriver | None = None,
    sensors: Sensors | None = None,
    computation_delay: float = 0.0,
    tolerance: float = 1e-6,
    current_outside: str = "refuse",
    threads: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> Batch:
    """Simulate many runs and keep their criteria.

    A run's result does not depend on the others: neither on their order nor on the number of
    threads. Controllers in plain Python run one by one.

    Parameters
    ----------
    cases : sequence of Case
        The runs.
    driver : CoilDriver, optional
        Lag, slew and limits of the coils; ideal by default.
    sensors : Sensors, optional
        Noise, delay and sampling of what the controllers are given; ideal by default.
    computation_delay : float
        Time from a decision to its command, s.
    tolerance : float
        Wanted accuracy, relative to each quantity's peak.
    current_outside : {"refuse", "clamp"}
        What to do with a command outside the driver's limits: the run fails, or it is clamped and
        counted.
    threads : int, optional
        Number of threads; as many as there are processors by default.
    progress : callable, optional
        Called with the number of runs that have just been finished.

    Returns
    -------
    Batch

    Raises
    ------
    InputError
        If an argument cannot be used.
    """
    driver, sensors = driver or CoilDriver(), sensors or Sensors()
    check_options(tolerance, current_outside, computation_delay)
    clamp, delays = current_outside == "clamp", (sensors.delay, computation_delay)

    def alone_with(case: Case, controller: Control) -> Run:
        return simulate(
            case.isolated, case.ground, controller, belief=case.belief, driver=driver,
            sensors=sensors, computation_delay=computation_delay, tolerance=tolerance,
            current_outside=current_outside,
        )

    lanes = []
    for case in cases:
        trial = partial(alone_with, case)
        lanes.append(
            prepared(
                case.isolated, case.ground, case.controller, case.belief, driver, delays, trial
            )
        )
    blocks, alone = _blocks(lanes)
    result = _Collected(len(cases))

    def run_block(block: list[int]) -> None:
        filled = block + [block[-1]] * (LANES - len(block))
        plan = Plan([lanes[k] for k in filled], sensors, computation_delay)
        work = plan.workspace(tolerance, clamp, record_steps=False, buffers=_memory.__dict__)
        work.march()
        criteria = summary([lane.isolated for lane in plan.lanes], plan.modes, work)
        for lane, k in enumerate(block):
            result.put(k, {name: v[lane] for name, v in criteria.items()}, plan.fate(work, lane))
            result.clamped[k] = work.counts[0, lane]
        if progress is not None:
            progress(len(block))

    if blocks:
        with kernel.compiling(kernel_for(lanes[blocks[0][0]].isolated, LANES)):
            run_block(blocks[0])
        with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
            list(pool.map(run_block, blocks[1:]))
    for k in alone:
        try:
            run = alone_with(cases[k], cases[k].controller)
        except (Diverged, InputError) as error:
            result.put(k, {}, error)
        else:
            result.put(k, run.criteria, None)
            result.clamped[k] = run.clamped
        if progress is not None:
            progress(1)
    return Batch(result.criteria(), result.failure, result.diverged, result.clamped)


def _blocks(lanes: Sequence[Lane]) -> tuple[list[list[int]], list[int]]:
    """Runs that can go side by side, in blocks; and those that must go alone."""
    alike: defaultdict[tuple, list[int]] = defaultdict(list)
    alone = []
    for k, lane in enumerate(lanes):
        if lane.schedule is None and lane.compiled is None:
            alone.append(k)
        else:
            alike[lane.key].append(k)
    blocks = [
        group[start : start + LANES]
        for group in alike.values()
        for start in range(0, len(group), LANES)
    ]
    return blocks, alone


class _Collected:
    """Results as they come in, from several threads."""

    def __init__(self, n_cases: int):
        self.rows: list[dict[str, float]] = [{} for _ in range(n_cases)]
        self.failure: list[str | None] = [None] * n_cases
        self.diverged = np.zeros(n_cases, bool)
        self.clamped = np.zeros(n_cases, int)

    def put(self, k: int, criteria: dict[str, float], fate: Exception | None) -> None:
        if fate is None:
            self.rows[k] = criteria
        else:
            self.failure[k] = str(fate)
            self.diverged[k] = isinstance(fate, Diverged)

    def criteria(self) -> dict[str, NDArray]:
        names = dict.fromkeys(name for row in self.rows for name in row)
        return {name: np.array([row.get(name, np.nan) for row in self.rows]) for name in names}
