"""Fruit fly optimisation with fixed and with self-adaptive step (Yu et al., Section 4).

Each parameter has a plane in which the swarm flies. A fly at distance D from the plane's origin
stands for the parameter ``scale / D`` above its lower bound; the swarm moves to its best fly when
that is better than any before. The paper as it must be read: it minimises (Eq 13 prints Max),
``rand`` lies in [-1, 1], and the paper's ``p = 1 / D`` identifies nothing unless the parameters
happen to be of order 1/D: a scale per parameter is declared instead.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from isolation_sim.errors import InputError

from .budget import Budget

DECAY = 10.0
"""Exponent of the adaptive step's decay over the whole flight (Eq 17)."""

START = 10.0
"""Half side of the square in which the swarm starts."""

# default scale over the width of the bounds; the paper's step of 20 makes D about 10
_SCALE_WIDTHS = 2.0


@dataclass(frozen=True, eq=False)
class Flight:
    """Outcome of independent flights."""

    coefficients: np.ndarray  # (n_runs, n_parameters): Best smell coefficients, 1/D
    values: np.ndarray  # (n_runs,): The objective there, in its own unit
    history: np.ndarray  # (n_runs, iterations): Best value after each iteration


def fly(
    objective: Callable[[np.ndarray], np.ndarray],
    starts: np.ndarray,
    step: float,
    iterations: int,
    population: int,
    rng: np.random.Generator,
    adaptive: bool = True,
) -> Flight:
    """Fly independent swarms, all runs at once (Yu et al., Eqs 8-17)."""
    swarm = np.array(starts, dtype=float)
    n_runs, n_parameters, _ = swarm.shape
    runs = np.arange(n_runs)
    best, coefficients = np.full(n_runs, np.inf), np.full((n_runs, n_parameters), np.nan)
    history = np.empty((n_runs, iterations))
    for iteration in range(1, iterations + 1):
        reach = step * np.exp(-DECAY * iteration / iterations) if adaptive else step
        moves = rng.uniform(-1.0, 1.0, (n_runs, population, n_parameters, 2))
        flies = swarm[:, np.newaxis] + reach * moves
        smell = 1.0 / np.hypot(flies[..., 0], flies[..., 1])
        values = objective(smell)
        first = np.argmin(values, axis=1)
        better = values[runs, first] < best
        best = np.where(better, values[runs, first], best)
        swarm[better] = flies[runs, first][better]
        coefficients[better] = smell[runs, first][better]
        history[:, iteration - 1] = best
    return Flight(coefficients, best, history)


def fruit_fly(
    evaluate: Budget,
    rng: np.random.Generator,
    population: int = 50,
    step: float = 20.0,
    scale: Any = None,
    *,
    adaptive: bool = True,
) -> None:
    """Search with the step that falls by exp(-10) over the budget, or with one step throughout."""
    lower, upper = evaluate.lower, evaluate.upper
    scales = _SCALE_WIDTHS * (upper - lower) if scale is None else np.array(scale, dtype=float)
    if scales.shape not in ((), lower.shape) or not np.all(np.isfinite(scales) & (scales > 0)):
        raise InputError(f"scale {scale!r}; expected: {lower.size} positive numbers")
    if not (population >= 1 and np.isfinite(step) and step > 0):
        raise InputError(f"population {population!r} and step {step!r}; expected: positive numbers")

    def objective(smell: np.ndarray) -> np.ndarray:
        # beyond the upper bound a fly stands for the bound
        return evaluate(np.clip(lower + scales * smell, lower, upper))

    starts = rng.uniform(-START, START, (1, lower.size, 2))
    iterations = -(-evaluate.allowed // population)
    fly(objective, starts, step, iterations, population, rng, adaptive)
