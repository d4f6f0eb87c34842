"""Text of the compiled kernel of a law under measured motion: a copy of ``device_kernel.py``.

This module imports only what the text depends on: a kernel is named by all of it, and is compiled
again if any of it changes.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from types import ModuleType
from typing import Any

from ...compilation.generated import in_cache, load_written, name_of_content
from ...compilation.kernel_text import assigned, kernel_text
from ...errors import InputError
from ...laws.emit import function_text, straight_line, symbols
from ...laws.fingerprint import fingerprint
from ...laws.law import Law

_ZERO = "0.0"
"""As ``straight_line`` writes what is always zero."""


@lru_cache(maxsize=64)
def compiled(law: Law, stiff: bool = False) -> ModuleType:
    """Compiled simulation of a law under measured motion, with its derivatives."""
    if law.unit:
        raise InputError(
            f"{law.unit}: a functional mock-up unit is no arithmetic; expected here: a law"
        )
    kind = "stiff" if stiff else "device"
    return load_written(kind, fingerprint(law), lambda: _text(law, stiff))


def is_compiled(law: Law) -> bool:
    """Whether the simulation of a law is in the cache folder."""
    content = fingerprint(law)
    return content is not None and in_cache(name_of_content("device", content, _text), "simulate")


def _begin(
    law: Law, names: list[str], parameters: list, unpack: list[str]
) -> tuple[list[str], set[tuple[int, int]]]:
    """Statements that set the states at rest; states and the parameters that move them there."""
    import casadi

    n, n_parameters = len(law.states), len(parameters)
    if not n:
        return ["return"], set()
    rest = (0.0,) * n if law.rest is None else law.rest(tuple(parameters))
    values = casadi.SX(casadi.vertcat(*rest))
    by = casadi.jacobian(values, casadi.vertcat(*parameters))
    places = [(i, j) for i in range(n) for j in range(n_parameters)]
    results = [*casadi.vertsplit(values), *(by[i, j] for i, j in places)]
    named = dict(zip(names, parameters, strict=True))
    _, _, statements, texts = straight_line(named, results)
    slopes = dict(zip(places, texts[n:], strict=True))
    return [
        *(unpack if law.rest else ()),
        *statements,
        *(f"s[{i}] = {texts[i]}" for i in range(n)),
        *(f"by[{i}, {n + j}] = {one}" for (i, j), one in slopes.items()),
        "return",
    ], {place for place, one in slopes.items() if one != _ZERO}


def _slopes(
    entries: list[str], moved: set[tuple[int, int]], n: int, n_parameters: int
) -> list[str]:
    """Statements that carry the states' derivatives over a step; those that are 0 stay as they are.

    ``entries``: derivatives of the new states by the old ones and the parameters, row by row.
    """
    by = {divmod(k, n + n_parameters): one for k, one in enumerate(entries) if one != _ZERO}
    body = []
    for j in range(n_parameters):
        rows = {i for i in range(n) if (i, j) in moved or (i, n + j) in by}
        while more := {i for i in range(n) for m in rows if (i, m) in by} - rows:
            rows |= more
        body += [f"old{i} = slope[{i}, k, {j}]" for i in sorted(rows)]
        for i in sorted(rows):
            terms = [f"{by[i, m]} * old{m}" for m in sorted(rows) if (i, m) in by]
            terms += [f"{by[i, n + j]} * power"] if (i, n + j) in by else []
            body.append(f"slope[{i}, k, {j}] = {' + '.join(terms) or _ZERO}")
    body = ["power = powers[k]", *body]
    return ["for k in range(carried):", *(f"    {line}" for line in body)]


def _text(law: Law, stiff: bool) -> str:
    """Source of the kernel: the law's response and its step, differentiated by CasADi."""
    import casadi

    from . import device_kernel, law_functions, run_walk

    n, n_parameters = len(law.states), len(law.parameters)
    s_names, p_names = [f"s{i}" for i in range(n)], [f"p{k}" for k in range(n_parameters)]
    s, p = symbols(s_names), symbols(p_names)
    x, v = symbols(["x", "v"])
    force = law.force(x, v, tuple(s), tuple(p))
    by_force = [casadi.gradient(force, symbol) for symbol in (*s, *p)]
    unpack = [f"{name} = s[{i}]" for i, name in enumerate(s_names)]
    unpack += [f"{name} = parameters[{k}]" for k, name in enumerate(p_names)]
    named = dict(zip(["x", "v", *s_names, *p_names], [x, v, *s, *p], strict=True))
    _, _, alone, (response,) = straight_line(named, [force])
    _, _, with_slopes, results = straight_line(named, [force, *by_force])
    with_slopes += [f"by[0, {i}] = {value}" for i, value in enumerate(results[1:])]
    begin, moved = _begin(law, p_names, p, unpack[n:])
    blocks = [
        "from isolation_sim.compilation.options import inline, math",
        assigned({"N_STATES": n, "N_PARAMETERS": n_parameters}),
        function_text("begin", "s, parameters, by", begin),
        function_text(
            "respond", "x, v, s, parameters", [*unpack, *alone, f"return {response}"], doc="Force."
        ),
        function_text(
            "respond_with_slopes",
            "x, v, s, parameters, by",
            [*unpack, *with_slopes, f"return {results[0]}"],
            doc="Force; by gets its derivatives by the states and the parameters.",
        ),
    ]
    times = ["xa", "va", "xm", "vm", "xb", "vb", "h"]
    alone = with_slopes = ["pass"]
    if n:
        places = symbols(times)

        def rates(x, v, state):
            return law.rates(x, v, tuple(state), tuple(p))

        new = (_rosenbrock if stiff else _runge_kutta)(rates, s, places)
        named = dict(zip([*times, *s_names, *p_names], [*places, *s, *p], strict=True))
        by = casadi.jacobian(casadi.vertcat(*new), casadi.vertcat(*s, *p))
        entries = [by[i, j] for i in range(n) for j in range(n + n_parameters)]
        # parameters are hoisted for their reciprocals: a division costs several products
        hoisted, _, statements, results = straight_line(named, new, p_names)
        stored = [f"s[{i}] = {value}" for i, value in enumerate(results)]
        alone = [*unpack, *hoisted, *statements, *stored]
        hoisted, _, statements, results = straight_line(named, [*new, *entries], p_names)
        with_slopes = [
            "s, parameters, powers, slope = work.s, work.parameters, work.powers, work.slope",
            *unpack,
            *hoisted,
            *statements,
            *_slopes(results[n:], moved, n, n_parameters),
            *(f"s[{i}] = {results[i]}" for i in range(n)),
        ]
    motion = ", ".join(times)
    blocks.append(function_text("step_alone", f"{motion}, s, parameters", alone))
    blocks.append(function_text("step_with_slopes", f"{motion}, carried, work", with_slopes))
    return kernel_text([run_walk, device_kernel], {law_functions: "\n\n".join(blocks)})


def _runge_kutta(rates: Callable[..., tuple], s: list, places: list) -> list:
    """States after a classical Runge-Kutta step."""
    xa, va, xm, vm, xb, vb, h = places
    k1 = rates(xa, va, s)
    k2 = rates(xm, vm, [a + h / 2 * b for a, b in zip(s, k1, strict=True)])
    k3 = rates(xm, vm, [a + h / 2 * b for a, b in zip(s, k2, strict=True)])
    k4 = rates(xb, vb, [a + h * b for a, b in zip(s, k3, strict=True)])
    return [
        a + h / 6 * (b + 2 * c + 2 * d + e) for a, b, c, d, e in zip(s, k1, k2, k3, k4, strict=True)
    ]


def _rosenbrock(rates: Callable[..., tuple], s: list, places: list) -> list:
    """States after a Rosenbrock step for stiff laws."""
    # Rodas3, four stages, third order, stiffly accurate (Sandu et al., Atmospheric Environment 31,
    # 1997): a state far faster than the step follows the motion. The rates' change with time is
    # that of the parabola through beginning, middle and end; no derivative by the velocity, which
    # is open where it reverses.
    import casadi

    xa, va, xm, vm, xb, vb, h = places
    state = casadi.vertcat(*s)

    def slopes(x: Any, v: Any, at: Any) -> Any:
        return h * casadi.vertcat(*rates(x, v, casadi.vertsplit(at)))

    first = slopes(xa, va, state)
    drift = 4 * slopes(xm, vm, state) - 3 * first - slopes(xb, vb, state)
    matrix = casadi.SX.eye(len(s)) - casadi.jacobian(first, state) / 2

    def solved(right: Any) -> Any:
        if matrix.sparsity().is_diag():
            return right / 2 / casadi.diag(matrix)
        return casadi.solve(matrix, right / 2)

    k1 = solved(first + drift / 2)
    k2 = solved(first + 4 * k1 + 1.5 * drift)
    k3 = solved(slopes(xb, vb, state + 2 * k1) + k1 - k2)
    k4 = solved(slopes(xb, vb, state + 2 * k1 + k3) + k1 - k2 - 8 / 3 * k3)
    return casadi.vertsplit(state + 2 * k1 + k3 + k4)
