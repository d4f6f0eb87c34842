"""Estimate of the isolator force relative to the nominal one, during the motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from isolation_sim.structures import IsolatedStructure

CERTAIN = 0.1
"""Acceleration, m/s^2. A second of it, as predicted, weighs as much as the nominal model."""
LOWEST, HIGHEST = 0.3, 3.0


class ForceScale:
    """One factor on all device forces, by least squares with forgetting."""

    # The isolators carry what the inertia forces of all levels add up to: the sum of mass times
    # absolute acceleration, in each direction, is compared with the devices' forces by the law.
    # nominal: The model reasoned with.
    # step: Interval between decisions, s.
    # memory: Time after which what was seen counts 1/e, s.

    def __init__(self, nominal: IsolatedStructure, step: float, memory: float):
        along = nominal.structure.influence.T
        mass = np.diag(along @ nominal.structure.mass @ along.T)[:, np.newaxis]
        self._inertia = along @ nominal.structure.mass / mass
        self._devices = -along @ nominal.element_rows.T / mass
        self._keep = float(np.exp(-step / memory))
        self._prior = CERTAIN**2 / step
        self._square = self._product = self._prior
        self.factor = 1.0  # Force over that of the nominal model, 0.3 to 3

    def learn(self, acceleration: NDArray, force: NDArray) -> float:
        """Take one more instant into account."""
        seen, expected = self._inertia @ acceleration, self._devices @ force
        forgotten = (1 - self._keep) * self._prior
        self._square = self._keep * self._square + forgotten + float(expected @ expected)
        self._product = self._keep * self._product + forgotten + float(expected @ seen)
        self.factor = min(max(self._product / self._square, LOWEST), HIGHEST)
        return self.factor
