"""Causes that the model of an isolated building may lack: each adds a few numbers to it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...effects import Effect
from ...effects.effect import in_sentence
from .isolator_effects import ISOLATOR_EFFECTS
from .model import GROUND, BuildingModel, Soil, shear_stiffness
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
        return self.name == "sensor_bias" and self.place != GROUND

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
    result = [*_storeys(model), _base_mass(model), _damping(model)]
    result += [_soil(model, False), _soil(model, True)]
    result += _isolators(model, records)
    if model.device.depends_on_current and all(r.current is not None for r in records):
        result += [*_actuation(), *_limit(records)]
    result += _biases(records)
    return tuple(result)


def _storeys(model: BuildingModel) -> Iterator[Candidate]:
    """A storey's columns, walls or braces are softer than assumed."""
    nominal = model.nominal.structure
    stiffness = shear_stiffness(nominal)
    for number, name in enumerate(nominal.storeys, start=1):
        row = nominal.drift_rows[number - 1]
        pattern = stiffness[number - 1] * np.outer(row, row)

        def apply(model: BuildingModel, values: Values, lost=pattern) -> BuildingModel:
            softer = model.structure.stiffness - values[0] * lost
            return replace(model, structure=replace(model.structure, stiffness=softer))

        yield Candidate(
            "storey_stiffness_loss", name, (Parameter("loss", "1", 0.0, 0.95),), ((0.1,),), apply,
            f"{name} has lost {{loss:.1%}} of its stiffness", numbers=(("storey", number),),
        )  # fmt: skip


def _base_mass(model: BuildingModel) -> Candidate:
    """The mass of the base differs from the assumed one."""
    base = model.structure.base[0]
    mass = float(model.structure.mass[base, base])

    def apply(model: BuildingModel, values: Values) -> BuildingModel:
        changed = model.structure.mass.copy()
        changed[base, base] += values[0] * mass
        return replace(model, structure=replace(model.structure, mass=changed))

    return Candidate(
        "base_mass_error", "", (Parameter("relative_error", "1", -0.9, 5.0),), ((0.05,),), apply,
        "the base's mass is {relative_error:+.1%} off",
    )  # fmt: skip


def _damping(model: BuildingModel) -> Candidate:
    """Something else damps the isolation layer: cables, pipes, sliders, air."""
    row = model.nominal.elements[0].direction
    critical = 2 * model.structure.total_mass * 2 * np.pi / TYPICAL_PERIOD

    def apply(model: BuildingModel, values: Values) -> BuildingModel:
        damping = model.structure.damping + values[0] * np.outer(row, row)
        return replace(model, structure=replace(model.structure, damping=damping))

    return Candidate(
        "extra_isolator_damping", "", (Parameter("coefficient", "N s/m", 0.0),),
        ((0.03 * critical,),), apply,
        "the isolation layer has {coefficient:.3g} N s/m of damping more",
    )  # fmt: skip


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
        for k, share in ((5.0 * layer, 0.1), (50.0 * layer, 0.1), (500.0 * layer, 0.1))
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
    deformation = max(float(np.abs(r.values[:, -1]).max()) for r in records)
    accelerations = [np.sqrt(np.mean(r.values[:, :-1].mean(axis=1) ** 2)) for r in records]
    force = model.structure.total_mass * float(max(accelerations))
    # fitted in the device's own scale, reported in the building's
    metre, newton = device.length, device.force_scale
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
        float(np.abs(np.diff(r.current)).max() / r.ground.dt)
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
    for channel in (GROUND, *records[0].channels):
        unit = channel.rpartition("displacement_")[2] if "displacement" in channel else "m/s2"
        size = 1e-3 if unit == "m" else 1e-2

        def apply(model: BuildingModel, values: Values, channel=channel) -> BuildingModel:
            return replace(model, biases={**model.biases, channel: np.array(values)})

        for form, names in _BIASES.items():
            yield Candidate(
                "sensor_bias", channel, tuple(Parameter(n, unit) for n in names),
                ((size, *(0.0,) * (len(names) - 1)),), apply,
                f"{channel} is off by {{mean:.3g}} {unit}"
                + (" on average, drifting" if form == "drifting" else ""),
                form=form,
            )  # fmt: skip


_BIASES = {"constant": ("mean",), "drifting": ("mean", "slope", "curvature", "cubic")}
"""Parameters of each form of a bias: coefficients of Legendre polynomials over the record."""
