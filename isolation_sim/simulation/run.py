"""One run: simulation of an isolated structure with a ground motion and a controller."""

from __future__ import annotations

import os
from collections import namedtuple
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ground_motions import Record
from ground_motions.old_names import renamed_arguments

from ..compilation.generated import COMPILED
from ..criterion import Criterion, selected_criteria
from ..errors import AccuracyWarning, InputError, warn
from ..laws.passive_switching import instantaneous
from ..laws.trace_check import check_traceable
from ..structures import IsolatedStructure
from .control import CoilDriver, Control, RunContext, Schedule, Sensors, calling, current_of
from .fmu_run import Coupling, at_every_sample, check_limits, refuse_unit, unit_element
from .kernel.loading import compiling
from .kernel.slots import DECIDE
from .plan import Lane, Plan, refusal
from .result import Run
from .workspace import Workspace

FIXED_BASE = "fixed base"
"""Name of the run of the building without isolation."""


@renamed_arguments(belief="nominal")
def simulate(
    isolated: IsolatedStructure,
    ground: Record | Sequence[Record],
    controller: Control,
    *,
    nominal: IsolatedStructure | None = None,
    driver: CoilDriver | None = None,
    sensors: Sensors | None = None,
    computation_delay: float = 0.0,
    tolerance: float = 1e-6,
    current_outside: str = "refuse",
    criteria: Sequence[str | Criterion] = (),
) -> Run:
    """Simulate one run."""
    further = selected_criteria(criteria)
    driver, sensors = driver or CoilDriver(), sensors or Sensors()
    check_options(tolerance, current_outside, computation_delay)

    trial = partial(
        simulate, isolated, ground, nominal=nominal, driver=driver, sensors=sensors,
        computation_delay=computation_delay, tolerance=tolerance, current_outside=current_outside,
    )  # fmt: skip
    e = unit_element(traceable(isolated))
    if e is not None:
        if nominal is None:
            raise InputError(
                f"{isolated.elements[e].device.law.unit}: an FMU's equations are unknown to the "
                "controller; expected: nominal, a plant with a law, or [nominal] in a scenario"
            )
        check_limits(isolated.elements[e], driver)
        controller = at_every_sample(controller, one_per_direction(ground)[0].dt)
    delays = sensors.delay, computation_delay
    lane = prepare_lane(isolated, ground, controller, nominal, driver, delays, trial, alone=True)
    refuse = current_outside == "refuse"
    if lane.schedule is not None and refuse:
        _check_schedule(lane.schedule, lane)
    plan = Plan([lane], sensors, computation_delay, alike=True)
    with compiling(plan.kernel):
        work = plan.workspace(tolerance, not refuse, record_steps=True)
        advance = work.integrate if e is None else Coupling(work, isolated, e)
        _drive(work, plan, controller, advance)
    failure = plan.failure(work, 0)
    if failure is not None:
        raise failure
    run = Run(isolated, lane.records, controller.name, plan.modes[0], plan.outputs[0], work)
    run.source = getattr(controller, "source", "")
    report, cautions = (getattr(controller, name, None) for name in ("report", "cautions"))
    if report is not None:
        run.decisions = str(report)
    if cautions is not None:
        run.cautions = tuple(cautions(lane.context, sensors))
    run.selected = further
    if further:
        _ = run.criteria  # errors of their functions belong here
    if run.unresolved:
        warn(
            f"{run.unresolved} integration steps missed the tolerance {tolerance:.3g}; all of them "
            f"meet {run.accuracy:.2g}. A force that jumps, or that changes sign many times within "
            "a sample, cannot be followed more accurately: give it a smoothing velocity or a "
            "contact stiffness",
            AccuracyWarning,
        )
    return run


def fixed_base_run(
    isolated: IsolatedStructure, ground: Record | Sequence[Record], tolerance: float = 1e-6
) -> Run:
    """Simulate the superstructure on a fixed base."""
    return simulate(isolated.fixed_base(), ground, NoControl(), tolerance=tolerance)


class NoControl:
    """Controller without a command, for a structure without coils."""

    name = FIXED_BASE
    period: float | None = None
    preview_time = 0.0

    def prepare(self, context: RunContext, trial: Any) -> None:
        """Nothing to prepare."""

    def measures(self, nominal: IsolatedStructure) -> tuple[str, ...]:
        """Nothing to measure."""
        return ()

    def schedule(self, context: RunContext) -> Schedule | None:
        """One instant, without a coil."""
        return Schedule(np.zeros(1), np.zeros((1, len(context.low))))

    def compiled(self, context: RunContext) -> None:
        """No decision."""

    def reset(self, context: RunContext) -> None:
        """Nothing to reset."""

    def current(self, t: float, measurement: Any) -> float:
        """No current."""
        return 0.0


def traceable(isolated: IsolatedStructure) -> IsolatedStructure:
    """Return the structure; raises `InputError` for laws that cannot be traced."""
    for law in isolated.group_laws:
        check_traceable(law)
    return isolated


def one_per_direction(ground: Record | Sequence[Record]) -> tuple[Record, ...]:
    """Return the records of all directions."""
    return (ground,) if isinstance(ground, Record) else tuple(ground)


def check_options(tolerance: float, current_outside: str, computation_delay: float) -> None:
    """Check the options."""
    if not 1e-12 <= tolerance <= 1e-2:
        raise InputError("tolerance", f"{tolerance}", "1e-12 to 1e-2")
    if current_outside not in ("refuse", "clamp"):
        raise InputError("current_outside", repr(current_outside), "'refuse' or 'clamp'")
    if not 0 <= computation_delay < np.inf:
        raise InputError("computation_delay", f"{computation_delay} s", "0 or more")


def prepare_lane(
    isolated: IsolatedStructure,
    ground: Record | Sequence[Record],
    controller: Control,
    nominal: IsolatedStructure | None,
    driver: CoilDriver,
    delays: tuple[float, float],
    trial: Callable[[Control], Run] | None,
    alone: bool = False,
) -> Lane:
    """Set a controller's run context; get its commands or its compiled decision."""
    tested = _check_plant(isolated, alone)
    records = _check_records(isolated, ground)
    coils = _coils(isolated, driver)
    if nominal is not None:
        nominal = traceable(nominal)
    elif getattr(controller, "predicts_switching", False):
        nominal = isolated
    else:
        nominal = _with_instantaneous_devices(isolated)
    context = _run_context(nominal, records, controller, coils, tested, driver, delays)
    # a controller with its own period decides during the run
    _check_memory(isolated, records, controller.period, controller.name)
    with calling(controller, "prepare"):
        controller.prepare(context, trial)
    with calling(controller, "reset"):
        controller.reset(context)
    with calling(controller, "schedule"):
        schedule = controller.schedule(context)
    # with NUMBA_DISABLE_JIT=1 nothing is compiled
    compiled = None
    if COMPILED and schedule is None:
        with calling(controller, "compiled"):
            compiled = controller.compiled(context)
    # decisions with a report or with further inputs are made outside the kernel
    if compiled is not None and (
        compiled.inputs or (alone and getattr(controller, "report", None))
    ):
        compiled = None
    return Lane(isolated, records, coils, context, schedule, compiled, controller.name)


@lru_cache(maxsize=1024)
def _check_plant(isolated: IsolatedStructure, alone: bool) -> NDArray:
    """Refuse a plant that cannot be simulated; highest tested current of each coil, A."""
    traceable(isolated)
    if not alone:
        refuse_unit(isolated)
    if not isolated.elements:
        raise InputError(
            f"{isolated.structure.name} has no isolator or other element; put it on one with "
            ".on(device) or add one with .with_element(...)"
        )
    tested = np.array([isolated.tested_current(c) for c in range(isolated.n_channels)])
    tested.flags.writeable = False
    return tested


def _check_memory(
    isolated: IsolatedStructure, records: tuple[Record, ...], period: float | None, name: str
) -> None:
    """Refuse a run with arrays larger than this computer's memory."""
    n_samples = len(records[0].acceleration)
    n_decisions = records[0].duration / period if period else 0.0
    # modes at the points and at the steps, forces, states, commands
    numbers = 12 * isolated.structure.n_dofs + 24 * len(isolated.elements) + 16
    size = 8.0 * numbers * (n_samples + n_decisions)
    if size <= memory_size():
        return
    cause = f"ground motion of {n_samples:,} samples"
    if n_decisions > n_samples:
        cause = f"{name}: period is {period:g} s, {n_decisions:.3g} decisions"
    raise InputError(
        f"{cause}: a run needs about {size / 1e9:.3g} GB; expected: up to "
        f"{memory_size() / 1e9:.3g} GB, this computer's memory"
    )


@lru_cache
def memory_size() -> float:
    """Physical memory of this computer, bytes; 8 GB if unknown."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE")) * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):
        return 8e9


@lru_cache(maxsize=256)
def _with_instantaneous_devices(isolated: IsolatedStructure) -> IsolatedStructure:
    """The plant with instantaneous devices, whose force follows the current, for controllers."""
    elements = tuple(replace(e, device=instantaneous(e.device)) for e in isolated.elements)
    unchanged = all(a.device is b.device for a, b in zip(elements, isolated.elements, strict=True))
    return isolated if unchanged else replace(isolated, elements=elements)


def _check_records(
    isolated: IsolatedStructure, ground: Record | Sequence[Record]
) -> tuple[Record, ...]:
    """One record per direction, all with the same samples."""
    records = one_per_direction(ground)
    directions = isolated.structure.directions
    if len(records) != len(directions):
        raise InputError(
            f"{isolated.structure.name} takes {len(directions)} ground motions "
            f"({', '.join(directions)}); {len(records)} given; expected: one per direction. "
            "Several records are for isolation-sim suite, or compare_records in Python"
        )
    first = records[0]
    for record in records[1:]:
        if len(record.acceleration) != len(first.acceleration) or record.dt != first.dt:
            raise InputError(
                f"ground motions {first.name!r} and {record.name!r} differ in length or time step; "
                "resample and pad them to the same samples"
            )
    return records


@lru_cache(maxsize=1024)
def _coils(isolated: IsolatedStructure, driver: CoilDriver) -> NDArray:
    """Lag, slew, lowest, highest current, step, initial current of each coil, (n_channels, 6)."""
    rows = []
    for channel in range(isolated.n_channels):
        low, high = isolated.current_range(channel)
        for name in ("low", "high", "initial"):
            limit = getattr(driver, name)
            if limit is not None and not low <= limit <= high:
                raise InputError(
                    f"coil driver: {name} {limit} A is outside {low:.4g} to {high:.4g} A, where "
                    f"the device on channel {channel} is meaningful"
                )
        low = low if driver.low is None else driver.low
        high = high if driver.high is None else driver.high
        initial = min(max(0.0, low), high) if driver.initial is None else driver.initial
        if not low <= initial <= high:
            raise InputError(
                f"coil driver: initial {initial} A is outside its limits, {low:.4g} to {high:.4g} A"
            )
        step = driver.step
        if step and not step * np.floor(high / step + 1e-9) >= low - 1e-9 * step:
            raise InputError(
                f"coil driver: step {step} A has no multiple within its limits, {low:.4g} to "
                f"{high:.4g} A"
            )
        rows.append([driver.lag, driver.slew, low, high, step, initial])
    coils = np.array(rows).reshape(-1, 6)
    coils.flags.writeable = False
    return coils


def _run_context(
    nominal: IsolatedStructure,
    records: tuple[Record, ...],
    controller: Control,
    coils: NDArray,
    tested: NDArray,
    driver: CoilDriver,
    delays: tuple[float, float],
) -> RunContext:
    record = records[0]
    period = record.dt if controller.period is None else controller.period
    if not period > 0:
        raise InputError(f"{controller.name}: period", f"{period} s", "above 0")
    with calling(controller, "measures"):
        measures = controller.measures(nominal)
    if measures is None or isinstance(measures, str):
        raise InputError(
            f"{controller.name}: measures() gave {measures!r}; expected: a tuple of names, such as "
            f"({measures or 'base_displacement_m'!r},)"
        )
    return RunContext(
        nominal=nominal,
        period=period,
        duration=record.dt * (len(record.acceleration) - 1),
        low=coils[:, 2],
        high=coils[:, 3],
        tested=tested,
        outputs=(*measures, *(f"coil{c}_current_A" for c in range(len(coils)))),
        driver=driver,
        delays=delays,
        # a controller without this information cannot use it
        ground=records if getattr(controller, "preview_time", 0.0) > 0 else None,
    )


def _drive(work: Workspace, plan: Plan, controller: Control, advance: Callable[[], int]) -> None:
    """Run to the end; a controller in plain Python decides between parts of the integration."""
    if advance() != DECIDE:
        return
    context, sensing = plan.lanes[0].context, plan.sensing
    measurement_type = namedtuple("Measurement", context.outputs)  # type: ignore[misc]
    width, n_measures = len(plan.lanes[0].coils), len(context.outputs)
    events, position = work.grid.events[:, 1].tolist(), work.position
    times, rows = sensing.decision_times.tolist(), sensing.measured_for.tolist()
    while True:
        k = events[position[0]]
        measurement = measurement_type._make(work.measured[rows[k], 0, :n_measures].tolist())
        currents = current_of(controller, times[k], measurement)
        if currents.shape not in ((width,), (1,)):
            raise InputError(
                f"{controller.name}: current() gave {currents.size} numbers at t = "
                f"{times[k]:.4g} s; expected: 1 for all coils, or {width}, one per coil"
            )
        work.chosen[k, 0, :width] = currents
        if advance() != DECIDE:
            return


def _check_schedule(schedule: Schedule, lane: Lane) -> None:
    low, high = lane.context.low, lane.context.high
    outside = ~((schedule.current >= low) & (schedule.current <= high))
    if outside.any():
        k, c = np.argwhere(outside)[0]
        raise refusal(schedule.current[k, c], schedule.time[k], lane, int(c))
