"""Speed of a fit against SciPy's least_squares over odeint, in one process at the same optimum.

Run it with ``python -m studies.benchmarks.fitting``. Five parameters, 5 s at 256 Hz, 2 % noise;
both start at the same numbers, a factor 2 to 3 off. SciPy runs with its own difference steps and
with steps chosen for it, each at the quickest tolerances that arrive at the optimum: with the
default ones it stops elsewhere. Times are the best of several.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy.integrate import odeint
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import least_squares

from isolation_sim.identification.least_squares import levenberg_marquardt
from isolation_sim.identification.sensitivities import Motion, Simulator
from isolation_sim.laws import LAWS, law

from .timing import shortest_time

RATE, DURATION, CURRENT, NOISE = 256.0, 5.0, 1.0, 0.02
FACTORS = np.array([2.5, 0.4, 0.5, 2.0, 2.5])
"""Start over truth."""
WITHIN = 1e-6
"""Largest relative excess of the cost over the tight reference's."""
TARGET_RATIO = 500.0
SOLVERS = (1.5e-8, 1e-9, 1e-10, 1e-11)
"""Relative tolerances of odeint to try, its default first."""
ENDS = (1e-8, 1e-12)
"""Tolerances of least_squares to try, its default first."""
DEFAULT, TUNED = "its own difference steps", "difference steps of 1e-4"


@dataclass(frozen=True)
class Test:
    """A made measurement."""

    __test__ = False

    # time, displacement, velocity, force: (n,): SI
    time: NDArray
    displacement: NDArray
    velocity: NDArray
    force: NDArray
    # truth, start: (5,): Parameters of the strain-stiffening law
    truth: NDArray
    start: NDArray


def noisy_test(seed: int = 0) -> Test:
    """Measure the published isolator in a motion of two sinusoids, integrated by odeint."""
    t = np.arange(int(DURATION * RATE) + 1) / RATE
    x, v = np.zeros_like(t), np.zeros_like(t)
    for amplitude, frequency in ((5e-3, 0.7), (2e-3, 2.9)):
        omega = 2 * np.pi * frequency
        x += amplitude * np.sin(omega * t)
        v += amplitude * omega * np.cos(omega * t)
    truth = np.array(law("strain_stiffening").parameters_at(CURRENT))
    exact = Test(t, x, v, np.zeros_like(t), truth, truth)
    force = Peer(exact, 1e-11).force(truth)
    noise = NOISE * np.sqrt(np.mean(force**2)) * np.random.default_rng(seed).standard_normal(t.size)
    return Test(t, x, v, force + noise, truth, truth * FACTORS)


class Peer:
    """The same fit as a user would write it: odeint over a compiled right-hand side."""

    def __init__(self, test: Test, tolerance: float):
        self.test, self.tolerance, self.solves = test, tolerance, 0
        self.rate = _compiled_rate(test)

    def force(self, parameters: NDArray) -> NDArray:
        """Force at the samples, N."""
        self.solves += 1
        c0, k0, c1, k1, alpha = parameters.tolist()
        y, z = odeint(
            self.rate, [0.0, 0.0], self.test.time, (c0, k0, c1, k1, alpha), rtol=self.tolerance,
            atol=1e-3 * self.tolerance,
        ).T  # fmt: skip
        return k1 * y + alpha * z**3

    def fit(self, options: dict[str, Any]) -> Any:
        """Fit by ``scipy.optimize.least_squares`` in parameters relative to the start."""
        start, force = self.test.start, self.test.force

        def residual(relative: NDArray) -> NDArray:
            return self.force(relative * start) - force

        return least_squares(residual, np.ones(5), bounds=(1e-9, np.inf), **options)


def _compiled_rate(test: Test) -> Callable:
    from numba import njit

    cubic = CubicHermiteSpline(test.time, test.displacement, test.velocity).c
    last = len(test.time) - 2

    @njit
    def rate(state, t, c0, k0, c1, k1, alpha):
        i = min(max(int(t * RATE), 0), last)
        h = t - i / RATE
        a, b, c, d = cubic[0, i], cubic[1, i], cubic[2, i], cubic[3, i]
        x, v = ((a * h + b) * h + c) * h + d, (3 * a * h + 2 * b) * h + c
        y, z = state
        return v + (k0 * x - (k0 + k1) * y) / c0, v - alpha / c1 * z**3

    rate(np.zeros(2), 0.0, 1.0, 1.0, 1.0, 1.0, 1.0)
    return rate


class Ours:
    """The fit by this library's parts: compiled sensitivities and Levenberg-Marquardt."""

    def __init__(self, test: Test, n_steps: int):
        self.test = test
        motion = Motion(
            starts=np.array([0, len(test.time)]),
            displacement=test.displacement,
            velocity=test.velocity,
            current=np.full(len(test.time), CURRENT),
            dt=np.array([1 / RATE]),
        )
        self.simulator = Simulator(LAWS["strain_stiffening"], motion, n_steps=n_steps)
        self.simulations = self.with_derivatives = 0

    def residuals(self, parameters: NDArray, derivatives: bool) -> tuple[NDArray, NDArray]:
        """Residuals, N, and their derivatives."""
        self.simulations += 1
        self.with_derivatives += derivatives
        force, jacobian = self.simulator.run(parameters, derivatives)
        return force - self.test.force, jacobian

    def fit(self, tolerance: float) -> Any:
        """Fit from the start."""
        start = self.test.start
        return levenberg_marquardt(
            self.residuals, start, 1e-9 * start, np.full(5, np.inf), 100, tolerance
        )


def main(repetitions: int = 200) -> dict[str, float]:
    """Print the benchmark."""
    test = noisy_test()
    # costs are compared as one integrator sees them, far tighter than those that were used
    evaluate = Peer(test, 1e-11)

    def cost(parameters: NDArray) -> float:
        return 0.5 * float(np.sum((evaluate.force(parameters) - test.force) ** 2))

    tight = {"xtol": 1e-14, "ftol": 1e-14, "gtol": 1e-14, "jac": "3-point", "diff_step": 1e-4}
    reference = cost(evaluate.fit(tight).x * test.start)

    def excess(parameters: NDArray) -> float:
        return cost(parameters) / reference - 1

    ends = ((1, 1e-4), (1, 1e-5), (1, 1e-6), (1, 1e-8), (2, 1e-8), (4, 1e-10))
    for n_steps, tolerance in ends:
        ours = Ours(test, n_steps)
        ours_off = excess(ours.fit(tolerance).x)
        if ours_off <= WITHIN:
            break
    counts = ours.simulations, ours.with_derivatives
    seconds = shortest_time(lambda: ours.fit(tolerance), repetitions)

    table = Table(title=f"Five parameters, {DURATION:g} s at {RATE:g} Hz, {100 * NOISE:g} % noise")
    for column in ("fit", "cost over reference - 1", "simulations", "ms", "ratio"):
        table.add_column(column, justify="left" if column == "fit" else "right")
    table.add_row(
        f"isolation_sim, {n_steps} step(s) a sample", f"{ours_off:.1e}",
        f"{counts[0]} ({counts[1]} with derivatives)", f"{seconds * 1e3:.3f}", "1",
    )  # fmt: skip
    ratios = {}
    for step, what in ((None, DEFAULT), (1e-4, TUNED)):
        arrived = []
        for solver in SOLVERS:
            for end in ENDS:
                peer = Peer(test, solver)
                options: dict[str, Any] = {"diff_step": step}
                options |= dict.fromkeys(("xtol", "ftol", "gtol"), end)
                begin = time.perf_counter()
                result = peer.fit(options)
                spent, off = time.perf_counter() - begin, excess(result.x * test.start)
                if off <= WITHIN:
                    arrived.append((spent, solver, end, off, peer.solves, options))
        if not arrived:
            table.add_row(f"least_squares over odeint, {what}", "does not arrive", "", "", "")
            continue
        _, solver, end, off, solves, options = min(arrived, key=lambda result: result[0])
        peer = Peer(test, solver)
        spent = shortest_time(
            lambda peer=peer, options=options: peer.fit(options), 3 if step is None else 10
        )
        ratios[what] = spent / seconds
        table.add_row(
            f"least_squares over odeint at {solver:g}, {what}, ends at {end:g}", f"{off:.1e}",
            f"{solves}", f"{spent * 1e3:.1f}", f"{ratios[what]:.0f}",
        )  # fmt: skip
    console = Console()
    console.print(table)
    simulating = shortest_time(lambda: ours.simulator.run(test.start), repetitions)
    plainly = shortest_time(lambda: ours.simulator.run(test.start, False), repetitions)
    inside = counts[1] * simulating + (counts[0] - counts[1]) * plainly
    console.print(
        f"{ratios.get(DEFAULT, np.nan):.0f} times faster than least_squares as a user calls it, at "
        f"tolerances that arrive (target: {TARGET_RATIO:.0f}), and "
        f"{ratios.get(TUNED, np.nan):.0f} times faster where someone chose its difference steps "
        f"well. Of the {seconds * 1e3:.3f} ms, "
        f"{inside * 1e3:.3f} ms simulate ({simulating * 1e6:.0f} us with derivatives, "
        f"{plainly * 1e6:.0f} us without); the rest is the search's linear algebra."
    )
    return {
        "ratio": ratios.get(DEFAULT, np.nan),
        "tuned_ratio": ratios.get(TUNED, np.nan),
        "excess": ours_off,
    }


if __name__ == "__main__":
    main()
