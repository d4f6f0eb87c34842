"""Bryson's rule: the sum of squared outputs, each over its largest acceptable value."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from isolation_sim.structures import Structure

from .compiled import CompiledController
from .settings import Number, SearchRange, setting


class BrysonsRule(CompiledController):
    """A controller that weighs displacement, velocity, drift and acceleration by Bryson's rule.

    References
    ----------
    Bryson and Ho 1975, Applied Optimal Control.
    """

    largest_displacement: float = setting(
        0.2, "acceptable isolator deformation; inf for no weight", Number(above=0, infinite=True),
        "m", SearchRange(0.02, 2.0),
    )  # fmt: skip
    largest_velocity: float = setting(
        0.3, "acceptable velocity of that deformation; inf for no weight",
        Number(above=0, infinite=True), "m/s", SearchRange(0.03, 10.0),
    )  # fmt: skip
    largest_drift: float = setting(
        np.inf, "acceptable storey drift; inf for no weight", Number(above=0, infinite=True), "m"
    )
    largest_acceleration: float = setting(
        1.0, "acceptable absolute acceleration of a level; inf for no weight",
        Number(above=0, infinite=True), "m/s^2", SearchRange(0.1, 10.0),
    )  # fmt: skip

    def weighted_outputs(self, linear: Structure, rows: NDArray) -> NDArray:
        """Outputs over their largest acceptable values."""
        n = linear.n_dofs
        acceleration = -np.linalg.solve(linear.mass, np.hstack([linear.stiffness, linear.damping]))
        return np.vstack([
            np.pad(rows, ((0, 0), (0, n))) / self.largest_displacement,
            np.pad(rows, ((0, 0), (n, 0))) / self.largest_velocity,
            np.pad(linear.drift_rows, ((0, 0), (0, n))) / self.largest_drift,
            acceleration / self.largest_acceleration,
        ])  # fmt: skip
