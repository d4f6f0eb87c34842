"""An effect along measured runs: its functions, compiled once whatever law they stand around.

Motion, current and force of a test are known at every sample, so that an effect can be evaluated
by itself, one after another, before or after the law. Without states that is NumPy's work. States
take one compiled Rosenbrock step a sample (two stages, second order, L-stable), since an effect's
lag may be far shorter than a sample.
"""

from __future__ import annotations

from functools import lru_cache, reduce
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...compilation.kernel_text import assigned, kernel_text
from ...effects import Effect, Signals
from ...generated import load_written
from ...identification.measured_runs import MeasuredRuns
from ...identification.run_starts import lead_in
from ...laws.emit import function_text, straight_line, symbols
from .carried_history import after_rests, first_states, has_unknown_starts

_KINK = 0.5
"""Change of a state's decay rate times the step, above which its rate has a kink in the step."""
_STEPS_TO_START = 3
"""Steps to the unknown state at the start of a run. Convergence: the last one changes it by 2 %."""
HOOKS = ("motion", "current", "factor", "force")


def evaluate(
    effect: Effect,
    data: MeasuredRuns,
    force: NDArray,
    parameters: NDArray,
    motion: tuple[NDArray, NDArray] | None = None,
    current: NDArray | None = None,
) -> dict[str, Any]:
    """Evaluate an effect along runs, under the law's ``force`` (N)."""
    # ``motion`` (m, m/s) and ``current`` (A) may take the place of the measured ones. Returned are,
    # by function, "motion" (2, n_samples), "current", "factor" and "force" (n_samples,).
    x, v = (data.x, data.v) if motion is None else motion
    current = data.current if current is None else current
    if not effect.states:
        signals = Signals(x, v, data.a, current, force, data.temperature)
        return _at_once(effect, signals, tuple(parameters))
    first = np.zeros((len(data.starts) - 1, len(effect.states)))
    # a slow effect begins at the first sample: before it the device may have rested for long
    periods = np.zeros_like(data.periods) if effect.gradual else data.periods
    ahead = lead_in(data.starts, data.dt, periods, x)
    if effect.start is not None:
        for run, k in enumerate(data.starts[:-1] + ahead.lead):
            signals = Signals(x[k], v[k], data.a[k], current[k], force[k], data.temperature[k])
            first[run] = effect.start(signals, tuple(parameters))
    rows = [name for name in HOOKS for _ in range(_width(effect, name))]
    out = np.empty((len(rows), len(x)))

    def trajectory(first: NDArray) -> None:
        _compiled(effect).trajectory(
            data.starts, data.dt, *ahead, x, v, data.a, current, force, data.temperature,
            np.ascontiguousarray(parameters, float), first, np.zeros(len(effect.states)), out,
        )  # fmt: skip

    if has_unknown_starts(effect) and data.past is not None:
        for _ in range(_STEPS_TO_START):
            trajectory(first)
            factor = out[rows.index("factor")]
            first = after_rests(effect, data, force, factor, first, parameters)
    else:
        first = first_states(effect, data, first, parameters)
    trajectory(first)
    return {
        name: out[:2] if name == "motion" else out[rows.index(name)] for name in dict.fromkeys(rows)
    }


def _at_once(effect: Effect, signals: Signals, parameters: tuple) -> dict[str, Any]:
    """An effect without states, at all samples."""
    result = {}
    with np.errstate(all="ignore"):
        for hook in HOOKS:
            function = getattr(effect, hook)
            if function is not None:
                value = function(signals, (), parameters)
                result[hook] = value if hook == "motion" else value + np.zeros_like(signals.x)
    return result


def _width(effect: Effect, hook: str) -> int:
    if getattr(effect, hook) is None:
        return 0
    return 2 if hook == "motion" else 1


@lru_cache(maxsize=256)
def _compiled(effect: Effect) -> ModuleType:
    return load_written("effect", None, lambda: _text(effect))


def _text(effect: Effect) -> str:
    """Source of the kernel: the effect's functions and the Rosenbrock step of its states."""
    import casadi

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
    unpack = [f"{name} = s[{i}]" for i, name in enumerate(z_names)]
    unpack += [f"{name} = parameters[{k}]" for k, name in enumerate(p_names)]
    named = dict(zip([*names, *z_names, *p_names], [*signals, *z, *p], strict=True))
    _, _, statements, results = straight_line(named, outputs)
    arguments = ", ".join(names)
    respond = [*unpack, *statements, *(f"out[{i}, k] = {r}" for i, r in enumerate(results))]
    ends = [f"{name}_{end}" for end in (0, 1) for name in names]
    both, (h,) = symbols(ends), symbols(["h"])
    begin, end = Signals(*both[: len(names)]), Signals(*both[len(names) :])
    named = dict(zip([*ends, "h", *z_names, *p_names], [*both, h, *z, *p], strict=True))
    new = _rosenbrock(effect, begin, end, h, z, tuple(p))
    _, _, statements, results = straight_line(named, new)
    step = [*unpack, *statements, *(f"s[{i}] = {r}" for i, r in enumerate(results))]
    functions = [
        "from isolation_sim.compilation.options import exact, math",
        assigned({"N_STATES": len(effect.states)}),
        function_text("respond", f"{arguments}, s, parameters, out, k", respond, "@exact"),
        function_text("step", f"{', '.join(ends)}, h, s, parameters", step, "@exact"),
    ]
    return kernel_text([effect_kernel], {effect_functions: "\n\n".join(functions)})


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
