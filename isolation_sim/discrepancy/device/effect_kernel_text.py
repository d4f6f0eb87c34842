"""Text of the compiled kernel of an effect: its functions in a copy of ``effect_kernel.py``.

This module imports only what the text depends on: a kernel is named by all of it, and is compiled
again if any of it changes.
"""

from __future__ import annotations

import re
from functools import lru_cache, reduce
from types import ModuleType
from typing import Any

from ...compilation.generated import in_cache, load_written, name_of_content
from ...compilation.kernel_text import assigned, kernel_text
from ...effects import Effect, Signals
from ...laws.emit import function_text, straight_line, symbols
from ...laws.fingerprint import fingerprint

_KINK = 0.5
"""Change of a state's decay rate times the step, above which its rate has a kink in the step."""
HOOKS = ("motion", "current", "factor", "force")


@lru_cache(maxsize=256)
def compiled(effect: Effect) -> ModuleType:
    """Compiled trajectories of an effect's states, outputs and derivatives."""
    return load_written("effect", _fingerprint(effect), lambda: _text(effect))


@lru_cache(maxsize=256)
def _fingerprint(effect: Effect) -> str | None:
    sizes = [len(effect.states), len(effect.parameters), "force" in effect.needs]
    return fingerprint([*sizes, effect.rates, *(getattr(effect, hook) for hook in HOOKS)])


def is_compiled(effect: Effect, differentiated: bool) -> bool:
    """Whether an effect, or its derivatives, are in the cache folder, or need no compilation."""
    if not effect.states or (differentiated and "force" not in effect.needs):
        return True
    content = _fingerprint(effect)
    function = "trajectory_with_slopes" if differentiated else "trajectory"
    return content is None or in_cache(name_of_content("effect", content, _text), function)


def _text(effect: Effect) -> str:
    """Source of the kernel: the effect's functions and the Rosenbrock step of its states."""
    import casadi

    from ...identification.kernel import run_walk
    from . import effect_functions, effect_kernel

    z_names = [f"z{i}" for i in range(len(effect.states))]
    p_names = [f"p{k}" for k in range(len(effect.parameters))]
    z, p = symbols(z_names), symbols(p_names)
    names = list(Signals._fields)
    signals = symbols(names)
    here = Signals(*signals)
    outputs: list[Any] = []
    for hook in HOOKS:
        function = getattr(effect, hook)
        if function is not None:
            value = function(here, tuple(z), tuple(p))
            outputs += value if hook == "motion" else [value]
    outputs = [casadi.SX(value) for value in outputs]
    named = dict(zip([*names, *z_names, *p_names], [*signals, *z, *p], strict=True))
    ends = [f"{name}_{end}" for end in (0, 1) for name in names]
    both, (h,) = symbols(ends), symbols(["h"])
    begin, end = Signals(*both[: len(names)]), Signals(*both[len(names) :])
    new = _rosenbrock(effect, begin, end, h, z, tuple(p)) if z else []
    at_ends = dict(zip([*ends, "h", *z_names, *p_names], [*both, h, *z, *p], strict=True))

    def text(
        name: str, arguments: str, inputs: dict[str, Any], places: dict[str, str], values: list,
        stored: str, by: list,
    ) -> str:  # fmt: skip
        """Text of a function that stores values, and their derivatives in an array."""
        if not values:  # the step of an effect without states
            return function_text(name, arguments, ["return"], "@exact_inline")
        slopes = casadi.jacobian(casadi.vertcat(*values), casadi.vertcat(*by))
        entries = [(i, j) for i in range(len(values)) for j in range(len(by))]
        expressions = [*values, *(slopes[i, j] for i, j in entries)]
        _, _, statements, results = straight_line(inputs, expressions)
        last = [f"{stored.format(i)} = {one}" for i, one in enumerate(results[: len(values)])]
        derivatives = zip(entries, results[len(values) :], strict=True)
        last += [f"by[{i}, {j}] = {one}" for (i, j), one in derivatives]
        used = set(re.findall(r"\w+", " ".join([*statements, *results])))
        first = [f"{one} = {place}" for one, place in places.items() if one in used]
        body = [*first, *statements, *last, "return"]
        return function_text(name, arguments, body, "@exact_inline")

    unpack = {name: f"s[{i}]" for i, name in enumerate(z_names)}
    unpack |= {name: f"parameters[{k}]" for k, name in enumerate(p_names)}
    at_sample = {name: f"signals.{name}[k]" for name in names} | unpack
    in_step = {f"{name}_0": f"signals.{name}[k]" for name in names} | unpack
    in_step |= {f"{name}_1": f"signals.{name}[n]" for name in names}
    # only what follows the force has its derivatives carried along
    follows = "force" in effect.needs
    by_response = [*z, *p, here.force] if follows else []
    by_step = [*z, *p, begin.force, end.force] if follows else []
    responding = named, at_sample, outputs, "out[{}, k]"
    stepping = at_ends, in_step, new, "s[{}]"
    of_response, of_step = "signals, k, s, parameters, out", "signals, k, n, h, s, parameters"
    functions = [
        "from isolation_sim.compilation.options import exact_inline, math",
        assigned({"N_STATES": len(z), "N_PARAMETERS": len(p), "N_OUTPUTS": len(outputs)}),
        text("respond", of_response, *responding, []),
        text("step", of_step, *stepping, []),
        text("respond_with_slopes", f"{of_response}, by", *responding, by_response),
        text("step_with_slopes", f"{of_step}, by", *stepping, by_step),
    ]
    return kernel_text([run_walk, effect_kernel], {effect_functions: "\n\n".join(functions)})


def _rosenbrock(effect: Effect, begin: Signals, end: Signals, h: Any, z: list, p: tuple) -> list:
    """States after one step along which the signals are straight lines."""
    # Verwer's method of two stages with its term for signals that move: a state that is far faster
    # than a step ends where the signals do, as it should.
    import casadi

    from .effect_functions import GAMMA

    rates, states = effect.rates, casadi.vertcat(*z)
    assert rates is not None
    slope, slope_end = (casadi.vertcat(*rates(signals, tuple(z), p)) for signals in (begin, end))
    by_states, by_states_end = (casadi.jacobian(one, states) for one in (slope, slope_end))
    separate = by_states.sparsity().is_diag() or by_states.nnz() == 0

    def solved(right: Any) -> Any:
        if separate:
            return right / (1 - GAMMA * h * casadi.diag(by_states))
        return casadi.solve(casadi.SX.eye(len(z)) - GAMMA * h * by_states, right)

    drift = GAMMA * (slope_end - slope)
    first = solved(slope + drift)
    moved = states + h * first
    second = solved(
        casadi.vertcat(*rates(end, tuple(casadi.vertsplit(moved)), p)) - drift - 2 * first
    )
    new = states + h * (1.5 * first + 0.5 * second)
    if not separate:
        return casadi.vertsplit(new)
    # Where a follower of peaks takes hold or lets go within the step, the method may pass the peak,
    # which the follower never forgets. Implicit Euler does not.
    decays = [casadi.diag(by_states), casadi.diag(by_states_end)]
    decays += casadi.substitute([decays[1]], [states], [moved])
    fastest, slowest = (reduce(extreme, decays) for extreme in (casadi.fmin, casadi.fmax))
    euler = states + h * slope_end / (1 - h * fastest)
    return casadi.vertsplit(casadi.if_else(h * (slowest - fastest) > _KINK, euler, new))
