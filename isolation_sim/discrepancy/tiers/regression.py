"""Linear regression on a residual beside a fitted model, judged on conditions left out.

All candidates are columns of one problem whose normal equations are kept fold by fold: any subset
of the columns is fitted without any condition, and judged on that condition, by small systems.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...identification.measured_runs import MeasuredRuns
from ..decisions import LEFT_OUT_GROUPS, SAME_CONDITION

_RIDGE = 1e-9
"""Of each column's own power: keeps dependent columns solvable."""


def conditions(data: MeasuredRuns) -> list[tuple[str, NDArray]]:
    """Groups of fitted samples to leave out in turn, and their names."""
    # Runs of nearly the same amplitude and velocity are one motion. Many motions are put together
    # by their size, so that what is left out is also an extrapolation. A single run is cut in time.
    own = [run for run in data.runs if data.fitted[run].any()]
    number = np.zeros(len(data.x), dtype=int)
    if len(own) < 3:
        inside = np.flatnonzero(data.fitted)
        parts = np.array_split(inside, LEFT_OUT_GROUPS)
        return [(f"part {k + 1}", _mask(number, part)) for k, part in enumerate(parts)]
    sizes = np.log([[np.max(np.abs(y[run])) for y in (data.x, data.v)] for run in own])
    motions: list[list[int]] = []
    for k in np.argsort(sizes.sum(axis=1), kind="stable").tolist():
        near = (m for m in motions if np.all(np.abs(sizes[k] - sizes[m[0]]) < SAME_CONDITION))
        found = next(near, None)
        if found is None:
            motions.append([k])
        else:
            found.append(k)
    count = min(LEFT_OUT_GROUPS, len(motions))
    groups = [
        [k for m in part for k in motions[m]] for part in np.array_split(range(len(motions)), count)
    ]  # fmt: skip
    named = [
        (f"up to {1e3 * np.exp(max(sizes[k][0] for k in group)):.3g} mm, "
         f"{1e3 * np.exp(max(sizes[k][1] for k in group)):.3g} mm/s", group)
        for group in groups
    ]  # fmt: skip
    result = [(name, _runs_mask(data, [own[k] for k in group])) for name, group in named]
    return [one for one in result if one[1].any()]


def _mask(like: NDArray, places: NDArray) -> NDArray:
    mask = np.zeros(len(like), dtype=bool)
    mask[places] = True
    return mask


def _runs_mask(data: MeasuredRuns, runs: Sequence[slice]) -> NDArray:
    mask = np.zeros(len(data.x), dtype=bool)
    for run in runs:
        mask[run] = data.fitted[run]
    return mask


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

    def fit(self, chosen: NDArray, gram: NDArray, penalty: NDArray | float = _RIDGE) -> NDArray:
        """Coefficients of chosen columns, in units of their sizes, by given products."""
        inside = gram[np.ix_(chosen, chosen)]
        damped = inside + np.diag(np.zeros(len(chosen)) + penalty)
        return -np.linalg.solve(damped, gram[chosen, -1]) if len(chosen) else np.zeros(0)

    def left(self, chosen: NDArray, coefficients: NDArray, gram: NDArray) -> float:
        """Squared residual that coefficients leave, by given products."""
        inside = gram[np.ix_(chosen, chosen)]
        b = gram[chosen, -1]
        total = gram[-1, -1] + 2 * coefficients @ b + coefficients @ inside @ coefficients
        return max(float(total), 0.0) * float(self.size[-1] ** 2)

    def coefficients(
        self, chosen: NDArray, penalty: NDArray | float = _RIDGE, without: int = -1
    ) -> NDArray:
        """Coefficients in the columns' units, of all folds or without one."""
        total = self.gram.sum(axis=0) - (self.gram[without] if without >= 0 else 0.0)
        return self.fit(chosen, total, penalty) * self.size[-1] / self.size[chosen]

    def left_out(self, chosen: NDArray, penalty: NDArray | float = _RIDGE) -> NDArray:
        """Squared residual of each fold, fitted without it, (n_folds,)."""
        total = self.gram.sum(axis=0)
        return np.array([
            self.left(chosen, self.fit(chosen, total - one, penalty), one) for one in self.gram
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
