"""The engineer's building with candidate causes, and its prediction of a record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ground_motions import Record

from ...effects import Effect, extend
from ...errors import Diverged, InputError
from ...laws import Device
from ...registry import controller
from ...simulation.control import CoilDriver, Control, RunContext, Schedule
from ...simulation.run import simulate
from ...structures import IsolatedStructure, Structure
from .isolator_effects import ISOLATOR_EFFECTS, absent
from .record import DISPLACEMENT, BuildingRecord

GROUND = "ground_acceleration_m_s2"
FOUNDATION = "foundation"
STOREY_HEIGHT = 3.5
"""Storey height of a structure without heights, m."""
TOLERANCE = 1e-6


@dataclass(frozen=True)
class Soil:
    """Sway or rocking of a foundation on its soil."""

    stiffness: float  # N/m or N m
    damping: float  # N s/m or N m s
    mass: float  # kg or kg m^2: Of the foundation and of the soil that moves with it
    rocking: bool = False  # Whether it turns about its own level, instead of moving sideways


@dataclass(frozen=True, eq=False)
class BuildingModel:
    """A building on isolators, changed by causes."""

    nominal: IsolatedStructure  # As the engineer gave it; its first element is the isolation layer
    structure: Structure  # Linear part
    # Effects around the isolators' law, with parameters in the device's scale
    effects: Mapping[Effect, Mapping[str, float]] = field(default_factory=dict)
    soil: Soil | None = None  # None for a rigid soil
    delay: float = 0.0  # Delay of the recorded current at the isolators, s
    lag: float = 0.0  # Time constant with which they follow it, s
    slew: float = np.inf  # Slew rate of the supply, A/s
    supply_limit: float = np.inf  # Highest current that reaches them, A
    # Error of a channel as Legendre coefficients over the record's duration, in its unit
    biases: Mapping[str, NDArray] = field(default_factory=dict)

    @property
    def device(self) -> Device:
        """The isolation layer's device, with the effects around it."""
        device = self.nominal.elements[0].device
        if not self.effects:
            return device
        size = device.deformation_scale / device.length
        around = ISOLATOR_EFFECTS.values()
        return extend(device, [(e, self.effects.get(e) or absent(e, size)) for e in around])

    def assembled(self) -> IsolatedStructure:
        """Assemble structure, isolators and soil."""
        first, *others = self.nominal.elements
        elements = (replace(first, device=self.device), *others)
        if self.soil is None:
            return IsolatedStructure(self.structure, elements)
        founded, carried = _founded(self.structure, self.soil)
        # deformations are those of the building seen from its foundation
        return IsolatedStructure(
            founded, tuple(replace(e, direction=e.direction @ carried) for e in elements)
        )

    def predict(self, record: BuildingRecord, ground: Record | None = None) -> NDArray:
        """Simulate a record's channels, (n, n_channels); not a number if the model diverges."""
        # ``ground`` may take the place of the record's ground motion on the same samples, m/s^2.
        return self.simulated(record, ground) + self.bias(record)

    def simulated(
        self, record: BuildingRecord, ground: Record | None = None, end: int | None = None
    ) -> NDArray:
        """Simulate the building's motion, without the errors of its sensors; see ``predict``."""
        motion = record.ground if ground is None else ground
        if GROUND in self.biases:
            error = _legendre(self.biases[GROUND], len(motion))
            motion = replace(motion, acceleration=motion.acceleration - error)
        motion = replace(motion, acceleration=motion.acceleration[:end])
        isolated = self.assembled()
        driver = CoilDriver()
        if record.current is not None and (self.lag or np.isfinite(self.slew)):
            start = float(np.clip(record.current[0], *isolated.current_range()))
            driver = CoilDriver(lag=self.lag, slew=self.slew, initial=start)
        try:
            run = simulate(
                isolated,
                motion,
                self._control(record),
                driver=driver,
                tolerance=TOLERANCE,
                current_outside="clamp",
            )
        except Diverged:
            return np.full((len(motion), len(record.channels)), np.nan)
        columns = _columns(isolated, record.channels, run.outputs.names)
        return run.values[:, columns]

    def bias(self, record: BuildingRecord) -> NDArray:
        """Error of the sensors, (n, n_channels), in each channel's unit."""
        n = len(record.ground)
        error = np.zeros((n, len(record.channels)))
        for k, channel in enumerate(record.channels):
            if channel in self.biases:
                error[:, k] = _legendre(self.biases[channel], n)
        return error

    def _control(self, record: BuildingRecord) -> Control:
        if record.current is None:
            return controller("passive_off")
        return RecordedCurrent(
            record.ground.time, np.minimum(record.current, self.supply_limit), self.delay
        )


class RecordedCurrent:
    """The current of a record, linear between samples, with a delay."""

    # Held over half a sample's step about each sample and about each middle between two.

    name = "recorded"
    period: float | None = None
    preview_time = 0.0

    def __init__(self, time: NDArray, current: NDArray, delay: float) -> None:
        between = (current[1:] + current[:-1]) / 2
        values = np.append(np.column_stack([current[:-1], between]).ravel(), current[-1])
        quarter = (time[1] - time[0]) / 4
        starts = np.arange(values.size) * 2 * quarter - quarter + delay
        changes = np.append(False, np.diff(values) != 0)
        self._table = np.append(0.0, starts[changes]), np.append(values[0], values[changes])

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
        time, current = self._table
        within = time < context.duration
        channels = len(context.low)
        return Schedule(time[within], np.repeat(current[within, np.newaxis], channels, axis=1))


def building_model(isolated: IsolatedStructure, records: Sequence[BuildingRecord]) -> BuildingModel:
    """Check that a structure can represent the building of some records."""
    structure = isolated.structure
    if len(structure.directions) != 1 or len(structure.base) != 1:
        raise InputError(
            f"{structure.name} has {len(structure.directions)} directions and "
            f"{len(structure.base)} base dofs; expected for a building record: one of each"
        )
    base = np.eye(structure.n_dofs)[structure.base[0]]
    if not isolated.elements or not np.array_equal(isolated.elements[0].direction != 0, base != 0):
        raise InputError(
            f"{structure.name}: the first element must be the isolation layer, between ground "
            "and base"
        )
    lowest = isolated.current_range()[0] if isolated.n_channels else 0.0
    for record in records:
        if max(record.floors, default=0) > len(structure.superstructure):
            raise InputError(
                f"{record.name} has floor{max(record.floors)}; {structure.name} has "
                f"{len(structure.superstructure)} floors above its base"
            )
        if record.current is None and lowest > 0:
            raise InputError(
                f"{record.name} has no column current_A, and the isolators of {structure.name} "
                f"need a current of {lowest:g} A or more"
            )
    return BuildingModel(isolated, structure)


def shear_stiffness(structure: Structure) -> NDArray:
    """Stiffness of each storey, N/m, by least squares if it is no pure shear building."""
    rows = structure.drift_rows
    patterns = np.array([np.outer(row, row).ravel() for row in rows]).T
    return np.linalg.lstsq(patterns, structure.stiffness.ravel(), rcond=None)[0]


def _founded(structure: Structure, soil: Soil) -> tuple[Structure, NDArray]:
    """Structure with a foundation's motion as its last dof, and the structure's motion less that.

    Spring and dashpots between floors, and whatever ties the building to its foundation, see only
    what ``carried`` leaves: displacements less those with which the foundation carries it.
    """
    n = structure.n_dofs
    arm = _levels(structure) if soil.rocking else structure.influence[:, 0]
    carried = np.column_stack([np.eye(n), -arm])
    corner = np.zeros((n + 1, n + 1))
    corner[-1, -1] = 1.0
    shaken = 0.0 if soil.rocking else 1.0
    founded = replace(
        structure,
        mass=np.pad(structure.mass, ((0, 1), (0, 1))) + soil.mass * corner,
        damping=carried.T @ structure.damping @ carried + soil.damping * corner,
        stiffness=carried.T @ structure.stiffness @ carried + soil.stiffness * corner,
        influence=np.append(structure.influence, [[shaken]], axis=0),
        names=(*structure.names, FOUNDATION),
        drift_rows=structure.drift_rows @ carried,
    )
    return founded, carried


def _levels(structure: Structure) -> NDArray:
    """Height of base and floors above the foundation, (n,), m; the base one storey above it."""
    heights = structure.heights
    storeys = np.full(len(structure.superstructure), STOREY_HEIGHT) if heights is None else heights
    levels = np.zeros(structure.n_dofs)
    levels[structure.base[0]] = storeys[0]
    levels[list(structure.superstructure)] = storeys[0] + np.cumsum(storeys)
    return levels


def _columns(
    isolated: IsolatedStructure, channels: tuple[str, ...], names: tuple[str, ...]
) -> list[int]:
    structure = isolated.structure
    base = structure.base[0]
    above = [i for i in structure.superstructure if structure.names[i] != FOUNDATION]
    target = []
    for channel in channels:
        where = channel.split("_")[0]
        if channel == DISPLACEMENT:
            target.append(f"{isolated.elements[0].name}_deformation_m")
        elif where == "base":
            target.append(f"{structure.names[base]}_acceleration_m_s2")
        else:
            floor = int(where.removeprefix("floor"))
            target.append(f"{structure.names[above[floor - 1]]}_acceleration_m_s2")
    return [names.index(name) for name in target]


def _legendre(coefficients: NDArray, n: int) -> NDArray:
    return _legendre_rows(n, len(coefficients)) @ np.asarray(coefficients)


@lru_cache(maxsize=16)
def _legendre_rows(n: int, terms: int) -> NDArray:
    return np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, n), terms - 1)
