"""Exact propagation of a structure over an interval, with interpolated forces and ground motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from isolation_sim.simulation.complex_modes import Modes

_POINTS = 40
"""Gauss points of the convolution with a mode; exact to rounding up to |eigenvalue| h = 30."""


@dataclass(frozen=True)
class Propagator:
    """Modes after a time t, from those at 0: z = decay z0 + force r + ground a."""

    # The modes are in real form: all real parts, then all imaginary ones.

    decay: NDArray  # (n, n): From the modes
    # (n, n_elements, n_nodes): From the difference of each device's force (N, device scale) and its
    # reference spring and dashpot, at equally spaced nodes of the interval
    force: NDArray
    # (n, n_directions, 2): From the ground acceleration (m/s^2) at the interval's two ends
    ground: NDArray


def propagator(modes: Modes, h: float, t: float, n_nodes: int) -> Propagator:
    """Propagate modes from the start of an interval to a time in it."""
    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
    at, weights = t * (nodes + 1) / 2, t * weights / 2
    kernel = weights * np.exp(np.multiply.outer(modes.eigenvalues, t - at))

    def convolved(columns: NDArray, n: int) -> NDArray:
        shapes = kernel @ _lagrange(at / h, n).T
        parts = columns.T[:, :, np.newaxis] * shapes[:, np.newaxis, :]
        return np.concatenate([parts.real, parts.imag])

    grown = np.exp(modes.eigenvalues * t)
    turned = np.diag(grown.imag)
    stretched = np.diag(grown.real)
    return Propagator(
        np.block([[stretched, -turned], [turned, stretched]]),
        convolved(modes.force, n_nodes),
        convolved(modes.ground, 2),
    )


def _lagrange(x: NDArray, n: int) -> NDArray:
    """Lagrange polynomials of n equally spaced nodes on [0, 1], (n, len(x))."""
    nodes = np.linspace(0, 1, n) if n > 1 else np.zeros(1)
    values = np.ones((n, x.size))
    for k in range(n):
        for j in range(n):
            if j != k:
                values[k] *= (x - nodes[j]) / (nodes[k] - nodes[j])
    return values
