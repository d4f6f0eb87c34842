"""Forces of a law under measured motion, with exact derivatives by its coefficients."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..compilation.kernel_text import assigned, kernel_text
from ..errors import InputError
from ..generated import in_cache, load_written, name_of_content
from ..laws.emit import function_text, straight_line, symbols
from ..laws.fingerprint import fingerprint
from ..laws.law import Law
from .device_arguments import workspace
from .run_starts import Runs, lead_in

_LARGEST_CHANGE = 1e3
"""Change of a run's force over the relative change of a coefficient, in units of the force, beyond
which the derivative is the integration's and not the law's."""
_DIVERGING = 0.5
"""Relative change of a run's largest force by twice the steps from which it still diverges."""
_MANY_SAMPLES = 10_000
"""Samples from which Rosenbrock steps are worth their compilation."""
_MANY_STEPS = 16
"""Runge-Kutta steps a sample at which Rosenbrock steps are tried."""
_FEW_STIFF_STEPS = 8
"""Rosenbrock steps a sample up to which they cost less."""
_STIFF_STATES = 4
"""States up to which their equations are solved in a Rosenbrock step."""
_ZERO = "0.0"
"""As ``straight_line`` writes what is always zero."""


@dataclass(frozen=True)
class Motion:
    """Measured motion of several test runs, one after another."""

    starts: NDArray  # (n_runs + 1,) int: First sample of each run, and the end
    # displacement, velocity, current: (n_samples,): m, m/s, A
    displacement: NDArray
    velocity: NDArray
    current: NDArray
    dt: NDArray  # (n_runs,): Sample interval of each run, s
    # (n_runs,), s: Period of each run whose first cycle is steady; 0, or None for all, from rest
    periods: NDArray | None = None

    @cached_property
    def runs(self) -> Runs:
        """Where the runs lie, each with the motion that leads into it."""
        periods = np.zeros_like(self.dt) if self.periods is None else self.periods
        return lead_in(self.starts, self.dt, periods, self.displacement)

    @cached_property
    def runs_at_rest(self) -> Runs:
        """The same if every run begins at rest."""
        return lead_in(self.starts, self.dt, np.zeros_like(self.dt), self.displacement)

    def with_current(self, current: NDArray) -> Motion:
        """Return the same motion under another current, (n_samples,), A."""
        other = replace(self, current=current)
        other.__dict__["runs"] = self.runs  # they do not depend on it
        return other


class Simulator:
    """A law under measured motion.

    Parameters
    ----------
    law : Law
        The law.
    motion : Motion
        The motion.
    n_powers : int
        Coefficients of each parameter: ascending powers of the current.
    n_steps : int or (n_runs,) array of int
        Integration steps a sample, of all runs or of each.
    stiff : bool or (n_runs,) array of bool
        Whether these are Rosenbrock steps, which a state far faster than a step leaves stable.
    """

    def __init__(
        self,
        law: Law,
        motion: Motion,
        n_powers: int = 1,
        n_steps: int | NDArray = 1,
        stiff: bool | NDArray = False,
    ):
        self.law, self.motion, self.n_powers = law, motion, n_powers
        self.n_steps = np.broadcast_to(np.asarray(n_steps, np.int64), motion.dt.shape).copy()
        self.stiff = np.broadcast_to(np.asarray(stiff, bool), motion.dt.shape).copy()

    def run(self, theta: NDArray, derivatives: bool = True) -> tuple[NDArray, NDArray]:
        """Simulate all runs; ``theta``: one parameter's coefficients after another's."""
        law, motion, n_samples = self.law, self.motion, len(self.motion.displacement)
        # without memory any run may begin
        runs = motion.runs if law.states else motion.runs_at_rest
        whole = self.n_steps.all()
        force = np.empty(n_samples) if whole else np.full(n_samples, np.nan)
        jacobian = np.empty((n_samples if derivatives else 0, len(theta)))
        rows = np.ascontiguousarray(theta, float).reshape(-1, self.n_powers)
        for stiff in (False, True):
            n_steps = np.where(self.stiff == stiff, self.n_steps, 0)
            if not n_steps.any():
                continue
            compiled(law, stiff).simulate(
                runs,
                motion.displacement,
                motion.velocity,
                motion.current,
                n_steps,
                rows,
                workspace(len(law.states), len(law.parameters), self.n_powers),
                force,
                jacobian,
            )
        return force, jacobian

    def with_steps(self, n_steps: NDArray, stiff: NDArray) -> Simulator:
        """Return the simulator with other steps; runs with none are left out."""
        other = copy(self)
        other.n_steps, other.stiff = n_steps, stiff
        return other

    def resolved(self, theta: NDArray, tolerance: float = 1e-4, most: int = 64) -> Simulator:
        """Return the simulator with as many steps a sample as each run's accuracy needs.

        The force of each run then changes by less than ``tolerance`` with twice the steps, and no
        derivative diverges. If there are many samples, a run that would need many steps gets
        Rosenbrock steps where a few of them are enough.
        """
        every = np.full(len(self.n_steps), bool(self.law.states))
        if len(self.motion.displacement) < _MANY_SAMPLES:
            result, _ = self._doubled(theta, every, tolerance, most)
        else:
            result, left = self._doubled(theta, every, tolerance, min(_MANY_STEPS, most))
            result = result._stiff_where(theta, left & ~self.stiff, tolerance)
            result, _ = result._doubled(theta, left & (result.stiff == self.stiff), tolerance, most)
        # a force that saturates is bounded by itself, while its derivatives may grow at every step
        while (more := result._diverging(theta) & (result.n_steps < most)).any():
            n_steps = np.where(more, 2 * result.n_steps, result.n_steps)
            result = result.with_steps(n_steps, result.stiff)
        return result

    def _doubled(
        self, theta: NDArray, chosen: NDArray, tolerance: float, most: int
    ) -> tuple[Simulator, NDArray]:
        """Double the steps of some runs until that changes no force; runs it does at the end."""
        unresolved, runs = chosen & (self.n_steps < most), self.motion.starts[:-1]
        left = chosen & ~unresolved
        if not unresolved.any():
            return self, left
        force, n_steps = self.run(theta, derivatives=False)[0], self.n_steps
        while unresolved.any():
            trial = np.where(unresolved, 2 * n_steps, n_steps)
            finer = self.with_steps(trial, self.stiff).run(theta, derivatives=False)[0]
            with np.errstate(all="ignore"):
                size = np.maximum.reduceat(np.abs(finer), runs)
                change = np.maximum.reduceat(np.abs(finer - force), runs)
                # a run that still diverges has no size
                largest = np.max(size[change < _DIVERGING * size], initial=1e-150)
                unresolved &= ~(change < tolerance * largest)
            n_steps, force = np.where(unresolved, trial, n_steps), finer
            left |= unresolved & (n_steps >= most)
            unresolved &= n_steps < most
        return self.with_steps(n_steps, self.stiff), left

    def _stiff_where(self, theta: NDArray, chosen: NDArray, tolerance: float) -> Simulator:
        """Take Rosenbrock steps in those of the chosen runs where a few of them are enough."""
        if not chosen.any() or len(self.law.states) > _STIFF_STATES:
            return self
        trial = self.with_steps(np.where(chosen, 1, 0), chosen)
        trial, left = trial._doubled(theta, chosen, tolerance, _FEW_STIFF_STEPS)
        taken = chosen & ~left
        if taken.any():
            trial = self.with_steps(np.where(taken, trial.n_steps, 0), taken)
            taken &= ~trial._diverging(theta)
        n_steps = np.where(taken, trial.n_steps, self.n_steps)
        return self.with_steps(n_steps, self.stiff | taken)

    @np.errstate(all="ignore")
    def _diverging(self, theta: NDArray) -> NDArray:
        """Whether derivatives of each run diverge though its force does not, (n_runs,) bool."""
        runs = self.motion.starts[:-1]
        if not self.law.states:
            return np.zeros(len(runs), bool)
        force, jacobian = self.run(theta)
        change = np.maximum.reduceat(np.max(np.abs(jacobian * theta), axis=1), runs)
        size = np.maximum.reduceat(np.abs(force), runs)
        return np.isfinite(size) & ~(change <= _LARGEST_CHANGE * size)


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


def compile_law(law: Law) -> None:
    """Compile the simulation of a law to the cache folder."""
    n, time = len(law.parameters), np.linspace(0.0, 1.0, 8)
    motion = Motion(np.array([0, 8]), time, time, time, np.array([0.1]))
    with np.errstate(all="ignore"):
        Simulator(law, motion).run(np.ones(n))


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
