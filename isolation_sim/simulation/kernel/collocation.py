"""Constants of the collocation at the three Gauss points of a step of unit length."""

from __future__ import annotations

import numpy as np

_ROOT15 = 15.0**0.5
NODES = (0.5 - _ROOT15 / 10, 0.5, 0.5 + _ROOT15 / 10)
"""Gauss points."""
WEIGHTS = (5 / 18, 8 / 18, 5 / 18)
COLLOCATION = (
    (5 / 36, 2 / 9 - _ROOT15 / 15, 5 / 36 - _ROOT15 / 30),
    (5 / 36 + _ROOT15 / 24, 2 / 9, 5 / 36 - _ROOT15 / 24),
    (5 / 36 + _ROOT15 / 30, 2 / 9 + _ROOT15 / 15, 5 / 36),
)
"""Integrals of the Lagrange polynomials from the step's start to each node."""
END_FROM_NODES = (5 / 3, -4 / 3, 5 / 3)
"""Weights w_j: state at the end = start + sum of w_j (state at node j - start)."""
GAIN_SLOPE = (np.array(COLLOCATION) @ COLLOCATION - np.array(COLLOCATION) / 2).tolist()
"""First-order change of ``COLLOCATION`` by the relaxation of a state."""
RATES_FROM_NODES = np.linalg.inv(COLLOCATION)
"""Matrix D: step length * rates at the nodes = D (states at the nodes - state at the start)."""


def polynomials(*nodes: float) -> tuple[tuple[float, ...], ...]:
    """Ascending coefficients of the polynomials that are 1 at one node and 0 at the others."""
    return tuple(map(tuple, np.linalg.inv(np.vander(nodes, increasing=True)).T.tolist()))


NODES_AND_END = (*NODES, 1.0)
LAGRANGE = polynomials(*NODES)
THROUGH_ENDS = polynomials(0.0, *NODES, 1.0)
