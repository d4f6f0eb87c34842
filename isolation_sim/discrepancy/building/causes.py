"""Causes that the model of an isolated building may lack: each adds a few numbers to it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...effects import Effect
from ...effects.effect import in_sentence
from ...structures import Structure
from .channels import GROUND, ROTATION, channel
from .isolator_effects import ISOLATOR_EFFECTS
from .model import BuildingModel, Soil, dofs_by_level, motion_of, shear_stiffness
from .record import BuildingRecord

Values = tuple[float, ...]
TYPICAL_PERIOD = 2.0
"""s: of isolated buildings, for the orders of magnitude that fits start from."""


@dataclass(frozen=True)
class Parameter:
    """A number of a cause."""

    # name, unit: As reported, SI
    name: str
    unit: str
    # lower, upper: Bounds, in ``unit``
    lower: float = -np.inf
    upper: float = np.inf
    # Whether only its order of magnitude is known beforehand; its logarithm is fitted
    logarithmic: bool = False
    # Reported number over the fitted one; for what is fitted in a device's own scale
    factor: float = 1.0


@dataclass(frozen=True, eq=False)
class Candidate:
    """A cause that may be put into a building's model."""

    name: str  # In the catalogue
    place: str  # Which storey or channel; empty where there is only one
    parameters: tuple[Parameter, ...]  # Fitted numbers
    starts: tuple[Values, ...]  # Values from which fits start
    # ``apply(model, values)`` -> BuildingModel with the cause
    apply: Callable[[BuildingModel, Values], BuildingModel]
    says: str  # Description for the report; names of its values in braces
    form: str = ""  # Variant of the cause
    # Fixed numbers to report beside the fitted ones: the storey's
    numbers: tuple[tuple[str, float], ...] = ()

    @property
    def of_sensor(self) -> bool:
        """Whether it changes a sensor's signal and not the motion of the building."""
        return self.name == "sensor_bias" and not self.place.startswith(GROUND)

    @property
    def key(self) -> tuple[str, str]:
        """Key of a cause: a model contains it once at each place."""
        return self.name, self.place

    @property
    def label(self) -> str:
        """Name and place, to print."""
        return f"{self.name} ({self.place})" if self.place else self.name


def candidates(model: BuildingModel, records: Sequence[BuildingRecord]) -> tuple[Candidate, ...]:
    """All candidate causes for the records of a building."""
    result = [*_storeys(model, records), *_base_mass(model, records), _damping(model)]
    result += [_soil(model, False), _soil(model, True)]
    if all(law.directions < 3 for law in model.nominal.group_laws):
        # no effect has a form under a vertical load that changes
        result += _isolators(model, records)
    if model.device.depends_on_current and all(r.current is not None for r in records):
        result += [*_actuation(), *_limit(records)]
    result += _biases(records)
    return tuple(result)


def _storeys(model: BuildingModel, records: Sequence[BuildingRecord]) -> Iterator[Candidate]:
    """A storey's columns, walls or braces are softer than assumed, in one direction or in all."""
    nominal, axes = model.nominal.structure, records[0].axes
    rows, stiffness = nominal.drift_rows, shear_stiffness(nominal)
    motions = [motion_of(nominal, row, axes) for row in rows]
    turns = any(sensor.axis == ROTATION for sensor in records[0].sensors)
    arms = _squared_arms(nominal)
    for number, storey in enumerate(_by_storey(motions), start=1):
        along = {axis: storey[axis] for axis in axes if axis in storey}
        twist = storey.get(ROTATION)
        # frames along either direction resist the rotation
        resisting = {
            axis: stiffness[k] * arms[axis] for axis, k in along.items() if twist is not None
        }
        patterns = []
        for axis, k in along.items():
            pattern = stiffness[k] * np.outer(rows[k], rows[k])
            if twist is not None:
                share = resisting[axis] / sum(resisting.values())
                pattern += share * stiffness[twist] * np.outer(rows[twist], rows[twist])
            patterns.append(pattern)
            yield _softer(nominal.storeys[k], number, pattern)
            if turns and twist is not None:
                reach = float(np.sqrt(stiffness[twist] / stiffness[k]))
                turned = rows[twist] * (-1.0 if axis == "x" else 1.0)
                frame = _Frame(axis, stiffness[k], rows[k], turned, reach)
                yield _softer_frame(nominal.storeys[k], number, frame)
        if len(along) > 1:
            yield _softer(f"storey{number}", number, np.sum(patterns, axis=0))


def _squared_arms(structure: Structure) -> dict[str, float]:
    """Relative squared distance between the frames along x and y, as far as the isolators are."""
    if structure.isolator_positions is None:
        return {"x": 1.0, "y": 1.0}
    width, depth = np.ptp(structure.isolator_positions, axis=0)
    return {"x": float(depth**2), "y": float(width**2)} if width * depth else {"x": 1.0, "y": 1.0}


def _by_storey(motions: Sequence[str | None]) -> list[dict[str, int]]:
    """Drift rows of each storey from below, by the direction in which they lie."""
    storeys: list[dict[str, int]] = []
    for k, motion in enumerate(motions):
        if motion is None:
            continue
        number = motions[:k].count(motion)
        if number == len(storeys):
            storeys.append({})
        storeys[number][motion] = k
    return storeys


class _Frame(NamedTuple):
    """A storey's frames along a direction."""

    axis: str  # x or y
    stiffness: float  # N/m
    row: NDArray  # (n,): Their drift at the plan's centre
    turned: NDArray  # (n,): What is added to it per metre across
    reach: float  # Largest distance across, m


def _softer(place: str, number: int, pattern: NDArray) -> Candidate:
    """A storey has lost a share of its stiffness ``pattern`` (n, n)."""

    def apply(model: BuildingModel, values: Values) -> BuildingModel:
        softer = model.structure.stiffness - values[0] * pattern
        return replace(model, structure=replace(model.structure, stiffness=softer))

    return Candidate(
        "storey_stiffness_loss", place, (Parameter("loss", "1", 0.0, 0.95),), ((0.1,),), apply,
        f"{place} has lost {{loss:.1%}} of its stiffness", numbers=(("storey", number),),
    )  # fmt: skip


def _softer_frame(place: str, number: int, frame: _Frame) -> Candidate:
    """A frame beside the plan's centre has lost stiffness, so that the storey turns."""
    across = "y" if frame.axis == "x" else "x"

    def apply(model: BuildingModel, values: Values) -> BuildingModel:
        loss, position = values
        drift = frame.row + position * frame.turned
        softer = model.structure.stiffness - loss * frame.stiffness * np.outer(drift, drift)
        return replace(model, structure=replace(model.structure, stiffness=softer))

    return Candidate(
        "storey_stiffness_loss", place,
        (Parameter("loss", "1", 0.0, 0.95), Parameter("position", "m", -frame.reach, frame.reach)),
        ((0.1, 0.0),), apply,
        f"{place} has lost {{loss:.1%}} of its stiffness, at {across} = {{position:.3g}} m",
        form="one_side", numbers=(("storey", number),),
    )  # fmt: skip


def _base_mass(model: BuildingModel, records: Sequence[BuildingRecord]) -> Iterator[Candidate]:
    """The mass of the base differs from the assumed one."""
    structure = model.structure
    block = np.ix_(structure.base, structure.base)
    mass = structure.mass[block]

    def change(model: BuildingModel, added: NDArray) -> BuildingModel:
        changed = model.structure.mass.copy()
        changed[block] += added
        return replace(model, structure=replace(model.structure, mass=changed))

    relative = Parameter("relative_error", "1", -0.9, 5.0)
    yield Candidate(
        "base_mass_error", "", (relative,), ((0.05,),),
        lambda model, values: change(model, values[0] * mass),
        "the base's mass is {relative_error:+.1%} off",
    )  # fmt: skip
    turns = any(sensor.axis == ROTATION for sensor in records[0].sensors)
    if not turns:
        return
    dofs = [dofs_by_level(structure, axis) for axis in (*records[0].axes, ROTATION)]
    places = tuple(structure.base.index(one[0]) for one in dofs)
    rigid = mass[np.ix_(places, places)]
    total = rigid[0, 0]
    centre = np.array([rigid[1, 2], -rigid[0, 2]]) / total
    inertia = rigid[2, 2] - total * centre @ centre
    size = float(np.sqrt(inertia / total))

    def eccentric(model: BuildingModel, values: Values) -> BuildingModel:
        more, x, y, turning = values
        added = np.zeros_like(mass)
        other = _rigid((1 + more) * total, (1 + turning) * inertia, centre + np.array([x, y]))
        added[np.ix_(places, places)] = other - rigid
        return change(model, added)

    yield Candidate(
        "base_mass_error", "",
        (relative, Parameter("shift_x", "m", -2 * size, 2 * size),
         Parameter("shift_y", "m", -2 * size, 2 * size),
         Parameter("inertia_error", "1", -0.9, 5.0)),
        ((0.05, 0.05 * size, 0.05 * size, 0.05),), eccentric,
        "the base's mass is {relative_error:+.1%} off, its inertia in rotation {inertia_error:+.1%}"
        ", its centre {shift_x:+.3g} m along x and {shift_y:+.3g} m along y from the assumed one",
        form="eccentric",
    )  # fmt: skip


def _rigid(mass: float, inertia: float, centre: NDArray) -> NDArray:
    """Mass matrix of a slab about the origin, (3, 3); its inertia is that about its centre."""
    x, y = centre
    about = inertia + mass * (x**2 + y**2)
    return np.array([[mass, 0, -mass * y], [0, mass, mass * x], [-mass * y, mass * x, about]])


def _damping(model: BuildingModel) -> Candidate:
    """Something else damps the isolation layer: cables, pipes, sliders, air."""
    rows = model.nominal.element_rows[list(model.isolators)]
    # as the isolators are distributed, and in total one in every direction
    shares = _shares(model)
    pattern = sum(share * np.outer(row, row) for share, row in zip(shares, rows, strict=True))
    critical = 2 * model.structure.total_mass * 2 * np.pi / TYPICAL_PERIOD

    def apply(model: BuildingModel, values: Values) -> BuildingModel:
        damping = model.structure.damping + values[0] * pattern
        return replace(model, structure=replace(model.structure, damping=damping))

    return Candidate(
        "extra_isolator_damping", "", (Parameter("coefficient", "N s/m", 0.0),),
        ((0.03 * critical,),), apply,
        "the isolation layer has {coefficient:.3g} N s/m of damping more",
    )  # fmt: skip


def _force_scales(model: BuildingModel) -> NDArray:
    """Force scale of each isolator, (n_isolators,)."""
    return np.array([model.nominal.elements[e].device.force_scale for e in model.isolators])


def total_force_scale(model: BuildingModel) -> float:
    """Force of all isolators over that of the device, along the first direction."""
    along = np.abs(model.nominal.holding[list(model.isolators), 0])
    return float(along @ _force_scales(model))


def _shares(model: BuildingModel) -> NDArray:
    """Share of each isolator in the force along its direction, (n_isolators,)."""
    return _force_scales(model) / total_force_scale(model)


_SOIL_STIFFNESS = tuple(5 * 10 ** (k / 2) for k in range(9))
"""Stiffness of the soil over that of an isolation layer from which fits start: from soft to nearly
rigid, so close that the next minimum of the misfit is the deepest."""


def _soil(model: BuildingModel, rocking: bool) -> Candidate:
    """The foundation sways or rocks on soft soil; with it moves about the base's weight of soil."""
    structure = model.structure
    slab = float(structure.mass[structure.base[0], structure.base[0]])
    total = structure.total_mass
    layer = total * (2 * np.pi / TYPICAL_PERIOD) ** 2
    arm = 10.0 if rocking else 1.0

    def apply(model: BuildingModel, values: Values) -> BuildingModel:
        stiffness, damping, mass = values
        return replace(model, soil=Soil(stiffness, damping, mass, rocking))

    starts = tuple(
        (k * arm**2, 2 * share * np.sqrt(k * total) * arm**2, slab * arm**2 / (3 if rocking else 1))
        for k, share in ((factor * layer, 0.1) for factor in _SOIL_STIFFNESS)
    )
    names = ("stiffness", "damping", "inertia" if rocking else "mass")
    units = ("N m", "N m s", "kg m^2") if rocking else ("N/m", "N s/m", "kg")
    return Candidate(
        "soil_flexibility", "",
        tuple(
            Parameter(name, unit, 1e-4 * start, 1e6 * start, logarithmic=True)
            for name, unit, start in zip(names, units, starts[0], strict=True)
        ),
        starts, apply,
        f"the foundation {'rocks' if rocking else 'sways'} on soil of {{stiffness:.3g}} {units[0]}",
        form="rocking" if rocking else "sway",
    )  # fmt: skip


def _isolators(model: BuildingModel, records: Sequence[BuildingRecord]) -> Iterator[Candidate]:
    """Causes that the isolators' law may lack."""
    device = model.nominal.elements[0].device
    deformation = max(float(np.abs(r.displacement(axis)).max()) for r in records for axis in r.axes)
    accelerations = [
        np.sqrt(np.mean(r.mean_acceleration(r.values, axis) ** 2))
        for r in records
        for axis in r.axes
    ]
    force = model.structure.total_mass * float(max(accelerations))
    # fitted in the device's own scale, reported in the building's, of all isolators together
    metre, newton = device.length, total_force_scale(model)
    length, strength = deformation / metre, force / newton
    speed = length * 2 * np.pi / TYPICAL_PERIOD
    sizes = {
        "m": length, "m/s": speed, "N": strength, "N/m": strength / length, "1/m": 1 / length
    }  # fmt: skip
    factors = {"m": metre, "m/s": metre, "N": newton, "N/m": newton / metre, "1/m": 1 / metre}
    for name, effect in ISOLATOR_EFFECTS.items():
        yield _around_the_law(name, effect, sizes, factors)


def _around_the_law(
    name: str, effect: Effect, sizes: dict[str, float], factors: dict[str, float]
) -> Candidate:
    def apply(model: BuildingModel, values: Values) -> BuildingModel:
        numbers = dict(zip(effect.parameter_names, values, strict=True))
        return replace(model, effects={**model.effects, effect: numbers})

    parameters, columns = [], []
    for q in effect.parameters:
        parameters.append(
            Parameter(q.name, q.unit, q.lower, q.upper, factor=factors.get(q.unit, 1.0))
        )
        columns.append([start * sizes.get(q.unit, 1.0) for start in q.starts])
    most = max(len(column) for column in columns)
    starts = tuple(
        tuple(column[min(k, len(column) - 1)] for column in columns) for k in range(most)
    )
    says = ", ".join(f"{q.name} {{{q.name}:.3g}} {q.unit}" for q in parameters)
    return Candidate(
        name, "", tuple(parameters), starts, apply,
        f"{in_sentence(effect.title)} in the isolation layer ({says})", form=effect.form,
    )  # fmt: skip


def _actuation() -> Iterator[Candidate]:
    """The recorded command reaches the isolators late: after a dead time, or through a lag."""

    def late(model: BuildingModel, values: Values) -> BuildingModel:
        return replace(model, delay=values[0])

    def sluggish(model: BuildingModel, values: Values) -> BuildingModel:
        return replace(model, lag=values[0])

    yield Candidate(
        "actuation_delay", "", (Parameter("delay", "s", 0.0, 2.0),),
        ((0.005,), (0.05,), (0.2,)), late,
        "the current acts {delay:.3g} s after it was recorded", form="dead_time",
    )  # fmt: skip
    yield Candidate(
        "actuation_delay", "", (Parameter("lag", "s", 1e-4, 2.0),),
        ((0.005,), (0.05,), (0.2,)), sluggish,
        "the current acts through a lag of {lag:.3g} s", form="first_order",
    )  # fmt: skip


def _limit(records: Sequence[BuildingRecord]) -> Iterator[Candidate]:
    """The supply does not give the highest currents that were recorded as commands."""
    highest = max(float(r.current.max()) for r in records if r.current is not None)
    if highest <= 0:
        return

    def clipped(model: BuildingModel, values: Values) -> BuildingModel:
        return replace(model, supply_limit=values[0])

    def slow(model: BuildingModel, values: Values) -> BuildingModel:
        return replace(model, slew=values[0])

    yield Candidate(
        "current_supply_limit", "", (Parameter("limit", "A", 0.0, highest),),
        ((0.97 * highest,), (0.8 * highest,), (0.5 * highest,)), clipped,
        "the current stops at {limit:.3g} A", form="largest_current",
    )  # fmt: skip
    fastest = max(
        float(np.abs(np.diff(r.current)).max() / r.dt)
        for r in records if r.current is not None
    )  # fmt: skip
    yield Candidate(
        "current_supply_limit", "",
        (Parameter("slew", "A/s", 1e-3 * fastest, fastest, logarithmic=True),),
        ((0.7 * fastest,), (0.2 * fastest,), (0.05 * fastest,)), slow,
        "the current changes by {slew:.3g} A/s at most", form="slew",
    )  # fmt: skip


def _biases(records: Sequence[BuildingRecord]) -> Iterator[Candidate]:
    """A sensor has a constant or slowly varying error."""
    for name in (*records[0].ground_channels, *records[0].channels):
        sensor = channel(name)
        assert sensor is not None
        size = 1e-3 if sensor.is_displacement else 1e-2

        def apply(model: BuildingModel, values: Values, name=name) -> BuildingModel:
            return replace(model, biases={**model.biases, name: np.array(values)})

        for form, names in _BIASES.items():
            yield Candidate(
                "sensor_bias", name, tuple(Parameter(n, sensor.unit) for n in names),
                ((size, *(0.0,) * (len(names) - 1)),), apply,
                f"{name} is off by {{mean:.3g}} {sensor.unit}"
                + (" on average, drifting" if form == "drifting" else ""),
                form=form,
            )  # fmt: skip


_BIASES = {"constant": ("mean",), "drifting": ("mean", "slope", "curvature", "cubic")}
"""Parameters of each form of a bias: coefficients of Legendre polynomials over the record."""
