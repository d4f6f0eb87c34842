"""Nonlinear least squares within bounds, for problems whose derivatives cost next to nothing.

A compiled law gives residuals and their exact derivatives in some tens of microseconds; a general
library's bookkeeping would take most of a fit's time. So the step is taken from the normal
equations of the scaled problem, which are of the size of the parameters, not of the data.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Problem = Callable[[NDArray, bool], tuple[NDArray, NDArray]]
"""(parameters, whether derivatives are wanted) -> residuals (n,), derivatives (n, n_parameters)."""


@dataclass(frozen=True)
class Optimum:
    """Where a least-squares search ended.

    Attributes
    ----------
    x : (n,) array
        Parameters.
    cost : float
        Half the sum of squared residuals.
    jacobian : (n_residuals, n) array
        Derivatives of the residuals there.
    iterations : int
        Steps tried.
    converged : bool
        Whether it ended because no step would lower the cost noticeably.
    """

    x: NDArray
    cost: float
    jacobian: NDArray
    iterations: int
    converged: bool


def levenberg_marquardt(
    problem: Problem,
    start: NDArray,
    lower: NDArray,
    upper: NDArray,
    scale: NDArray,
    most: int = 100,
    tolerance: float = 1e-10,
) -> Optimum:
    """Minimise half the sum of squared residuals within bounds.

    Parameters
    ----------
    problem : callable
        Residuals and their derivatives; a residual that is not finite makes a step fail.
    start : (n,) array
        Parameters to start from; moved into the bounds.
    lower, upper : (n,) array
        Bounds.
    scale : (n,) array
        Size of a noticeable change of each parameter.
    most : int
        Most steps to try.
    tolerance : float
        Relative decrease of the cost below which the search ends.

    Returns
    -------
    Optimum

    Notes
    -----
    Levenberg's damping in variables scaled by the columns' norms (Marquardt), Nielsen's update of
    the damping; a parameter on a bound takes part only if the descent leads inwards.
    """
    x = np.clip(start, lower, upper)
    residual, jacobian = problem(x, True)
    cost = _cost(residual)
    damping, growth = 1e-3, 2.0
    for iteration in range(1, most + 1):
        scaled = jacobian * scale
        gradient, curvature = scaled.T @ residual, scaled.T @ scaled
        free = ~(((x <= lower) & (gradient > 0)) | ((x >= upper) & (gradient < 0)))
        if not free.any() or not np.isfinite(cost):
            return Optimum(x, cost, jacobian, iteration, bool(np.isfinite(cost)))
        inner = curvature[np.ix_(free, free)]
        diagonal = np.diag(inner) + 1e-14 * np.trace(inner) + 1e-300
        while True:
            step = np.zeros_like(x)
            step[free] = np.linalg.solve(
                inner + np.diag(damping * diagonal), -gradient[free]
            )
            trial = np.clip(x + step * scale, lower, upper)
            moved = (trial - x) / scale
            predicted = -(gradient @ moved + 0.5 * moved @ curvature @ moved)
            if predicted <= tolerance * cost:
                return Optimum(x, cost, jacobian, iteration, True)
            new_cost = _cost(problem(trial, False)[0])
            gain = (cost - new_cost) / predicted
            if gain > 0:
                break
            damping, growth = damping * growth, growth * 2
            if damping > 1e12:
                return Optimum(x, cost, jacobian, iteration, True)
        small = cost - new_cost <= tolerance * cost
        x = trial
        residual, jacobian = problem(x, True)
        cost = _cost(residual)
        damping, growth = damping * max(1 / 3, 1 - (2 * gain - 1) ** 3), 2.0
        if small:
            return Optimum(x, cost, jacobian, iteration, True)
    return Optimum(x, cost, jacobian, most, False)


def _cost(residual: NDArray) -> float:
    cost = 0.5 * float(residual @ residual)
    return cost if np.isfinite(cost) else np.inf
