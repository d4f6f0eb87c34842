"""An objective within bounds that may be evaluated so often and no more."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np


class BudgetSpent(Exception):
    """The last evaluation was used; the budget holds the best result."""


class Budget:
    """An objective within bounds, counted."""

    def __init__(
        self,
        objective: Callable[[np.ndarray], float],  # Point, shape (n_parameters,), to a number
        # lower, upper: (n_parameters,): Bounds, in the parameters' units
        lower: np.ndarray,
        upper: np.ndarray,
        allowed: int,  # Evaluations that may be spent
    ):
        self._objective = objective
        self.lower, self.upper = lower, upper
        self.allowed = allowed
        # (n_parameters,): Best point so far; None before a finite value
        self.best: np.ndarray | None = None
        self.history: list[float] = []  # Best value after each evaluation, in the objective's unit

    @property
    def spent(self) -> int:
        """Evaluations spent."""
        return len(self.history)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Evaluate points one by one."""
        rows = points.reshape(-1, points.shape[-1])
        return np.array([self._one(row) for row in rows]).reshape(points.shape[:-1])

    def _one(self, point: np.ndarray) -> float:
        if self.spent >= self.allowed:
            raise BudgetSpent
        value = float(self._objective(point.copy()))
        if not np.isfinite(value):
            value = np.inf
        least = self.history[-1] if self.history else np.inf
        if value < least:
            self.best = point.copy()
        self.history.append(min(value, least))
        return value
