"""The compiled kernel's arrays for one block of lanes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numba import typeof
from numpy.typing import NDArray

from .complex_modes import Modes
from .elements import Elements
from .grid import Grid
from .kernel.arguments import (
    Candidates,
    Coils,
    DenseScratch,
    History,
    Intervals,
    Lanes,
    LawNumbers,
    Limits,
    Measurements,
    PeakScratch,
    Propagation,
    Quantities,
    Scratch,
    Sizes,
    TimeGrid,
)
from .kernel.loading import Kernel, Shape
from .kernel.slots import BUFFER_FULL, FORCES, NEXT, STEP

N_LEVELS = 24
"""The shortest step is a segment divided by 2**23."""

ERROR_FACTOR = 8.0
"""Largest accepted error estimate of a step over the tolerance. The errors of many steps partly
cancel, and the estimate is too large for smooth response."""


@dataclass
class Tables:
    """Propagation coefficients of a structure on a grid; the kernel fills them on demand."""

    # (n_numbers, table_lanes) complex: ``Modes.packed`` of each lane, or of the structure of all
    # lanes
    modes: NDArray
    # (n_classes, n_levels) int: Where the coefficients of a class of segments at a level begin in
    # ``table``
    offsets: NDArray
    table: NDArray  # lanes innermost: The coefficients
    built: NDArray  # (n_classes, n_levels) int: Whether they have been filled in

    @classmethod
    def empty(cls, shape: Shape, modes: Sequence[Modes], grid: Grid) -> Tables:
        """Empty tables."""
        n_modes = modes[0].eigenvalues.size
        sub = np.maximum(grid.intervals[:, None] >> np.arange(N_LEVELS), 1)
        sizes = table_size(shape, n_modes, sub)
        offsets = np.cumsum(sizes.ravel()).reshape(sizes.shape) - sizes
        return cls(
            modes=np.stack([m.packed() for m in modes], axis=1),
            offsets=offsets,
            table=np.empty(int(sizes.sum()) * len(modes)),
            built=np.zeros(sizes.shape, np.int64),
        )


def padded(shape: Shape, n_modes: int) -> int:
    """Number of modes after padding."""
    # a single run computes eight modes at a time, a batch all lanes of one mode
    multiple = 8 if shape.lanes == 1 else 1
    return -(-n_modes // multiple) * multiple


def table_size(shape: Shape, n_modes: int, n_sub: Any) -> Any:
    """Number of coefficients of one step length; see ``layout`` in the kernel."""
    e, g = shape.n_elements, shape.n_ground
    columns = 2 * padded(shape, n_modes)
    rows = 8 * e * (2 * n_modes + g * (n_sub + 1) + 3 * e)
    return rows + columns * (1 + 2 * g + 3 * e * n_sub)


@dataclass
class Sensing:
    """Measurements of a controller, and their instants."""

    measure: NDArray  # (n_outputs, 2 n_modes + n_elements + n_directions, lanes): Output rows
    noise: NDArray  # (n_measurements, n_outputs, lanes), or empty: Noise on each measurement
    n_measurements: int  # Number of measurements
    decision_times: NDArray  # (n_decisions,): Instants of the decisions, s
    measured_for: NDArray  # (n_decisions,) int: The measurement that each decision is based on
    function: int  # Address of a compiled controller; 0 for decisions outside the kernel
    # settings, memory: (lanes, n): Settings and memory of a compiled controller
    settings: NDArray
    memory: NDArray
    numbers: tuple[int, ...]  # What a compiled controller is given beside the lengths

    @classmethod
    def none(cls, lanes: int) -> Sensing:
        """No measurements, for commands known before the run."""
        empty = np.zeros((lanes, 0))
        nothing = np.zeros((0, 0, lanes))
        return cls(nothing, nothing, 0, np.zeros(0), np.zeros(0, np.int64), 0, empty, empty, ())


@dataclass
class Workspace:
    """State, inputs and results of one block of lanes."""

    kernel: Kernel  # Compiled functions
    tables: Tables  # Coefficients; shared by consecutive runs of one structure on one grid
    elements: Elements  # The plants' elements
    grid: Grid  # Grid points, segments and events
    # (n_points, n_directions, lanes): Ground acceleration at the grid points, m/s^2
    ground: NDArray
    # (n_channels, 5, lanes): Lag (s), slew (A/s), lowest current, highest current and step (A) of
    # each coil
    driver: NDArray
    initial_current: NDArray  # (n_channels, lanes): Coil currents at the start, A
    # (n_commands, lanes, n_channels): Commands, A; a controller writes them during the run
    chosen: NDArray
    sensing: Sensing  # Measurements, instants of decisions, and compiled controller
    tolerance: float  # Relative accuracy of the response
    # Whether a command outside the driver's limits is clamped and counted, or ends the run
    clamp: bool
    # Whether to record every step's forces and states at the nodes (one lane only); otherwise only
    # the forces of steps shorter than a grid interval
    record_steps: bool
    # Memory of an earlier workspace, which is overwritten
    buffers: dict[str, NDArray] | None = None
    measured: NDArray = field(init=False)
    z: NDArray = field(init=False)
    states: NDArray = field(init=False)

    def __post_init__(self) -> None:
        shape, grid, lanes = self.kernel.shape, self.grid, self.kernel.shape.lanes
        elements, n_modes = self.elements, self.elements.n_modes
        n_pad, n_points = padded(shape, n_modes), len(grid.time)
        n_segments, n_channels = len(grid.segments) - 1, len(self.driver)
        sensing = self.sensing
        n_outputs = len(sensing.measure)
        self.position = np.zeros(2, np.int64)
        self.sizes = Sizes(
            n_modes, n_pad, shape.n_elements, shape.n_ground, n_channels, n_segments, N_LEVELS,
            n_outputs, elements.n_states, sensing.function, bool(self.record_steps),
            bool(self.clamp),
        )  # fmt: skip
        self.limits = Limits(
            0.03 * self.tolerance, ERROR_FACTOR * self.tolerance, self.tolerance,
            self.elements.deformation_limit,
        )  # fmt: skip
        # one row after the last point is scratch for steps inside a grid interval
        self.z = self._big("z", ((n_points + 2) * 2 * n_pad * lanes,))
        self.z[: 2 * n_pad * lanes] = 0.0
        self.z[n_points * 2 * n_pad * lanes :] = 0.0
        self.states = self._big(
            "states", (n_points + 1, shape.n_elements, elements.n_states, lanes)
        )
        self.states[0] = 0.0
        self.measured = np.zeros((sensing.n_measurements, lanes, n_outputs + n_channels))
        # before the first command the coils have their initial currents
        self.command = np.zeros((n_points, n_channels, lanes))
        self.command[0] = self.initial_current
        self.coil_history = np.zeros((n_segments, n_channels, lanes))
        self.coil = np.array(self.initial_current, float)
        self.alive = np.zeros(lanes, np.int64)
        self.counts = np.zeros((4, lanes), np.int64)
        self.missed = np.zeros(lanes)
        self.forces = self._big("forces", (n_points * shape.n_elements * FORCES * lanes,))
        # a step's modes and, of each element, forces at its start and nodes, states at both
        per_step = 2 * n_pad + shape.n_elements * (4 + 4 * elements.n_states * self.record_steps)
        # memory that no step needs costs nothing
        n_steps = 4 * n_points + 256 if self.record_steps else 256
        self.steps = self._big("steps", (n_steps, (per_step + STEP) * lanes))
        self.step_count = np.zeros(1, np.int64)
        # of each grid interval: into how many recorded steps it is cut and the first of them, or
        # over how many intervals its one step goes, negative
        self.cuts = np.zeros((n_points, lanes), np.int64)
        self.first_step = np.zeros((n_points, lanes), np.int64)
        self.arguments = (self.position, self.sizes, self.limits, *self._grouped())

    def _big(self, name: str, shape: tuple[int, ...]) -> NDArray:
        """Array that is written before it is read; reused from an earlier run if possible."""
        if self.buffers is None:
            return np.empty(shape)
        if name not in self.buffers or self.buffers[name].shape != shape:
            self.buffers[name] = np.empty(shape)
        return self.buffers[name]

    def _addresses_of_rows(self) -> tuple[int, ...]:
        """Addresses, strides in bytes and sizes of a compiled controller's rows."""
        rows = (self.measured, self.sensing.settings, self.sensing.memory, self.chosen)
        # the last channel, of elements without a coil, is not passed to the controller
        hidden = (1, 0, 0, 1)
        lengths = [row.shape[-1] - h for row, h in zip(rows, hidden, strict=True)]
        self._sizes = np.array([*lengths, *self.sensing.numbers], dtype=np.int64)
        return (
            *(n for r in rows for n in (r.ctypes.data, 8 * r.shape[-1])),
            self._sizes.ctypes.data,
        )

    def _grouped(self) -> tuple[Any, ...]:
        """The groups of arrays, which do not change while the kernel runs."""
        shape, grid, elements = self.kernel.shape, self.grid, self.elements
        lanes = shape.lanes
        sensing, tables = self.sensing, self.tables
        coils = Coils(
            self.command, self.driver, self.coil, np.full((shape.n_elements, lanes), np.nan),
            np.zeros((shape.n_elements, lanes), np.int64), self.coil_history,
        )  # fmt: skip
        whole = ("base", "place", "tried", "hold", "active", "going", "todo")
        floats = ("last", "previous", "defects", "errors", "kinks", "worst")
        return (
            TimeGrid(grid.segments, grid.spans, grid.events, self.ground.ravel()),
            Propagation(
                tables.offsets, tables.modes, tables.table, tables.built, np.empty(4, complex),
                np.empty(3, complex),
            ),
            Measurements(
                sensing.measure, sensing.noise, self.measured, self.chosen, sensing.decision_times,
                sensing.measured_for, self._addresses_of_rows() if sensing.function else (0,) * 9,
            ),
            coils,
            LawNumbers(
                elements.table, elements.breaks, elements.shape, elements.channel,
                elements.functions, elements.sizes,
            ),
            Lanes(
                level=np.full(lanes, 1, np.int64), contraction=np.ones(lanes), alive=self.alive,
                missed=self.missed, counts=self.counts,
                **dict(zip(whole, np.zeros((len(whole), lanes), np.int64), strict=True)),
                **dict(zip(floats, np.zeros((len(floats), lanes)), strict=True)),
            ),
            History(
                self.z, self.states.ravel(), self.forces, self.steps, self.step_count, self.cuts,
                self.first_step, np.zeros(lanes, np.int64),
            ),
            Scratch(
                elements.numbers.copy(),
                np.empty((int(grid.intervals.max()) + 1) * shape.n_ground * lanes),
            ),
        )  # fmt: skip

    def integrate(self) -> int:
        """Integrate until the kernel stops; returns its status."""
        return self._to_a_stop(self.kernel.integration.integrate)

    def integrator(self) -> Callable[[], int]:
        """``integrate`` for many short parts: it looks up the arguments' types only once."""
        compiled = self.kernel.integration.integrate
        types = tuple(map(typeof, self.arguments))
        if types not in compiled.overloads:
            compiled.compile(types)
        return partial(self._to_a_stop, compiled.overloads[types].entry_point)

    def _to_a_stop(self, compiled: Callable[..., int]) -> int:
        """Integrate until the kernel stops, except for a full step record."""
        while True:
            status = compiled(*self.arguments)
            if status != BUFFER_FULL:
                return status
            larger = np.empty((4 * len(self.steps), *self.steps.shape[1:]))
            larger[: len(self.steps)] = self.steps
            self.steps = larger
            *others, history, scratch = self.arguments
            self.arguments = (*others, history._replace(steps=self.steps), scratch)

    def carried(self) -> dict[str, NDArray]:
        """Data from segment to segment beside modes and states; the last axis is the lane."""
        *_, coils, _, lanes, history, scratch = self.arguments
        return {
            "w": scratch.w.reshape(-1, self.kernel.shape.lanes), "applied": coils.applied,
            "moving": coils.moving, "coil": coils.current, "last_step": history.last_step,
            **lanes._asdict(),
        }  # fmt: skip

    def state_at(self, point: int) -> dict[str, NDArray]:
        """Copies of the state at a grid point and of the data carried on."""
        row = len(self.z) // (len(self.grid.time) + 2)
        return {
            "position": self.position.copy(),
            "z": self.z[point * row : (point + 1) * row].copy(),
            "states": self.states[point].copy(),
            **{name: array.copy() for name, array in self.carried().items()},
        }

    def restore(self, point: int, state: Mapping[str, NDArray]) -> None:
        """Continue from a state of `state_at`."""
        row = len(state["z"])
        self.position[:] = state["position"]
        self.z[point * row : (point + 1) * row] = state["z"]
        self.states[point] = state["states"]
        for name, array in self.carried().items():
            array[...] = state[name]

    def peaks_and_mean_squares(self, quantities: Quantities) -> NDArray:
        """Every quantity's peak and mean square, (2, n_quantities, lanes)."""
        n_quantities, n_fast = quantities.n_quantities, quantities.fast.size
        module, grid, lanes = self.kernel.peaks, self.grid, self.kernel.shape.lanes
        n_modes, _, n_elements, n_ground = self.sizes[:4]
        per_block = 8 // quantities.n_directions
        n_blocks = -(-n_quantities // per_block)
        track = np.zeros((n_blocks, module.KINDS, 8, lanes))
        candidates = Candidates(
            np.empty((lanes, module.CANDIDATES, 2), np.int64),
            np.empty((lanes, module.CANDIDATES)),
            np.zeros(lanes, np.int64),
            np.empty(n_quantities, np.int64),
        )
        scratch = PeakScratch(
            np.empty(module.POINTS, np.int64),
            np.empty(n_elements * module.POINTS * lanes),
            np.zeros(n_blocks * 2 * module.SLOTS * 8 * lanes),
            np.zeros(module.SLOTS, np.int64),
            np.zeros((n_blocks, module.SLOTS), np.int64),
            np.empty(n_elements * lanes),
            np.zeros(8 * lanes),
            np.empty(8 * lanes),
            np.empty((module.SLOTS, n_fast, lanes)),
            np.empty((n_fast, lanes)),
            np.zeros((module.SLOTS, lanes)),
        )
        dense = DenseScratch(
            np.empty(n_modes, complex),
            np.empty((1 + 2 * n_ground + 3 * n_elements, n_modes), complex),
            np.full(2, -1.0),
            np.empty((n_elements, 8)),
            np.zeros(module.DENSE * 2 * n_modes),
            np.zeros(module.DENSE * n_elements),
            np.zeros(module.DENSE * n_ground),
            np.empty(8 * (2 * n_modes + n_elements + n_ground)),
            np.empty(module.DENSE * 8),
            np.arange(module.DENSE),
            np.zeros((n_quantities, 2)),
            np.empty(3, complex),
            np.empty(4, complex),
        )
        *_, history, _ = self.arguments
        module.find_peaks(
            self.sizes,
            Intervals(grid.segments, grid.segment_of, grid.lengths, self.ground.ravel()),
            quantities, history, self.tables.modes, candidates, scratch, dense, track.ravel(),
        )  # fmt: skip
        result = track[:, [module.PEAK, module.TOTAL], :per_block].swapaxes(0, 1)
        return result.reshape(2, -1, lanes)[:, :n_quantities]


def modal_motion(work: Workspace, n_modes: int, lane: int, points: Any = slice(None)) -> NDArray:
    """Complex modal coordinates of a lane at some points of the grid, (n_points, n_modes)."""
    n_points = len(work.grid.time)
    z = work.z.reshape(n_points + 2, 2, padded(work.kernel.shape, n_modes), -1)[:n_points]
    return z[points, 0, :n_modes, lane] + 1j * z[points, 1, :n_modes, lane]


def motion_by_steps(work: Workspace, n_modes: int, lane: int) -> NDArray:
    """As ``modal_motion`` at all grid points, and where steps begin between them."""
    lanes, n_pad = work.cuts.shape[1], padded(work.kernel.shape, n_modes)
    steps = work.steps.reshape(len(work.steps), -1, lanes)[:, :, lane]
    following = steps.shape[1] - STEP + NEXT
    numbers, intervals = [], []
    for interval in np.flatnonzero(work.cuts[:, lane] > 1).tolist():
        number = int(work.first_step[interval, lane])
        for _ in range(work.cuts[interval, lane] - 1):
            number = int(steps[number, following])
            numbers.append(number)
            intervals.append(interval)
    inside = steps[numbers]
    within = inside[:, :n_modes] + 1j * inside[:, n_pad : n_pad + n_modes]
    points = modal_motion(work, n_modes, lane)
    return np.insert(points, np.array(intervals, int) + 1, within, axis=0)
