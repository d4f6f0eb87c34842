"""Check whether a user's law can be traced and differentiated; the error names the reason."""

from __future__ import annotations

import ast
import inspect
import linecache
import textwrap
import traceback
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ground_motions.python_source import parse

from ..errors import InputError
from .emit import symbols
from .law import Law

_INSTEAD = {
    "if": "a comparison as a multiplier, such as (x > 0) * k * x",
    "and, or, not": "products of comparisons, such as (x > 0) * (v > 0)",
    "max": "np.fmax(a, b), or (a + b + np.fabs(a - b)) / 2",
    "min": "np.fmin(a, b), or (a + b - np.fabs(a - b)) / 2",
    "math": "the NumPy function of the same name",
    "where": "a comparison as a multiplier, such as (x > 0) * a + (x <= 0) * b",
    "list": "one expression, or several in round brackets",
    "clip": "np.fmin(np.fmax(x, low), high)",
}
_CALLS = {
    "max": "max", "maximum": "max", "min": "min", "minimum": "min", "where": "where",
    "clip": "clip",
}  # fmt: skip
_POINTS = 5


@lru_cache(maxsize=256)
def check_traceable(law: Law) -> None:
    """Refuse a law outside this package whose functions CasADi cannot follow, naming the line."""
    functions = {"force": law.force, "rates": law.rates, "stored_energy": law.stored_energy}
    # of a law with effects, the functions are ours and call those of the effects
    inner = [
        function
        for effect in getattr(law, "effects", ())
        for function in (
            effect.motion, effect.current, effect.time_scale, effect.factor, effect.force,
            effect.rates,
        )
        if function is not None and not _is_ours(function)
    ]  # fmt: skip
    for name, function in functions.items():
        if function is not None and (inner or not _is_ours(function)):
            _check(law, name, function, inner or [function])


def _is_ours(function: Callable[..., Any]) -> bool:
    return getattr(function, "__module__", "").partition(".")[0] == __name__.partition(".")[0]


def _check(
    law: Law, name: str, function: Callable[..., Any], suspects: Sequence[Callable[..., Any]]
) -> None:
    import casadi

    states, parameters = law.state_names, law.parameter_names
    with_velocity = name != "stored_energy"
    each = law.directions
    n = each * (1 + with_velocity)
    variables = symbols([*["x"] * each, *["v"] * (n - each), *states, *parameters])

    def arguments(values: Any) -> tuple:
        motion = [tuple(values[k : k + each]) for k in range(0, n, each)]
        own = [pair[0] for pair in motion] if each == 1 else motion
        return *own, tuple(values[n : n + len(states)]), tuple(values[n + len(states) :])

    random = np.random.default_rng(0)

    def numbers() -> NDArray:
        point = random.uniform(-1, 1, len(variables))
        point[n + len(states) :] = [_inside(q, random) for q in law.parameters]
        return point

    try:
        with np.errstate(all="ignore"):
            function(*arguments([*numbers()]))
    except Exception as error:
        raise _own_error(law, name, error) from None
    try:
        value = function(*arguments(variables))
        if isinstance(value, list):
            raise TypeError("a list")
        traced = casadi.SX(casadi.vertcat(*_as_list(value)))
        compiled = casadi.Function("law", variables, [traced])
    except Exception as error:
        raise _error(law, name, suspects, error) from None
    for _ in range(_POINTS):
        point = numbers()
        with np.errstate(all="ignore"):
            direct = np.array(_as_list(function(*arguments([*point]))), float).ravel()
        result = np.array(compiled(*point)).ravel()
        if not np.allclose(result, direct, rtol=1e-9, atol=0.0, equal_nan=True):
            raise _error(law, name, suspects, None)


@lru_cache(maxsize=256)
def check_differentiable(law: Law, deformation: float = 0.0, velocity: float = 0.0) -> None:
    """Refuse a law whose derivatives by states at rest or by parameters are not numbers."""
    import casadi

    check_traceable(law)
    own, n = (*law.state_names, *law.parameter_names), len(law.states)
    x, v, *variables = symbols(["x", "v", *own])
    random = np.random.default_rng(0)
    numbers = tuple(_inside(q, random) for q in law.parameters)
    rest = (0.0,) * n if law.rest is None else law.rest(numbers)
    point = (deformation, velocity, *rest, *numbers)
    for name, function in (("force", law.force), ("rates", law.rates)):
        value = _as_list(function(x, v, tuple(variables[:n]), tuple(variables[n:])))
        by = casadi.jacobian(casadi.SX(casadi.vertcat(*value)), casadi.vertcat(*variables))
        at_rest = np.array(casadi.Function("by", [x, v, *variables], [by])(*point))
        wrong = [own[k] for k in np.flatnonzero(~np.isfinite(at_rest).all(axis=0))]
        if wrong:
            raise InputError(
                f"law {law.name!r}: no derivative of the {name} by {', '.join(wrong)} at rest, for "
                "fits and predictions; expected: 1e-300 added to a square whose power, root or "
                "logarithm is taken, such as (z * z + 1e-300) ** (n / 2) for |z| ** n"
            )


def _inside(quantity: Any, random: np.random.Generator) -> float:
    low = quantity.lower if np.isfinite(quantity.lower) else -1.0
    high = quantity.upper if np.isfinite(quantity.upper) else low + 2.0
    return float(random.uniform(low, high))


def _as_list(value: Any) -> list[Any]:
    return list(value) if isinstance(value, tuple) else [value]


def _own_error(law: Law, name: str, error: Exception) -> InputError:
    """The error that a function raises with numbers, and its line."""
    at = traceback.extract_tb(error.__traceback__)[-1]
    return InputError(
        f"law {law.name!r}: {at.filename}:{at.lineno}: {at.line!r} in {name}: "
        f"{type(error).__name__}: {error}"
    )


def _error(
    law: Law, name: str, suspects: Sequence[Callable[..., Any]], error: Exception | None
) -> InputError:
    """The line that cannot be traced, and its replacement."""
    place, line, instead = next(filter(any, map(_suspect, suspects)), ("", "", ""))
    if not place:
        reason = "other numbers than with NumPy" if error is None else type(error).__name__
        own = {each.__code__.co_filename for each in suspects if hasattr(each, "__code__")}
        frames = traceback.extract_tb(error.__traceback__) if error else []
        at = next((each for each in reversed(frames) if each.filename in own), None)
        where = f"{at.filename}:{at.lineno}: {at.line!r} in {name}" if at else name
        return InputError(
            f"law {law.name!r}: {where} cannot be traced ({reason}); expected: + - * / **, "
            "comparisons as multipliers and NumPy's elementary functions, of single states: "
            "(z,) = states"
        )
    return InputError(
        f"law {law.name!r}: {place}: {line!r} cannot be traced in {name}; expected: {instead}"
    )


def _suspect(function: Callable[..., Any]) -> tuple[str, str, str]:
    """Place, text and remedy of the first line with something that cannot be traced."""
    try:
        text, first = inspect.getsourcelines(function)
        tree = parse(textwrap.dedent("".join(text)))
    except (OSError, TypeError, SyntaxError):
        return "", "", ""
    file = inspect.getsourcefile(function) or "?"
    for number, what in sorted(_untraceable(tree)):
        at = first + number - 1
        return f"{file}:{at}", linecache.getline(file, at).strip(), _INSTEAD[what]
    return "", "", ""


def _untraceable(tree: ast.AST) -> Iterator[tuple[int, str]]:
    for node in ast.walk(tree):
        if isinstance(node, ast.If | ast.IfExp | ast.While):
            yield node.lineno, "if"
        elif isinstance(node, ast.Return) and isinstance(node.value, ast.List):
            yield node.lineno, "list"
        elif isinstance(node, ast.BoolOp) or (
            isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not)
        ):
            yield node.lineno, "and, or, not"
        elif isinstance(node, ast.Call):
            function = node.func
            if isinstance(function, ast.Name) and function.id in _CALLS:
                yield node.lineno, _CALLS[function.id]
            elif isinstance(function, ast.Attribute):
                if isinstance(function.value, ast.Name) and function.value.id == "math":
                    yield node.lineno, "math"
                elif function.attr in _CALLS:
                    yield node.lineno, _CALLS[function.attr]
