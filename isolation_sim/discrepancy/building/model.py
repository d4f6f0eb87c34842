"""The engineer's building with candidate causes, and its prediction of a record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ground_motions import Record

from ...effects import Effect, extend
from ...errors import Diverged, InputError
from ...laws import Device
from ...registry import controller
from ...simulation.control import CoilDriver, Control, RunContext, Schedule
from ...simulation.result import Run
from ...simulation.run import simulate
from ...structures import IsolatedStructure, Structure
from .channels import AXES, ROTATION
from .isolator_effects import absent, around_the_law
from .record import BuildingRecord

FOUNDATION = "foundation"
STOREY_HEIGHT = 3.5
"""Storey height of a structure without heights, m."""
TOLERANCE = 1e-6
_JUMP = 1e-3
"""Half of the time, in samples, in which a held current changes."""
JUMPS = 0.0, -2 * _JUMP, 2 * _JUMP
"""Times, in samples after its sample, at which a held current may jump: the channels of that sample
then show the middle of the jump, or they were taken just after or before it."""


@dataclass(frozen=True)
class Soil:
    """Sway or rocking of a foundation on its soil, alike in all directions."""

    stiffness: float  # N/m or N m
    damping: float  # N s/m or N m s
    mass: float  # kg or kg m^2: Of the foundation and of the soil that moves with it
    rocking: bool = False  # Whether it turns about its own level, instead of moving sideways


@dataclass(frozen=True, eq=False)
class BuildingModel:
    """A building on isolators, changed by causes."""

    nominal: IsolatedStructure  # As the engineer gave it; its first element is an isolator
    structure: Structure  # Linear part
    # Effects around the isolators' law, with parameters in the device's scale
    effects: Mapping[Effect, Mapping[str, float]] = field(default_factory=dict)
    soil: tuple[Soil, ...] = ()  # Motions of the foundation on it; none on a rigid soil
    # Hysteretic elements in storeys, by the storey's place among the drifts
    hysteresis: Mapping[int, Device] = field(default_factory=dict)
    # Which of ``JUMPS`` a recorded current makes that is held; None if it is linear between samples
    jump: float | None = None
    # Whether the ground motion has no frequencies above the samples', or is linear between them
    band_limited: bool = False
    delay: float = 0.0  # Delay of the recorded current at the isolators, s
    lag: float = 0.0  # Time constant with which they follow it, s
    slew: float = np.inf  # Slew rate of the supply, A/s
    supply_limit: float = np.inf  # Highest current that reaches them, A
    # Error of a channel as Legendre coefficients over the record's duration, in its unit
    biases: Mapping[str, NDArray] = field(default_factory=dict)
    gains: Mapping[str, float] = field(default_factory=dict)  # Shown over true motion, by channel
    delays: Mapping[str, float] = field(default_factory=dict)  # How late a channel is, s
    # How much later it is every second, s, by a clock of another rate
    drifts: Mapping[str, float] = field(default_factory=dict)
    exchanged: tuple[tuple[str, str], ...] = ()  # Channels that show each other's motion

    @property
    def isolators(self) -> tuple[int, ...]:
        """Elements with the device of the first one, whatever share of it."""
        first = self.nominal.elements[0].device
        return tuple(
            e for e, one in enumerate(self.nominal.elements) if _same_device(one.device, first)
        )

    def changed(self, **matrices: Any) -> BuildingModel:
        """The model with other matrices of its structure, such as ``stiffness``."""
        return replace(self, structure=replace(self.structure, **matrices))

    @property
    def device(self) -> Device:
        """The first isolator's device, with the effects around it."""
        return self._extended(self.nominal.elements[0].device)

    def _extended(self, device: Device) -> Device:
        if not self.effects:
            return device
        size = device.deformation_scale / device.length
        around = around_the_law(self.effects)
        return extend(device, [(e, self.effects.get(e) or absent(e, size)) for e in around])

    @cached_property
    def assembled(self) -> IsolatedStructure:
        """Structure, isolators and soil; the engine keeps what it derives from one such object."""
        elements = list(self.nominal.elements)
        extended: dict[float, Device] = {}
        for e in self.isolators if self.effects else ():
            device = elements[e].device
            if device.force_scale not in extended:
                extended[device.force_scale] = self._extended(device)
            elements[e] = replace(elements[e], device=extended[device.force_scale])
        structure = self.structure
        for k, device in self.hysteresis.items():
            elements += structure.with_element(device, structure.storeys[k]).elements
        if not self.soil:
            return IsolatedStructure(structure, tuple(elements))
        founded, carried = _founded(structure, self.soil)
        # deformations are those of the building seen from its foundation
        return IsolatedStructure(
            founded, tuple(replace(e, direction=e.direction @ carried) for e in elements)
        )

    def predict(self, record: BuildingRecord, ground: Sequence[Record] | None = None) -> NDArray:
        """Simulate a record's channels, (n, n_channels); not a number if the model diverges."""
        # ``ground`` may take the place of the record's ground motion on the same samples, m/s^2.
        return self.sensed(record, self.simulated(record, ground))

    def simulated(
        self,
        record: BuildingRecord,
        ground: Sequence[Record] | None = None,
        end: int | None = None,
    ) -> NDArray:
        """Simulate the building's motion, without the errors of its sensors; see ``predict``."""
        try:
            run = self.run(record, ground, end)
        except Diverged:
            return np.full((len(record.ground[0].acceleration[:end]), len(record.channels)), np.nan)
        return run.combined(self.measured(record, run.isolated, run.outputs.names))

    def run(
        self,
        record: BuildingRecord,
        ground: Sequence[Record] | None = None,
        end: int | None = None,
        control: Control | None = None,
    ) -> Run:
        """Simulate the building under a record's ground motion and current; see ``predict``."""
        motions = []
        for name, motion in zip(record.ground_channels, ground or record.ground, strict=True):
            error = _legendre(self.biases[name], len(record)) if name in self.biases else 0.0
            shaking = motion.acceleration
            if record.filter and record.filter.ground:
                shaking = record.filter.restore(shaking, record.dt)
            shaking = (shaking - error) / self.gains.get(name, 1.0)
            if self.band_limited:
                shaking = _for_lines(shaking)
            motions.append(replace(motion, acceleration=shaking[:end]))
        isolated = self.assembled
        driver = CoilDriver()
        slew = np.inf if self.jump is None else self.slew
        if record.current is not None and (self.lag or np.isfinite(slew)):
            start = float(np.clip(record.current[0], *isolated.current_range()))
            driver = CoilDriver(lag=self.lag, slew=slew, initial=start)
        return simulate(
            isolated,
            motions,
            self.control(record) if control is None else control,
            driver=driver,
            tolerance=TOLERANCE,
            current_outside="clamp",
        )

    def measured(
        self, record: BuildingRecord, isolated: IsolatedStructure, names: tuple[str, ...]
    ) -> NDArray:
        """Columns of a run's outputs that give the record's channels, (n_outputs, n_channels)."""
        # causes change its matrices alone
        structure = self.nominal.structure
        levels = {axis: dofs_by_level(structure, axis) for axis in (*record.axes, ROTATION)}
        all_names = isolated.structure.names
        result = np.zeros((len(names), len(record.sensors)))
        for k, sensor in enumerate(record.sensors):
            dof = levels[sensor.axis][sensor.floor]
            if not sensor.is_displacement:
                result[names.index(f"{all_names[dof]}_acceleration_m_s2"), k] = 1.0
                continue
            # of the base, seen from the foundation
            row = _carried(self.structure, self.soil)[dof]
            for j in np.flatnonzero(row):
                result[names.index(f"{all_names[j]}_displacement_m"), k] = row[j]
        return result

    def sensed(self, record: BuildingRecord, motion: NDArray) -> NDArray:
        """What the sensors of a record show of a simulated motion, (n, n_channels)."""
        from scipy.ndimage import map_coordinates, shift

        shown, channels = motion.copy(), record.channels
        for pair in self.exchanged:
            first, second = (channels.index(name) for name in pair)
            shown[:, [first, second]] = shown[:, [second, first]]
        for k, name in enumerate(channels):
            if name in self.drifts:
                samples = np.arange(len(shown)) * (1 - self.drifts[name])
                shown[:, k] = map_coordinates(shown[:, k], [samples], mode="nearest")
            if name in self.delays:
                shown[:, k] = shift(shown[:, k], self.delays[name] / record.dt, mode="nearest")
            if name in self.gains:
                shown[:, k] *= self.gains[name]
            if name in self.biases:
                shown[:, k] += _legendre(self.biases[name], len(record))[: len(shown)]
        return record.filter.apply(shown, record.dt) if record.filter else shown

    def control(self, record: BuildingRecord) -> Control:
        """The current that reaches the isolators, as a control."""
        if record.current is None:
            return controller("passive_off")
        current = np.minimum(record.current, self.supply_limit)
        return RecordedCurrent(record.time, current, self.delay, self.jump, self.slew)


class RecordedCurrent:
    """The current of a record, with a delay: held from sample to sample, or linear between them.

    A current that is linear also follows a slew rate; it would lag behind the steps of a schedule.
    """

    name = "recorded"
    period: float | None = None
    preview_time = 0.0

    def __init__(
        self,
        time: NDArray,
        current: NDArray,
        delay: float,
        jump: float | None,
        slew: float = np.inf,
    ) -> None:
        step = time[1] - time[0]
        between = (current[1:] + current[:-1]) / 2
        values = np.append(np.column_stack([current[:-1], between]).ravel(), current[-1])
        if jump is None and np.isfinite(slew):
            values = _followed(values, slew * step / 2)
        starts = np.arange(values.size) * step / 2 - step / 4
        if jump is not None:
            starts = (np.repeat(np.arange(current.size), 2)[1:] + jump) * step
            starts += np.where(np.arange(values.size) % 2, -1, 1) * _JUMP * step
        changes = np.append(False, np.diff(values) != 0)
        self.values = current
        self.table = np.append(0.0, starts[changes] + delay), np.append(values[0], values[changes])

    def prepare(self, context: RunContext, trial: Any) -> None:
        """Nothing to prepare."""

    def measures(self, nominal: IsolatedStructure) -> tuple[str, ...]:
        """Nothing."""
        return ()

    def compiled(self, context: RunContext) -> None:
        """Nothing to decide."""

    def reset(self, context: RunContext) -> None:
        """Nothing to forget."""

    def current(self, t: float, measurement: Any) -> Any:
        """Nothing: the schedule holds every command."""
        raise NotImplementedError

    def schedule(self, context: RunContext) -> Schedule:
        """Return the commands within the run."""
        time, current = self.table
        within = time < context.duration
        channels = len(context.low)
        return Schedule(time[within], np.repeat(current[within, np.newaxis], channels, axis=1))


def _followed(values: NDArray, most: float) -> NDArray:
    """Values that follow others by at most so much from one to the next."""
    followed = [float(values[0])]
    for value in values[1:].tolist():
        followed.append(min(max(value, followed[-1] - most), followed[-1] + most))
    return np.array(followed)


def building_model(isolated: IsolatedStructure, records: Sequence[BuildingRecord]) -> BuildingModel:
    """Check that a structure can represent the building of some records."""
    structure = isolated.structure
    for record in records:
        _check_directions(record, structure)
    _check_layer(isolated)
    lowest = isolated.current_range()[0] if isolated.n_channels else 0.0
    for record in records:
        for sensor in sorted(record.sensors, key=lambda sensor: -sensor.floor):
            n_levels = len(dofs_by_level(structure, sensor.axis))
            if n_levels == 0:
                raise InputError(
                    f"{record.name} has {sensor.name}; {structure.name} does not rotate"
                )
            if sensor.floor >= n_levels:
                raise InputError(
                    f"{record.name} has floor{sensor.floor}; {structure.name} has {n_levels - 1} "
                    "floors above its base"
                )
        if record.current is None and lowest > 0:
            raise InputError(
                f"{record.name} has no column current_A, and the isolators of {structure.name} "
                f"need a current of {lowest:g} A or more"
            )
    return BuildingModel(isolated, structure)


def _check_directions(record: BuildingRecord, structure: Structure) -> None:
    """Refuse a structure that moves along other directions than a record."""
    directions = structure.directions
    if len(directions) != len(record.axes):
        count = {1: "one direction", 2: "two directions"}
        names = ", ".join(record.ground_channels)
        raise InputError(
            f"{record.name} has ground motion along {count[len(record.axes)]} ({names}); "
            f"{structure.name} moves along {', '.join(directions)}; expected: the same number"
        )
    for axis in record.axes:
        if not dofs_by_level(structure, axis):
            raise InputError(
                f"{structure.name}: no dof of its base moves with the ground along "
                f"{axis or directions[0]} alone; expected: one"
            )


def _check_layer(isolated: IsolatedStructure) -> None:
    """Refuse a structure whose first element is no isolator, or that is not held."""
    structure = isolated.structure
    above = [i for i in range(structure.n_dofs) if i not in structure.base]
    first = isolated.elements[0].direction if isolated.elements else None
    if first is None or structure.foundation or np.any(first[above]):
        raise InputError(
            f"{structure.name}: the first element must be the isolation layer, between ground "
            "and base"
        )
    model = BuildingModel(isolated, structure)
    held = np.abs(isolated.holding[list(model.isolators)]).max(axis=0)
    for label, how in zip(structure.directions, held, strict=True):
        if how == 0:
            raise InputError(
                f"{structure.name}: {isolated.elements[0].device.name} does not act along {label}; "
                "expected: isolators of the first element's device along every direction"
            )


@lru_cache(maxsize=64)
def dofs_by_level(structure: Structure, axis: str) -> tuple[int, ...]:
    """Dofs of base and floors along a direction or in rotation; empty if it has none."""
    n = len(structure.horizontal)
    moved = np.zeros(n)
    if axis != ROTATION:
        moved[AXES.index(axis) if axis else 0] = 1.0
    base, above = (
        [i for i in dofs if np.array_equal(structure.influence[i, :n], moved)]
        for dofs in (structure.base, structure.superstructure)
    )
    return (base[0], *above) if len(base) == 1 else ()


def motion_of(structure: Structure, row: NDArray, axes: tuple[str, ...]) -> str | None:
    """Direction along which a row over the dofs, such as a drift, lies; None if it mixes them."""
    if len(axes) == 1:
        return axes[0]
    touched = set(np.flatnonzero(row).tolist())
    for axis in (*axes, ROTATION):
        if touched <= set(dofs_by_level(structure, axis)):
            return axis
    return None


def _same_device(one: Device, other: Device) -> bool:
    """Whether two devices are alike but for the number of them."""
    return one.law is other.law and one.length == other.length and one.current == other.current


def shear_stiffness(structure: Structure) -> NDArray:
    """Stiffness of each storey, N/m, by least squares if it is no pure shear building."""
    rows = structure.drift_rows
    if not len(rows):
        return np.zeros(0)
    patterns = np.array([np.outer(row, row).ravel() for row in rows]).T
    return np.linalg.lstsq(patterns, structure.stiffness.ravel(), rcond=None)[0]


def _founded(structure: Structure, soil: Sequence[Soil]) -> tuple[Structure, NDArray]:
    """Structure with a foundation's motions as its last dofs, and the structure's less those.

    Spring and dashpots between floors, and whatever ties the building to its foundation, see only
    what ``carried`` leaves: displacements less those with which the foundation carries it.
    """
    n, directions = structure.influence.shape
    added = len(soil) * directions
    carried = _carried(structure, soil)
    mass, damping, stiffness = (
        np.diag(
            np.concatenate([np.zeros(n), np.repeat([getattr(s, name) for s in soil], directions)])
        )
        for name in ("mass", "damping", "stiffness")
    )
    names = [
        f"{_motion(one)}_{axis}" if directions > 1 else _motion(one)
        for one in soil
        for axis in structure.directions
    ]
    shaken = [(0.0 if one.rocking else 1.0) * np.eye(directions) for one in soil]
    founded = replace(
        structure,
        mass=np.pad(structure.mass, (0, added)) + mass,
        damping=carried.T @ structure.damping @ carried + damping,
        stiffness=carried.T @ structure.stiffness @ carried + stiffness,
        influence=np.concatenate([structure.influence, *shaken]),
        names=(*structure.names, *names),
        foundation=tuple(range(n, n + added)),
        drift_rows=structure.drift_rows @ carried,
    )
    return founded, carried


def _motion(soil: Soil) -> str:
    return f"{FOUNDATION}_rocking" if soil.rocking else FOUNDATION


def _carried(structure: Structure, soil: Sequence[Soil]) -> NDArray:
    """Motion of the structure seen from its foundation, over its dofs and the foundation's."""
    levels = [_levels(structure)[:, np.newaxis] if one.rocking else 1.0 for one in soil]
    return np.hstack([
        np.eye(structure.n_dofs), *(-level * structure.influence for level in levels)
    ])  # fmt: skip


def _levels(structure: Structure) -> NDArray:
    """Height of base and floors above the foundation, (n,), m; the base one storey above it."""
    levels = np.zeros(structure.n_dofs)
    for axis in AXES[: len(structure.directions)]:
        dofs = dofs_by_level(structure, axis)
        heights = _storey_heights(structure, len(dofs) - 1)
        levels[list(dofs)] = heights[0] + np.append(0.0, np.cumsum(heights))
    return levels


def _storey_heights(structure: Structure, n_storeys: int) -> NDArray:
    """Storey heights from below, (n_storeys,), m; they repeat for each direction."""
    heights = structure.heights
    if heights is None or n_storeys == 0 or len(heights) % n_storeys:
        return np.full(max(n_storeys, 1), STOREY_HEIGHT)
    return heights[:: len(heights) // n_storeys]


def _for_lines(samples: NDArray) -> NDArray:
    """Samples between which lines have the spectrum of a band-limited signal."""
    n = 2 * len(samples)
    # lines attenuate by the squared sinc; above 0.8 of the Nyquist frequency there is little signal
    frequency = np.minimum(np.fft.rfftfreq(n), 0.4)
    return np.fft.irfft(np.fft.rfft(samples, n) / np.sinc(frequency) ** 2, n)[: len(samples)]


def _legendre(coefficients: NDArray, n: int) -> NDArray:
    return _legendre_rows(n, len(coefficients)) @ np.asarray(coefficients)


@lru_cache(maxsize=16)
def _legendre_rows(n: int, terms: int) -> NDArray:
    return np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, n), terms - 1)


def force_scales(model: BuildingModel) -> NDArray:
    """Force scale of each isolator, (n_isolators,)."""
    return np.array([model.nominal.elements[e].device.force_scale for e in model.isolators])


def total_force_scale(model: BuildingModel) -> float:
    """Force of all isolators over that of the device, along the first direction."""
    along = np.abs(model.nominal.holding[list(model.isolators), 0])
    return float(along @ force_scales(model))
