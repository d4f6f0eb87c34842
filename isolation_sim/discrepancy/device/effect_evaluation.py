"""An effect along measured runs: its functions, compiled once whatever law they stand around.

Motion, current and force of a test are known at every sample, so that an effect can be evaluated
by itself, one after another, before or after the law. Without states that is NumPy's work. States
take one compiled Rosenbrock step a sample (two stages, second order, L-stable), since an effect's
lag may be far shorter than a sample.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, reduce
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...compilation.kernel_text import assigned, kernel_text
from ...effects import Effect, Signals
from ...generated import in_cache, load_written, name_of_content
from ...identification.measured_runs import MeasuredRuns, measured_runs
from ...identification.run_table import TestRun
from ...laws.emit import function_text, straight_line, symbols
from ...laws.fingerprint import fingerprint
from .carried_history import RestSlopes, after_rests, by_inputs, first_states, has_unknown_starts
from .late_motion import late_motion

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
    if effect.delay is not None:
        late = float(effect.delay(tuple(parameters)))
        longest = max(max(abs(q.lower), abs(q.upper)) for q in effect.parameters if q.unit == "s")
        return {"motion": late_motion(data, x, v, late, longest)}
    current = data.current if current is None else current
    signals = Signals(x, v, data.a, current, force, data.temperature)
    if not effect.states:
        return _at_once(effect, signals, tuple(parameters))
    return _Runs(effect, data, signals, parameters).evaluate()


def differentiate(
    effect: Effect, data: MeasuredRuns, force: NDArray, parameters: NDArray, by_force: NDArray,
    own: int,
) -> tuple[dict[str, Any], dict[str, NDArray]]:  # fmt: skip
    """Evaluate an effect that follows the law's ``force`` (N), and its derivatives.

    Of the directions of ``by_force``, the force's own derivatives, (n_samples, n_directions), those
    from ``own`` on are the effect's parameters.
    """
    signals = Signals(data.x, data.v, data.a, data.current, force, data.temperature)
    return _Runs(effect, data, signals, parameters).differentiate(by_force, own)


class _Runs:
    """An effect along runs, through its compiled functions."""

    def __init__(
        self, effect: Effect, data: MeasuredRuns, signals: Signals, parameters: NDArray
    ) -> None:
        self.effect, self.data, self.signals = effect, data, signals
        self.parameters = np.ascontiguousarray(parameters, float)
        # a slow effect begins at the first sample: before it the device may have rested for long
        motion = data.motion
        if signals.x is not data.x:
            motion = replace(motion, displacement=signals.x)
        self.runs = motion.runs_at_rest if effect.gradual else motion.runs
        self.rows = [name for name in HOOKS for _ in range(_width(effect, name))]
        self.out = np.empty((len(self.rows), len(signals.x)))

    def evaluate(self) -> dict[str, Any]:
        first, _ = self._fresh()

        def follow(first: NDArray, slope: NDArray | None) -> NDArray | None:
            state = np.zeros(len(self.effect.states))
            _compiled(self.effect).trajectory(
                self.runs, self.signals, self.parameters, first, state, self.out
            )
            return None

        self._from_start(first, None, follow)
        return self._by_function(self.out)

    def differentiate(
        self, by_force: NDArray, own: int
    ) -> tuple[dict[str, Any], dict[str, NDArray]]:
        n, n_own, n_directions = len(self.effect.states), len(self.parameters), by_force.shape[1]
        by_out = np.empty((len(self.rows), *by_force.shape))
        state, new_slope = np.zeros(n), np.empty((n, n_directions))
        by = np.empty((max(n, len(self.rows)), n + n_own + 2))

        def follow(first: NDArray, slope: NDArray | None) -> NDArray | None:
            assert slope is not None
            _compiled(self.effect).trajectory_with_slopes(
                self.runs, self.signals, self.parameters, first, state, self.out, by_force, own,
                slope.copy(), new_slope, by, by_out,
            )  # fmt: skip
            return by_out

        first, by_signals = self._fresh()
        slope = np.zeros((*first.shape, n_directions))
        for run, (of_force, of_own) in enumerate(by_signals):
            slope[run] = of_force * by_force[self._at(run)]
            slope[run, :, own : own + n_own] += of_own
        self._from_start(first, (by_force, slope, own), follow)
        return self._by_function(self.out), self._by_function(by_out)

    def _from_start(
        self, first: NDArray, by: tuple[NDArray, Any, int] | None, follow: Callable[..., Any]
    ) -> None:
        """Follow each run from the states that the runs before have left, from fresh ones."""
        effect, data, force, p = self.effect, self.data, self.signals.force, self.parameters
        slope: Any
        slope, own = (None, 0) if by is None else by[1:]
        if has_unknown_starts(effect) and data.past is not None:
            place = self.rows.index("factor")
            for _ in range(_STEPS_TO_START):
                by_out = follow(first, slope)
                known = None if by is None else RestSlopes(by[0], by_out[place], slope, own)
                first, slope = after_rests(effect, data, force, self.out[place], first, p, known)
        else:
            first, slope = first_states(effect, data, first, p, slope, own)
        follow(first, slope)

    def _fresh(self) -> tuple[NDArray, list[tuple[NDArray, NDArray]]]:
        """First states of a fresh device in each run; their derivatives by force and parameters."""
        effect, p = self.effect, tuple(self.parameters)
        first = np.zeros((len(self.data.dt), len(effect.states)))
        if effect.start is None:
            return first, []
        by_signals = []
        for run in range(len(first)):
            at = self._at(run)
            here = Signals(*(one[at] for one in self.signals))
            first[run] = effect.start(here, p)
            if "force" in effect.needs:
                by = by_inputs(effect.start, here, p)
                n = len(here)
                by_signals.append((by[:, Signals._fields.index("force"), np.newaxis], by[:, n:]))
        return first, by_signals

    def _at(self, run: int) -> int:
        """Sample at which the device goes into a run from rest."""
        return int(self.data.starts[run] + self.runs.lead[run])

    def _by_function(self, rows: NDArray) -> dict[str, Any]:
        return {
            name: rows[:2] if name == "motion" else rows[self.rows.index(name)]
            for name in dict.fromkeys(self.rows)
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


def compile_effect(effect: Effect, differentiated: bool) -> None:
    """Compile an effect, or its derivatives, to the cache folder."""
    wave = np.sin(np.linspace(0.0, 1.0, 32))
    zero, parameters = np.zeros_like(wave), np.ones(len(effect.parameters))
    data = measured_runs([TestRun("wave", np.arange(32) / 32, wave, wave, wave, zero)])
    with np.errstate(all="ignore"):
        if differentiated:
            by_force = np.zeros((len(wave), len(parameters)))
            differentiate(effect, data, data.force, parameters, by_force, 0)
        else:
            evaluate(effect, data, data.force, parameters)


def _text(effect: Effect) -> str:
    """Source of the kernel: the effect's functions and the Rosenbrock step of its states."""
    import casadi

    from ...identification import run_walk
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
