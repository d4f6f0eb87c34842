"""Forces of a law under measured motion, with exact derivatives by its coefficients."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from ..compilation.kernel_text import assigned, kernel_text
from ..errors import InputError
from ..generated import load_written
from ..laws.emit import function_text, straight_line, symbols
from ..laws.fingerprint import fingerprint
from ..laws.law import Law
from .run_starts import lead_in

_LARGEST_CHANGE = 1e3
"""Change of a run's force over the relative change of a coefficient, in units of the force, beyond
which the derivative is the integration's and not the law's."""


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


class Simulator:
    """A law under measured motion.

    Parameters
    ----------
    law : Law
        The law.
    motion : Motion
        The motion.
    owner, power : sequence of int, (n_coefficients,)
        Each coefficient's parameter, by number, and power of the current.
    n_steps : int or (n_runs,) array of int
        Integration steps a sample, of all runs or of each.
    """

    def __init__(
        self,
        law: Law,
        motion: Motion,
        owner: Sequence[int] | NDArray,
        power: Sequence[int] | NDArray,
        n_steps: int | NDArray = 1,
    ):
        self.law, self.motion = law, motion
        self.n_steps = np.broadcast_to(np.asarray(n_steps, np.int64), motion.dt.shape).copy()
        self.owner, self.power = np.array(owner, np.int64), np.array(power, np.int64)
        self.module = compiled(law)
        periods = motion.periods if law.states else None  # without memory any run may begin
        if periods is None:
            periods = np.zeros_like(motion.dt)
        self._lead_in = lead_in(motion.starts, motion.dt, periods, motion.displacement)
        n, n_theta = len(law.states), len(self.owner)
        self._work = (
            np.zeros(max(n, 1)),
            np.zeros(len(law.parameters)),
            np.zeros((max(n, 1), n_theta)),
            np.zeros((max(n, 1), n_theta)),
            np.zeros((max(n, 1), n + len(law.parameters))),
            np.zeros(n_theta),
        )

    def run(self, theta: NDArray, derivatives: bool = True) -> tuple[NDArray, NDArray]:
        """Simulate all runs."""
        motion, n_samples = self.motion, len(self.motion.displacement)
        force = np.empty(n_samples)
        jacobian = np.empty((n_samples if derivatives else 0, len(self.owner)))
        self.module.simulate(
            motion.starts,
            motion.displacement,
            motion.velocity,
            motion.current,
            motion.dt,
            self.n_steps,
            *self._lead_in,
            np.ascontiguousarray(theta, float),
            self.owner,
            self.power,
            *self._work,
            force,
            jacobian,
        )
        return force, jacobian

    def copy(self) -> Simulator:
        """Return a simulator that another thread may use at the same time."""
        return Simulator(self.law, self.motion, self.owner, self.power, self.n_steps)

    def resolved(self, theta: NDArray, tolerance: float = 1e-4, most: int = 64) -> Simulator:
        """Return the simulator with as many steps a sample as each run's accuracy needs.

        The force of each run then changes by less than ``tolerance`` with twice the steps, and no
        derivative diverges.
        """
        force = self.run(theta, derivatives=False)[0]
        n_steps, runs = self.n_steps, self.motion.starts[:-1]
        unresolved = np.full(len(runs), bool(self.law.states))
        while unresolved.any():
            trial = np.where(unresolved, 2 * n_steps, n_steps)
            fine = Simulator(self.law, self.motion, self.owner, self.power, trial)
            finer = fine.run(theta, derivatives=False)[0]
            with np.errstate(all="ignore"):
                size = max(np.max(np.abs(finer)), 1e-150)
                wrong = np.maximum.reduceat(np.abs(finer - force), runs) / size
                unresolved &= ~(wrong < tolerance)
            n_steps, force = np.where(unresolved, trial, n_steps), finer
            unresolved &= n_steps < most
        result = Simulator(self.law, self.motion, self.owner, self.power, n_steps)
        # a force that saturates is bounded by itself, while its derivatives may grow at every step
        while (more := result._diverging(theta) & (result.n_steps < most)).any():
            n_steps = np.where(more, 2 * result.n_steps, result.n_steps)
            result = Simulator(self.law, self.motion, self.owner, self.power, n_steps)
        return result

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
def compiled(law: Law) -> ModuleType:
    """Compiled simulation of a law under measured motion, with its derivatives."""
    if law.unit:
        raise InputError(
            f"{law.unit}: a functional mock-up unit is no arithmetic; expected here: a law"
        )
    return load_written("device", fingerprint(law), lambda: _text(law))


def _begin(law: Law, names: list[str], parameters: list, unpack: list[str]) -> list[str]:
    """Statements that set the states at rest; by gets their derivatives by the parameters."""
    import casadi

    n, n_parameters = len(law.states), len(parameters)
    if not n:
        return ["return"]
    rest = (0.0,) * n if law.rest is None else law.rest(tuple(parameters))
    values = casadi.SX(casadi.vertcat(*rest))
    by = casadi.jacobian(values, casadi.vertcat(*parameters))
    places = [(i, j) for i in range(n) for j in range(n_parameters)]
    results = [*casadi.vertsplit(values), *(by[i, j] for i, j in places)]
    named = dict(zip(names, parameters, strict=True))
    _, _, statements, texts = straight_line(named, results)
    return [
        *(unpack if law.rest else ()),
        *statements,
        *(f"s[{i}] = {texts[i]}" for i in range(n)),
        *(f"by[{i}, {n + j}] = {one}" for (i, j), one in zip(places, texts[n:], strict=True)),
        "return",
    ]


def _text(law: Law) -> str:
    """Source of the kernel: the law's response and Runge-Kutta step, differentiated by CasADi."""
    import casadi

    from . import device_kernel, law_functions

    n, n_parameters = len(law.states), len(law.parameters)
    s_names, p_names = [f"s{i}" for i in range(n)], [f"p{k}" for k in range(n_parameters)]
    s, p = symbols(s_names), symbols(p_names)
    x, v = symbols(["x", "v"])
    force = law.force(x, v, tuple(s), tuple(p))
    response = [force, *(casadi.gradient(force, symbol) for symbol in (*s, *p))]
    unpack = [f"{name} = s[{i}]" for i, name in enumerate(s_names)]
    unpack += [f"{name} = parameters[{k}]" for k, name in enumerate(p_names)]
    named = dict(zip(["x", "v", *s_names, *p_names], [x, v, *s, *p], strict=True))
    _, _, statements, results = straight_line(named, response)
    blocks = [
        "from isolation_sim.compilation.options import inline, math",
        assigned({"N_STATES": n, "N_PARAMETERS": n_parameters}),
        function_text("begin", "s, parameters, by", _begin(law, p_names, p, unpack[n:])),
        function_text(
            "respond",
            "x, v, s, parameters, by",
            [
                *unpack,
                *statements,
                *(f"by[0, {i}] = {value}" for i, value in enumerate(results[1:])),
                f"return {results[0]}",
            ],
            doc="Force; by gets its derivatives by the states and the parameters.",
        ),
    ]
    times = ["xa", "va", "xm", "vm", "xb", "vb", "h"]
    arguments = ", ".join([*times, "s", "parameters"])
    alone = with_slopes = ["pass"]
    if n:
        places = symbols(times)
        xa, va, xm, vm, xb, vb, h = places

        def rates(x, v, state):
            return law.rates(x, v, tuple(state), tuple(p))

        k1 = rates(xa, va, s)
        k2 = rates(xm, vm, [a + h / 2 * b for a, b in zip(s, k1, strict=True)])
        k3 = rates(xm, vm, [a + h / 2 * b for a, b in zip(s, k2, strict=True)])
        k4 = rates(xb, vb, [a + h * b for a, b in zip(s, k3, strict=True)])
        new = [
            a + h / 6 * (b + 2 * c + 2 * d + e)
            for a, b, c, d, e in zip(s, k1, k2, k3, k4, strict=True)
        ]
        named = dict(zip([*times, *s_names, *p_names], [*places, *s, *p], strict=True))
        by = casadi.jacobian(casadi.vertcat(*new), casadi.vertcat(*s, *p))
        entries = [by[i, j] for i in range(n) for j in range(n + n_parameters)]
        # parameters are hoisted for their reciprocals: a division costs several products
        hoisted, _, statements, results = straight_line(named, new, p_names)
        stored = [f"s[{i}] = {value}" for i, value in enumerate(results)]
        alone = [*unpack, *hoisted, *statements, *stored]
        hoisted, _, statements, results = straight_line(named, [*new, *entries], p_names)
        body = [*unpack, *hoisted, *statements]
        width = n + n_parameters
        entry = {(i, j): results[n + i * width + j] for i in range(n) for j in range(width)}
        body += [f"by[{i}, {j}] = {one}" for (i, j), one in entry.items() if j >= n]
        body += ["for k in range(owner.shape[0]):"]
        for i in range(n):
            terms = " + ".join(f"{entry[i, j]} * slope[{j}, k]" for j in range(n))
            body.append(f"    new_slope[{i}, k] = {terms} + by[{i}, {n} + owner[k]] * factor[k]")
        body += [f"    slope[{i}, k] = new_slope[{i}, k]" for i in range(n)]
        body += [f"s[{i}] = {results[i]}" for i in range(n)]
        with_slopes = body
    blocks.append(function_text("step_alone", arguments, alone))
    arguments += ", owner, factor, slope, new_slope, by"
    blocks.append(function_text("step_with_slopes", arguments, with_slopes))
    return kernel_text([device_kernel], {law_functions: "\n\n".join(blocks)})
