"""The papers' searches against least squares with exact derivatives, on equal budgets.

Two problems, each at one current: the strain-stiffening law on synthetic loops with 2 % noise, and
the Bouc-Wen law on the measured runs of an MR damper. Every method looks in the same box: each
parameter's bounds, or its size by its unit and the data to within a factor of 300. Least squares is
what ``fit`` does at one current, from one random point of the box after another until the budget
is spent; the published numbers with which ``fit`` begins are not used.

An evaluation is one simulation of all samples; one with the derivatives by n parameters counts as
n + 1, though it takes two to three times as long as one without. Processor time includes what a
search itself spends, since its user waits for that too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from isolation_sim.errors import InputError
from isolation_sim.identification.least_squares import levenberg_marquardt
from isolation_sim.identification.measured_runs import measured_runs
from isolation_sim.identification.sensitivities import Motion, Simulator
from isolation_sim.laws import law
from studies.swarm import available_methods

from .damper import DATA, current, read_shortened
from .search_convergence import LEAST_SQUARES, Convergence, Problem, run_search
from .study import Outcome, Step, data_folder

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TITLE = "Searches for a law's parameters on equal budgets"
TITLES = {
    LEAST_SQUARES: "least squares",
    "fruit_fly": "fruit fly, adaptive step",
    "fruit_fly_fixed": "fruit fly, fixed step",
    "fish_swarm": "artificial fish swarm",
    "genetic": "genetic algorithm",
    "particle_swarm": "particle swarm",
    "cma_es": "CMA-ES",
}
NEAR = 0.01
"""A search has succeeded when its cost is within this part of the best known."""
HELD = {"A": 200.0, "n": 2.0}
"""Of the Bouc-Wen law: a redundant parameter and the exponent."""
BUDGET, SEEDS = 3000, 8
SHORT_BUDGET, SHORT_SEEDS = 600, 3
WARM = 100
"""Evaluations before time is taken, in which code is compiled and libraries are loaded."""
REFERENCE_STARTS = 40
"""Starts of the fits that give the best known cost, with the searches' own finds."""


def synthetic_loops(seed: int = 0, noise: float = 0.02) -> Problem:
    """Loops of a strain-stiffening device at three amplitudes and frequencies, with noise."""
    device = law("strain_stiffening")
    t = np.arange(0, 2.0, 1 / 200)
    tests = ((2e-3, 1.0), (6e-3, 0.5), (4e-3, 3.0))
    omega = [2 * np.pi * frequency for _, frequency in tests]
    motion = Motion(
        starts=len(t) * np.arange(len(tests) + 1),
        displacement=np.concatenate(
            [a * np.sin(w * t) for (a, _), w in zip(tests, omega, strict=True)]
        ),
        velocity=np.concatenate(
            [a * w * np.cos(w * t) for (a, _), w in zip(tests, omega, strict=True)]
        ),
        current=np.full(len(tests) * len(t), 1.0),
        dt=np.full(len(tests), 1 / 200),
    )
    # the published numbers, moved
    truth = np.array(device.parameters_at(1.0)) * (1.3, 0.8, 0.7, 1.2, 1.4)
    exact = Simulator(device.law, motion, n_steps=16)
    force = exact.run(truth, derivatives=False)[0]
    size = noise * np.sqrt(np.mean(force**2))
    force = force + size * np.random.default_rng(seed).standard_normal(len(force))
    return Problem("strain stiffening, synthetic", device.law.name, motion, force, {}, 1)


def measured_damper(folder: Path, at: str = "1 A") -> Problem:
    """Runs of the MR damper at one current, for the Bouc-Wen law."""
    runs = [run for run in read_shortened(folder).runs if current(run) == at]
    force = np.concatenate([run.force for run in runs])
    name = f"Bouc-Wen, damper at {at}"
    return Problem(name, "bouc_wen", measured_runs(runs).motion, force, HELD, 2)


@dataclass(frozen=True)
class MethodComparison:
    """All methods on one problem."""

    name: str  # Of the problem
    n_parameters: int  # That are looked for
    budget: int  # Evaluations of each search
    best_known: float  # Least cost that anything found
    searches: dict[str, list[Convergence]]  # By method, one per seed

    def excess(self, method: str) -> NDArray:
        """Final cost over the best known less 1, a seed each."""
        return np.array([c.best() / self.best_known - 1 for c in self.searches[method]])

    def arrivals(self, method: str) -> NDArray:
        """Evaluations and processor time (s) until success, (n_seeds, 2)."""
        goal = (1 + NEAR) * self.best_known
        return np.array([c.arrival(goal) for c in self.searches[method]])

    def success(self, method: str) -> float:
        """Share of the seeds that succeeded."""
        return float(np.mean(np.isfinite(self.arrivals(method)[:, 0])))

    @property
    def fit_time(self) -> float:
        """Median processor time in which least squares succeeds, s."""
        return float(np.median(self.arrivals(LEAST_SQUARES)[:, 1]))

    def at_equal_time(self, method: str) -> float:
        """Median cost over the best known less 1 when least squares has succeeded."""
        costs = [c.best(seconds=self.fit_time) for c in self.searches[method]]
        return float(np.median(costs)) / self.best_known - 1

    def records(self) -> list[dict[str, Any]]:
        """A row a method."""
        rows = []
        for method, searches in self.searches.items():
            excess, arrivals = self.excess(method), self.arrivals(method)
            there = arrivals[np.isfinite(arrivals[:, 0])]
            low, middle, high = np.quantile(excess, [0.25, 0.5, 0.75]).tolist()
            rows.append(
                {
                    "problem": self.name,
                    "method": TITLES[method],
                    "excess_median": middle,
                    "excess_lower_quartile": low,
                    "excess_upper_quartile": high,
                    "excess_at_equal_time": self.at_equal_time(method),
                    "success": self.success(method),
                    "evaluations": float(np.median(there[:, 0])) if there.size else "never",
                    "time_ratio": float(np.median(there[:, 1])) / self.fit_time
                    if there.size
                    else "never",
                    "budget_time_ratio": float(
                        np.median([c.total for c in searches]) / self.fit_time
                    ),
                }
            )
        return rows


def compare_methods(
    problem: Problem,
    budget: int = BUDGET,
    seeds: int = SEEDS,
    advance: Callable[[], None] = lambda: None,
) -> MethodComparison:
    """Search by every method, over several seeds."""
    searches: dict[str, list[Convergence]] = {}
    for method in (LEAST_SQUARES, *available_methods()):
        run_search(problem, method, WARM, seeds)
        searches[method] = []
        for seed in range(seeds):
            searches[method].append(run_search(problem, method, budget, seed))
            advance()
    u = problem.parameterisation
    tight = [
        levenberg_marquardt(problem.residuals, start, u.lower, u.upper, 500, 1e-12).x
        for start in u.starts(REFERENCE_STARTS, 10_000)
    ]
    costs = [problem.cost(x) for x in tight]
    costs += [one.best() for each in searches.values() for one in each]
    return MethodComparison(problem.name, len(u.scale), budget, float(np.nanmin(costs)), searches)


def outcome(folder: Path, short: bool, step: Step) -> Outcome:
    """Run the study."""
    problems, said = [synthetic_loops()], []
    try:
        problems.append(measured_damper(data_folder(DATA)))
    except InputError as error:
        said.append(f"Without the measured damper: {error}.")
    budget, seeds = (SHORT_BUDGET, SHORT_SEEDS) if short else (BUDGET, SEEDS)
    total = len(problems) * seeds * len(TITLES)
    comparisons = [
        compare_methods(problem, budget, seeds, lambda: step("searching", 1 / total))
        for problem in problems
    ]
    return Outcome(
        table=[row for comparison in comparisons for row in comparison.records()],
        finding="\n".join([*said, *map(finding, comparisons)]),
        figures={"convergence": figure(comparisons)},
    )


def finding(comparison: MethodComparison) -> str:
    """Say which methods solve a problem and at what price, from the numbers alone."""
    rows = comparison.records()
    ours = rows[0]
    text = (
        f"{comparison.name}, {comparison.n_parameters} parameters, {comparison.budget} "
        f"evaluations: least squares with exact derivatives comes within {NEAR:.0%} of the best "
        f"known cost, {100 * comparison.best_known:.2f} % of the force, from "
        f"{ours['success']:.0%} of the seeds"
    )
    if not ours["success"]:
        return f"{text}."
    text += f", after {ours['evaluations']:.0f} evaluations."
    for row in sorted(rows[1:], key=lambda row: (-row["success"], row["excess_median"])):
        if row["success"]:
            what = (
                f"from {row['success']:.0%}, by {row['evaluations'] / ours['evaluations']:.2g} "
                f"times the evaluations and {row['time_ratio']:.2g} times the time"
            )
        else:
            what = (
                f"never; it ends at {1 + row['excess_median']:.3g} times the best known cost "
                f"after {row['budget_time_ratio']:.2g} times the time"
            )
        text += f" {row['method'][0].upper()}{row['method'][1:]}: {what}."
    return text


def figure(comparisons: Sequence[MethodComparison]) -> Figure:
    """Draw the median cost over the best known, not below 1e-6, against evaluations."""
    from isolation_sim.reports.style import DOUBLE_COLUMN, legend, line_styles, new_figure, style

    with style():
        result = new_figure(DOUBLE_COLUMN, 3.4)
        axes = result.subplots(1, len(comparisons), squeeze=False, sharey=True)[0]
        for axis, comparison in zip(axes, comparisons, strict=True):
            spent = np.unique(np.geomspace(10, comparison.budget, 60).astype(int))
            looks = line_styles(len(comparison.searches))
            for (method, searches), look in zip(comparison.searches.items(), looks, strict=True):
                costs = np.array([[c.best(n) for n in spent] for c in searches])
                ratio = np.median(costs, axis=0) / comparison.best_known - 1
                axis.loglog(
                    spent, np.maximum(ratio, 1e-6), label=TITLES[method], markevery=7, **look
                )
            axis.axhline(NEAR, color="0.5", linewidth=0.6)
            axis.set_title(comparison.name)
            axis.set_xlabel("evaluations")
        axes[0].set_ylabel("cost over best known - 1, median")
        legend(result, axes[0], "outside upper center")
    return result
