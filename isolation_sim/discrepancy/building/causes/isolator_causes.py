"""Causes in the isolation layer, and in the currents that reach it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ....effects import Effect, EffectParameter
from ....effects.coulomb_friction import LENGTH, VELOCITY
from ....effects.effect import in_sentence
from ....identification.characteristic_scales import characteristic_scale
from ...decisions import ABRUPT
from ..isolator_effects import IMPACT, ISOLATOR_EFFECTS
from ..model import BuildingModel, force_scales, total_force_scale
from ..record import BuildingRecord
from .candidate import (
    EITHER_SIGN,
    TYPICAL_PERIOD,
    Candidate,
    Parameter,
    Values,
    add_to,
    set_fields,
)

_WEAK = 0.05
"""Share of its magnitude with which an effect begins where it does too much in full."""


CURRENT_CAUSES = "actuation_delay", "current_supply_limit"
LAYER_NUMBERS = "extra_isolator_damping", "isolator_force_error", "isolator_stiffness_error"
"""Causes that change the size of the isolators' force, but not its form."""


def layer_causes(model: BuildingModel, records: Sequence[BuildingRecord]) -> Iterator[Candidate]:
    """Causes in the isolation layer."""
    yield from _linear(model)
    yield _force()
    if all(law.directions < 3 for law in model.nominal.group_laws):
        # no effect has a form under a vertical load that changes
        yield from _effects(model, records)


def layer_effect(
    model: BuildingModel, records: Sequence[BuildingRecord], effect: Effect, start: Values
) -> Candidate:
    """An effect that is tried last, fitted from numbers in the device's scale."""
    names = {one.cause: name for name, one in ISOLATOR_EFFECTS.items()}
    name = names.get(effect.cause, effect.cause)
    scales = _scales_of(model, records)
    cause = _effect(name, effect, scales, (start,))
    (first,) = cause.starts
    # at the end of its range a number may have no slope that leads away from it
    inside = tuple(
        _begun(q, -1, scales) if v in {p.lower, p.upper}.difference(p.plain) else v
        for p, q, v in zip(cause.parameters, effect.parameters, first, strict=True)
    )
    return replace(cause, starts=(first,) if inside == first else (first, inside), last=True)


def effect_in_plan(
    model: BuildingModel, records: Sequence[BuildingRecord], effect: Effect
) -> Candidate:
    """An effect that is tried last in isolators of two directions, with the usual starts."""
    return replace(_around_the_law(effect.cause, effect, _scales_of(model, records)), last=True)


def current_causes(model: BuildingModel, records: Sequence[BuildingRecord]) -> Iterator[Candidate]:
    """Causes between the recorded current and the isolators."""
    if _has_current(model, records):
        yield from _delays()
        yield from _limits(records)


def _has_current(model: BuildingModel, records: Sequence[BuildingRecord]) -> bool:
    """Whether the isolators depend on a current that was recorded."""
    return model.device.depends_on_current and all(r.current is not None for r in records)


def _highest_current(records: Sequence[BuildingRecord]) -> float:
    """The highest recorded current, A; 1 A without one."""
    peaks = [float(r.current.max()) for r in records if r.current is not None]
    highest = max(peaks, default=0.0)
    return highest if highest > 0 else 1.0


def _linear(model: BuildingModel) -> Iterator[Candidate]:
    """Something else holds or damps the isolation layer, or its rubber differs from its law."""
    rows = model.nominal.element_rows[list(model.isolators)]
    # as the isolators are distributed, and in total one in every direction
    shares = force_scales(model) / total_force_scale(model)
    pattern = sum(share * np.outer(row, row) for share, row in zip(shares, rows, strict=True))
    total, omega = model.structure.total_mass, 2 * np.pi / TYPICAL_PERIOD
    yield Candidate(
        "extra_isolator_damping", "", (Parameter("coefficient", "N s/m", 0.0),),
        ((0.06 * total * omega,),), add_to("damping", pattern),
        "the isolation layer has {coefficient:.3g} N s/m of damping more",
    )  # fmt: skip
    most = 10 * total * omega**2
    yield Candidate(
        "isolator_stiffness_error", "", (Parameter("stiffness", "N/m", -most, most),),
        tuple((share * total * omega**2,) for (share,) in EITHER_SIGN),
        add_to("stiffness", pattern),
        "the stiffness of the isolation layer differs by {stiffness:+.3g} N/m from the model's",
    )  # fmt: skip


def _force() -> Candidate:
    """All isolators push harder or less than their law says: another batch, aged or cold rubber."""

    def apply(model: BuildingModel, values: Values) -> BuildingModel:
        elements = list(model.nominal.elements)
        for e in model.isolators:
            device = elements[e].device
            scale = (1 + values[0]) * device.force_scale
            elements[e] = replace(elements[e], device=replace(device, force_scale=scale))
        return replace(model, nominal=replace(model.nominal, elements=tuple(elements)))

    return Candidate(
        "isolator_force_error", "", (Parameter("relative_error", "1", -0.9, 5.0),), EITHER_SIGN,
        apply, "the force of the isolators differs by {relative_error:+.1%} from the model's",
    )  # fmt: skip


def _effects(model: BuildingModel, records: Sequence[BuildingRecord]) -> Iterator[Candidate]:
    """Causes that the isolators' law may lack."""
    scales = _scales_of(model, records)
    over = scales.building
    for name, effect in ISOLATOR_EFFECTS.items():
        if effect is not IMPACT:
            yield _around_the_law(name, effect, scales)
    # a layer that is beyond the gap for most of its motion, or by most of it, has no wall, but
    # another law
    usual = min(_rms_displacement(r) for r in records) / over.metre
    least = next(q.least for q in IMPACT.parameters if q.name == "gap")
    free = max(usual, least * scales.size("m"))
    for form, numbers in _CONTACTS.items():
        fixed = {**numbers, "only": 0.0}
        both = _beyond(free, _around_the_law("moat_impact", IMPACT, scales, form=form, fixed=fixed))
        stiff = _wall_starts(both, scales.size("m"), _STIFF_WALL)
        yield replace(both, starts=(*both.starts, *stiff))
    if any(law.directions > 1 for law in model.nominal.group_laws):
        return
    motions = [r.displacement(r.axes[0]) / over.metre for r in records]
    peaks = max(float(x.max()) for x in motions), min(float(x.min()) for x in motions)
    free = max(usual, least * float(np.abs(peaks).min()))
    for form, numbers in _CONTACTS.items():
        if form != "elastic":  # the others are, where they do not dissipate
            yield _one_wall(scales, peaks, form, numbers, free)


class _OverDevice(NamedTuple):
    """Force and deformation of the building over those of its device."""

    newton: float
    metre: float

    def factor(self, unit: str) -> float:
        """A quantity of the building over that of the device, by its unit."""
        return characteristic_scale(unit, self.newton, self.metre, 1.0)


def _over_device(model: BuildingModel) -> _OverDevice:
    return _OverDevice(total_force_scale(model), model.nominal.elements[0].device.length)


class _Scales(NamedTuple):
    """Sizes of force, deformation and current in a device, and the building over it."""

    force: float
    length: float
    current: float
    building: _OverDevice

    def size(self, unit: str) -> float:
        """Size of a quantity in the device, by its unit."""
        time = TYPICAL_PERIOD / (2 * np.pi)
        return characteristic_scale(unit, self.force, self.length, time, self.current)


def _scales_of(model: BuildingModel, records: Sequence[BuildingRecord]) -> _Scales:
    """Sizes in a device as records show them."""
    deformation = max(float(np.abs(r.displacement(axis)).max()) for r in records for axis in r.axes)
    accelerations = [
        np.sqrt(np.mean(r.mean_acceleration(r.values, axis) ** 2))
        for r in records
        for axis in r.axes
    ]
    force = model.structure.total_mass * float(max(accelerations))
    # fitted in the device's own scale, reported in the building's, of all isolators together
    over = _over_device(model)
    return _Scales(force / over.newton, deformation / over.metre, _highest_current(records), over)


_CONTACTS = {
    "dissipating": {"dashpot": 0.0},
    "elastic": {"damping": 0.0, "dashpot": 0.0},
    "linear": {"exponent": 1.0, "dashpot": 0.0},
    "dashpot": {"exponent": 1.0, "damping": 0.0},
}
"""Numbers that each form of a contact fixes."""


_STIFF_WALL = [(0.98, 10.0), (0.98, 100.0)]
"""Gaps, over the peak, and stiffnesses, over that of the layer, from which fits of a stiff wall
start: it lies close to the peak. Beyond the peak a wall would do nothing."""
_ONE_WALL = [(gap, times) for gap in (0.95, 0.85, 0.7) for times in (1.0, 10.0)] + _STIFF_WALL
"""The same of a wall on one side, with the peak on this side."""


def _beyond(free: float, contact: Candidate) -> Candidate:
    """A contact whose gap is no less than a displacement."""
    stiffness, gap, *others = contact.parameters
    gap = replace(gap, lower=max(gap.lower, free))
    starts = tuple((k, max(x, 1.01 * gap.lower), *rest) for k, x, *rest in contact.starts)
    return replace(contact, parameters=(stiffness, gap, *others), starts=starts)


def _rms_displacement(record: BuildingRecord) -> float:
    """RMS displacement of the isolators along the direction in which it is largest, m."""
    return float(np.sqrt(max(np.mean(record.displacement(axis) ** 2) for axis in record.axes)))


def _wall_starts(
    contact: Candidate, peak: float, choices: Sequence[tuple[float, float]]
) -> Iterator[Values]:
    """Values from which fits of a wall start."""
    stiffness, _, *others = contact.starts[0]
    return ((times * stiffness, gap * peak, *others) for gap, times in choices)


def _one_wall(
    scales: _Scales,
    peaks: tuple[float, float],
    form: str,
    fixed: Mapping[str, float],
    free: float,
) -> Candidate:
    """A wall on the side to which the sign of its gap points."""
    both = _beyond(
        free, _around_the_law("moat_impact", IMPACT, scales, fixed={**fixed, "only": 1.0})
    )
    least = both.parameters[1].lower

    def apply(model: BuildingModel, values: Values) -> BuildingModel:
        stiffness, gap, *others = values
        changed = both.apply(model, (stiffness, max(abs(gap), least), *others))
        numbers = {**changed.effects[IMPACT], "only": -1.0 if gap < 0 else 1.0}
        return replace(changed, effects={**changed.effects, IMPACT: numbers})

    parameters = tuple(
        replace(p, lower=-p.upper) if p.name == "gap" else p for p in both.parameters
    )
    starts = tuple(
        start for peak in peaks if abs(peak) > least
        for start in _wall_starts(both, peak, _ONE_WALL)
    )  # fmt: skip
    return replace(
        both, parameters=parameters, starts=starts, apply=apply,
        says=both.says.replace("in the isolation layer", "on one side of the isolation layer"),
        form=f"one_side_{form}",
    )  # fmt: skip


def _around_the_law(
    name: str,
    effect: Effect,
    scales: _Scales,
    form: str = "",
    fixed: Mapping[str, float] = MappingProxyType({}),
) -> Candidate:
    """An effect with numbers to start from by the sizes of force, deformation and current."""
    free = [q for q in effect.parameters if q.name not in fixed]
    # an effect that does too much in full begins weakly
    starts = tuple(
        tuple(
            _begun(q, min(k, len(q.starts) - 1), scales) * (share if q.magnitude else 1.0)
            for q in free
        )
        for share in (1.0, _WEAK)
        for k in range(max(len(q.starts) for q in free))
    )  # fmt: skip
    return _effect(name, effect, scales, starts, form, fixed)


def _begun(q: EffectParameter, k: int, scales: _Scales) -> float:
    """A number of an effect from which a fit may start, in the device's scale."""
    return q.starts[k] * (1.0 if q.unit in ("s", "1") else scales.size(q.unit))


def _effect(
    name: str,
    effect: Effect,
    scales: _Scales,
    starts: tuple[Values, ...],
    form: str = "",
    fixed: Mapping[str, float] = MappingProxyType({}),
) -> Candidate:
    """An effect around the isolators' law, in its own form or in one with fixed numbers."""
    free = [q for q in effect.parameters if q.name not in fixed]

    def apply(model: BuildingModel, values: Values) -> BuildingModel:
        numbers = dict(zip((q.name for q in free), values, strict=True))
        return replace(model, effects={**model.effects, effect: {**numbers, **fixed}})

    def parameter(q: EffectParameter) -> Parameter:
        lower, plain = q.lower, q.plain
        if q in (VELOCITY, LENGTH):
            # no record tells sharper friction from this one, whose simulation takes far longer
            lower = max(lower, ABRUPT * scales.size(q.unit))
            plain = (*plain, lower)
        factor = scales.building.factor(q.unit)
        return Parameter(q.name, q.unit, lower, q.upper, factor=factor, plain=plain)

    parameters = tuple(map(parameter, free))
    starts = tuple(
        tuple(max(v, p.lower) for v, p in zip(start, parameters, strict=True)) for start in starts
    )
    says = ", ".join(
        f"{q.name} {{{q.name}:.3g}}" + f" {q.unit}" * (q.unit != "1") for q in parameters
    )
    return Candidate(
        name, "", parameters, starts, apply,
        f"{in_sentence(effect.title)} in the isolation layer ({says})", form=form or effect.form,
    )  # fmt: skip


_DELAYS = (0.001,), (0.005,), (0.05,), (0.2,)
"""Delays from which fits start, s."""


def _delays() -> Iterator[Candidate]:
    """The recorded command reaches the isolators late: after a dead time, or through a lag."""
    yield Candidate(
        "actuation_delay", "", (Parameter("delay", "s", 0.0, 2.0),),
        _DELAYS, set_fields("delay"),
        "the current acts {delay:.3g} s after it was recorded", form="dead_time",
    )  # fmt: skip
    yield Candidate(
        "actuation_delay", "", (Parameter("lag", "s", 1e-4, 2.0),),
        _DELAYS, set_fields("lag"),
        "the current acts through a lag of {lag:.3g} s", form="first_order",
    )  # fmt: skip
    # a sampled controller and a coil
    yield Candidate(
        "actuation_delay", "",
        (Parameter("delay", "s", 0.0, 2.0), Parameter("lag", "s", 1e-4, 2.0)),
        tuple((share * d, (1 - share) * d) for (d,) in _DELAYS[1:3] for share in (0.7, 0.3)),
        set_fields("delay", "lag"),
        "the current acts {delay:.3g} s after it was recorded and through a lag of {lag:.3g} s",
        form="dead_time_and_lag",
    )  # fmt: skip


def _limits(records: Sequence[BuildingRecord]) -> Iterator[Candidate]:
    """The supply does not give the highest currents that were recorded as commands."""
    highest = max(float(r.current.max()) for r in records if r.current is not None)
    if highest <= 0:
        return
    yield Candidate(
        "current_supply_limit", "", (Parameter("limit", "A", 0.0, highest),),
        tuple((share * highest,) for share in (0.99, 0.97, 0.8, 0.5)), set_fields("supply_limit"),
        "the current stops at {limit:.3g} A", form="largest_current",
    )  # fmt: skip
    fastest = max(
        float(np.abs(np.diff(r.current)).max() / r.dt)
        for r in records if r.current is not None
    )  # fmt: skip
    yield Candidate(
        "current_supply_limit", "",
        (Parameter("slew", "A/s", 1e-3 * fastest, fastest, logarithmic=True),),
        tuple((share * fastest,) for share in (0.98, 0.9, 0.7, 0.2, 0.05)), set_fields("slew"),
        "the current changes by {slew:.3g} A/s at most", form="slew",
    )  # fmt: skip
