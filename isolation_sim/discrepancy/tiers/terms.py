"""Terms that an equation may add to a law's force: static ones, and ones with a hysteretic state.

A term is written once, as the text that stands in the law's file. The same text is evaluated along
measured runs when terms are selected.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...effects import Effect, EffectParameter, Signals
from ...identification.measured_runs import MeasuredRuns
from ...laws.law import Quantity
from ..device.effect_evaluation import evaluate

_PLAY_LAG = 2e-3
"""s: within which a play state follows the edge of its gap."""
_STEP, _MOST_STEPS = 0.3, 64
"""Motion in one step over the deformation at which a state yields, and steps a sample at most."""


@dataclass(frozen=True)
class Number:
    """A number inside a term.

    Attributes
    ----------
    symbol, unit, meaning : str
        Its expression, SI unit and meaning.
    value : float
        In ``unit``.
    least, most : float
        Bounds, in ``unit``.
    """

    symbol: str
    unit: str
    meaning: str
    value: float
    least: float = 0.0
    most: float = np.inf


@dataclass(frozen=True)
class Term:
    """A function of the motion, to be multiplied by a coefficient."""

    # As it is printed; its numbers' symbols, and ``s`` for its state, stand for themselves
    text: str
    code: str  # As Python code of ``x``, ``v``, ``s``, ``i`` and its numbers' symbols
    unit: str  # SI unit of its coefficient
    numbers: tuple[Number, ...] = ()  # Numbers inside the term, all positive but a position
    rate: str = ""  # Python code of the state's time derivative; empty where there is no state
    state_unit: str = "m"  # SI unit of the state
    current: bool = False  # Whether its state follows the current, ``i`` in ``rate``
    cause: str = ""  # Cause of the catalogue that it is a form of

    @property
    def title(self) -> str:
        """Text and numbers."""
        values = ", ".join(f"{n.symbol} = {n.value:.3g} {n.unit}" for n in self.numbers)
        return f"{self.text} ({values})" if values else self.text


_STATIC = (
    ("1", "1.0 + 0.0 * x", "N"),
    ("x", "x", "N/m"),
    ("x |x|", "x * np.fabs(x)", "N/m^2"),
    ("x^2", "x**2", "N/m^2"),
    ("x^3", "x**3", "N/m^3"),
    ("x^5", "x**5", "N/m^5"),
    ("v", "v", "N s/m"),
    ("|v|", "np.fabs(v)", "N s/m"),
    ("v^2", "v**2", "N s^2/m^2"),
    ("v |v|", "v * np.fabs(v)", "N s^2/m^2"),
    ("v^3", "v**3", "N s^3/m^3"),
    ("|x| v", "np.fabs(x) * v", "N s/m^2"),
    ("x v", "x * v", "N s/m^2"),
    ("x^2 v", "x**2 * v", "N s/m^3"),
    ("x |v|", "x * np.fabs(v)", "N s/m^2"),
    ("x v^2", "x * v**2", "N s^2/m^3"),
)
_WIDEST_GAP = 0.8
"""Half of a gap over the largest deformation, at most: one that never closes is none."""
_PLAY = f"((x - s - r) * (x - s > r) + (x - s + r) * (x - s < -r)) / {_PLAY_LAG}"
# text, rate of the state, its numbers, the largest length over the largest deformation, and cause
_MEMORY = (
    ("relaxation s' = v - s/t", "v - s / t", "t", np.inf, "extra_relaxation"),
    ("friction s' = v - |v| s/r", "v - np.fabs(v) * s / r", "r", np.inf, "coulomb_friction"),
    ("Bouc-Wen s' = v - |v| s |s|/r^2", "v - np.fabs(v) * s * np.fabs(s) / r**2", "r", np.inf, ""),
    ("flow s' = v - w sinh(s/r)", "v - w * np.sinh(s / r)", "rw", np.inf, ""),
    ("play of x over r", _PLAY, "r", _WIDEST_GAP, ""),
)
_AT_POSITION = (
    ("s x", "s * x", "N/m^2"),
    ("s x |x|", "s * x * np.fabs(x)", "N/m^3"),
    ("s |x|", "s * np.fabs(x)", "N/m^2"),
    ("s x^2", "s * x**2", "N/m^3"),
)
"""Friction that grows along the stroke, or towards its ends, with the state's code and unit."""
_SLIPPING = ("friction", "Bouc-Wen")
"""States of such a friction."""
_SLIP = "u - g sgn u where |u| > g, u = x - s, s play of x over r"
_BEYOND = "(x - s - g) * (x - s > g) + (x - s + g) * (x - s < -g)"
_SLIPS = (0.1, 0.2, 0.4)
"""Half of a gap that is dragged along, over the largest deformation."""
_ACCELERATION = "(v - s) / t"
_INERTIA = (
    ("a", _ACCELERATION, "N s^2/m"),
    ("a^2", f"({_ACCELERATION})**2", "N s^4/m^2"),
    ("a |a|", f"{_ACCELERATION} * np.fabs({_ACCELERATION})", "N s^4/m^2"),
)
_FLUX = "(i - s) / t"
_CURRENT_RATE = (
    ("dI/dt", _FLUX, "N s/A"),
    ("x dI/dt", f"x * {_FLUX}", "N s/A/m"),
    ("v dI/dt", f"v * {_FLUX}", "N s^2/A/m"),
)
_BUMP_WIDTH = 0.15
"""Width of a bump or a step over the largest deformation; they stand as far from each other."""
_BUMPS = tuple(_BUMP_WIDTH * k for k in range(-6, 7))
_WELLS = (0.1, 0.2, 0.4)
"""Width of a change of stiffness around the centre, over the largest deformation."""
_RIPPLES = (("sin(x/r)", "np.sin(x / r)"), ("1 - cos(x/r)", "1.0 - np.cos(x / r)"))
_WAVES = tuple(range(4, 65, 2))
"""Phase of a ripple at the largest deformation, rad: neighbours overlap."""
_LENGTHS = (0.003, 0.01, 0.03, 0.1, 0.3)
_SPEEDS = (0.01, 0.03, 0.1, 0.3)
_TIMES = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0)
_FAST = 0.03
"""Time over which the acceleration is taken, over that of the motion: laws do not know it."""
_CHANGING = 0.05
"""Range of a run's current over the largest from which it changes. Convention."""
_LEAST_SAMPLES = 2.0
"""Samples over which the rate of the current is taken, at least."""
_MEANINGS = {
    "r": ("m", "characteristic deformation"),
    "g": ("m", "deformation from which it acts"),
    "w": ("m/s", "velocity at which it saturates"),
    "t": ("s", "relaxation time"),
    "b": ("m", "position"),
}


def _numbers(
    least: float = 0.0, most: float = np.inf, **values: float
) -> tuple[Number, ...]:  # fmt: skip
    bounds = least, most
    return tuple(Number(name, *_MEANINGS[name], value, *bounds) for name, value in values.items())


def library(data: MeasuredRuns) -> tuple[Term, ...]:
    """Candidate terms, their numbers at characteristic scales of the data."""
    x, v = float(np.max(np.abs(data.x))), float(np.max(np.abs(data.v)))
    terms = [*_library(x, v)]
    if any(np.ptp(data.current[run]) > _CHANGING * np.max(data.current) for run in data.runs):
        terms += _current_terms(x / v, _LEAST_SAMPLES * float(np.median(data.dt)))
    return tuple(terms)


def _current_terms(time: float, least: float) -> Iterator[Term]:
    """Terms in the rate of the current, which is taken over a short time, s."""
    for share in _TIMES[:4]:
        for text, code, unit in _CURRENT_RATE:
            yield Term(
                f"{text}, dI/dt = s' = (I - s)/t", code, unit,
                _numbers(least, t=max(share * time, least)), _FLUX, "A", True,
            )  # fmt: skip


def _library(x: float, v: float) -> Iterator[Term]:
    yield from (Term(*one) for one in _STATIC)
    for share in _SPEEDS:
        for name in ("tanh", "arcsinh"):
            yield Term(
                f"{name}(v/w)", f"np.{name}(v / w)", "N", _numbers(w=share * v),
                cause="coulomb_friction" * (name == "tanh"),
            )  # fmt: skip
    for share in _BUMPS:
        u = "(x - b) / r"
        yield Term(
            "u exp(-u^2/2), u = (x - b)/r", f"{u} * np.exp(-0.5 * ({u})**2)", "N",
            _numbers(b=share * x, r=_BUMP_WIDTH * x),
        )  # fmt: skip
        yield Term(
            "exp(-u^2/2), u = (x - b)/r", f"np.exp(-0.5 * ({u})**2)", "N",
            _numbers(b=share * x, r=_BUMP_WIDTH * x),
        )  # fmt: skip
        yield Term(
            "exp(-u^2/2) tanh(v/w), u = (x - b)/r", f"np.exp(-0.5 * ({u})**2) * np.tanh(v / w)",
            "N", _numbers(b=share * x, r=_BUMP_WIDTH * x, w=_SPEEDS[1] * v),
        )  # fmt: skip
        yield Term(
            "tanh((x - b)/r)", "np.tanh((x - b) / r)", "N",
            _numbers(b=share * x, r=_BUMP_WIDTH * x),
        )  # fmt: skip
    for share in _WELLS:
        yield Term(
            "x exp(-(x/r)^2/2)", "x * np.exp(-0.5 * (x / r)**2)", "N/m", _numbers(r=share * x)
        )
    for text, code in _RIPPLES:
        for waves in _WAVES:
            yield Term(text, code, "N", _numbers(r=x / waves))
    for text, code, unit in _INERTIA:
        yield Term(
            f"{text}, a = s' = (v - s)/t", code, unit, _numbers(t=_FAST * x / v), _ACCELERATION,
            "m/s", cause="inertia_force" * (text == "a"),
        )  # fmt: skip
    for text, rate, symbols, widest, cause in _MEMORY:
        if symbols == "t":
            choices = [_numbers(t=t * x / v) for t in _TIMES]
        elif symbols == "r":
            choices = [_numbers(most=widest * x, r=share * x) for share in _LENGTHS]
        else:
            choices = [
                _numbers(r=r * x, w=w * v) for r in _LENGTHS[:-1] for w in _SPEEDS[:-1]
            ]  # fmt: skip
        for numbers in choices:
            yield Term(f"s, {text}", "s", "N/m", numbers, rate, cause=cause)
            if text.startswith(_SLIPPING):
                for name, code, unit in _AT_POSITION:
                    yield Term(f"{name}, {text}", code, unit, numbers, rate)
    for share in _SLIPS:
        r = share * x
        numbers = _numbers(most=_WIDEST_GAP * x, r=r, g=r / 2)
        yield Term(_SLIP, _BEYOND, "N/m", numbers, _PLAY)


def along(term: Term, data: MeasuredRuns) -> NDArray:
    """Value of a term at every sample, (n_samples,), in SI units."""
    values = {n.symbol: n.value for n in term.numbers}
    known = {"x": data.x, "v": data.v, "i": data.current, **values}
    if term.rate:
        known["s"] = _state(term, data)
    with np.errstate(all="ignore"):
        return run(term.code, known) + np.zeros(len(data.x))


def _state(term: Term, data: MeasuredRuns) -> NDArray:
    """State of a term along runs, between whose samples the motion is a straight line."""
    length = min((n.value for n in term.numbers if n.symbol == "r"), default=np.inf)
    # powers of two, so that many terms share one grid
    steps = np.clip(np.max(_moved(data)) / (_STEP * length), 1, _MOST_STEPS)
    fine, every = _finer(data, 2 ** int(np.ceil(np.log2(steps))))
    effect = _state_alone(term.rate, tuple(n.symbol for n in term.numbers), term.current)
    numbers = np.array([n.value for n in term.numbers])
    state = evaluate(effect, fine, np.zeros(len(fine.x)), numbers)["force"]
    runs = zip(pairwise(fine.starts), every, strict=True)
    return np.concatenate([state[a:b:m] for (a, b), m in runs])


@lru_cache(maxsize=4)
def _finer(data: MeasuredRuns, most: int) -> tuple[MeasuredRuns, list[int]]:
    """Runs along straight lines, and the steps a sample of each: fewer in slower runs."""
    moved = _moved(data)
    slower = np.log2(np.max(moved) / np.maximum(moved, np.max(moved) / most)).astype(int)
    every = most // 2**slower
    grids = [np.arange(m * (n - 1) + 1) / m for n, m in zip(data.lengths, every, strict=True)]
    ends = np.concatenate([[0], np.cumsum([len(grid) for grid in grids])])

    def finer(values: NDArray) -> NDArray:
        parts = zip(data.runs, grids, strict=True)
        return np.concatenate([
            np.interp(grid, np.arange(run.stop - run.start), values[run]) for run, grid in parts
        ])  # fmt: skip

    x = finer(data.x)
    nothing = np.zeros(len(x))
    fine = replace(
        data, starts=ends, dt=data.dt / every, x=x, v=finer(data.v), a=nothing,
        current=finer(data.current), temperature=nothing,
    )  # fmt: skip
    return fine, every.tolist()


def _moved(data: MeasuredRuns) -> NDArray:
    """Largest motion in one sample of each run, m."""
    return np.array([float(np.max(np.abs(data.v[run]))) for run in data.runs]) * data.dt


def run(code: str, known: dict[str, Any]) -> Any:
    """Evaluate a term's code, which is this module's own text."""
    return eval(code, {"np": np, "__builtins__": {}}, known)


@lru_cache(maxsize=64)
def _state_alone(rate: str, symbols: tuple[str, ...], current: bool) -> Effect:
    """An effect whose force is a term's state, so that it is simulated as effects are."""

    def rates(signals: Signals, states: tuple, parameters: tuple) -> tuple:
        known = {"x": signals.x, "v": signals.v, "i": signals.current, "s": states[0]}
        return (run(rate, known | dict(zip(symbols, parameters, strict=True))),)

    return Effect(
        cause="term",
        form=rate,
        title="State of a term",
        parameters=tuple(EffectParameter(s, _MEANINGS[s][0], _MEANINGS[s][1]) for s in symbols),
        states=(Quantity("s", "m", "state"),),
        rates=rates,
        start=(lambda signals, parameters: (signals.current,)) if current else None,
        force=lambda signals, states, parameters: states[0],
    )
