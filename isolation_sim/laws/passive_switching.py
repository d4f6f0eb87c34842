"""The passive switching rule: no change of the current ever adds energy to a device.

In the papers' laws a current that rises stiffens the springs as they are, stretched: their force
jumps, and so does the energy in them. Here stiffening acts on further deformation only, and
softening releases force in proportion to the stiffness lost. A spring of force ``p g(e)`` with
``g(e) = sign(e) |e|^n`` and energy ``p |e|^(n+1) / (n+1)`` keeps an elastic extension e of its own,

    e' = (rate of its whole extension) - e / n * max(p', 0) / p.

While p rises the force stays, e shrinks, and the energy falls by 1 / n of p's relative rise; while
p falls, e stays and force and energy fall with p. Both ways the field's work is negative:

    energy * (min(p', 0) - max(p', 0) / n) / p.

So that p' is known inside the law, the field is a state j of the law, ``j' = (I - j) / lag``, and
all parameters are those at j: the stiffnesses' and the dashpots'. At a constant current the law is
the one it is made from. A spring that was stiffened while stretched is at rest elsewhere than
before: in this rule an isolator may come to rest off its centre.

The rule is for laws whose stored energy is that of their declared ``springs``. Bouc-Wen's has no
closed form, the hybrid law's spring changes its shape with the current, and in the improved
Bouc-Wen law the state is measured in a yield value that the current changes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ground_motions.argument_types import checked

from ..errors import InputError
from .current_dependence import CurrentDependence
from .device import Device
from .law import Law, Quantity

FIELD_LAG = 5e-3
"""Default lag of the field behind the current, s: eddy currents in the steel of the core."""


@dataclass(frozen=True, eq=False)
class PassiveLaw(Law):
    """A law under the passive switching rule."""

    plain: Law | None = None  # The law that it is made from
    powers: tuple[int, ...] = ()  # Number of coefficients of each of that law's parameters


@checked
def passive(device: Device, field_lag: float = FIELD_LAG) -> Device:
    """Put a device under the passive switching rule.

    Parameters
    ----------
    device : Device
        Of a law that declares its springs; its parameters follow the current by one polynomial.
    field_lag : float, s, default 0.005
        Time constant with which the field follows the coil current.

    Returns
    -------
    Device
        The same device at a constant current; unchanged if the current has no effect on it.

    Raises
    ------
    InputError
        If the law does not allow the rule, with the reason.
    """
    if not device.depends_on_current or isinstance(device.law, PassiveLaw):
        return device
    if not field_lag > 0:
        raise InputError(f"{device.name}: field_lag", f"{field_lag} s", "above 0")
    _check(device)
    rows = _rows(device)
    law = _passive_law(device.law, tuple(len(rows[name]) for name in device.current.names))
    names = [name for own in _coefficient_names(device.law, law.powers) for name in own]
    numbers = [coefficient for row in rows.values() for coefficient in row]
    flat = {name: (number,) for name, number in zip(names, numbers, strict=True)}
    current = CurrentDependence.polynomial(
        flat | {"coil_current": (0.0, 1.0), "field_lag": (field_lag,)}
    )
    return replace(device, law=law, current=current, name=f"{device.name}, passive switching")


@checked
def instantaneous(device: Device) -> Device:
    """Return the device with instantaneous switching: its force follows the current at once.

    Parameters
    ----------
    device : Device
        Any device.

    Returns
    -------
    Device
        The device that ``passive`` was applied to; any other device unchanged.
    """
    law = device.law
    if not isinstance(law, PassiveLaw) or law.plain is None:
        return device
    values = dict(zip(device.current.names, device.current.coefficients[0, :, 0], strict=True))
    names = _coefficient_names(law.plain, law.powers)
    rows = {
        name: tuple(float(values[n]) for n in own)
        for name, own in zip(law.plain.parameter_names, names, strict=True)
    }
    name = device.name.removesuffix(", passive switching")
    return replace(device, law=law.plain, current=CurrentDependence.polynomial(rows), name=name)


def _rows(device: Device) -> dict[str, list[float]]:
    """Coefficients of each parameter, those above the highest that is not zero left out."""
    return {
        name: np.trim_zeros(row, "b").tolist() or [0.0]
        for name, row in zip(device.current.names, device.current.coefficients[0], strict=True)
    }


def _coefficient_names(law: Law, powers: tuple[int, ...]) -> list[list[str]]:
    return [
        [name] if n == 1 else [f"{name}_{power}" for power in range(n)]
        for name, n in zip(law.parameter_names, powers, strict=True)
    ]


def _check(device: Device) -> None:
    """Refuse a device for which the rule is not defined or not passive."""
    law, dependence = device.law, device.current
    refusal = f"{device.name} does not allow the passive switching rule: "
    if not law.springs:
        from .registry import LAWS

        allowed = ", ".join(name for name, other in LAWS.items() if other.springs)
        raise InputError(
            f"{refusal}{law.name} declares no springs that the current changes in proportion; "
            f"expected: {allowed}"
        )
    if len(dependence.coefficients) > 1:
        raise InputError(
            f"{refusal}its parameters are tabulated against the current; expected: one polynomial "
            "a parameter"
        )
    low, high = device.current_range
    if not low <= 0 <= high:
        raise InputError(
            f"{refusal}its field starts at 0 A, outside its range of {low:g} to {high:g} A"
        )
    stiffnesses = [spring.stiffness for spring in law.springs]
    currents = np.linspace(low, high, 201)[:-1] if np.isfinite(high - low) else np.zeros(1)
    for name, row, values in zip(
        dependence.names, dependence.coefficients[0], dependence.at(currents), strict=True
    ):
        if not row[1:].any():
            continue
        if name not in stiffnesses and _shapes_energy(law, name):
            raise InputError(
                f"{refusal}the current changes {name}, which shapes the stored energy; expected: "
                f"a current that changes {', '.join(stiffnesses)} and dampers"
            )
        if name in stiffnesses and not np.min(values) > 0:
            raise InputError(
                f"{refusal}{name}",
                f"{np.min(values):.4g} at {currents[np.argmin(values)]:.4g} A",
                "springs that stay above 0",
            )


def _shapes_energy(law: Law, name: str) -> bool:
    """Whether the stored energy depends on a parameter, tried at one arbitrary point."""
    assert law.stored_energy is not None
    numbers = [0.7 + 0.1 * k for k in range(len(law.parameters))]
    states = tuple(0.3 + 0.07 * k for k in range(len(law.states)))
    before = law.stored_energy(0.9, states, tuple(numbers))
    numbers[law.parameter_names.index(name)] *= 1.1
    return bool(law.stored_energy(0.9, states, tuple(numbers)) != before)


class _SpringPlaces(NamedTuple):
    """A spring by places among a law's parameters and the wrapped law's states."""

    stiffness: int  # Parameter
    power: float  # Where it is a number
    power_at: int | None  # Parameter that is the power
    extensions: tuple[int, ...]  # States that are its elastic extensions
    elastic: int | None  # The one of them that stands in for the device's deformation
    less: int | None  # State to take from the deformation


def _spring_places(law: Law) -> tuple[_SpringPlaces, ...]:
    result = []
    at = len(law.states)  # elastic extensions come behind the law's own states
    for spring in law.springs:
        own = [law.state_names.index(name) for name in spring.extensions if name != "x"]
        elastic = None
        if "x" in spring.extensions:
            elastic, at = at, at + 1
            own.append(elastic)
        named = isinstance(spring.power, str)
        result.append(
            _SpringPlaces(
                stiffness=law.parameter_names.index(spring.stiffness),
                power=1.0 if named else float(spring.power),
                power_at=law.parameter_names.index(str(spring.power)) if named else None,
                extensions=tuple(own),
                elastic=elastic,
                less=law.state_names.index(spring.less) if spring.less else None,
            )
        )
    return tuple(result)


@lru_cache(maxsize=64)
def _passive_law(law: Law, powers: tuple[int, ...]) -> PassiveLaw:
    """The law for so many coefficients of each parameter."""
    n_states, n_own = len(law.states), sum(powers)
    rows_of = tuple((sum(powers[:k]), sum(powers[: k + 1])) for k in range(len(powers)))
    springs = _spring_places(law)
    over_x = tuple(s for s in springs if s.elastic is not None)
    inner_force, inner_rates, inner_energy = law.force, law.rates, law.stored_energy

    def at_field(states: tuple, parameters: tuple) -> tuple:
        """Parameters at the field, each spring's relative growth of stiffness (1/s), field rate."""
        field, flat = states[-1], parameters[:n_own]
        field_rate = (parameters[n_own] - field) / parameters[n_own + 1]
        rows = tuple(flat[a:b] for a, b in rows_of)
        values = tuple(_polynomial(row, field) for row in rows)
        growths = []
        for spring in springs:
            p, row = values[spring.stiffness], rows[spring.stiffness]
            slope = _polynomial(tuple(k * c for k, c in enumerate(row))[1:], field)
            # where the end of the current's range takes a stiffness to 0, no energy is left
            growths.append((p > 0) * slope * field_rate / (p + (p <= 0)))
        return values, tuple(growths), field_rate

    def without(values: tuple, off: tuple) -> tuple:
        places = tuple(spring.stiffness for spring in off)
        return tuple(0.0 if k in places else p for k, p in enumerate(values))

    def share(function: Any, spring: Any, x: Any, states: tuple, values: tuple) -> tuple:
        """Contribution of one spring to the law's quantities, at its own extension."""
        if spring.elastic is not None:
            x = states[spring.elastic]
        if spring.less is not None:
            x = x + states[spring.less]
        on = function(x, states[:n_states], values)
        off = function(x, states[:n_states], without(values, (spring,)))
        return tuple(a - b for a, b in zip(on, off, strict=True))

    def total(function: Any, x: Any, states: tuple, values: tuple) -> tuple:
        """The law's quantities, with the contribution of each spring at its own extension."""
        result = function(x, states[:n_states], without(values, over_x))
        for spring in over_x:
            added = share(function, spring, x, states, values)
            result = tuple(a + b for a, b in zip(result, added, strict=True))
        return result

    def energies(x: Any, states: tuple, values: tuple) -> tuple:
        assert inner_energy is not None
        return (inner_energy(x, states, values),)

    def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
        def forces(own_x: Any, own: tuple, values: tuple) -> tuple:
            return (inner_force(own_x, v, own, values),)

        values, _, _ = at_field(states, parameters)
        return total(forces, x, states, values)[0]

    def rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
        def all_rates(own_x: Any, own: tuple, values: tuple) -> tuple:
            return tuple(inner_rates(own_x, v, own, values))

        values, growths, field_rate = at_field(states, parameters)
        result = list(total(all_rates, x, states, values))
        result += [v - (0.0 if s.less is None else result[s.less]) for s in over_x]
        for spring, growth in zip(springs, growths, strict=True):
            slip = (growth > 0) * growth / _power(spring, values)
            for k in spring.extensions:
                result[k] = result[k] - states[k] * slip
        return (*result, field_rate)

    def stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:
        return total(energies, x, states, at_field(states, parameters)[0])[0]

    def field_power(x: Any, states: tuple, parameters: tuple) -> Any:
        values, growths, _ = at_field(states, parameters)
        power = 0.0
        for spring, growth in zip(springs, growths, strict=True):
            (energy,) = share(energies, spring, x, states, values)
            fall = (growth < 0) * growth - (growth > 0) * growth / _power(spring, values)
            power = power + energy * fall
        return power

    def rest(parameters: tuple) -> tuple:
        return (0.0,) * (n_states + len(over_x)) + (parameters[n_own],)

    return PassiveLaw(
        name=f"{law.name}_passive",
        title=f"{law.title}, passive switching",
        states=(
            *law.states,
            *(
                Quantity(f"elastic_{law.parameter_names[s.stiffness]}", "m", "elastic extension")
                for s in over_x
            ),
            Quantity("field", "A", "current whose field is there"),
        ),
        parameters=(
            *_coefficients(law, powers),
            Quantity("coil_current", "A", "coil current"),
            Quantity("field_lag", "s", "time constant of the field", lower=0.0, divides=True),
        ),
        force=force,
        rates=rates,
        stored_energy=stored_energy,
        source=law.source,
        rest=rest,
        field_power=field_power,
        plain=law,
        powers=powers,
    )


def _coefficients(law: Law, powers: tuple[int, ...]) -> list[Quantity]:
    """Parameters that do not follow the current as they are, the others' coefficients."""
    result = []
    for quantity, own in zip(law.parameters, _coefficient_names(law, powers), strict=True):
        if len(own) == 1:
            result.append(quantity)
        else:
            result += [
                Quantity(name, f"{quantity.unit}/A^{power}", quantity.meaning)
                for power, name in enumerate(own)
            ]
    return result


def _power(spring: _SpringPlaces, values: tuple) -> Any:
    return spring.power if spring.power_at is None else values[spring.power_at]


def _polynomial(row: tuple, current: Any) -> Any:
    value = 0.0
    for coefficient in row[::-1]:
        value = value * current + coefficient
    return value
