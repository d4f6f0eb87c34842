"""Stability of the causes named: how often they are named again from other runs.

The runs of one condition are left out in turn, and runs are drawn again with replacement. Every
model is refitted to each such set by one Gauss-Newton step from its optimum: the normal equations
of a set of runs are the sum of those of its runs. In each set a cause competes with the model
without it and with its rivals, by the criteria of the search.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...identification.least_squares import DETERMINED
from ..decisions import REDRAWN, RIVAL_WINS
from .conditions import conditions
from .effect_search import EffectSearch
from .model import FittedModel


@dataclass(frozen=True)
class Stability:
    """How often a cause is named again."""

    # Share of the fits without the runs of one condition; not a number where all runs share their
    # conditions
    conditions: float
    resamplings: float  # Share of the resamplings of the runs
    named: float  # Share of both
    # The same in which the cause, or one that is named instead, is more than noise
    needed: float
    # Causes that are named instead in a share of these that counts, the most frequent first
    rivals: tuple[str, ...]


def stability(space: EffectSearch, searched: FittedModel, seed: int) -> list[Stability]:
    """Judge each effect of a model that the search found."""
    data = searched.model.data
    n_runs = len(data.dt)
    included = np.array([~runs for _, runs in conditions(data)], float).reshape(-1, n_runs)
    draws = np.random.default_rng(seed).multinomial(n_runs, np.full(n_runs, 1 / n_runs), REDRAWN)
    weights = np.concatenate([included, draws.astype(float)])
    sizes = (weights @ data.lengths) / len(data.x)
    misfit = _costs(space.base, weights) - space.noise_cost * sizes
    costs = _costs(searched, weights)
    result = []
    for place, name in enumerate(searched.causes):
        without, rivals = space.rivals(searched, place)
        costs_without = _costs(without, weights)
        helps = space.helps(without, searched, costs_without, costs, sizes, misfit, named=True)
        others = [one for one in rivals if np.isfinite(one.cost)]
        names = [name, *(one.causes[-1] for one in others)]
        penalised = [space.penalised(searched, costs, sizes)]
        penalised += [space.penalised(one, _costs(one, weights), sizes) for one in others]
        winners = np.array(names)[np.argmin(penalised, axis=0)]
        named = helps & (winners == name)
        wins = Counter(winners[winners != name].tolist())
        result.append(
            Stability(
                float(np.mean(named[: len(included)])) if len(included) else float("nan"),
                float(np.mean(named[len(included) :])),
                float(np.mean(named)),
                float(np.mean(helps)),
                tuple(one for one, n in wins.most_common() if n > RIVAL_WINS * len(weights)),
            )
        )
    return result


def _costs(fitted: FittedModel, weights: NDArray) -> NDArray:
    """Cost after one Gauss-Newton step on each set of runs, (n_sets,); weights (n_sets, n_runs)."""
    if not (np.isfinite(fitted.cost) and np.isfinite(fitted.jacobian).all()):
        return np.full(len(weights), np.inf)
    lower, upper = fitted.model.bounds()
    free = (fitted.values > lower) & (fitted.values < upper)
    jacobian, residual = fitted.jacobian[:, free], fitted.residual
    length = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    jacobian = jacobian / np.where(length > 0, length, 1.0)
    runs = fitted.model.data.runs
    squares = np.array([jacobian[run].T @ jacobian[run] for run in runs])
    slopes = np.array([jacobian[run].T @ residual[run] for run in runs])
    costs = np.array([residual[run] @ residual[run] for run in runs])
    slopes = weights @ slopes
    inverse = np.linalg.pinv(np.tensordot(weights, squares, 1), DETERMINED, hermitian=True)
    return weights @ costs - np.einsum("ki,kij,kj->k", slopes, inverse, slopes)
