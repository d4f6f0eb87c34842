"""Conversion of runs to the kernel's arrays: one run, or several runs in lanes."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ground_motions import STANDARD_GRAVITY, Record

from ..errors import Diverged, InputError, RefusedCurrent, unknown_name
from ..laws.device import Device
from ..laws.law import Law
from ..structures import IsolatedStructure
from .complex_modes import Modes, complex_modes
from .control import CompiledDecision, RunContext, Schedule, Sensors, instants
from .elements import MOST_TESTED, Elements, elements_of
from .grid import Grid, make_grid
from .kernel.loading import Kernel, Shape, compiling, load
from .kernel.slots import ALIVE, CURRENT_REFUSED, ENDED
from .outputs import Outputs, outputs_of
from .sensing import check_noise, latest_samples, measured_motion, noise_of
from .workspace import Sensing, Tables, Workspace

STRONGEST = 30.0
"""Peak ground acceleration above all records, m/s^2: a unit or a scale is wrong."""


@lru_cache(maxsize=256)
def modes_for(isolated: IsolatedStructure) -> tuple[Modes, Outputs]:
    """Modes of a structure with reference springs for its devices, and its outputs."""
    # The reference of a device is its stiffness to fast motion at the middle current. The residual
    # force, which the steps approximate, then hardly contains the kinks from the samples of the
    # ground motion.
    structure, elements = isolated.structure, isolated.elements
    references = []
    for element in elements:
        device = element.device
        low, high = device.current_range
        current = (low + high) / 2 if np.isfinite(high - low) else 0.0
        references.append(_fast_stiffness(device, current))
    arrays = (
        structure.mass,
        structure.damping,
        structure.stiffness,
        structure.influence,
        isolated.element_rows,
        np.array([e.device.length for e in elements]),
        np.array([e.device.force_scale for e in elements]),
        np.array(references),
    )
    modes = _complex_modes(*((one.shape, one.astype(float).tobytes()) for one in arrays))
    return modes, outputs_of(isolated, modes)


@lru_cache(maxsize=64)
def _complex_modes(*arrays: tuple[tuple[int, ...], bytes]) -> Modes:
    """Modes of equal arrays; a fit changes one device in the same structure many times."""
    return complex_modes(*(np.frombuffer(data).reshape(shape) for shape, data in arrays))


def _fast_stiffness(device: Device, current: float) -> float:
    """Stiffness of a device to a fast motion about rest, in its own scale, N/m."""
    # By differences: an approximation is enough, and CasADi takes time to load.
    law, parameters = device.law, device.parameters_at(current)
    step = 1e-4 * device.deformation_scale / device.length
    rest = (0.0,) * len(law.states) if law.rest is None else law.rest(parameters)
    # in fast motion, without relaxation, a state changes by its rate per velocity
    slopes = [
        (a - b) / 2
        for a, b in zip(
            law.rates(0.0, 1.0, rest, parameters),
            law.rates(0.0, -1.0, rest, parameters),
            strict=True,
        )
    ]
    ahead, behind = (
        law.force(
            side, 0.0, tuple(r + s * side for r, s in zip(rest, slopes, strict=True)), parameters
        )
        for side in (step, -step)
    )
    stiffness = float(ahead - behind) / (2 * step)
    return stiffness if np.isfinite(stiffness) and stiffness > 0 else 0.0


_STEADY = np.zeros(1).tobytes()
"""Instants of a schedule whose currents do not change."""


@lru_cache(maxsize=64)
def _scheduled_grid(n_samples: int, dt: float, instants: bytes) -> Grid:
    """Grid with a schedule's instants; a search simulates one record with one schedule often."""
    return make_grid(n_samples, dt, command_times=np.frombuffer(instants))


@lru_cache(maxsize=32)
def _cached_tables(shape: Shape, modes: Modes, n_samples: int, dt: float, thread: int) -> Tables:
    """Cached coefficients of runs without events, which depend only on the modes."""
    # The kernel fills them during a run, so that threads must not share them.
    return Tables.empty(shape, [modes], _scheduled_grid(n_samples, dt, _STEADY))


def kernel_for(isolated: IsolatedStructure, lanes: int, alike: bool) -> Kernel:
    """Compiled kernel for a structure's elements; ``alike``: all lanes have the same structure."""
    # a device of several directions belongs to its first element
    laws: list[Law | None] = []
    for group, law in zip(isolated.groups, isolated.group_laws, strict=True):
        laws += [law, *[None] * (len(group) - 1)]
    return load(laws, len(isolated.structure.directions), lanes, alike)


@lru_cache(maxsize=256)
def _elements_for(own: Kernel, plants: tuple[IsolatedStructure, ...]) -> Elements:
    with compiling(own):
        return elements_of(own, plants, [modes_for(plant)[0] for plant in plants])


@dataclass(frozen=True)
class Lane:
    """One run, before it starts."""

    isolated: IsolatedStructure  # The plant
    records: tuple[Record, ...]  # Ground motion, one per direction
    # (n_channels, 6): Lag (s), slew (A/s), lowest current, highest current, step and initial
    # current (A) of each coil
    coils: NDArray
    context: RunContext  # Information for the controller
    schedule: Schedule | None  # Commands known before the run
    # The controller in compiled code; without this and a schedule it decides in Python
    compiled: CompiledDecision | None
    controller: str  # Name of the controller

    @property
    def key(self) -> tuple:
        """Key of the runs that can be computed together."""
        record = (len(self.records[0].acceleration), self.records[0].dt)
        if self.schedule is not None:
            control: tuple = tuple(self.schedule.time.tolist())
        else:
            compiled = self.compiled
            control = (
                self.context.period,
                self.context.outputs,
                (
                    compiled.address,
                    compiled.numbers,
                    compiled.settings.shape,
                    compiled.memory.shape,
                )
                if compiled
                else id(self),
            )
        return _plant_key(self.isolated), record, len(self.records), control


@lru_cache(maxsize=1024)
def _plant_key(isolated: IsolatedStructure) -> tuple:
    """Key of the plants that can be computed together."""
    modes, outputs = modes_for(isolated)
    elements = tuple(
        (e.device.law, e.channel, e.device.current.coefficients.shape, e.follows)
        for e in isolated.elements
    )
    return elements, modes.eigenvalues.size, outputs.names, isolated.n_channels


class Plan:
    """Grid, events and arrays of one or several runs, before they start."""

    def __init__(
        self, lanes: Sequence[Lane], sensors: Sensors, computation_delay: float, alike: bool
    ):
        self.lanes = lanes  # Runs with one key
        first = lanes[0]
        self.kernel = kernel_for(first.isolated, len(lanes), alike)
        pairs = [modes_for(lane.isolated) for lane in lanes]
        self.modes = [modes for modes, _ in pairs]
        self.outputs = [outputs for _, outputs in pairs]
        check_noise(self.outputs[0].names, sensors)
        self.sensing = Sensing.none(len(lanes))
        n, dt = len(first.records[0].acceleration), first.records[0].dt
        width = len(first.coils)
        steady = False
        if first.schedule is None:
            self._closed_loop(n, dt, sensors, computation_delay)
        else:
            # one more channel, for the elements without a coil
            self.chosen = np.zeros((len(first.schedule.time), len(lanes), width + 1))
            for k, lane in enumerate(lanes):
                assert lane.schedule is not None
                self.chosen[:, k, :width] = lane.schedule.current
            times = np.ascontiguousarray(first.schedule.time, float).tobytes()
            steady = times == _STEADY
            self.grid = _scheduled_grid(n, dt, times)
        if alike and steady:
            thread = threading.get_ident()
            self.tables = _cached_tables(self.kernel.shape, self.modes[0], n, dt, thread)
        else:
            self.tables = Tables.empty(
                self.kernel.shape, self.modes[: self.kernel.shape.table_lanes], self.grid
            )
        if all(lane.records is first.records or lane.records == first.records for lane in lanes):
            self.ground = np.repeat(self._ground(first)[..., None], len(lanes), axis=2)
        else:
            self.ground = np.stack([self._ground(lane) for lane in lanes], axis=2)

    def _ground(self, lane: Lane) -> NDArray:
        time, records = self.grid.time, lane.records
        if len(time) == len(records[0].acceleration):
            return np.stack([r.acceleration for r in records], axis=1)
        ground = np.stack([np.interp(time, r.time, r.acceleration) for r in records], axis=1)
        # the instants on the grid may differ from the samples by rounding
        ground[self.grid.samples] = np.stack([r.acceleration for r in records], axis=1)
        return ground

    def _closed_loop(self, n: int, dt: float, sensors: Sensors, delay: float) -> None:
        lanes, first = self.lanes, self.lanes[0]
        context, width = first.context, len(first.coils)
        decision_times = instants(context.period, context.duration)
        times = decision_times - sensors.delay
        if sensors.sampling is not None:
            times = np.floor(times / sensors.sampling * (1 + 1e-12)) * sensors.sampling
        # before the first sample a sensor measures the building at rest
        measurement_times, measured_for = np.unique(np.maximum(times, 0.0), return_inverse=True)
        measured_for = latest_samples(len(measurement_times), sensors)[measured_for.ravel()]
        self.grid = make_grid(n, dt, measurement_times, decision_times, decision_times + delay)
        self.chosen = np.zeros((len(decision_times), len(lanes), width + 1))
        names = context.outputs[: len(context.outputs) - width]
        for lane, o in zip(lanes, self.outputs, strict=True):
            for name in names:
                if name not in o.names:
                    place = f"{lane.controller}: measures()"
                    raise InputError(f"{place}: {unknown_name('output', name, o.names)}")
        motion_rows = [
            measured_motion(lane.isolated, names, o.names, sensors.compensation)
            for lane, o in zip(lanes, self.outputs, strict=True)
        ]
        noise = noise_of(names, self.outputs[0].names, len(measurement_times), sensors)
        compiled = [lane.compiled for lane in lanes]
        self.sensing = Sensing(
            measure=np.stack(
                [row @ o.rows for row, o in zip(motion_rows, self.outputs, strict=True)], axis=2
            ),
            # each lane has the noise of its own single run
            noise=np.stack([noise @ row.T for row in motion_rows], axis=2)
            if noise.size
            else np.zeros((0, 0, len(lanes))),
            n_measurements=len(measurement_times),
            decision_times=decision_times,
            measured_for=measured_for,
            function=compiled[0].address if compiled[0] else 0,
            settings=np.array([c.settings if c else [] for c in compiled], float),
            memory=np.array([c.memory if c else [] for c in compiled], float),
            numbers=compiled[0].numbers if compiled[0] else (),
        )

    def workspace(
        self,
        tolerance: float,
        clamp: bool,
        record_steps: bool,
        buffers: dict[str, NDArray] | None = None,
    ) -> Workspace:
        """Arrays for the kernel."""
        lanes, width = self.lanes, len(self.lanes[0].coils)
        driver = np.zeros((width + 1, 5, len(lanes)))
        initial = np.zeros((width + 1, len(lanes)))
        driver[width] = np.array([0.0, np.inf, -np.inf, np.inf, 0.0])[:, None]
        for k, lane in enumerate(lanes):
            driver[:width, :, k] = lane.coils[:, :5]
            initial[:width, k] = lane.coils[:, 5]
        return Workspace(
            kernel=self.kernel,
            tables=self.tables,
            elements=_elements_for(self.kernel, tuple(lane.isolated for lane in lanes)),
            grid=self.grid,
            ground=self.ground,
            driver=driver,
            initial_current=initial,
            chosen=self.chosen,
            sensing=self.sensing,
            tolerance=tolerance,
            clamp=clamp,
            record_steps=record_steps,
            buffers=buffers,
        )

    def failure(self, work: Workspace, lane: int) -> InputError | Diverged | None:
        """Reason and time of an early end; None for a complete run."""
        code = int(work.alive[lane])
        if code == ALIVE:
            return None
        segment = int(work.counts[ENDED, lane]) - 1
        time = float(self.grid.time[self.grid.segments[segment, 0]])
        if code != CURRENT_REFUSED:
            cause = _CAUSES[code].format(most=MOST_TESTED, cause=_likely_cause(self.lanes[lane]))
            return Diverged(f"the run diverged at t = {time:.4g} s: {cause}")
        context = self.lanes[lane].context
        k = int(self.grid.events[: segment + 1, 2].max())
        commands = work.chosen[k, lane, : len(context.low)]
        channel = int(np.argmax(~((commands >= context.low) & (commands <= context.high))))
        return refusal(float(commands[channel]), time, self.lanes[lane], channel)


def refusal(current: float, time: float, lane: Lane, channel: int) -> RefusedCurrent:
    """Error for a refused current, with its controller, its time and the limits."""
    low, high = lane.context.low[channel], lane.context.high[channel]
    remedy = (
        "" if np.isnan(current) else "; current_outside='clamp' clamps and counts such commands"
    )
    return RefusedCurrent(
        f"{lane.controller}: current {current:.5g} A at t = {time:.4g} s is outside {low:.4g} to "
        f"{high:.4g} A, the range of the supply and of the devices on channel {channel}{remedy}"
    )


# in the order of the kernel's codes
_CAUSES = (
    "",
    "the device's force changes too fast to follow even in the smallest step; the law has left the "
    "range where it is meaningful",
    "a deformation is not a finite number",
    "the devices deform {most:.0f} times further than they were tested; {cause}",
)


def _likely_cause(lane: Lane) -> str:
    """Probable cause of a divergence, from the size of the motion and of the devices."""
    peak = max(record.pga for record in lane.records)
    if peak > STRONGEST:
        return (
            f"the ground motion peaks at {peak:.3g} m/s^2 ({peak / STANDARD_GRAVITY:.3g} g): check "
            "its unit and scale"
        )
    tested = ", ".join(
        f"{element.name} {1e3 * element.device.deformation_scale:.3g} mm"
        for element in lane.isolated.elements
    )
    return (
        f"check length_scale and force_scale (tested at this scale: {tested}), and whether the "
        "controller or the law puts energy into the building; tested_deformation_m allows more"
    )
