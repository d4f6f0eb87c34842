"""Genetic algorithm, particle swarm and CMA-ES of pymoo, on a budget."""

from __future__ import annotations

from typing import Any

import numpy as np

from isolation_sim.errors import InputError

from .budget import Budget


def genetic(evaluate: Budget, rng: np.random.Generator, population: int = 50) -> None:
    """Search by pymoo's genetic algorithm: tournament, simulated binary crossover, mutation."""
    _require(population)
    from pymoo.algorithms.soo.nonconvex.ga import GA

    _minimise(GA(pop_size=population), evaluate, rng)


def particle_swarm(evaluate: Budget, rng: np.random.Generator, population: int = 50) -> None:
    """Search by pymoo's particle swarm, whose inertia and attractions adapt."""
    _require(population)
    from pymoo.algorithms.soo.nonconvex.pso import PSO

    _minimise(PSO(pop_size=population), evaluate, rng)


def cma_es(
    evaluate: Budget, rng: np.random.Generator, sigma: float = 0.3, restarts: int = 9
) -> None:
    """Search by covariance matrix adaptation, restarted with twice the population when it ends."""
    if not (sigma > 0 and restarts >= 0):
        raise InputError(
            f"sigma {sigma!r} and restarts {restarts!r}; expected: sigma above 0, restarts from 0"
        )
    _require(1)
    from pymoo.algorithms.soo.nonconvex.cmaes import CMAES

    start = rng.uniform(evaluate.lower, evaluate.upper)
    algorithm = CMAES(x0=start, sigma=sigma, restarts=restarts, incpopsize=2)
    _minimise(algorithm, evaluate, rng)


def _require(population: int) -> None:
    if population < 1:
        raise InputError(f"population {population!r}; expected: 1 or more")
    try:
        import pymoo  # noqa: F401
    except ModuleNotFoundError:
        raise InputError(
            "genetic, particle_swarm and cma_es need pymoo, which is not installed: "
            "pip install pymoo; expected without it: fruit_fly, fruit_fly_fixed, fish_swarm"
        ) from None


def _minimise(algorithm: Any, evaluate: Budget, rng: np.random.Generator) -> None:
    from pymoo.core.problem import ElementwiseProblem
    from pymoo.optimize import minimize

    class Objective(ElementwiseProblem):
        def __init__(self) -> None:
            lower, upper = evaluate.lower, evaluate.upper
            super().__init__(n_var=lower.size, n_obj=1, xl=lower, xu=upper)

        def _evaluate(self, x: np.ndarray, out: dict, *args: Any, **kwargs: Any) -> None:
            value = float(evaluate(x))
            # pymoo sorts by value; a model that diverges is worst, not undefined
            out["F"] = value if np.isfinite(value) else 1e300

    minimize(
        Objective(),
        algorithm,
        ("n_eval", evaluate.allowed),
        seed=int(rng.integers(2**31)),
        copy_algorithm=False,
        verbose=False,
    )
