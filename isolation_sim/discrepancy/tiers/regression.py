"""Linear regression on a residual beside a fitted model, cross-validated over conditions.

All candidates are columns of one problem whose normal equations are kept fold by fold: any subset
of the columns is fitted without a condition and validated on it, by small systems.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_RIDGE = 1e-9
"""Of each column's own power: keeps dependent columns solvable."""


@dataclass(frozen=True, eq=False)
class Regression:
    """Normal equations of a residual and of columns that may reduce it, fold by fold."""

    # (n_folds, n + 1, n + 1): Products of all columns, the residual last, of each fold's samples
    gram: NDArray
    size: NDArray  # (n + 1,): Norm of each column over all folds

    @classmethod
    def of(cls, columns: NDArray, residual: NDArray, folds: Sequence[NDArray]) -> Regression:
        """Set up the products of columns, (n_samples, n), and a residual, (n_samples,)."""
        every = np.column_stack([columns, residual])
        with np.errstate(over="ignore", invalid="ignore"):
            size = np.sqrt(np.einsum("ij,ij->j", every, every))
        # a column that diverges is left out
        every[:, ~np.isfinite(size)] = 0.0
        size[~((size > 0) & np.isfinite(size))] = 1.0
        every = every / size
        return cls(np.stack([every[fold].T @ every[fold] for fold in folds]), size)

    def fit(self, chosen: NDArray, gram: NDArray) -> NDArray:
        """Coefficients of chosen columns, in units of their sizes, by given products."""
        damped = gram[np.ix_(chosen, chosen)] + _RIDGE * np.eye(len(chosen))
        return -np.linalg.solve(damped, gram[chosen, -1]) if len(chosen) else np.zeros(0)

    def left(self, chosen: NDArray, coefficients: NDArray, gram: NDArray) -> float:
        """Squared residual that coefficients leave, by given products."""
        inside = gram[np.ix_(chosen, chosen)]
        b = gram[chosen, -1]
        total = gram[-1, -1] + 2 * coefficients @ b + coefficients @ inside @ coefficients
        return max(float(total), 0.0) * float(self.size[-1] ** 2)

    def cost(self, chosen: NDArray) -> float:
        """Squared residual that a fit of chosen columns to all folds leaves."""
        total = self.gram.sum(axis=0)
        return self.left(chosen, self.fit(chosen, total), total)

    def left_out(self, chosen: NDArray) -> NDArray:
        """Squared residual of each fold, fitted without it, (n_folds,)."""
        total = self.gram.sum(axis=0)
        return np.array([
            self.left(chosen, self.fit(chosen, total - one), one) for one in self.gram
        ])  # fmt: skip

    def gains(self, chosen: NDArray, groups: Sequence[NDArray], without: int) -> NDArray:
        """Decrease of the squared residual by each group of columns beside those chosen."""
        # The columns are first made orthogonal to the chosen ones (orthogonal least squares).
        # ``without`` is a fold to leave out; none if negative.
        total = self.gram.sum(axis=0) - (self.gram[without] if without >= 0 else 0.0)
        if len(chosen):
            inside = total[np.ix_(chosen, chosen)] + _RIDGE * np.eye(len(chosen))
            total = total - total[:, chosen] @ np.linalg.solve(inside, total[chosen])
        gains = []
        for group in groups:
            inside = total[np.ix_(group, group)] + _RIDGE * np.eye(len(group))
            b = total[group, -1]
            gains.append(float(b @ np.linalg.solve(inside, b)) * float(self.size[-1] ** 2))
        return np.array(gains)
