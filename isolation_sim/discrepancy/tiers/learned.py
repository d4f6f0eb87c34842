"""The third tier: a learned term of bounded size, a measure of the other tiers' remaining misfit.

Ridge regression on random hyperbolic tangents of deformation, velocity and a few hysteretic
states: a network with one layer, of which the weights towards the output alone are fitted. Its
inputs are limited to the range of the tests, so that the term is bounded everywhere. The penalty is
chosen on conditions left out, on none of which the term is to lose.

A second network dissipates by construction: its units are elastic, or grow with the velocity or
with one hysteretic state, and these have weights that are nowhere negative. It is preferred.

Source: Rahimi and Recht (2008), Weighted sums of random kitchen sinks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb

import numpy as np
from numpy.typing import NDArray

from ...identification.least_squares import unit_columns
from ..decisions import DISSIPATIVE_GAIN, LEARNED_PENALTIES, LEARNED_UNITS, NEGLIGIBLE_LOSS
from ..device.model import Model
from .law_file import Network
from .terms import Term, along, library, run

_STEEP = 0.05
"""Share of the largest velocity above which the velocity's input grows logarithmically."""
_WEIGHT = 0.5
"""Standard deviation of a unit's weights, for inputs of unit RMS."""
_STATES = 5
"""Hysteretic states."""
_GATES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, -1.0, 0.0), (1.0, 0.0, -1.0))
"""Gates of velocity units, polynomials of |x| over the largest deformation."""


@dataclass(frozen=True, eq=False)
class _Units:
    """Random units, of which the weights towards the output are fitted."""

    weights: NDArray  # (n_inputs, n_units)
    offset: NDArray  # (n_units,)
    # (n_units, 3): Each unit is multiplied by a polynomial of |x|, by ascending powers of m
    gates: NDArray | None = None
    # (n_units,) bool: Whether a unit dissipates, so that its weight is not negative
    dissipates: NDArray | None = None

    def along(self, u: NDArray, x: NDArray) -> NDArray:
        """Values of the units, (n_samples, n_units), of inputs and of the deformation."""
        at = u @ self.weights
        values = np.tanh(at + self.offset) + np.tanh(at - self.offset)
        if self.gates is None:
            return values
        return values * (np.abs(x)[:, np.newaxis] ** np.arange(3) @ self.gates.T)


@dataclass(frozen=True, eq=False)
class Learned:
    """A learned term."""

    network: Network  # The term
    # (n_samples,), N: Residual of every condition, after a term that was fitted without it
    left_out: NDArray
    share: float  # Of a free network's gain that one that dissipates by construction reaches


def learn(
    model: Model, force: NDArray, without: NDArray, folds: Sequence[NDArray], seed: int = 0
) -> Learned:
    """Fit the learned term to the residual of a model on fitted data."""
    # ``force`` is the model's, (n_samples,), N; ``without`` that of the same model fitted without
    # each fold, (n_folds, n_samples).
    data = model.data
    force = data.bounded(force)
    states = _states(library(data))
    known = {"x": data.x, "v": data.v} | {f"m_{k}": along(s, data) for k, s in enumerate(states)}
    inside = data.fitted
    largest = float(np.max(np.abs(data.x[inside])))
    codes = _inputs(largest, float(np.max(np.abs(data.v[inside]))), states)
    u = np.stack([run(code, known) for code in codes], axis=1)
    current = data.current / (float(np.max(np.abs(data.current))) or 1.0)
    n_powers = len(model.parameterisation.currents) if np.ptp(current) > 0 else 1
    random = np.random.default_rng(seed)
    size = np.sqrt(np.mean(u[inside] ** 2, axis=0))

    before = np.zeros(len(data.x))
    for fold, modelled in zip(folds, without, strict=True):
        before[fold] = (modelled - data.force)[fold]
    every = np.logical_or.reduce(folds)

    def loses(residual: NDArray) -> bool:
        missed = min(data.relative(one, every) for one in (residual, before))
        return any(
            data.relative(residual, fold) > data.relative(before, fold) + NEGLIGIBLE_LOSS * missed
            for fold in folds
        )

    def fit(units: _Units) -> tuple[Network, NDArray]:
        positive, to_powers = None, np.eye(n_powers)
        if units.dissipates is not None:
            # weights that are nowhere negative are those of Bernstein's polynomials of the current
            positive, to_powers = np.tile(units.dissipates, n_powers), _bernstein(n_powers)
        basis = current[:, np.newaxis] ** np.arange(n_powers) @ to_powers
        values = units.along(u, data.x)
        columns = (basis[:, :, np.newaxis] * values[:, np.newaxis]).reshape(len(u), -1)
        columns = model.recorded(columns) * data.weight[:, np.newaxis]
        misses = [(modelled - data.force) * data.weight for modelled in without]
        parts = [
            _Normal.of(columns[other], missed[other])
            for fold, missed in zip(folds, misses, strict=True)
            for other in (inside & ~fold,)
        ]

        def left_out(penalty: float) -> NDArray:
            residual = np.zeros(len(data.x))
            for fold, missed, part in zip(folds, misses, parts, strict=True):
                c = part.ridge(penalty, positive)
                residual[fold] = (missed + columns @ c)[fold] / data.weight[fold]
            return residual

        results = {penalty: left_out(penalty) for penalty in LEARNED_PENALTIES}
        best = min(results, key=lambda one: (loses(results[one]), float(np.sum(results[one] ** 2))))
        missed = ((force - data.force) * data.weight)[inside]
        c = _Normal.of(columns[inside], missed).ridge(best, positive)
        limits = tuple(zip(codes, np.max(np.abs(u[inside]), axis=0).tolist(), strict=True))
        network = Network(
            states, limits, np.column_stack([units.offset, units.weights.T]),
            to_powers @ c.reshape(n_powers, -1), units.gates,
        )  # fmt: skip
        return network, results[best]

    free, free_left = fit(_free_units(random, size))
    passive, passive_left = fit(_dissipative_units(random, size, largest))
    power = float(before @ before)
    gain = power - float(free_left @ free_left)
    share = (power - float(passive_left @ passive_left)) / gain if gain > 0 else 1.0
    if share >= DISSIPATIVE_GAIN:
        return Learned(passive, passive_left, share)
    return Learned(free, free_left, share)


def _free_units(random: np.random.Generator, size: NDArray) -> _Units:
    """Units of all inputs."""
    weights = _WEIGHT * random.standard_normal((len(size), LEARNED_UNITS))
    return _Units(weights / size[:, np.newaxis], random.standard_normal(LEARNED_UNITS))


def _dissipative_units(random: np.random.Generator, size: NDArray, largest: float) -> _Units:
    """Units of the deformation, of the velocity near some deformation, and of one state each."""
    n = LEARNED_UNITS
    weights = np.zeros((len(size), n))
    # of four units one is elastic, two are of the velocity, and one is of a state
    kind = np.arange(n) % 4
    of = np.choose(kind, [0, 1, 1, 2 + np.arange(n) // 4 % _STATES])
    steepness = np.exp(random.standard_normal(n))
    weights[of, np.arange(n)] = steepness / size[of]
    # those of the velocity may grow or shrink with the deformation, and are nowhere negative
    gates = np.array(_GATES)[np.where(of == 1, random.integers(0, len(_GATES), n), 0)]
    gates = gates / largest ** np.arange(3)
    offset = steepness * np.abs(random.standard_normal(n))
    return _Units(weights, offset, gates, of > 0)


def _bernstein(n: int) -> NDArray:
    """Coefficients by ascending powers of Bernstein's polynomials, (n powers, n polynomials)."""
    degree = n - 1
    return np.array([
        [comb(degree, k) * comb(degree - k, p - k) * (-1) ** (p - k) if p >= k else 0
         for k in range(n)]
        for p in range(n)
    ], float)  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Normal:
    """Normal equations of columns, in units of their size, that take a residual away."""

    size: NDArray  # (n,): Norm of each column
    square: NDArray  # (n, n)
    right: NDArray  # (n,)

    @classmethod
    def of(cls, columns: NDArray, residual: NDArray) -> _Normal:
        """Set them up for columns, (n_samples, n), and a residual, (n_samples,)."""
        scaled, size = unit_columns(columns)
        return cls(size, scaled.T @ scaled, -(scaled.T @ residual))

    def ridge(self, penalty: float, positive: NDArray | None = None) -> NDArray:
        """Coefficients that are penalised; those of ``positive`` columns are not negative."""
        square = self.square + penalty * np.eye(len(self.size))
        if positive is None:
            return np.linalg.solve(square, self.right) / self.size
        from scipy.linalg import solve_triangular
        from scipy.optimize import nnls

        upper = np.linalg.cholesky(square).T
        right = solve_triangular(upper, self.right, trans=1)
        free = np.flatnonzero(~positive)
        both, _ = nnls(np.hstack([upper, -upper[:, free]]), right, maxiter=100 * len(self.size))
        result = both[: len(self.size)]
        result[free] -= both[len(self.size) :]
        return result / self.size


def _states(terms: Sequence[Term]) -> tuple[Term, ...]:
    """Some of the hysteretic states: friction and flow at two scales, and relaxation."""

    def of(kind: str) -> list[Term]:
        return [term for term in terms if term.rate and f"s, {kind}" in term.text]

    friction, flow, relaxation = of("friction"), of("flow"), of("relaxation")
    return friction[1], friction[3], flow[1], flow[5], relaxation[1]


def _inputs(deformation: float, speed: float, states: Sequence[Term]) -> list[str]:
    """Python code of the network's inputs."""
    memories = [f"m_{k} / {term.numbers[0].value:.6g}" for k, term in enumerate(states[:4])]
    # friction may differ along the stroke: a sum of units follows a product of inputs poorly
    at_position = f"{memories[0]} * x / {deformation:.6g}"
    return ["x", f"np.arcsinh(v / {_STEEP * speed:.6g})", *memories, "m_4", at_position]
