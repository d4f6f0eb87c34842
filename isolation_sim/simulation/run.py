"""One run: an isolated structure, a ground motion and a controller, integrated in compiled code."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from ground_motions import Record
from numpy.typing import NDArray

from ..errors import Diverged, InputError
from ..structures import IsolatedStructure
from . import kernel
from .control import CoilDriver, CompiledDecision, Control, Schedule, Sensors, Situation, instants
from .grid import Grid, make_grid
from .modal import Modes, modes_of
from .outputs import Outputs, outputs_of
from .result import Run
from .workspace import Sensing, Tables, Workspace


def simulate(
    isolated: IsolatedStructure,
    ground: Record | Sequence[Record],
    controller: Control,
    *,
    belief: IsolatedStructure | None = None,
    driver: CoilDriver | None = None,
    sensors: Sensors | None = None,
    computation_delay: float = 0.0,
    tolerance: float = 1e-6,
    current_outside: str = "refuse",
) -> Run:
    """Simulate one run.

    Parameters
    ----------
    isolated : IsolatedStructure
        The plant.
    ground : Record or sequence of Record
        Ground acceleration, one record a direction of the structure, on the same samples.
    controller : Control
        Sets the coil currents.
    belief : IsolatedStructure, optional
        The model that the controller reasons with; the plant itself by default.
    driver : CoilDriver, optional
        Lag, slew and limits of the coils; ideal by default.
    sensors : Sensors, optional
        Noise, delay and sampling of what the controller is given; ideal by default.
    computation_delay : float
        Time from a decision to its command, s.
    tolerance : float
        Wanted accuracy, relative to each quantity's peak; 1e-12 to 1e-2.
    current_outside : {"refuse", "clamp"}
        What to do with a command outside the driver's limits: end with an error, or clamp and
        count it.

    Returns
    -------
    Run

    Raises
    ------
    InputError
        If an argument cannot be used, or a current is refused.
    Diverged
        If the response leaves the range of numbers or of the law; with the time and the cause.
    """
    records = check_ground(isolated, ground)
    driver, sensors = driver or CoilDriver(), sensors or Sensors()
    if not 1e-12 <= tolerance <= 1e-2:
        raise InputError(f"tolerance is {tolerance}; accepted: 1e-12 to 1e-2")
    if current_outside not in ("refuse", "clamp"):
        raise InputError(f"current_outside is {current_outside!r}; accepted: 'refuse' or 'clamp'")
    if not computation_delay >= 0:
        raise InputError(f"computation_delay is {computation_delay} s; accepted: 0 or more")
    coils = drivers(isolated, driver)
    situation = situation_of(isolated if belief is None else belief, records[0], controller, coils)
    prepare = getattr(controller, "prepare", None)
    if prepare is not None:

        def trial(other: Control) -> Run:
            return simulate(
                isolated, ground, other, belief=belief, driver=driver, sensors=sensors,
                computation_delay=computation_delay, tolerance=tolerance,
                current_outside=current_outside,
            )

        prepare(situation, trial)
    controller.reset(situation)
    schedule = controller.schedule(situation)
    compiled = None if schedule is not None else controller.compiled(situation)
    plan = _Plan(isolated, records, coils, situation, sensors, computation_delay, schedule, compiled)
    if schedule is not None and current_outside == "refuse":
        _check_schedule(schedule, situation)
    with kernel.compiling(plan.module):
        work = plan.workspace(tolerance, current_outside == "clamp")
        _drive(work, plan, controller)
    _report(work, plan, current_outside)
    return Run(isolated, records, controller.name, plan.modes, plan.outputs, work)


def check_ground(isolated: IsolatedStructure, ground: Record | Sequence[Record]) -> tuple:
    """One record a direction, all on the same samples, or an InputError."""
    records = (ground,) if isinstance(ground, Record) else tuple(ground)
    directions = isolated.structure.directions
    if len(records) != len(directions):
        raise InputError(
            f"{isolated.structure.name} takes {len(directions)} ground motions "
            f"({', '.join(directions)}); {len(records)} given"
        )
    first = records[0]
    for record in records[1:]:
        if len(record.acceleration) != len(first.acceleration) or record.dt != first.dt:
            raise InputError(
                f"ground motions {first.name!r} and {record.name!r} differ in length or time step; "
                "resample and pad them to the same samples"
            )
    return records


def drivers(isolated: IsolatedStructure, driver: CoilDriver) -> NDArray:
    """Lag, slew, lowest and highest current and initial current of each coil, (n_channels, 5)."""
    rows = []
    for channel in range(isolated.n_channels):
        low, high = isolated.current_range(channel)
        for name, given in (("low", driver.low), ("high", driver.high), ("initial", driver.initial)):
            if given is not None and not low <= given <= high:
                raise InputError(
                    f"coil driver: {name} {given} A is outside {low:.4g} to {high:.4g} A, where "
                    f"the device on channel {channel} is meaningful"
                )
        low = low if driver.low is None else driver.low
        high = high if driver.high is None else driver.high
        rows.append([driver.lag, driver.slew, low, high, driver.initial])
    return np.array(rows).reshape(-1, 5)


def situation_of(
    belief: IsolatedStructure, record: Record, controller: Control, coils: NDArray
) -> Situation:
    """What a controller is told before a run."""
    period = record.dt if controller.period is None else controller.period
    if not period > 0:
        raise InputError(f"{controller.name}: period is {period} s; accepted: above 0")
    measured = tuple(controller.measures(belief))
    return Situation(
        belief=belief,
        period=period,
        duration=record.dt * (len(record.acceleration) - 1),
        low=coils[:, 2],
        high=coils[:, 3],
        outputs=(*measured, *(f"coil{c}_current_A" for c in range(len(coils)))),
    )


@lru_cache(maxsize=64)
def modes_for(isolated: IsolatedStructure, currents: tuple[float, ...]) -> tuple[Modes, Outputs]:
    """Modes of a structure whose reference elements are the devices' at given currents (A).

    The reference is the device's stiffness to fast motion: the kinks that a ground motion's samples
    put into the response then drop out of what the steps must approximate.
    """
    structure, elements = isolated.structure, isolated.elements
    references = [
        complex(e.device.linearised(0.0 if e.channel is None else currents[e.channel], 1e6).real)
        * e.device.length / e.device.force_scale
        for e in elements
    ]
    modes = modes_of(
        structure.mass, structure.damping, structure.stiffness, structure.influence,
        isolated.element_rows,
        np.array([e.device.length for e in elements]),
        np.array([e.device.force_scale for e in elements]),
        np.array(references),
    )
    return modes, outputs_of(isolated, modes)


@lru_cache(maxsize=64)
def _uniform_grid(n_samples: int, dt: float) -> Grid:
    return make_grid(n_samples, dt, begun=np.zeros(1))


@lru_cache(maxsize=32)
def _tables(isolated: IsolatedStructure, currents: tuple, n_samples: int, dt: float) -> Tables:
    """Coefficients for runs without events; kept, since they depend on the structure alone."""
    module = kernel_for(isolated, 1)
    return Tables.empty(module, [modes_for(isolated, currents)[0]], _uniform_grid(n_samples, dt))


def kernel_for(isolated: IsolatedStructure, lanes: int) -> Any:
    """Compiled kernel for a structure's elements."""
    laws = tuple(e.device.law for e in isolated.elements)
    return kernel.load(laws, len(isolated.structure.directions), lanes)


class _Plan:
    """Grid, events and arrays of one run, before it starts."""

    def __init__(
        self,
        isolated: IsolatedStructure,
        records: tuple[Record, ...],
        coils: NDArray,
        situation: Situation,
        sensors: Sensors,
        computation_delay: float,
        schedule: Schedule | None,
        compiled: CompiledDecision | None,
    ):
        self.isolated, self.coils, self.situation = isolated, coils, situation
        self.compiled = compiled
        self.module = kernel_for(isolated, 1)
        n, dt = len(records[0].acceleration), records[0].dt
        steady = schedule is not None and len(schedule.time) == 1
        reference = schedule.current[0] if steady else (coils[:, 2] + coils[:, 3]) / 2
        currents = tuple(np.clip(reference, coils[:, 2], coils[:, 3]).tolist())
        self.modes, self.outputs = modes_for(isolated, currents)
        self.sensing = Sensing.none(1)
        if schedule is not None:
            self.chosen = self._with_passive(schedule.current)
        if steady:
            self.grid = _uniform_grid(n, dt)
            self.tables = _tables(isolated, currents, n, dt)
        elif schedule is not None:
            self.grid = make_grid(n, dt, begun=schedule.time)
            self.tables = Tables.empty(self.module, [self.modes], self.grid)
        else:
            self._closed_loop(n, dt, sensors, computation_delay)
        self.ground = np.stack(
            [np.interp(self.grid.time, r.time, r.acceleration) for r in records], axis=1
        )[..., None]

    def _with_passive(self, current: NDArray) -> NDArray:
        """Commands with one more channel for the elements that no coil drives."""
        n, width = len(current), len(self.coils)
        commands = np.zeros((n, 1, width + 1))
        commands[:, 0, :width] = current
        return commands

    def _closed_loop(
        self, n: int, dt: float, sensors: Sensors, computation_delay: float
    ) -> None:
        situation = self.situation
        decided = instants(situation.period, situation.duration)
        asked = decided - sensors.delay
        if sensors.sampling is not None:
            asked = np.floor(asked / sensors.sampling * (1 + 1e-12)) * sensors.sampling
        # before the first sample a sensor reads the building at rest
        sensed, measured_for = np.unique(np.maximum(asked, 0.0), return_inverse=True)
        self.grid = make_grid(n, dt, sensed, decided, decided + computation_delay)
        self.tables = Tables.empty(self.module, [self.modes], self.grid)
        width = len(self.coils)
        names = situation.outputs[: len(situation.outputs) - width]
        compiled = self.compiled
        self.chosen = np.zeros((len(decided), 1, width + 1))
        self.sensing = Sensing(
            measure=np.ascontiguousarray(self.outputs.select(names)[..., None]),
            noise=_noise(names, len(sensed), sensors),
            n_measurements=len(sensed),
            decided=decided,
            measured_for=measured_for.ravel().astype(np.int64),
            function=compiled.address if compiled else 0,
            settings=np.array(compiled.settings if compiled else [], float).reshape(1, -1),
            memory=np.array(compiled.memory if compiled else [], float).reshape(1, -1),
        )

    def workspace(self, tolerance: float, clamp: bool) -> Workspace:
        """Arrays for the kernel."""
        elements, width = self.isolated.elements, len(self.coils)
        driver = np.zeros((width + 1, 4, 1))
        driver[:width, :, 0] = self.coils[:, :4]
        driver[width, :, 0] = [0.0, np.inf, -np.inf, np.inf]
        return Workspace(
            module=self.module,
            tables=self.tables,
            modes=[self.modes],
            devices=[tuple(e.device for e in elements)],
            channel=np.array([width if e.channel is None else e.channel for e in elements]),
            grid=self.grid,
            ground=self.ground,
            driver=driver,
            initial_current=np.append(self.coils[:, 4], 0.0)[:, None],
            chosen=self.chosen,
            sensing=self.sensing,
            tolerance=tolerance,
            deformation_limit=deformation_limit(self.isolated),
            clamp=clamp,
            record_steps=True,
        )


def deformation_limit(isolated: IsolatedStructure) -> float:
    """Summed device deformation that counts as diverged, m: a hundred times what was tested."""
    return 100.0 * sum(e.device.deformation_scale / e.device.length for e in isolated.elements)


def _noise(names: Sequence[str], n_measurements: int, sensors: Sensors) -> NDArray:
    if not sensors.noise:
        return np.zeros((0, 0, 1))
    used = set()
    size = np.zeros(len(names))
    for k, name in enumerate(names):
        for key, value in sensors.noise.items():
            if name == key or name.endswith("_" + key):
                size[k] = value
                used.add(key)
    unused = sorted(set(sensors.noise) - used)
    if unused:
        raise InputError(
            f"sensors: noise of {unused[0]!r} applies to nothing that the controller measures; "
            f"measured: {', '.join(names)}"
        )
    random = np.random.default_rng(sensors.seed)
    return (random.standard_normal((n_measurements, len(names))) * size)[..., None]


def _drive(work: Workspace, plan: _Plan, controller: Control) -> None:
    """Run to the end; a controller in plain Python decides between stretches."""
    decide = plan.module.DECIDE
    if work.march() != decide:
        return
    situation, sensing = plan.situation, plan.sensing
    make = namedtuple("Measurement", situation.outputs)._make  # noqa: PYI024
    width, n_given = len(plan.coils), len(situation.outputs)
    events, info = work.grid.events[:, 1].tolist(), work.info
    times, rows = sensing.decided.tolist(), sensing.measured_for.tolist()
    while True:
        k = events[info[0]]
        measurement = make(work.measured[rows[k], 0, :n_given].tolist())
        work.chosen[k, 0, :width] = controller.current(times[k], measurement)
        if work.march() != decide:
            return


def _check_schedule(schedule: Schedule, situation: Situation) -> None:
    outside = (schedule.current < situation.low) | (schedule.current > situation.high)
    outside |= ~np.isfinite(schedule.current)
    if outside.any():
        k, c = np.argwhere(outside)[0]
        raise _refused(schedule.current[k, c], schedule.time[k], situation, c)


def _refused(current: float, time: float, situation: Situation, channel: int) -> InputError:
    return InputError(
        f"current {current:.5g} A at t = {time:.4g} s is outside {situation.low[channel]:.4g} to "
        f"{situation.high[channel]:.4g} A, where the device on channel {channel} is meaningful; "
        "current_outside='clamp' clamps and counts such commands"
    )


def _report(work: Workspace, plan: _Plan, current_outside: str) -> None:
    """Raise what became of a run that did not reach its end."""
    reason = fate(plan.module, work, 0)
    if reason is None:
        return
    window = int(work.counts[3, 0]) - 1
    time = float(plan.grid.time[plan.grid.windows[window, 0]])
    if reason == "current refused":
        k = int(plan.grid.events[: window + 1, 2].max())
        commands = work.chosen[k, 0, : len(plan.coils)]
        low, high = plan.situation.low, plan.situation.high
        channel = int(np.argmax(~((commands >= low) & (commands <= high))))
        raise _refused(float(commands[channel]), time, plan.situation, channel)
    raise Diverged(f"the run diverged at t = {time:.4g} s: {reason}")


def fate(module: Any, work: Workspace, lane: int) -> str | None:
    """Why a lane did not reach the end; None if it did."""
    return {
        module.ALIVE: None,
        module.CURRENT_REFUSED: "current refused",
        module.NO_CONVERGENCE: (
            "the device's force changes too fast to follow even in the smallest step; the law has "
            "left the range where it is meaningful"
        ),
        module.NOT_FINITE: "a deformation is not a finite number",
        module.TOO_LARGE: (
            "a device is deformed a hundred times further than it was tested; the controller or "
            "the law puts energy into the building"
        ),
    }[int(work.alive[lane])]
