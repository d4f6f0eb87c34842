"""The second tier: a sparse equation added to a law's force.

Candidate terms are screened by orthogonal regression on the force residual along the measured
motion, beside the tangent of everything fitted so far. A term is taken if it lowers the error on
conditions left out by more than one standard error and makes none of them worse, and if it is also
the choice without most of the conditions. The whole is then written as a law and fitted through the
simulation, together with the numbers inside its terms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...identification.least_squares import levenberg_marquardt
from ..decisions import (
    EQUATION_GAIN,
    EQUATION_STABLE,
    EQUATION_TERMS,
    NEARLY_CHOSEN,
    SIMPLER,
    WORSE,
)
from ..device.load_cell_offset import EACH_RUN, run_means
from ..device.model import Model
from .law_file import Chosen
from .regression import Regression
from .terms import along, library

_SCREENED = 40
"""Candidates that are judged on conditions left out."""
_TRIED = 5
"""Candidates that are asked for their stability."""


@dataclass(frozen=True, eq=False)
class _Candidate:
    """A term with powers of the current, and its columns among all of them."""

    chosen: Chosen
    columns: NDArray


@dataclass(frozen=True, eq=False)
class Selection:
    """Terms selected, the values fitted beside them, and the stability of each term."""

    chosen: tuple[Chosen, ...]  # Terms in the order in which they were found
    # tuple of (n_powers,): Of each term, by its powers of the current
    coefficients: tuple[NDArray, ...]
    stability: tuple[float, ...]  # Share of the conditions without which the term is chosen as well
    values: NDArray  # (n_values,): Values of the model fitted beside the terms


def select(model: Model, values: NDArray, folds: Sequence[NDArray]) -> Selection:
    """Select terms beside a model on fitted data."""
    columns, candidates = _columns(model)
    found: list[_Candidate] = []
    stability: list[float] = []
    coefficients = np.zeros(0)
    while len(found) < EQUATION_TERMS:
        taken = np.concatenate([one.columns for one in found]) if found else np.zeros(0, int)
        values, coefficients = _joint(model, values, columns[:, taken], coefficients)
        residual, jacobian = model.residuals(values, True)
        n = jacobian.shape[1]
        residual = residual + columns[:, taken] @ coefficients
        regression = Regression.of(np.hstack([jacobian, columns]), residual, folds)
        beside = np.concatenate([np.arange(n), n + taken])
        best = _next(regression, beside, [c for c in candidates if c not in found], n)
        if best is None:
            break
        found.append(best[0])
        stability.append(best[1])
        coefficients = np.concatenate([coefficients, np.zeros(len(best[0].columns))])
    taken = np.concatenate([one.columns for one in found]) if found else np.zeros(0, int)
    values, coefficients = _joint(model, values, columns[:, taken], coefficients)
    ends = np.cumsum([len(one.columns) for one in found])[:-1]
    return Selection(
        tuple(one.chosen for one in found),
        tuple(np.split(coefficients, ends.astype(int))) if found else (),
        tuple(stability),
        values,
    )


def _columns(model: Model) -> tuple[NDArray, list[_Candidate]]:
    """Weighted columns of all terms and powers, and the candidates that are made of them."""
    data = model.data
    degree = len(model.parameterisation.currents) - 1
    powers = range(degree + 1 if np.ptp(data.current) > 0 else 1)
    sets = list(dict.fromkeys([(0,), *((p,) for p in powers[1:]), tuple(powers)]))
    columns: list[NDArray] = []
    candidates = []
    for term in library(data):
        value = along(term, data)
        size = float(np.linalg.norm(value))
        if not (np.isfinite(size) and size > 0):
            continue
        at = len(columns)
        columns += [value * data.current**p for p in powers]
        candidates += [_Candidate(Chosen(term, s), at + np.array(s)) for s in sets]
    every = data.record(np.stack(columns, axis=1))
    if EACH_RUN in model.effects:
        every = every - run_means(data, every)
    return (every * data.weight[:, np.newaxis])[data.fitted], candidates


def _joint(
    model: Model, values: NDArray, columns: NDArray, coefficients: NDArray
) -> tuple[NDArray, NDArray]:
    """Fit a model through its simulation together with the coefficients of columns."""
    if not columns.shape[1]:
        return values, coefficients
    n = len(values)
    size = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    scaled = columns / size
    lower, upper = model.bounds()
    open_ = np.full(columns.shape[1], np.inf)

    def problem(both: NDArray, derivatives: bool) -> tuple[NDArray, NDArray]:
        residual, jacobian = model.residuals(both[:n], derivatives)
        residual = residual + scaled @ both[n:]
        return residual, np.hstack([jacobian, scaled]) if derivatives else jacobian

    start = np.concatenate([values, coefficients * size])
    result = levenberg_marquardt(
        problem, start, np.concatenate([lower, -open_]), np.concatenate([upper, open_]), 8, 1e-3
    )
    return result.x[:n], result.x[n:] / size


def _next(
    regression: Regression, beside: NDArray, candidates: Sequence[_Candidate], n: int
) -> tuple[_Candidate, float] | None:
    """The next term with its stability; None if the data ask for no other."""
    groups = [n + one.columns for one in candidates]
    gains = regression.gains(beside, groups, -1)
    before = regression.left_out(beside)
    tried = []
    for k in np.argsort(-gains)[:_SCREENED].tolist():
        after = regression.left_out(np.concatenate([beside, groups[k]]))
        change = before - after
        error = float(np.std(after, ddof=1)) * np.sqrt(len(after))
        if np.all(np.sqrt(after) <= WORSE * np.sqrt(before)) and change.sum() > max(
            error, EQUATION_GAIN * before.sum()
        ):
            tried.append((float(change.sum()), k))
    if not tried:
        return None
    most = max(tried)[0]
    # the simplest of those that are nearly as good comes first
    tried.sort(key=lambda one: (
        one[0] < SIMPLER * most,
        len(groups[one[1]]) + len(candidates[one[1]].chosen.term.numbers),
        -one[0],
    ))  # fmt: skip
    without = [regression.gains(beside, groups, fold) for fold in range(len(before))]
    for _, k in tried[:_TRIED]:
        stable = float(np.mean([g[k] >= NEARLY_CHOSEN * g.max() for g in without]))
        if stable >= EQUATION_STABLE:
            return candidates[k], stable
    return None
