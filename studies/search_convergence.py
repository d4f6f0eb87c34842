"""A fitting problem at one current, and the progress of searches for its parameters."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from isolation_sim.identification.least_squares import levenberg_marquardt
from isolation_sim.identification.parameterisation import Parameterisation
from isolation_sim.identification.sensitivities import Motion, Simulator
from isolation_sim.laws import LAWS
from studies.swarm import search

LEAST_SQUARES = "least_squares"
DECADES = 2.5
"""What is known beforehand of a parameter's size: so many powers of ten to either side."""
DIVERGED = 1e3
"""Cost of a simulation that diverges: a search that begins there has to get on."""


class Problem:
    """A law's parameters to be found from measured forces at one current."""

    def __init__(
        self,
        name: str,
        law_name: str,
        motion: Motion,  # What the device was moved by
        force: NDArray,  # (n_samples,): What it resisted with, N
        fixed: dict[str, float],  # Parameters that are held, SI
        n_steps: int,  # Integration steps a sample
    ):
        self.name, self.force = name, force
        x, v, size = (
            float(np.sqrt(np.mean(y**2))) for y in (motion.displacement, motion.velocity, force)
        )
        sizes = (size, x, x / v)
        self.parameterisation = Parameterisation(LAWS[law_name], motion.current[:1], sizes, fixed)
        u = self.parameterisation
        self.simulator = Simulator(u.law, motion, u.n_powers, n_steps)

    def residuals(self, values: NDArray, derivatives: bool) -> tuple[NDArray, NDArray]:
        """Force residuals, N, and their derivatives by the unknowns."""
        u = self.parameterisation
        with np.errstate(all="ignore"):
            force, jacobian = self.simulator.run(u.coefficients(values), derivatives)
            return force - self.force, jacobian @ u.spread

    def cost(self, values: NDArray) -> float:
        """RMS of the residual over RMS of the measured force."""
        with np.errstate(all="ignore"):
            residual = self.residuals(values, False)[0]
            cost = float(np.sqrt(np.mean(residual**2) / np.mean(self.force**2)))
        return cost if np.isfinite(cost) else np.inf

    def bounds(self) -> list[tuple[float, float]]:
        """Bounds of the coordinates in which the papers' searches look; see ``values``."""
        reach = float(np.arcsinh(10**DECADES))
        result: list[tuple[float, float]] = []
        for quantity in self.parameterisation.free:
            if np.isfinite([quantity.lower, quantity.upper]).all():
                result.append((quantity.lower, quantity.upper))
            elif quantity.lower < 0:
                result.append((-reach, reach))
            else:
                result.append((-DECADES, DECADES))
        return result

    def values(self, place: NDArray) -> NDArray:
        """Parameters at a place between the bounds.

        The decimal logarithm of the parameter over its size, where it is positive; the inverse
        hyperbolic sine where it may have either sign; itself where it has both bounds.
        """
        u = self.parameterisation
        result = np.empty_like(place)
        for k, (quantity, y) in enumerate(zip(u.free, place, strict=True)):
            if np.isfinite([quantity.lower, quantity.upper]).all():
                result[k] = y
            else:
                result[k] = u.scale[k] * (np.sinh(y) if quantity.lower < 0 else 10**y)
        return np.clip(result, u.lower, u.upper)


@dataclass(frozen=True)
class Convergence:
    """How one search went."""

    # (n,): Evaluations spent when the cost was better than before, the first at a finite cost
    evaluations: NDArray
    seconds: NDArray  # (n,): Processor time spent then
    costs: NDArray  # (n,): The cost then
    total: float  # Processor time in all, s

    def best(self, spent: float = np.inf, seconds: float = np.inf) -> float:
        """Least cost within a budget; infinite before the first."""
        keep = (self.evaluations <= spent) & (self.seconds <= seconds)
        return float(self.costs[keep][-1]) if keep.any() else np.inf

    def arrival(self, cost: float) -> tuple[float, float]:
        """Evaluations and processor time (s) until a cost; infinite if never."""
        there = np.flatnonzero(self.costs <= cost)
        if not there.size:
            return np.inf, np.inf
        return float(self.evaluations[there[0]]), float(self.seconds[there[0]])


class _Recorder:
    """Counts evaluations and notes every improvement."""

    def __init__(self, budget: int):
        self.budget, self.spent, self.least = budget, 0, np.inf
        self.begin = time.process_time()
        self.notes: list[tuple[int, float, float]] = []

    def note(self, cost: float, worth: int = 1) -> None:
        self.spent += worth
        if cost < self.least and self.spent <= self.budget:
            self.least = cost
            self.notes.append((self.spent, time.process_time() - self.begin, cost))

    def convergence(self) -> Convergence:
        total = time.process_time() - self.begin
        spent, seconds, costs = np.array(self.notes, float).reshape(-1, 3).T
        return Convergence(spent, seconds, costs, total)


class _BudgetSpent(Exception):
    pass


def least_squares(problem: Problem, budget: int, seed: int) -> Convergence:
    """Levenberg-Marquardt steps from one random start after another."""
    u, recorder = problem.parameterisation, _Recorder(budget)
    size = np.sqrt(np.mean(problem.force**2) * len(problem.force))
    n = len(u.scale)

    def counted(values: NDArray, derivatives: bool) -> tuple[NDArray, NDArray]:
        if recorder.spent >= budget:
            raise _BudgetSpent
        residual, jacobian = problem.residuals(values, derivatives)
        with np.errstate(all="ignore"):
            cost = float(np.sqrt(np.vdot(residual, residual))) / size
        recorder.note(cost, n + 1 if derivatives else 1)
        return residual, jacobian

    random = np.random.default_rng(seed)
    low, high = np.transpose(problem.bounds())
    try:
        while True:
            start = problem.values(random.uniform(low, high))
            rough = levenberg_marquardt(counted, start, u.lower, u.upper, 30, 1e-5)
            if rough.cost <= 1.1 * 0.5 * (recorder.least * size) ** 2:
                levenberg_marquardt(counted, rough.x, u.lower, u.upper, 300, 1e-10)
    except _BudgetSpent:
        pass
    return recorder.convergence()


def run_search(problem: Problem, method: str, budget: int, seed: int) -> Convergence:
    """Search by one method."""
    if method == LEAST_SQUARES:
        return least_squares(problem, budget, seed)
    recorder = _Recorder(budget)

    def objective(place: NDArray) -> float:
        cost = min(problem.cost(problem.values(place)), DIVERGED)
        recorder.note(cost)
        return cost

    search(method, objective, problem.bounds(), budget, seed)
    return recorder.convergence()
