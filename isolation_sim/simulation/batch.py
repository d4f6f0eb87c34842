"""Many runs in parallel: in vector lanes and on several threads."""

from __future__ import annotations

import os
import threading
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ground_motions import Record
from ground_motions.argument_types import checked

from ..criterion import Criterion, selected_criteria
from ..errors import Diverged, InputError, warn
from ..structures import IsolatedStructure
from ..written_names import as_written
from .contact import contacts_of_lane
from .control import CoilDriver, Control, Sensors
from .kernel.loading import compiling
from .kernel.slots import CLAMPED, MISSED
from .plan import Lane, Plan
from .plausibility import end_state, input_warnings
from .result import Run
from .run import check_options, prepare_lane, simulate, traceable
from .run_criteria import criteria_key, criteria_of_lanes
from .tested_range import compare_with_tests, peak_currents
from .validity import BETWEEN, Validity, validity_lines_of_many, validity_of, warnings_of_many

LANES = 16
"""Number of runs that the kernel computes together: two vectors of eight."""

FEWEST = 8
"""Least number of runs for a block of lanes and its kernel; fewer runs are computed one by one."""

_memory = threading.local()
"""Large arrays of a thread, reused for consecutive blocks."""

_Block = list[tuple[int, Lane]]
"""Runs that are computed together, with their numbers."""

__all__ = ["Batch", "Case", "simulate_many"]


@checked
@dataclass(frozen=True)
class Case:
    """One of many runs.

    Attributes
    ----------
    isolated : IsolatedStructure
        The plant.
    ground : Record or sequence of Record
        Ground acceleration, m/s^2, one record per direction.
    controller : Control
        Controller of the coil currents, such as ``controller("clipped_lqr")``; one instance per
        case.
    nominal : IsolatedStructure or None
        The nominal model of the controller; None for the plant.
    """

    isolated: IsolatedStructure
    ground: Record | Sequence[Record]
    controller: Control
    nominal: IsolatedStructure | None = None

    def __post_init__(self) -> None:
        traceable(self.isolated)


@dataclass(frozen=True)
class Batch:
    """Results of many runs.

    Attributes
    ----------
    criteria : dict of str to (n_cases,) array
        Peaks and RMS values as in ``isolation_sim.criteria``; NaN for failed runs.
    failure : list of str or None
        Reason and time of a failure; None for a successful run.
    diverged : (n_cases,) bool array
        Whether the response left the range of floating-point numbers or of the law, or the
        controller raised an error.
    clamped : (n_cases,) int array
        Number of commands clamped to the driver's limits.
    unresolved : (n_cases,) int array
        Steps that missed the tolerance; see ``Run``.
    deformation_over_tested : (n_cases,) array
        Largest deformation of an element over that of its law's tests; 0 without tests, NaN for
        failed runs.
    current_over_tested : (n_cases,) array
        The same for the coil currents.
    moving_at_end : (n_cases,) bool array
        Whether the building still moves at the end; false for failed runs.
    displacement_at_end : (n_cases,) array
        Displacement at which the base stays, over its peak; NaN for failed runs.
    implausible : (n_cases,) array of str
        Warnings about structure, isolators and ground motion, separated by ``|``.
    cautions : (n_cases,) array of str
        Warnings of the controllers about their use.
    contacts : (n_cases,) int array
        Number of contacts with moat walls and end stops.
    """

    criteria: dict[str, NDArray]
    failure: list[str | None]
    diverged: NDArray
    clamped: NDArray
    unresolved: NDArray
    deformation_over_tested: NDArray
    current_over_tested: NDArray
    moving_at_end: NDArray
    displacement_at_end: NDArray
    implausible: NDArray
    cautions: NDArray
    contacts: NDArray

    def warnings(self) -> list[str]:
        """Return warnings about the validity of the results.

        Returns
        -------
        list of str
            Each kind with the number of runs: beyond the tested deformations or currents,
            implausible structures and ground motions, a building that moves or is displaced at the
            end, contacts with moat walls and end stops, cautions of controllers, missed tolerances,
            clamped commands.
        """
        return validity_lines_of_many(vars(self))

    def __repr__(self) -> str:
        failed = sum(reason is not None for reason in self.failure)
        return f"Batch({len(self.failure)} runs, {failed} failed, {len(self.criteria)} criteria)"


@checked
def simulate_many(
    cases: Sequence[Case],
    *,
    driver: CoilDriver | None = None,
    sensors: Sensors | None = None,
    computation_delay: float = 0.0,
    tolerance: float = 1e-6,
    current_outside: str = "refuse",
    criteria: Sequence[str | Criterion] = (),
    threads: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> Batch:
    """Simulate many runs and return their criteria.

    The result of a run does not depend on other runs, their order or the number of threads.
    Controllers in plain Python run one by one, as do fewer than eight runs of one kind: with equal
    laws, sampling and decisions.

    Parameters
    ----------
    cases : sequence of Case
        The runs.
    driver : CoilDriver, optional
        Lag, slew and limits of the coils; ideal by default.
    sensors : Sensors, optional
        Noise, delay and sampling of the controllers' measurements; ideal by default.
    computation_delay : float
        Time from a decision to its command, s.
    tolerance : float
        Target accuracy, relative to each quantity's peak.
    current_outside : {"refuse", "clamp"}
        Treatment of a command outside the driver's limits: the run fails, or the command is
        clamped and counted.
    criteria : sequence of str or Criterion
        Further criteria, by name, place or themselves. They need whole runs, which are computed one
        by one.
    threads : int, optional
        Number of threads; one per processor by default.
    progress : callable, optional
        Called with the number of runs finished since the last call.

    Returns
    -------
    Batch

    Raises
    ------
    InputError
        If an argument cannot be used.

    Warns
    -----
    TestedRangeWarning
        If runs exceed the deformations or currents of the device tests.
    PlausibilityWarning
        If structures, isolators or ground motions are implausible, or buildings move or are
        displaced at the end, or moat walls or end stops are touched.
    ControllerWarning
        If controllers were not made for these conditions.
    """
    result = run_cases(
        cases, driver=driver, sensors=sensors, computation_delay=computation_delay,
        tolerance=tolerance, current_outside=current_outside, criteria=criteria, threads=threads,
        progress=progress,
    )  # fmt: skip
    for line, kind in warnings_of_many(vars(result)):
        warn(line, kind)
    return result


def run_cases(
    cases: Sequence[Case],
    *,
    driver: CoilDriver | None = None,
    sensors: Sensors | None = None,
    computation_delay: float = 0.0,
    tolerance: float = 1e-6,
    current_outside: str = "refuse",
    criteria: Sequence[str | Criterion] = (),
    threads: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> Batch:
    """Simulate many runs without a warning; see `simulate_many`."""
    driver, sensors = driver or CoilDriver(), sensors or Sensors()
    check_options(tolerance, current_outside, computation_delay)
    for k, case in enumerate(cases):
        if not isinstance(case, Case):
            raise InputError(f"cases[{k}]", f"a {type(case).__name__}", "Case(...)")
    if threads is not None and threads < 1:
        raise InputError("threads", f"{threads}", "1 or more")
    conditions = _Conditions(driver, sensors, computation_delay, tolerance, current_outside)
    further = selected_criteria(criteria)
    # with few structures each block has only one structure and shares its coefficients
    n_plants = len({id(case.isolated) for case in cases})
    alike = n_plants == 1 or 2 * LANES * n_plants <= len(cases)
    results = _Results(len(cases))

    def run_block(block: _Block) -> None:
        conditions.run_block(block, cases, alike, results)
        if progress is not None:
            progress(len(block))

    units = (e.device.law.unit for c in cases for e in getattr(c.isolated, "elements", ()))
    few = len(cases) < FEWEST or any(units) or bool(further)
    alone = list(range(len(cases))) if few else []
    blocks = _blocks(() if few else map(conditions.lane, cases), alone, alike)
    first = next(blocks, None)
    if first is not None:
        run_block(first)
    # a block is computed while the next ones are prepared
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        try:
            for one in [pool.submit(run_block, block) for block in blocks]:
                one.result()
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    for k in alone:
        try:
            run = conditions.run_alone(cases[k], cases[k].controller, further)
        except (Diverged, InputError) as error:
            results.put_criteria([k], {}, [error])
        else:
            results.put_criteria([k], run.criteria, [None])
            results.validity[k] = validity_of(run)
        if progress is not None:
            progress(1)
    return results.batch()


@dataclass(frozen=True)
class _Conditions:
    """What all runs of a batch have in common."""

    driver: CoilDriver
    sensors: Sensors
    computation_delay: float
    tolerance: float
    current_outside: str

    def run_alone(
        self, case: Case, controller: Control, criteria: Sequence[str | Criterion] = ()
    ) -> Run:
        """One run by itself."""
        return simulate(
            case.isolated, case.ground, controller, nominal=case.nominal, criteria=criteria,
            **vars(self),
        )  # fmt: skip

    def lane(self, case: Case) -> Lane:
        """A case as the kernel takes it."""
        return prepare_lane(
            case.isolated, case.ground, case.controller, case.nominal, self.driver,
            (self.sensors.delay, self.computation_delay), partial(self.run_alone, case),
        )  # fmt: skip

    def run_block(
        self, block: _Block, cases: Sequence[Case], alike: bool, results: _Results
    ) -> None:
        """Compute a block of cases together, and write their results."""
        lanes = [lane for _, lane in block]
        lanes += lanes[-1:] * (LANES - len(lanes))
        plan = Plan(lanes, self.sensors, self.computation_delay, alike)
        work = plan.workspace(
            self.tolerance, self.current_outside == "clamp", record_steps=False,
            buffers=_memory.__dict__,
        )  # fmt: skip
        with compiling(plan.kernel):
            work.integrate()
        criteria = criteria_of_lanes([lane.isolated for lane in plan.lanes], work)
        failures = [plan.failure(work, at) for at in range(len(block))]
        results.put_criteria([k for k, _ in block], criteria, failures)
        currents = peak_currents(work)
        for at, (k, lane) in enumerate(block):
            clamped, unresolved = work.counts[[CLAMPED, MISSED], at].tolist()
            results.validity[k] = Validity(clamped=clamped, unresolved=unresolved)
            if failures[at] is not None:
                continue
            isolated, modes = lane.isolated, plan.modes[at]
            peaks = compare_with_tests(isolated, modes, work, criteria, currents, at)
            cautions = getattr(cases[k].controller, "cautions", None)
            listed = cautions(lane.context, self.sensors) if cautions else ()
            results.validity[k] = Validity(
                clamped,
                peaks.deformation_ratio,
                peaks.current_ratio,
                unresolved,
                *end_state(isolated, modes, work, at),
                BETWEEN.join(input_warnings(isolated, modes, lane.records)),
                BETWEEN.join(f"{as_written(lane.controller)}: {each}" for each in listed),
                sum(contacts_of_lane(isolated, modes, work, at).values()),
            )


def _blocks(lanes: Iterable[Lane], alone: list[int], alike: bool) -> Iterator[_Block]:
    """Blocks of runs that can be computed together, by number; the others go to ``alone``."""
    # ``alike``: all runs of a block have the same structure.
    waiting: defaultdict[tuple, _Block] = defaultdict(list)
    for k, lane in enumerate(lanes):
        if lane.schedule is None and lane.compiled is None:
            alone.append(k)
            continue
        own = id(lane.isolated) if alike else criteria_key(lane.isolated)
        key = (lane.key, own)
        waiting[key].append((k, lane))
        if len(waiting[key]) == LANES:
            yield waiting.pop(key)
    for block in waiting.values():
        # an empty lane costs as much as another one, with the decisions of its controller
        if len(block) < FEWEST:
            alone += [k for k, _ in block]
        else:
            yield block


class _Results:
    """Results of several threads."""

    def __init__(self, n_cases: int):
        self.criteria: dict[str, NDArray] = {}
        self.failure: list[str | None] = [None] * n_cases
        self.diverged = np.zeros(n_cases, bool)
        self.validity = [Validity()] * n_cases

    def batch(self) -> Batch:
        """The results as arrays over the runs."""
        validity = {
            name: np.array(
                [getattr(each, name) for each in self.validity],
                object if isinstance(default, str) else type(default),
            )
            for name, default in Validity()._asdict().items()
        }
        return Batch(self.criteria, self.failure, self.diverged, **validity)

    def put_criteria(
        self, numbers: list[int], criteria: Mapping[str, Any], failures: Sequence[Exception | None]
    ) -> None:
        """Write the criteria of some runs, or the reasons of their failure."""
        failed = {k: each for k, each in zip(numbers, failures, strict=True) if each is not None}
        for name, values in criteria.items():
            if name not in self.criteria:
                # another thread may have been first
                self.criteria.setdefault(name, np.full(len(self.failure), np.nan))
            stored = self.criteria[name]
            stored[numbers] = np.atleast_1d(values)[: len(numbers)]
            stored[list(failed)] = np.nan
        for k, failure in failed.items():
            self.failure[k] = str(failure)
            self.diverged[k] = isinstance(failure, Diverged)
