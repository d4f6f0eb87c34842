"""Li & Li, Table 1: the five-parameter model fitted anew to the measured stiffness and damping."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from isolation_sim.laws.published import CURRENTS_A, LI_LI_GENERALISED
from studies.papers.tables import LI_LI_DAMPING_RATIO, LI_LI_STIFFNESS_N_PER_MM

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

NAMES = tuple(LI_LI_GENERALISED)
"""c0, k0, c1, k1, alpha; N, mm, s."""

OMEGA = 2 * np.pi
"""Circular frequency of Table 1, 1/s."""

REFERENCE_MM = 4.0
"""Amplitude at which the amplitude's factor is 1."""

STARTS = 4
"""Random starts of each fit; the best is taken."""


@cache
def lower_branch() -> CubicSpline:
    """Steady force of the stiffening branch, over c1 ω X.

    The branch depends only on s = X (alpha / (c1 ω))^(1/2): its state over the amplitude obeys
    dζ/dτ = cos τ - s² ζ³, and its force over c1 ω X is s² ζ³.
    """
    from scipy.interpolate import CubicSpline

    s = np.exp(np.linspace(np.log(1e-2), np.log(1e2), 120))
    square, n = s**2, 512
    h = np.pi / n
    tau = -np.pi / 2 + h * np.arange(n + 1)

    def half_cycle(start: NDArray) -> tuple[NDArray, NDArray]:
        """Implicit midpoint rule over half a cycle, and its derivative by the start."""
        zeta, slope = np.empty((n + 1, len(s))), np.ones(len(s))
        zeta[0] = start
        for i in range(n):
            middle = zeta[i]
            rate = np.cos(tau[i] + h / 2)
            for _ in range(3):
                off = middle - zeta[i] - h / 2 * (rate - square * middle**3)
                middle = middle - off / (1 + h / 2 * 3 * square * middle**2)
            zeta[i + 1] = 2 * middle - zeta[i]
            decay = h / 2 * 3 * square * middle**2
            slope = slope * (1 - decay) / (1 + decay)
        return zeta, slope

    start = -np.minimum(1.0, s ** (-2 / 3))
    for _ in range(4):
        zeta, slope = half_cycle(start)
        start = start - (zeta[-1] + start) / (slope + 1)  # half a cycle on, the state is opposite
    force = square * zeta**3
    loss = 2 / np.pi * np.trapezoid(force * np.cos(tau)[:, None], dx=h, axis=0)
    return CubicSpline(np.log(s), np.column_stack([force[-1], loss]))


def loops(c0: NDArray, k0: NDArray, c1: NDArray, k1: NDArray, alpha: NDArray) -> NDArray:
    """Steady loops at Table 1's amplitudes and currents; further axes of the parameters first."""
    series = k0 + 1j * OMEGA * c0
    upper = k1 * series / (k1 + series)
    x = np.array(list(LI_LI_STIFFNESS_N_PER_MM))[:, None]
    s = np.broadcast_to(x * np.sqrt(alpha / (c1 * OMEGA)), (*alpha.shape[:-2], 3, 4))
    lower = lower_branch()(np.log(np.clip(s, 1e-2, 1e2)))
    stiffness = upper.real + c1 * OMEGA * lower[..., 0]
    return np.array([stiffness, (upper.imag + c1 * OMEGA * lower[..., 1]) / (2 * stiffness)])


@dataclass(frozen=True)
class Refit:
    """How close a form of the model comes to Table 1."""

    # stiffness, damping: Root mean square of the twelve relative errors, percent
    stiffness: float
    damping: float
    parameters: int  # How many numbers were fitted
    # e0 and e1 (1/A) of the factor (X / 4 mm)^-(e0 + e1 I) on every parameter; empty without
    softening: tuple[float, ...] = ()


@cache
def refit(degree: int, softening: bool = False) -> Refit:
    """Fit the five-parameter model to Table 1 by least squares of all 24 relative errors."""
    from scipy.optimize import least_squares

    measured = np.array(
        [list(table.values()) for table in (LI_LI_STIFFNESS_N_PER_MM, LI_LI_DAMPING_RATIO)]
    )
    currents = np.array(CURRENTS_A)
    # a parameter's polynomial is given by the logarithms of its values at degree + 1 currents
    nodes = np.linspace(0.0, 3.0, degree + 1)
    powers = np.arange(degree + 1)
    values = currents[:, None] ** powers @ np.linalg.inv(nodes[:, None] ** powers)
    amplitudes = np.array(list(LI_LI_STIFFNESS_N_PER_MM))[:, None] / REFERENCE_MM
    count = len(NAMES) * (degree + 1)

    def errors(numbers: NDArray) -> NDArray:
        """Relative errors; of several parameterisations, one row each."""
        shape = numbers.shape[:-1]
        at_nodes = np.exp(np.clip(numbers[..., :count].reshape(*shape, len(NAMES), -1), -20, 20))
        parameters = np.maximum(at_nodes @ values.T, 1e-9)[..., None, :]
        if softening:
            e0, e1 = (numbers[..., k, None, None, None] for k in (count, count + 1))
            parameters = parameters * amplitudes ** -(e0 + e1 * currents)
        simulated = loops(*np.moveaxis(parameters, -3, 0))
        return np.moveaxis(simulated, 0, -3).reshape(*shape, -1) / measured.ravel() - 1

    def slopes(numbers: NDArray) -> NDArray:
        """Forward differences, all columns at once."""
        step = 1.5e-8 * np.where(numbers < 0, -1, 1) * np.maximum(1.0, np.abs(numbers))
        moved = errors(numbers + np.diag(step))
        return ((moved - errors(numbers)) / step[:, None]).T

    rng = np.random.default_rng(0)
    middle = np.log([5.0, 10.0, 5.0, 40.0, 0.05])[:, None]
    fits = []
    for _ in range(STARTS):
        start = (middle + rng.normal(0, 1.0, (len(NAMES), degree + 1))).ravel()
        fits.append(least_squares(errors, [*start, *((0.3, 0.0) if softening else ())], slopes))
    best = min(fits, key=lambda fit: fit.cost)
    stiffness, damping = 100 * np.sqrt(np.mean(best.fun.reshape(2, -1) ** 2, axis=1))
    return Refit(
        float(stiffness),
        float(damping),
        len(best.x),
        tuple(float(e) for e in best.x[count:]),
    )
