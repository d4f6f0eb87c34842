"""Estimate of the isolator force relative to the nominal one, during the motion, for Numba.

The isolators carry what the inertia forces of all levels add up to: the sum of mass times absolute
acceleration, in each direction, is compared with the devices' forces by the law. One factor on all
of these forces follows by least squares with forgetting.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from isolation_sim.structures import IsolatedStructure

CERTAIN = 0.1
"""Acceleration, m/s^2. One second of it has the same weight as the nominal model."""
LOWEST, HIGHEST = 0.3, 3.0


def balance(nominal: IsolatedStructure) -> tuple[NDArray, NDArray]:
    """Rows of each direction's mean acceleration, from accelerations and from forces."""
    structure = nominal.structure
    along = structure.above_foundation[:, : len(structure.horizontal)].T
    mass = np.diag(along @ structure.mass @ along.T)[:, np.newaxis]
    return along @ structure.mass / mass, -along @ nominal.element_rows.T / mass


def learn_scale(
    acceleration: NDArray, force: NDArray, by_inertia: NDArray, by_force: NDArray, decay: float,
    prior: float, sums: NDArray,
) -> float:  # fmt: skip
    """Update the force over that of the nominal model, 0.3 to 3, by one more instant."""
    # sums: (2,): of squares and of products; ``prior`` each at the start
    for k in range(2):
        sums[k] = decay * sums[k] + (1.0 - decay) * prior
    for d in range(by_inertia.shape[0]):
        seen, expected = 0.0, 0.0
        for i in range(by_inertia.shape[1]):
            seen += by_inertia[d, i] * acceleration[i]
        for e in range(by_force.shape[1]):
            expected += by_force[d, e] * force[e]
        sums[0] += expected * expected
        sums[1] += expected * seen
    return min(max(sums[1] / sums[0], LOWEST), HIGHEST)
