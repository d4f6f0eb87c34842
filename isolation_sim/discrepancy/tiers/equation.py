"""The second tier: a sparse equation added to a law's force.

Candidate terms are screened by orthogonal regression on the force residual along the measured
motion, beside the tangent of everything fitted so far. The numbers inside the leading terms are
searched before terms are selected. A term is taken if it lowers the error on conditions left out by
more than one standard error and makes none of them worse, and if it is also the choice without most
of the conditions. The whole is then written as a law and fitted through the simulation, together
with the numbers inside its terms.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ...identification.least_squares import levenberg_marquardt, orthonormal, unit_columns
from ..decisions import (
    EQUATION_GAIN,
    EQUATION_STABLE,
    EQUATION_STANDS_OUT,
    EQUATION_TERMS,
    NEARLY_CHOSEN,
    SIMPLER,
    WORSE,
)
from ..device.model import Model
from .law_file import Chosen
from .terms import Term, along, library

_SCREENED = 40
"""Candidates that are validated on conditions left out."""
_TRIED = 5
"""Candidates that are asked for their stability."""
_LEADING = 6
"""Terms whose numbers are searched before the selection."""
_SEARCHED = 40
"""Trials of a term's numbers."""
_REACH = 5.0
"""Factor on a number up to which it is searched."""
_NEAR = 2.0
"""Factor between numbers up to which two terms of one kind are one."""


@dataclass(frozen=True, eq=False)
class _Candidate:
    """A term with powers of the current, and its columns among all of them."""

    chosen: Chosen
    columns: NDArray

    def is_near(self, other: _Candidate) -> bool:
        """Whether it is another one's term, or a part of it, with slightly different numbers."""
        one, two = self.chosen.term, other.chosen.term
        inside = set(self.chosen.powers) <= set(other.chosen.powers)
        return (
            inside
            and one.text == two.text
            and all(
                abs(a.value - b.value) < (_NEAR - 1) * min(abs(a.value), abs(b.value))
                for a, b in zip(one.numbers, two.numbers, strict=True)
            )
        )


class _Library:
    """Candidates beside a model, and their columns; better numbers join them."""

    def __init__(self, model: Model, pool: ThreadPoolExecutor):
        data = model.data
        self._model, self._pool = model, pool
        degree = len(model.parameterisation.currents) - 1
        self._powers = tuple(range(degree + 1 if np.ptp(data.current) > 0 else 1))
        self.candidates: list[_Candidate] = []
        self.columns = np.zeros((int(data.fitted.sum()), 0))
        # a law reads the current through a parameter that is its first power
        self.add(one for one in library(data) if degree > 0 or not one.current)

    def add(self, terms: Iterable[Term]) -> None:
        """Add terms with every set of powers of the current."""
        columns, at = [self.columns], self.columns.shape[1]
        for term in terms:
            powers = (0,) if term.current else self._powers
            own = self.along(term, powers)
            if own is None:
                continue
            columns.append(own)
            for powers_set in dict.fromkeys([(0,), *((p,) for p in powers[1:]), powers]):
                place = at + np.array([powers.index(p) for p in powers_set])
                self.candidates.append(_Candidate(Chosen(term, powers_set), place))
            at += len(powers)
        self.columns = np.hstack(columns)

    def along(self, term: Term, powers: Sequence[int]) -> NDArray | None:
        """Weighted columns of a term by powers of the current; None if it is zero or diverges."""
        data = self._model.data
        value = along(term, data)
        size = float(np.linalg.norm(value))
        if not (np.isfinite(size) and size > 0):
            return None
        every = self._model.recorded(np.stack([value * data.current**p for p in powers], axis=1))
        return (every * data.weight[:, np.newaxis])[data.fitted]

    def search_numbers(
        self, selected: Sequence[_Candidate], gains: NDArray, beside: NDArray, residual: NDArray
    ) -> None:
        """Add the leading terms with numbers for which they reduce a residual most.

        ``gains`` are of all candidates; ``beside`` are columns that are fitted together with a
        term.
        """
        basis = orthonormal(beside)
        residual = residual - basis @ (basis.T @ residual)
        leading: dict[str, _Candidate] = {}
        for k in np.argsort(-gains).tolist():
            one = self.candidates[k]
            taken = any(one.is_near(other) for other in selected)
            if one.chosen.term.numbers and not taken and len(leading) < _LEADING:
                leading.setdefault(one.chosen.term.text, one)
        self.add(list(self._pool.map(
            lambda one: self._with_best_numbers(one.chosen, basis, residual), leading.values()
        )))  # fmt: skip

    def _with_best_numbers(self, chosen: Chosen, basis: NDArray, residual: NDArray) -> Term:
        """A term with the numbers for which it reduces a residual most."""
        from scipy.optimize import minimize

        term = chosen.term
        sizes = np.array([abs(n.value) for n in term.numbers])
        is_position = np.array([n.symbol == "b" for n in term.numbers])

        def at(step: NDArray) -> Term:
            values = np.where(
                is_position,
                [n.value for n in term.numbers] + step * sizes.min(),
                sizes * np.exp(np.clip(step, -np.log(_REACH), np.log(_REACH))),
            )
            bounded = [
                float(v) if n.symbol == "b" else float(np.clip(v, n.least, n.most))
                for n, v in zip(term.numbers, values, strict=True)
            ]
            numbers = zip(term.numbers, bounded, strict=True)
            return replace(term, numbers=tuple(replace(n, value=v) for n, v in numbers))

        def left(step: NDArray) -> float:
            columns = self.along(at(step), chosen.powers)
            if columns is None:
                return float(residual @ residual)
            columns = columns - basis @ (basis.T @ columns)
            scaled, _ = unit_columns(columns)
            rest = residual - scaled @ np.linalg.lstsq(scaled, residual)[0]
            return float(rest @ rest)

        n = len(sizes)
        simplex = np.vstack([np.zeros(n), 0.4 * np.eye(n)])
        options = {"maxfev": _SEARCHED, "initial_simplex": simplex, "xatol": 1e-2, "fatol": np.inf}
        return at(minimize(left, np.zeros(n), method="Nelder-Mead", options=options).x)


@dataclass(frozen=True, eq=False)
class Selection:
    """Terms selected, the values fitted beside them, and the stability of each term."""

    chosen: tuple[Chosen, ...]  # Terms in the order of their selection
    # tuple of (n_powers,): Of each term, by its powers of the current
    coefficients: tuple[NDArray, ...]
    stability: tuple[float, ...]  # Share of the conditions without which the term is chosen as well
    values: NDArray  # (n_values,): Values of the model fitted beside the terms
    cost: float  # Sum of squared residuals over their noise that is left

    def criterion(self, n: int) -> float:
        """Schwarz's criterion for so many residuals; the less the better."""
        inside = sum(len(one.term.numbers) for one in self.chosen)
        n_numbers = len(self.values) + inside + sum(map(len, self.coefficients))
        return n * float(np.log(self.cost)) + n_numbers * float(np.log(n))


def select(
    model: Model, values: NDArray, folds: Sequence[NDArray], pool: ThreadPoolExecutor,
    first: str = "",
) -> Selection:  # fmt: skip
    """Select terms beside a model on fitted data; ``first``: one that is taken before all."""
    library = _Library(model, pool)
    selected: list[_Candidate] = []
    left: list[_Candidate] = []
    stability: list[float] = []
    coefficients = np.zeros(0)
    while True:
        taken = _places(selected)
        values, coefficients = _joint(model, values, library.columns[:, taken], coefficients)
        # of the model without its terms, whose coefficients are fitted anew beside any other
        residual, jacobian = model.residuals(values, True)
        n = jacobian.shape[1]
        regression = Regression.of(np.hstack([jacobian, library.columns]), residual, folds)
        gone = _replaced(regression, selected, n)
        if gone is not None:
            # a term that later ones replace is left out for good
            ends = np.cumsum([0, *(len(one.columns) for one in selected)])
            coefficients = np.delete(coefficients, np.arange(ends[gone], ends[gone + 1]))
            left.append(selected.pop(gone))
            del stability[gone]
            continue
        # terms that replace each other one after the other lead nowhere
        if EQUATION_TERMS in (len(selected), len(left)):
            break
        # which terms lead is known from a first regression; their numbers are then searched
        beside = np.concatenate([np.arange(n), n + taken])
        groups = [n + one.columns for one in library.candidates]
        known = [*selected, *left]
        library.search_numbers(
            known, regression.gains(beside, groups, -1),
            np.hstack([jacobian, library.columns[:, taken]]), residual,
        )  # fmt: skip
        regression = Regression.of(np.hstack([jacobian, library.columns]), residual, folds)
        others = [
            one for one in library.candidates
            if not any(one.is_near(other) for other in known)
        ]  # fmt: skip
        if first and not known:
            others = [one for one in others if one.chosen.written.split(", ")[0] == first]
        best = _next(regression, beside, others, n) if others else None
        if best is None:
            break
        selected.append(best[0])
        stability.append(best[1])
        coefficients = np.concatenate([coefficients, np.zeros(len(best[0].columns))])
    ends = np.cumsum([len(one.columns) for one in selected])[:-1]
    left_over = residual + library.columns[:, _places(selected)] @ coefficients
    return Selection(
        tuple(one.chosen for one in selected),
        tuple(np.split(coefficients, ends.astype(int))) if selected else (),
        tuple(stability),
        values,
        float(left_over @ left_over),
    )


def _places(candidates: Sequence[_Candidate]) -> NDArray:
    """Columns of candidates."""
    return np.concatenate([one.columns for one in candidates]) if candidates else np.zeros(0, int)


def _replaced(regression: Regression, selected: Sequence[_Candidate], n: int) -> int | None:
    """A term without which the others predict conditions left out nearly as well."""

    def error(terms: Sequence[_Candidate]) -> float:
        return float(regression.left_out(np.concatenate([np.arange(n), n + _places(terms)])).sum())

    if len(selected) < 2:
        return None
    without = [error([*selected[:k], *selected[k + 1 :]]) for k in range(len(selected))]
    least = int(np.argmin(without))
    return least if without[least] <= (1 + EQUATION_GAIN) * error(selected) else None


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
        error = min(float(np.std(one, ddof=1)) for one in (after, change)) * np.sqrt(len(after))
        if _is_worse_nowhere(after, before) and change.sum() > max(
            error, EQUATION_GAIN * before.sum()
        ):
            tried.append((float(change.sum()), k))
    if not tried:
        # the regression is linear: a law far from its right numbers may have to move by more
        strongest = int(np.argmax(gains))
        if gains[strongest] < EQUATION_STANDS_OUT * regression.cost(beside):
            return None
        tried = [(float(gains[strongest]), strongest)]
    most = max(tried)[0]
    # the simplest of those that are nearly as good comes first
    tried.sort(key=lambda one: (
        one[0] < SIMPLER * most,
        len(groups[one[1]]) + len(candidates[one[1]].chosen.term.numbers),
        -one[0],
    ))  # fmt: skip
    without = [regression.gains(beside, groups, fold) for fold in range(len(before))]

    def stability(gains: Sequence[float]) -> float:
        pairs = zip(gains, without, strict=True)
        return float(np.mean([gain >= NEARLY_CHOSEN * g.max() for gain, g in pairs]))

    for change, k in tried[:_TRIED]:
        stable = stability([g[k] for g in without])
        if stable >= EQUATION_STABLE:
            pair = _plain_pair(
                regression, beside, candidates, groups, candidates[k], change, before
            )
            if pair is None:
                return candidates[k], stable
            first, both = pair
            folds = range(len(before))
            stable = stability([regression.gains(beside, [both], fold)[0] for fold in folds])
            return candidates[first], stable
    return None


def _is_worse_nowhere(after: NDArray, before: NDArray) -> bool:
    """Whether no condition left out has a squared residual that is clearly larger than before."""
    return bool(np.all(np.sqrt(after) <= WORSE * np.sqrt(before)))


def _plain_pair(
    regression: Regression, beside: NDArray, candidates: Sequence[_Candidate],
    groups: Sequence[NDArray], one: _Candidate, change: float, before: NDArray,
) -> tuple[int, NDArray] | None:  # fmt: skip
    """The stronger of two plain terms that do together what one with more numbers does."""
    powers = one.chosen.powers
    if len(one.chosen.term.numbers) <= len(powers):
        return None
    plain = [
        k for k, other in enumerate(candidates)
        if not other.chosen.term.numbers and other.chosen.powers == powers
    ]  # fmt: skip
    pairs = list(combinations(plain, 2))
    if not pairs:
        return None
    together = [np.concatenate([groups[a], groups[b]]) for a, b in pairs]
    best = int(np.argmax(regression.gains(beside, together, -1)))
    after = regression.left_out(np.concatenate([beside, together[best]]))
    if not _is_worse_nowhere(after, before) or (before - after).sum() < SIMPLER * change:
        return None
    own = regression.gains(beside, [groups[k] for k in pairs[best]], -1)
    return pairs[best][int(np.argmax(own))], together[best]


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
