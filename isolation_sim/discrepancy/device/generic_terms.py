"""Generic terms outside the catalogue: products of simple functions of motion, current and time.

Each term is an effect like any other, with one coefficient, so that it is fitted, tested and put
into an extended law in the same way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np

from ...effects import Effect, EffectParameter, Signals
from ...laws.law import Quantity

OUTSIDE = "outside_catalogue"
"""Name of a cause that is none of the catalogue's."""

_IN_CATALOGUE = ("sign(v)", "a")
"""Terms that are effects of the catalogue: friction and inertia."""
_BACKLASH_LAG = 2e-3
"""s: within which the play state follows the edge of its gap."""


@dataclass(frozen=True, eq=False)
class _Factor:
    """A function of one variable: which, how it is written, powers of units, its value."""

    variable: str
    text: str
    unit: Mapping[str, int]
    value: Callable[..., Any]


def _none(s: Signals) -> Any:
    return 1.0


_NOTHING = _Factor("", "", {}, _none)
_BY_X = (
    _NOTHING,
    _Factor("displacement", "x", {"m": 1}, lambda s: s.x),
    _Factor("displacement", "|x|", {"m": 1}, lambda s: np.fabs(s.x)),
    _Factor("displacement", "x^2", {"m": 2}, lambda s: s.x**2),
    _Factor("displacement", "x |x|", {"m": 2}, lambda s: s.x * np.fabs(s.x)),
    _Factor("displacement", "x^3", {"m": 3}, lambda s: s.x**3),
    _Factor("displacement", "x^5", {"m": 5}, lambda s: s.x**5),
    _Factor("displacement", "sign(x)", {}, lambda s: np.sign(s.x)),
)
_BY_V = (
    _NOTHING,
    _Factor("velocity", "v", {"m": 1, "s": -1}, lambda s: s.v),
    _Factor("velocity", "|v|", {"m": 1, "s": -1}, lambda s: np.fabs(s.v)),
    _Factor("velocity", "v^2", {"m": 2, "s": -2}, lambda s: s.v**2),
    _Factor("velocity", "v |v|", {"m": 2, "s": -2}, lambda s: s.v * np.fabs(s.v)),
    _Factor("velocity", "v^3", {"m": 3, "s": -3}, lambda s: s.v**3),
    _Factor("velocity", "sign(v)", {}, lambda s: np.sign(s.v)),
)
_BY_I = (
    _NOTHING,
    _Factor("current", "I", {"A": 1}, lambda s: s.current),
    _Factor("current", "I^2", {"A": 2}, lambda s: s.current**2),
)
_BY_A = (
    _NOTHING,
    _Factor("acceleration", "a", {"m": 1, "s": -2}, lambda s: s.a),
    _Factor("acceleration", "a^2", {"m": 2, "s": -4}, lambda s: s.a**2),
    _Factor("acceleration", "a |a|", {"m": 2, "s": -4}, lambda s: s.a * np.fabs(s.a)),
)


def _written(factors: tuple[_Factor, ...]) -> Effect:
    """The effect that adds a coefficient times a product of factors."""
    values = tuple(f.value for f in factors)
    variables = {f.variable for f in factors}

    def force(signals: Signals, states: tuple, parameters: tuple) -> Any:
        total = parameters[0]
        for value in values:
            total = total * value(signals)
        return total

    return _term(
        " ".join(f.text for f in factors),
        _newtons_per(factors),
        force,
        acceleration="acceleration" in variables,
        temperature="temperature" in variables,
        current="current" in variables,
    )


def _term(
    text: str,
    unit: str,
    force: Callable[..., Any],
    states: tuple[Quantity, ...] = (),
    rates: Callable[..., tuple] | None = None,
    acceleration: bool = False,
    temperature: bool = False,
    current: bool = False,
) -> Effect:
    used = {"acceleration": acceleration, "temperature": temperature, "current": current}
    coefficient = EffectParameter(
        "coefficient", unit, f"coefficient of {text}", magnitude=True, starts=(0.1,)
    )
    return Effect(
        cause=OUTSIDE,
        form=text,
        title=f"Term {text}",
        parameters=(coefficient,),
        states=states,
        rates=rates,
        force=force,
        needs=frozenset(name for name, is_used in used.items() if is_used),
    )


@lru_cache(maxsize=64)
def with_each_power(term: Effect) -> tuple[Effect, int] | None:
    """The term with a coefficient for each power of the current, and the term's own power."""
    words = term.form.split()
    power = next((k for k, one in enumerate(_BY_I) if one.text and one.text in words), 0)
    text = " ".join(words[:-1] if power else words)
    factors = next((f for f in _by_motion() if " ".join(one.text for one in f) == text), ())
    if not factors or text in _IN_CATALOGUE:
        return None
    motion = _written(factors)
    product_of = motion.force
    assert product_of is not None

    def force(signals: Signals, states: tuple, parameters: tuple) -> Any:
        by_current = sum(c * f.value(signals) for c, f in zip(parameters, _BY_I, strict=True))
        return product_of(signals, states, (by_current,))

    coefficients = tuple(
        EffectParameter(
            f"coefficient_{k}", _newtons_per((*factors, one)), f"coefficient of {text} I^{k}",
            magnitude=k == 0, starts=(0.1,) if k == 0 else (0.0,),
        )
        for k, one in enumerate(_BY_I)
    )  # fmt: skip
    name = f"{text} (1, I, I^2)"
    family = replace(
        motion, form=name, title=f"Term {name}", parameters=coefficients, force=force,
        needs=motion.needs | {"current"},
    )  # fmt: skip
    return family, power


def _newtons_per(factors: tuple[_Factor, ...]) -> str:
    """Unit of the coefficient, such as N s/m^3."""
    powers: dict[str, int] = {}
    for factor in factors:
        for symbol, power in factor.unit.items():
            powers[symbol] = powers.get(symbol, 0) + power

    def written(chosen: dict[str, int]) -> str:
        return " ".join(f"{s}^{p}" if p > 1 else s for s, p in chosen.items())

    above = written({"N": 1} | {s: -p for s, p in powers.items() if p < 0})
    below = written({s: p for s, p in powers.items() if p > 0})
    return f"{above}/{below}" if below else above


def _clock(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    return (1.0 + 0.0 * signals.x,)


def _with_time() -> Iterator[Effect]:
    """Slow changes: stiffness, damping or zero that drift with the time since a test began."""
    clock = (Quantity("time", "s", "since the test began"),)
    for text, unit, value in (
        ("t", "N/s", lambda s: 1.0),
        ("x t", "N/m s", lambda s: s.x),
        ("v t", "N/m", lambda s: s.v),
    ):

        def force(signals: Signals, states: tuple, p: tuple, value: Any = value) -> Any:
            return p[0] * states[0] * value(signals)

        yield _term(text, unit, force, clock, _clock)


def _with_play(gap: float) -> Effect:
    """Backlash: a spring behind a gap, which the motion drags along."""

    def rates(signals: Signals, states: tuple, parameters: tuple) -> tuple:
        ahead = signals.x - states[0]
        beyond = (ahead - gap) * (ahead > gap) + (ahead + gap) * (ahead < -gap)
        return (beyond / _BACKLASH_LAG,)

    def force(signals: Signals, states: tuple, parameters: tuple) -> Any:
        return parameters[0] * states[0]

    state = (Quantity("dragged", "m", "position dragged across the gap"),)
    return _term(f"play of x over {1e3 * gap:.3g} mm", "N/m", force, state, rates)


def _with_current_rate(time: float) -> Iterator[Effect]:
    """Forces by the rate of the current, which is taken over a time."""
    # One low-pass makes the rate late by its time, which two correct to first order.

    def rates(signals: Signals, states: tuple, parameters: tuple) -> tuple:
        before, earlier = states
        return ((signals.current - before) / time, (before - earlier) / time)

    def start(signals: Signals, parameters: tuple) -> tuple:
        return (signals.current, signals.current)

    before = (
        Quantity("before", "A", "current a moment before"),
        Quantity("earlier", "A", "current a moment before that"),
    )
    rate = _Factor("current", "dI/dt", {"A": 1, "s": -1}, _none)
    for motion in (_BY_X[0], _BY_X[1], _BY_V[1]):

        def force(signals: Signals, states: tuple, p: tuple, motion: _Factor = motion) -> Any:
            change = 2 * signals.current - 3 * states[0] + states[1]
            return p[0] * motion.value(signals) * change / time

        text = f"{motion.text} dI/dt".strip()
        unit = _newtons_per((motion, rate))
        yield replace(_term(text, unit, force, before, rates, current=True), start=start)


def _by_motion() -> list[tuple[_Factor, ...]]:
    """Products of functions of displacement and velocity, and functions of the acceleration."""
    products = [tuple(f for f in pair if f is not _NOTHING) for pair in product(_BY_X, _BY_V)]
    return [*(one for one in products if one), *((f,) for f in _BY_A[1:])]


@lru_cache(maxsize=8)
def generic_terms(
    largest: float, has_current: bool, has_temperature: bool, rate_time: float = 0.0
) -> tuple[Effect, ...]:
    """Dictionary of terms; the rate of the current is taken over a time, s, if it is not 0."""
    by_current = _BY_I if has_current else _BY_I[:1]
    result = [
        _written((*factors, *([power] if power is not _NOTHING else [])))
        for factors, power in product([(), *_by_motion()], by_current)
        if factors or power is not _NOTHING
    ]
    result += [_written((a, x)) for a, x in product(_BY_A[1:], _BY_X[1:3])]
    if has_temperature:
        warmth = _Factor("temperature", "T", {"degC": 1}, lambda s: s.temperature)
        result += [_written((warmth, f)) for f in (_BY_V[1], _BY_X[5])]
    result += list(_with_time())
    if rate_time:
        result += list(_with_current_rate(rate_time))
    result += [_with_play(round(part * largest, 6)) for part in (0.02, 0.06, 0.2)]
    return tuple(term for term in result if term.form not in _IN_CATALOGUE)


def variables(text: str) -> tuple[str, ...]:
    """Variables that a term is a function of."""
    if text.startswith("play"):
        return ("displacement", "past_deformation")
    symbols = {
        "x": "displacement", "v": "velocity", "a": "acceleration", "I": "current",
        "T": "temperature", "t": "time",
    }  # fmt: skip
    cleaned = text.replace("sign", "").replace("dI/dt", "I")
    return tuple(name for symbol, name in symbols.items() if symbol in cleaned)
