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
        if not (np.isfinite(cost) and np.isfinite(scaled).all()):
            return Optimum(x, np.inf, jacobian, iteration, False)
        gradient, curvature = scaled.T @ residual, scaled.T @ scaled
        free = ~(((x <= lower) & (gradient > 0)) | ((x >= upper) & (gradient < 0)))
        if not free.any():
            return Optimum(x, cost, jacobian, iteration, True)
        below, above = (lower - x) / scale, (upper - x) / scale
        while True:
            moved, clipped = _step(gradient, curvature, free, damping, below, above)
            predicted = -(gradient @ moved + 0.5 * moved @ curvature @ moved)
            if predicted <= tolerance * cost and not clipped:
                return Optimum(x, cost, jacobian, iteration, True)
            gain = -1.0
            if predicted > 0:
                trial = np.clip(x + moved * scale, lower, upper)
                new_cost = _cost(problem(trial, False)[0])
                gain = (cost - new_cost) / predicted
            if gain > 0:
                break
            damping, growth = damping * growth, growth * 2
            if damping > 1e12:
                return Optimum(x, cost, jacobian, iteration, True)
        small = cost - new_cost <= tolerance * cost and not clipped
        x = trial
        residual, jacobian = problem(x, True)
        cost = _cost(residual)
        damping, growth = damping * max(1 / 3, 1 - (2 * gain - 1) ** 3), 2.0
        if small:
            return Optimum(x, cost, jacobian, iteration, True)
    return Optimum(x, cost, jacobian, most, False)


def _step(
    gradient: NDArray,
    curvature: NDArray,
    free: NDArray,
    damping: float,
    below: NDArray,
    above: NDArray,
) -> tuple[NDArray, bool]:
    """Damped step of the free parameters between bounds, and whether it meets one.

    Parameters that would leave stop at their bound; the others then step anew.
    """
    step, free, clipped = np.zeros_like(gradient), free.copy(), False
    norm = np.sqrt(np.diag(curvature))
    norm[norm == 0] = 1.0
    while free.any():
        inner = curvature[np.ix_(free, free)] / np.outer(norm[free], norm[free])
        # the floor keeps what the data do not determine solvable
        inner[np.diag_indices_from(inner)] += damping + 1e-13
        wanted = -(gradient + curvature @ (step * ~free))[free] / norm[free]
        step[free] = np.linalg.solve(inner, wanted) / norm[free]
        outside = free & ((step < below) | (step > above))
        if not outside.any():
            break
        step = np.where(outside, np.clip(step, below, above), step)
        free, clipped = free & ~outside, True
    return step, clipped


def _cost(residual: NDArray) -> float:
    with np.errstate(over="ignore", invalid="ignore"):
        cost = 0.5 * float(residual @ residual)
    return cost if np.isfinite(cost) else np.inf
