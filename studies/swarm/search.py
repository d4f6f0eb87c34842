"""One function for every search, and the budget that makes them comparable."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ground_motions.argument_types import checked
from isolation_sim.errors import InputError, check_name

from . import fish_swarm, fruit_fly, library
from .budget import Budget, BudgetSpent

# one line per method: a function of the budgeted objective and a random generator
_METHODS: dict[str, Callable[..., None]] = {
    "fruit_fly": fruit_fly.fruit_fly,
    "fruit_fly_fixed": partial(fruit_fly.fruit_fly, adaptive=False),
    "fish_swarm": fish_swarm.fish_swarm,
    "genetic": library.genetic,
    "particle_swarm": library.particle_swarm,
    "cma_es": library.cma_es,
}
_SUPPLIED = ("evaluate", "rng", "adaptive")


@dataclass(frozen=True, eq=False)
class SearchResult:
    """Result of a search.

    Attributes
    ----------
    x : numpy.ndarray, shape (n_parameters,)
        Best point, in the bounds' units.
    value : float
        The objective there, in its own unit.
    history : numpy.ndarray, shape (evaluations,)
        Best value after each evaluation.
    evaluations : int
        Evaluations spent: the budget, or fewer where a method ended by itself.
    method : str
        Name of the method.
    """

    x: np.ndarray
    value: float
    history: np.ndarray
    evaluations: int
    method: str


def available_methods() -> tuple[str, ...]:
    """Names of the searches.

    Returns
    -------
    tuple of str
    """
    return tuple(_METHODS)


@checked
def search(
    method: str,
    objective: Callable[[np.ndarray], float],
    bounds: ArrayLike,
    budget: int,
    seed: int,
    **settings: Any,
) -> SearchResult:
    """Minimise an objective within bounds by one of the papers' searches.

    Parameters
    ----------
    method : str
        ``fruit_fly`` (self-adaptive step), ``fruit_fly_fixed``, ``fish_swarm``; from pymoo
        ``genetic``, ``particle_swarm`` and ``cma_es``.
    objective : callable
        Point, shape (n_parameters,), to a number; a value that is not finite counts as worst.
    bounds : array_like, shape (n_parameters, 2)
        Lower and upper bound of each parameter, in its unit, finite.
    budget : int
        Evaluations of the objective, spent to the last unless a method ends by itself.
    seed : int
        The same seed gives the same result.
    **settings : Any
        The method's own, such as ``population``; ``scale`` and ``step`` of the fruit flies.

    Returns
    -------
    SearchResult

    Raises
    ------
    InputError
        If a method, a setting or its value is unknown, bounds or budget are not usable, the
        objective is finite nowhere, or pymoo is needed and not installed.
    """
    check_name("search method", method, _METHODS)
    run = _METHODS[method]
    accepted = [name for name in inspect.signature(run).parameters if name not in _SUPPLIED]
    for name in settings:
        check_name(f"setting of {method}", name, accepted)
    lower, upper = _checked_bounds(bounds)
    whole = isinstance(budget, int | np.integer) and not isinstance(budget, bool)
    if not (whole and budget >= 1):
        raise InputError(f"budget {budget!r}; expected: a whole number of evaluations, 1 or more")
    evaluate = Budget(objective, lower, upper, int(budget))
    try:
        run(evaluate, np.random.default_rng(seed), **settings)
    except BudgetSpent:
        pass
    if evaluate.best is None:
        raise InputError(
            f"objective is not finite at any of {evaluate.spent} points; expected: an objective "
            "that is finite somewhere within the bounds"
        )
    history = np.array(evaluate.history)
    return SearchResult(evaluate.best, float(history[-1]), history, evaluate.spent, method)


def _checked_bounds(bounds: Any) -> tuple[np.ndarray, np.ndarray]:
    pairs = np.array(bounds, dtype=float)
    if pairs.ndim != 2 or pairs.shape[0] == 0 or pairs.shape[1] != 2:
        raise InputError(f"bounds of shape {pairs.shape}; expected: (n_parameters, 2)")
    for k, (low, high) in enumerate(pairs):
        if not (np.isfinite(low) and np.isfinite(high) and low < high):
            raise InputError(
                f"bounds of parameter {k}: {low:g} to {high:g}; expected: finite, the lower first"
            )
    return pairs[:, 0], pairs[:, 1]
