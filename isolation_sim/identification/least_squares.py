"""Nonlinear least squares within bounds, for problems whose derivatives cost next to nothing.

A compiled law gives residuals and their exact derivatives in some tens of microseconds; a general
library's bookkeeping would take most of a fit's time. So the step is taken from the normal
equations of the scaled problem, which are of the size of the parameters, not of the data.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite

import numpy as np
from numpy.typing import NDArray

Problem = Callable[[NDArray, bool], tuple[NDArray, NDArray]]
"""(parameters, whether derivatives are wanted) -> residuals (n,), derivatives (n, n_parameters)."""
VALLEY = 10
"""Successive steps whose common gain decides whether a search moves along a flat valley."""
DETERMINED = 1e-6
"""Of the largest singular value of derivatives in unit columns: directions below it are not
determined by the data."""
AT_BOUND = 1e-6
"""Distance from a bound, over the size of a value, below which it lies at it: an optimiser's
rounding. Theory."""


@dataclass(frozen=True)
class Optimum:
    """Where a least-squares search ended."""

    x: NDArray  # (n,): Parameters
    cost: float  # Half the sum of squared residuals
    residual: NDArray  # (n_residuals,): Residuals there
    jacobian: NDArray  # (n_residuals, n): Their derivatives
    iterations: int  # Steps tried
    converged: bool  # Whether it ended because no step would lower the cost noticeably


def at_bound(value: float, lower: float, upper: float, size: float | None = None) -> bool:
    """Whether a fitted value lies at a bound; ``size``: its range, or itself if that is open."""
    if size is None:
        size = upper - lower if isfinite(upper - lower) else abs(value)
    return bool(min(abs(value - lower), abs(upper - value)) <= AT_BOUND * size)


def levenberg_marquardt(
    problem: Problem,
    start: NDArray,
    lower: NDArray,
    upper: NDArray,
    most: int = 100,
    tolerance: float = 1e-10,
    eager: bool = True,
    valley: float = 0.0,
    secants: bool = False,
) -> Optimum:
    """Minimise half the sum of squared residuals within bounds.

    The search has also converged where ``VALLEY`` steps together lower the cost by less than the
    share ``valley``. With ``secants``, for derivatives that cost much, each step updates them
    (Broyden's method); they are computed again where a step fails and before the search has
    converged.

    Notes
    -----
    Levenberg's damping in variables scaled by the columns' norms (Marquardt), Nielsen's update of
    the damping; a parameter on a bound takes part only if the descent leads inwards, and one whose
    step would cross a bound stops there while the others step anew.
    """
    x = np.clip(start, lower, upper)
    residual, jacobian = problem(x, True)
    stale = False  # whether the derivatives are updated ones
    cost = _cost(residual)
    damping, growth = 1e-3, 2.0
    costs = [cost]
    for iteration in range(1, most + 1):
        # everything below is in variables that the derivatives' columns make of one size
        with np.errstate(over="ignore", invalid="ignore"):
            curvature = jacobian.T @ jacobian
        if not (isfinite(cost) and np.isfinite(curvature).all()):
            return Optimum(x, np.inf, residual, jacobian, iteration, False)
        norm = np.sqrt(curvature.diagonal())
        norm[norm == 0] = 1.0
        curvature = curvature / norm / norm[:, np.newaxis]
        gradient = (residual @ jacobian) / norm
        below, above = (lower - x) * norm, (upper - x) * norm
        free = ((below < 0) | (gradient <= 0)) & ((above > 0) | (gradient >= 0))
        hopeful = eager and not secants
        converged, gain = not free.any(), -1.0
        while not converged:
            step, clipped = _step(gradient, curvature, free, damping, below, above)
            predicted = -float((gradient + 0.5 * (curvature @ step)) @ step)
            converged = predicted <= tolerance * cost and not clipped
            if predicted > 0 and not converged:
                trial = np.minimum(np.maximum(x + step / norm, lower), upper)
                new_residual, new_jacobian = problem(trial, hopeful)
                new_cost = _cost(new_residual)
                gain = (cost - new_cost) / predicted
            if gain > 0 or stale:
                break
            hopeful = False
            damping, growth = damping * growth, growth * 2
            converged = converged or damping > 1e12
        if stale and not gain > 0:
            jacobian, stale = problem(x, True)[1], False
            continue
        if converged:
            return Optimum(x, cost, residual, jacobian, iteration, True)
        small = cost - new_cost <= tolerance * cost and not clipped
        costs.append(new_cost)
        flat = len(costs) > VALLEY and costs[-1 - VALLEY] - new_cost < valley * new_cost
        ends = (small or flat) and not stale
        if hopeful:
            jacobian = new_jacobian
        elif secants and not (small or flat):
            jacobian, stale = _updated(jacobian, new_residual - residual, trial - x, norm), True
        else:
            jacobian, stale = problem(trial, True)[1], False
        x, cost, residual = trial, new_cost, new_residual
        damping, growth = damping * max(1 / 3, 1 - (2 * gain - 1) ** 3), 2.0
        if ends:
            return Optimum(x, cost, residual, jacobian, iteration, True)
    if stale:
        jacobian = problem(x, True)[1]
    return Optimum(x, cost, residual, jacobian, most, False)


def _updated(jacobian: NDArray, change: NDArray, step: NDArray, norm: NDArray) -> NDArray:
    """Derivatives that agree with a step, changed least in variables scaled by ``norm``."""
    scaled = norm**2 * step
    return jacobian + np.outer(change - jacobian @ step, scaled / (scaled @ step))


def _step(
    gradient: NDArray,
    curvature: NDArray,
    free: NDArray,
    damping: float,
    below: NDArray,
    above: NDArray,
) -> tuple[NDArray, bool]:
    """Damped step of the free parameters between bounds, and whether it meets one."""
    # Parameters that would leave stop at their bound; the others then step anew.
    # the floor keeps what the data do not determine solvable
    damped = curvature + (damping + 1e-13) * np.eye(len(gradient))
    if free.all():
        step = np.linalg.solve(damped, -gradient)
        if ((step >= below) & (step <= above)).all():
            return step, False
    step, free, clipped = np.zeros_like(gradient), free.copy(), False
    while free.any():
        target = -(gradient + curvature @ (step * ~free))[free]
        step[free] = np.linalg.solve(damped[np.ix_(free, free)], target)
        outside = free & ((step < below) | (step > above))
        if not outside.any():
            break
        step = np.where(outside, np.clip(step, below, above), step)
        free, clipped = free & ~outside, True
    return step, clipped


def unit_columns(jacobian: NDArray) -> tuple[NDArray, NDArray]:
    """Scale the columns of derivatives to length 1; those that are zero or diverge are zero."""
    largest = np.max(np.abs(jacobian), axis=0, initial=0.0)
    usable = np.isfinite(largest) & (largest > 0)
    # squares of large derivatives may overflow
    scaled = np.where(usable, jacobian, 0.0) / np.where(usable, largest, 1.0)
    length = np.sqrt(np.einsum("ij,ij->j", scaled, scaled))
    length[~usable] = 1.0
    return scaled / length, np.where(usable, length * largest, 1.0)


def orthonormal(jacobian: NDArray) -> NDArray:
    """Orthonormal directions that the columns of derivatives determine, (n_residuals, n)."""
    u, s, _ = np.linalg.svd(unit_columns(jacobian)[0], full_matrices=False)
    return u[:, s > DETERMINED * max(float(s[0]), 1e-300)] if len(s) else u


def _cost(residual: NDArray) -> float:
    # unlike @, vdot does not warn of what is not finite
    cost = 0.5 * float(np.vdot(residual, residual))
    return cost if isfinite(cost) else np.inf
