"""Put effects around a law: the result is a law again.

In the order given, effects change the motion, the current and the time that the law sees; the
law's force is multiplied by all factors; added forces come last. Behind a linkage, or a late
channel, stands the whole device: each effect sees the motion that the law sees, or, if it changes
the motion itself, the one that those before it leave. Each sees the true current. A recorder that
filters the force follows that of the device with its other effects.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ground_motions.argument_types import checked

from ..errors import InputError, check_name
from ..laws.current_dependence import CurrentDependence
from ..laws.device import Device
from ..laws.law import InPlan, Law, Quantity
from ..laws.registry import LAWS
from ..laws.trace_check import check_traceable
from .effect import REFERENCE_TEMPERATURE, Effect, EffectInPlan, Signals, in_sentence

ACCELERATION_LAG = 2e-3
"""s: in a law, acceleration is the velocity's rate through a first-order filter of this lag."""

CURRENT = "coil_current"
TEMPERATURE = "temperature"


@dataclass(frozen=True, eq=False)
class ExtendedLaw(Law):
    """A law with effects around it.

    Attributes
    ----------
    base : Law
        The law inside.
    effects : tuple of Effect
        In the order in which they act.
    breaks : tuple of float or None, A
        Breaks of the base parameters' current dependence where the law itself evaluates it, since
        an effect changes the current that it sees; None where it does not.
    """

    base: Law | None = None
    effects: tuple[Effect, ...] = ()
    breaks: tuple[float, ...] | None = None

    def _over(self, functions: InPlan | None, directions: int) -> Law:
        assert self.base is not None
        lacking = [e.cause for e in self.effects if e.plan is None]
        if lacking or directions > 2 or self.breaks is not None:
            around = ", ".join(lacking or [e.cause for e in self.effects])
            raise InputError(
                f"effects act along one direction ({around}); expected for biaxial isolators: "
                "effects with a form in plan, and no change of their vertical load"
            )
        return _in_plan(self, self.base.in_plan)


@checked
def extend(device: Device, applied: Sequence[tuple[Effect, Mapping[str, float]]]) -> Device:
    """Put effects around a device's law.

    Parameters
    ----------
    device : Device
        The device, not extended yet.
    applied : sequence of (Effect, mapping of str to float)
        Effects in the order in which they act, each with all of its parameters in SI units.

    Returns
    -------
    Device
        With the same scales and range of current; its law's last parameters are those of the
        effects, named ``cause_parameter``.

    Raises
    ------
    InputError
        If a parameter is missing, unknown or out of bounds, a cause is given twice, or the device
        is extended already.
    """
    if isinstance(device.law, ExtendedLaw):
        raise InputError(f"{device.name} has effects already; expected: a law without effects")
    if device.law.unit:
        raise InputError(f"{device.law.unit}: a functional mock-up unit takes no effects")
    effects = tuple(effect for effect, _ in applied)
    causes = [effect.cause for effect in effects]
    for cause in causes:
        if causes.count(cause) > 1:
            raise InputError(f"effect {cause!r} given twice; expected: each cause once")
    law = extended_law(device.law, effects, device.current)
    rows: dict[str, Any] = {}
    for effect, values in applied:
        _check_parameters(effect, values)
        rows |= {f"{effect.cause}_{name}": (value,) for name, value in values.items()}
    # without this, a damper with friction would ask for a coil
    by_current = device.depends_on_current or any("current" in e.needs for e in effects)
    rows[CURRENT] = (0.0, 1.0) if by_current else (0.0,)
    rows[TEMPERATURE] = (REFERENCE_TEMPERATURE,)
    names = law.parameter_names
    outer = {name: rows[name] for name in names if name in rows}
    if law.breaks is None:
        current = _join(device.current, CurrentDependence.polynomial(outer))
    else:
        flat = device.current.coefficients.ravel()
        inner = {name: (float(c),) for name, c in zip(names, flat, strict=False)}
        current = CurrentDependence.polynomial(inner | outer)
    return replace(
        device,
        law=law,
        current=current,
        name=f"{device.name} with {', '.join(causes)}" if causes else device.name,
    )


def _check_parameters(effect: Effect, values: Mapping[str, float]) -> None:
    """Refuse unknown and missing parameters of an effect."""
    for name in values:
        check_name(f"parameter of {effect.name}", name, effect.parameter_names)
    for name in effect.parameter_names:
        if name not in values:
            needed = ", ".join(effect.parameter_names)
            raise InputError(f"{effect.name}: parameter {name!r} is missing; needed: {needed}")


def _join(inner: CurrentDependence, outer: CurrentDependence) -> CurrentDependence:
    """Parameters of two dependences side by side; the second has one piece."""
    pieces, _, n_in = inner.coefficients.shape
    powers = max(n_in, outer.coefficients.shape[2])

    def pad(c: Any) -> Any:
        return np.pad(c, ((0, 0), (0, 0), (0, powers - c.shape[2])))

    alike = np.repeat(pad(outer.coefficients), pieces, axis=0)
    both = np.concatenate([pad(inner.coefficients), alike], axis=1)
    return CurrentDependence((*inner.names, *outer.names), inner.breaks, both)


@checked
def separate(device: Device) -> tuple[Device, list[tuple[Effect, dict[str, float]]]]:
    """Take a device apart again: the one inside and its effects with their numbers.

    Parameters
    ----------
    device : Device
        Any device.

    Returns
    -------
    base : Device
        Without effects.
    applied : list of (Effect, dict of str to float)
        As ``extend`` takes them; empty where the device has no effects.
    """
    law = device.law
    if not isinstance(law, ExtendedLaw) or law.base is None:
        return device, []
    names = device.current.names
    coefficients = device.current.coefficients
    applied = [
        (
            effect,
            {
                q.name: float(coefficients[0, names.index(f"{effect.cause}_{q.name}"), 0])
                for q in effect.parameters
            },
        )
        for effect in law.effects
    ]
    n = len(law.base.parameters)
    if law.breaks is None:
        inner = CurrentDependence(names[:n], device.current.breaks, coefficients[:, :n])
    else:
        pieces = len(law.breaks) + 1
        n_inner = len(law.parameters) - len(_outer_parameters(law.effects))
        flat = coefficients[0, :n_inner, 0]
        breaks = np.array([-np.inf, *law.breaks, np.inf])
        inner = CurrentDependence(law.base.parameter_names, breaks, flat.reshape(pieces, n, -1))
    name = device.name.split(" with ")[0]
    return replace(device, law=law.base, current=inner, name=name), applied


def check_effect(effect: Effect) -> None:
    """Refuse an effect outside this package that cannot be traced, naming the line."""
    inner = LAWS["linear"]
    names = dict.fromkeys(inner.parameter_names, 1.0)
    check_traceable(extended_law(inner, [effect], CurrentDependence.polynomial(names)))


def extended_law(law: Law, effects: Sequence[Effect], dependence: CurrentDependence) -> ExtendedLaw:
    """Write the law of a device with effects."""
    if not any(effect.current is not None for effect in effects):
        return _extended_law(law, tuple(effects), None, 0)
    breaks = tuple(dependence.breaks[1:-1].tolist())
    return _extended_law(law, tuple(effects), breaks, dependence.coefficients.shape[2])


class _Functions(NamedTuple):
    """Functions of an effect; None for those that it does not have."""

    motion: Callable[..., tuple] | None
    current: Callable[..., Any] | None
    time_scale: Callable[..., Any] | None
    factor: Callable[..., Any] | None
    force: Callable[..., Any] | None
    rates: Callable[..., tuple] | None
    start: Callable[..., tuple] | None
    records_force: bool


@lru_cache(maxsize=256)
def _extended_law(
    law: Law, effects: tuple[Effect, ...], breaks: tuple[float, ...] | None, n_powers: int
) -> ExtendedLaw:
    evaluate, inner = _evaluation(law, breaks, n_powers)
    functions = tuple(
        _Functions(*(getattr(effect, name) for name in _Functions._fields)) for effect in effects
    )
    outer = _outer_parameters(effects)
    has_temperature = TEMPERATURE in [q.name for q in outer]
    filtered = any("acceleration" in effect.needs for effect in effects)
    n_inner, n_states = len(inner), len(law.states)
    places = _places(effects, n_inner + 1 + has_temperature, n_states)
    inner_force, inner_rates = law.force, law.rates

    def unpack(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
        """Force of the device; each effect's signals, states, parameters; law's inputs, time."""
        temperature = parameters[n_inner + 1] if has_temperature else REFERENCE_TEMPERATURE
        a = (v - states[-1]) / ACCELERATION_LAG if filtered else 0.0
        signals = Signals(x, v, a, parameters[n_inner], 0.0, temperature)
        own = [(states[low:high], parameters[first:last]) for first, last, low, high in places]
        reaching = []
        for effect, (z, p) in zip(functions, own, strict=True):
            reaching.append(signals)
            if effect.motion is not None:
                seen_x, seen_v = effect.motion(signals, z, p)
                signals = signals._replace(x=seen_x, v=seen_v)
        seen_current = signals.current
        slower = None
        for effect, (z, p) in zip(functions, own, strict=True):
            if effect.current is not None:
                seen_current = effect.current(signals._replace(current=seen_current), z, p)
            if effect.time_scale is not None:
                scale = effect.time_scale(signals, z, p)
                slower = scale if slower is None else slower * scale
        # in its own time the law moves faster
        seen_v = signals.v if slower is None else signals.v * slower
        seen = (
            signals.x, seen_v, states[:n_states], evaluate(seen_current, parameters[:n_inner])
        )  # fmt: skip
        law_force = inner_force(*seen)
        each = [
            ((signals if effect.motion is None else first)._replace(force=law_force), z, p)
            for effect, first, (z, p) in zip(functions, reaching, own, strict=True)
        ]
        total = law_force
        for effect, one in zip(functions, each, strict=True):
            if effect.factor is not None:
                total = total * effect.factor(*one)
        for effect, one in zip(functions, each, strict=True):
            if effect.force is not None and not effect.records_force:
                total = total + effect.force(*one)
        each = [
            (one[0]._replace(force=total), *one[1:]) if effect.records_force else one
            for effect, one in zip(functions, each, strict=True)
        ]
        return total, each, seen, slower

    def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
        total, each, _, _ = unpack(x, v, states, parameters)
        for effect, one in zip(functions, each, strict=True):
            if effect.force is not None and effect.records_force:
                total = total + effect.force(*one)
        return total

    def rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
        _, each, seen, slower = unpack(x, v, states, parameters)
        result = tuple(inner_rates(*seen))
        if slower is not None:
            result = tuple(rate / slower for rate in result)
        for effect, one in zip(functions, each, strict=True):
            if effect.rates is not None:
                result = (*result, *effect.rates(*one))
        return (*result, (v - states[-1]) / ACCELERATION_LAG) if filtered else result

    def rest(parameters: tuple) -> tuple:
        current = parameters[n_inner]
        temperature = parameters[n_inner + 1] if has_temperature else REFERENCE_TEMPERATURE
        signals = Signals(0.0, 0.0, 0.0, current, 0.0, temperature)
        result: tuple = (0.0,) * n_states
        if law.rest is not None:
            result = tuple(law.rest(evaluate(current, parameters[:n_inner])))
        for effect, (first, last, low, high) in zip(functions, places, strict=True):
            own: tuple = (0.0,) * (high - low)
            if effect.start is not None:
                own = effect.start(signals, parameters[first:last])
            result = (*result, *own)
        return (*result, 0.0) if filtered else result

    all_states = [*law.states]
    for effect in effects:
        all_states += [replace(q, name=f"{effect.cause}_{q.name}") for q in effect.states]
    if filtered:
        all_states.append(Quantity("followed_velocity", "m/s", "velocity, with a short lag"))
    return ExtendedLaw(
        name="+".join([law.name, *(effect.name for effect in effects)]),
        title=", ".join([law.title, *(in_sentence(effect.title) for effect in effects)]),
        parameters=(*inner, *outer),
        force=force,
        states=tuple(all_states),
        rates=rates,
        stored_energy=_stored_energy(law, effects, n_inner, places),
        field_power=_field_power(law, effects, n_inner),
        rest=rest,
        source="; ".join(s for s in [law.source, *(e.source for e in effects)] if s),
        base=law,
        effects=effects,
        breaks=breaks,
    )


def _places(
    effects: Sequence[Effect], parameter: int, state: int
) -> tuple[tuple[int, int, int, int], ...]:
    """Start and stop of each effect's parameters, and of its states, in those of the law."""
    result = []
    for effect in effects:
        stop, stop_state = parameter + len(effect.parameters), state + len(effect.states)
        result.append((parameter, stop, state, stop_state))
        parameter, state = stop, stop_state
    return tuple(result)


def _in_plan(law: ExtendedLaw, base: Law) -> Law:
    """An extended law over two directions: the states of its base along both, then the effects'."""
    n_inner, n_states = len(base.parameters), len(base.states)
    has_temperature = TEMPERATURE in law.parameter_names
    places = _places(law.effects, n_inner + 1 + has_temperature, n_states)
    plans = tuple(effect.plan or EffectInPlan() for effect in law.effects)

    def signals_of(x: tuple, v: tuple, states: tuple, parameters: tuple) -> Signals:
        temperature = parameters[n_inner + 1] if has_temperature else REFERENCE_TEMPERATURE
        inner = base.force(x, v, states[:n_states], parameters[:n_inner])
        return Signals(x, v, (0.0, 0.0), parameters[n_inner], tuple(inner), temperature)

    def force(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
        signals = signals_of(x, v, states, parameters)
        along_x, along_y = signals.force
        for plan, (first, last, low, high) in zip(plans, places, strict=True):
            if plan.factor is not None:
                left = plan.factor(signals, states[low:high], parameters[first:last])
                along_x, along_y = left * along_x, left * along_y
        for plan, (first, last, low, high) in zip(plans, places, strict=True):
            if plan.force is not None:
                added = plan.force(signals, states[low:high], parameters[first:last])
                along_x, along_y = along_x + added[0], along_y + added[1]
        return along_x, along_y

    def rates(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
        signals = signals_of(x, v, states, parameters)
        result = tuple(base.rates(x, v, states[:n_states], parameters[:n_inner]))
        for plan, (first, last, low, high) in zip(plans, places, strict=True):
            if plan.rates is not None:
                own = plan.rates(signals, states[low:high], parameters[first:last])
                result = (*result, *own)
        return result

    return Law(
        name=law.name, title=law.title, parameters=law.parameters, force=force,
        states=(*base.states, *law.states[n_states // 2 :]), rates=rates, source=law.source,
        directions=2,
    )  # fmt: skip


def _outer_parameters(effects: Sequence[Effect]) -> list[Quantity]:
    """Parameters beside the base law's: current, temperature, the effects' own."""
    outer = [Quantity(CURRENT, "A", "coil current")]
    if any("temperature" in effect.needs for effect in effects):
        outer.append(Quantity(TEMPERATURE, "degC", "temperature of the surroundings"))
    for effect in effects:
        for q in effect.parameters:
            outer.append(
                Quantity(f"{effect.cause}_{q.name}", q.unit, q.meaning, q.lower, q.upper, q.divides)
            )
    return outer


def _evaluation(
    law: Law, breaks: tuple[float, ...] | None, powers: int
) -> tuple[Callable[..., tuple], list[Quantity]]:
    """Function of the current and the first parameters that gives the base law's; these first."""
    if breaks is None:
        return _pass_parameters, list(law.parameters)
    pieces, n = len(breaks) + 1, len(law.parameters)

    def evaluate(current: Any, flat: tuple) -> tuple:
        values = []
        for k in range(n):
            total = 0.0
            for piece in range(pieces):
                at = (piece * n + k) * powers
                value = flat[at + powers - 1]
                for power in range(powers - 2, -1, -1):
                    value = value * current + flat[at + power]
                if piece > 0:
                    value = value * (current >= breaks[piece - 1])
                if piece < pieces - 1:
                    value = value * (current < breaks[piece])
                total = total + value
            values.append(total)
        return tuple(values)

    inner = []
    for piece in range(pieces):
        mark = f"_piece{piece}" if pieces > 1 else ""
        for q in law.parameters:
            inner += [
                Quantity(f"{q.name}{mark}_{power}", f"{q.unit}/A^{power}", q.meaning)
                for power in range(powers)
            ]
    return evaluate, inner


def _pass_parameters(current: Any, flat: tuple) -> tuple:
    return tuple(flat)


def _stored_energy(
    law: Law,
    effects: Sequence[Effect],
    n_inner: int,
    places: Sequence[tuple[int, int, int, int]],
) -> Callable[..., Any] | None:
    """Stored energy of the whole, where all that effects do is to add forces; else None."""
    if law.stored_energy is None or not _only_add(effects):
        return None
    inner = law.stored_energy
    n_states = len(law.states)
    own = tuple((e.stored_energy, *place) for e, place in zip(effects, places, strict=True))

    def stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:
        total = inner(x, states[:n_states], parameters[:n_inner])
        for energy, first, last, low, high in own:
            if energy is not None:
                total = total + energy(x, states[low:high], parameters[first:last])
        return total

    return stored_energy


def _field_power(law: Law, effects: Sequence[Effect], n_inner: int) -> Callable[..., Any] | None:
    """Power of a change of the field on the stored energy, where effects only add forces."""
    if law.field_power is None or not _only_add(effects):
        return None
    inner, n_states = law.field_power, len(law.states)

    def field_power(x: Any, states: tuple, parameters: tuple) -> Any:
        return inner(x, states[:n_states], parameters[:n_inner])

    return field_power


def _only_add(effects: Sequence[Effect]) -> bool:
    """Whether the law's force stays as it is, and others are added."""
    return not any(e.motion or e.current or e.factor for e in effects)
