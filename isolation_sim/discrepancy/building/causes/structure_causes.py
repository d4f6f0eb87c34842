"""Causes in the structure and its soil: stiffness, mass and damping that differ from the model."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....structures import Structure
from ....structures.yielding import storey_hysteresis
from ..channels import ROTATION
from ..model import BuildingModel, Soil, dofs_by_level, motion_of, shear_stiffness
from ..record import BuildingRecord
from .candidate import EITHER_SIGN, TYPICAL_PERIOD, Candidate, Parameter, Values, add_to


def structure_causes(
    model: BuildingModel, records: Sequence[BuildingRecord]
) -> Iterator[Candidate]:
    """Causes in storeys, masses, damping and soil."""
    yield from _storeys(model, records)
    yield _stiffness()
    yield from _base_mass(model, records)
    yield from _floor_masses(model, records)
    yield from _damping(model)
    sway, rocking = _soil(model, False), _soil(model, True)
    yield sway
    yield rocking
    yield _both_motions(sway, rocking)


def _storeys(model: BuildingModel, records: Sequence[BuildingRecord]) -> Iterator[Candidate]:
    """A storey is softer, stiffer or more damped than assumed, in one direction or in all."""
    nominal, axes = model.nominal.structure, records[0].axes
    rows, stiffness = nominal.drift_rows, shear_stiffness(nominal)
    motions = [motion_of(nominal, row, axes) for row in rows]
    turns = any(sensor.axis == ROTATION for sensor in records[0].sensors)
    arms = _squared_arms(nominal)
    peaks = {axis: _peak_force(model, records, axis) for axis in axes}
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
            yield _stiffer(nominal.storeys[k], number, pattern)
            critical = 2 * float(np.sqrt(stiffness[k] * nominal.total_mass))
            yield _damped(nominal.storeys[k], number, rows[k], critical)
            yield _yielding(nominal.storeys[k], number, k, stiffness[k], peaks[axis])
            if turns and twist is not None:
                reach = float(np.sqrt(stiffness[twist] / stiffness[k]))
                turned = rows[twist] * (-1.0 if axis == "x" else 1.0)
                frame = _Frame(axis, stiffness[k], rows[k], turned, reach)
                yield _softer_frame(nominal.storeys[k], number, frame)
        if len(along) > 1:
            yield _softer(f"storey{number}", number, np.sum(patterns, axis=0))
            yield _stiffer(f"storey{number}", number, np.sum(patterns, axis=0))


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
    return Candidate(
        "storey_stiffness_loss", place, (Parameter("loss", "1", 0.0, 0.95),), ((0.1,),),
        add_to("stiffness", -pattern), f"{place} has lost {{loss:.1%}} of its stiffness",
        numbers=(("storey", number),),
    )  # fmt: skip


def _stiffer(place: str, number: int, pattern: NDArray) -> Candidate:
    """A storey is stiffer: infill, cladding or partitions."""
    return Candidate(
        "storey_stiffness_gain", place, (Parameter("gain", "1", 0.0, 5.0),), ((0.1,),),
        add_to("stiffness", pattern), f"{place} is {{gain:.1%}} stiffer than assumed",
        numbers=(("storey", number),),
    )  # fmt: skip


def _damped(place: str, number: int, row: NDArray, critical: float) -> Candidate:
    """A damper stands in a storey, or it dissipates more than assumed."""
    return Candidate(
        "extra_storey_damping", place, (Parameter("coefficient", "N s/m", 0.0),),
        ((0.02 * critical,), (0.2 * critical,)), add_to("damping", np.outer(row, row)),
        f"{place} has {{coefficient:.3g}} N s/m of damping more", numbers=(("storey", number),),
    )  # fmt: skip


def _peak_force(model: BuildingModel, records: Sequence[BuildingRecord], axis: str) -> float:
    """Largest force of the whole building on its isolators along a direction, N."""
    peaks = [float(np.abs(r.mean_acceleration(r.values, axis)).max()) for r in records]
    return model.nominal.structure.total_mass * max(peaks)


def _yielding(place: str, number: int, row: int, stiffness: float, peak: float) -> Candidate:
    """A storey yields."""

    def apply(model: BuildingModel, values: Values) -> BuildingModel:
        yield_shear, hardening, smoothness = values
        soft = (1 - hardening) * stiffness
        drift = model.structure.drift_rows[row]
        elastic = model.structure.stiffness - soft * np.outer(drift, drift)
        device = storey_hysteresis(soft, yield_shear / stiffness, smoothness)
        hysteresis = {**model.hysteresis, row: device}
        return replace(model.changed(stiffness=elastic), hysteresis=hysteresis)

    return Candidate(
        "storey_yielding", place,
        (Parameter("yield_shear", "N", 0.1 * peak, 10 * peak, logarithmic=True),
         Parameter("hardening_ratio", "1", 0.0, 0.95, plain=(0.0,)),
         Parameter("smoothness", "1", *_SMOOTHNESSES, logarithmic=True, plain=_SMOOTHNESSES)),
        tuple((share * peak, 0.1, _SMOOTHNESS) for share in (0.7, 0.4, 0.2)), apply,
        f"{place} yields at {{yield_shear:.3g}} N, with {{hardening_ratio:.2f}} of its stiffness "
        "beyond", numbers=(("storey", number),), late=True,
    )  # fmt: skip


def _stiffness() -> Candidate:
    """All storeys are softer or stiffer than assumed."""

    def apply(model: BuildingModel, values: Values) -> BuildingModel:
        stiffness = (1 + values[0]) * model.structure.stiffness
        return model.changed(stiffness=stiffness)

    return Candidate(
        "structure_stiffness_error", "", (Parameter("relative_error", "1", -0.9, 5.0),),
        EITHER_SIGN, apply,
        "the stiffness of the whole structure differs by {relative_error:+.1%} from the model's",
    )  # fmt: skip


def _damping(model: BuildingModel) -> Iterator[Candidate]:
    """The damping of the structure differs from the assumed one."""
    if not np.any(model.structure.damping):
        return

    def apply(model: BuildingModel, values: Values) -> BuildingModel:
        damping = (1 + values[0]) * model.structure.damping
        return model.changed(damping=damping)

    error = Parameter("relative_error", "1", -0.95, 20.0)
    yield Candidate(
        "structural_damping_error", "", (error,),
        ((0.1,),), apply,
        "the damping of the structure differs by {relative_error:+.1%} from the model's",
    )  # fmt: skip

    def proportional(model: BuildingModel, values: Values) -> BuildingModel:
        changed = apply(model, values)
        structure = changed.structure
        return changed.changed(damping=structure.damping + values[1] * structure.stiffness)

    yield Candidate(
        "structural_damping_error", "", (error, Parameter("per_stiffness", "s", 0.0, 1.0)),
        ((0.0, 1e-3),), proportional,
        "the damping of the structure differs by {relative_error:+.1%} and {per_stiffness:.3g} s "
        "times its stiffness from the model's", form="stiffness_proportional",
    )  # fmt: skip


def _floor_masses(model: BuildingModel, records: Sequence[BuildingRecord]) -> Iterator[Candidate]:
    """The mass of a floor, or of all floors, differs from the assumed one."""
    structure = model.structure
    levels = [dofs_by_level(structure, axis) for axis in (*records[0].axes, ROTATION)]
    # not every level need turn
    along = [dofs for dofs in levels if len(dofs) == len(levels[0])]
    floors = [list(floor) for floor in zip(*along, strict=True)][1:]
    if len(floors) > 1:
        yield _floor_mass("all floors", [dof for floor in floors for dof in floor])
    for number, dofs in enumerate(floors, start=1):
        yield _floor_mass(f"floor{number}", dofs, (("floor", number),))


def _floor_mass(
    place: str, dofs: list[int], numbers: tuple[tuple[str, float], ...] = ()
) -> Candidate:
    block = np.ix_(dofs, dofs)

    def apply(model: BuildingModel, values: Values) -> BuildingModel:
        mass = model.structure.mass.copy()
        mass[block] *= 1 + values[0]
        return model.changed(mass=mass)

    return Candidate(
        "floor_mass_error", place, (Parameter("relative_error", "1", -0.9, 5.0),), EITHER_SIGN,
        apply, f"the mass of {place} differs by {{relative_error:+.1%}} from the model's",
        numbers=numbers,
    )  # fmt: skip


def _softer_frame(place: str, number: int, frame: _Frame) -> Candidate:
    """A frame beside the plan's centre has lost stiffness, so that the storey turns."""
    across = "y" if frame.axis == "x" else "x"

    def apply(model: BuildingModel, values: Values) -> BuildingModel:
        loss, position = values
        drift = frame.row + position * frame.turned
        softer = model.structure.stiffness - loss * frame.stiffness * np.outer(drift, drift)
        return model.changed(stiffness=softer)

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
        return model.changed(mass=changed)

    relative = Parameter("relative_error", "1", -0.9, 5.0)
    yield Candidate(
        "base_mass_error", "", (relative,), EITHER_SIGN,
        lambda model, values: change(model, values[0] * mass),
        "the base's mass differs by {relative_error:+.1%} from the model's",
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
        "the base's mass differs by {relative_error:+.1%} from the model's, its inertia in "
        "rotation by {inertia_error:+.1%}, its centre {shift_x:+.3g} m along x and {shift_y:+.3g} "
        "m along y from the assumed one",
        form="eccentric",
    )  # fmt: skip


def _rigid(mass: float, inertia: float, centre: NDArray) -> NDArray:
    """Mass matrix of a slab about the origin, (3, 3); its inertia is that about its centre."""
    x, y = centre
    about = inertia + mass * (x**2 + y**2)
    return np.array([[mass, 0, -mass * y], [0, mass, mass * x], [-mass * y, mass * x, about]])


_SOIL_STIFFNESS = tuple(5 * 10 ** (k / 2) for k in range(9))
"""Stiffness of the soil over that of an isolation layer from which fits start: from soft to nearly
rigid, so close that the next minimum of the misfit is the deepest."""

_SMOOTHNESS, _SMOOTHNESSES = 3.0, (1.0, 9.0)
"""Exponent of a yielding storey's Bouc-Wen law from which fits start, and its range: of masonry
and concrete to steel, whose corner is sharp."""
_FOUNDATION = 0.02, 50.0
"""Least and largest mass of a foundation with its soil over that of the base."""


def _soil(model: BuildingModel, rocking: bool) -> Candidate:
    """The foundation sways or rocks on soft soil; with it moves about the base's weight of soil."""
    structure = model.structure
    slab = float(structure.mass[structure.base[0], structure.base[0]])
    total = structure.total_mass
    layer = total * (2 * np.pi / TYPICAL_PERIOD) ** 2
    arm = 10.0 if rocking else 1.0

    def apply(model: BuildingModel, values: Values) -> BuildingModel:
        stiffness, damping, mass = values
        return replace(model, soil=(Soil(stiffness, damping, mass, rocking),))

    starts = tuple(
        (k * arm**2, 2 * share * np.sqrt(k * total) * arm**2, slab * arm**2 / (3 if rocking else 1))
        for k, share in ((factor * layer, 0.1) for factor in _SOIL_STIFFNESS)
    )
    names = (
        ("rocking_stiffness", "rocking_damping", "inertia")
        if rocking
        else ("stiffness", "damping", "mass")
    )
    units = ("N m", "N m s", "kg m^2") if rocking else ("N/m", "N s/m", "kg")
    return Candidate(
        "soil_flexibility", "",
        tuple(
            Parameter(name, unit, least * start, most * start, logarithmic=True)
            for name, unit, start, (least, most) in zip(
                names, units, starts[0], ((1e-4, 1e6), (1e-4, 1e6), _FOUNDATION), strict=True
            )
        ),
        starts, apply,
        f"the foundation {'rocks' if rocking else 'sways'} on soil of "
        f"{{{names[0]}:.3g}} {units[0]}",
        form="rocking" if rocking else "sway",
    )  # fmt: skip


def _both_motions(sway: Candidate, rocking: Candidate) -> Candidate:
    """The foundation sways and rocks; of many numbers, and so tried where one of both is found."""
    n = len(sway.parameters)

    def apply(model: BuildingModel, values: Values) -> BuildingModel:
        motions = sway.apply(model, values[:n]), rocking.apply(model, values[n:])
        return replace(model, soil=tuple(one for moved in motions for one in moved.soil))

    starts = tuple((*one, *other) for one, other in zip(sway.starts, rocking.starts, strict=True))
    return Candidate(
        sway.name, "", (*sway.parameters, *rocking.parameters),
        # the stiffest first: what one motion alone was found to be is carried over to it
        starts[::-2], apply, f"{sway.says}, and rocks on one of {{rocking_stiffness:.3g}} N m",
        form="sway_and_rocking", instead=True,
    )  # fmt: skip
