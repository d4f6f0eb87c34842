"""The third tier: a learned term of bounded size, a measure of the other tiers' remaining misfit.

Ridge regression on random hyperbolic tangents of deformation, velocity and a few hysteretic
states: a network with one layer, of which the weights towards the output alone are fitted. Its
inputs are limited to the range of the tests, so that the term is bounded everywhere. The penalty is
chosen on conditions left out.

Source: Rahimi and Recht (2008), Weighted sums of random kitchen sinks.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..decisions import LEARNED_PENALTIES, LEARNED_UNITS
from ..device.load_cell_offset import EACH_RUN, run_means
from ..device.model import Model
from .law_file import Network
from .terms import Term, along, library, run

_STEEP = 0.05
"""Share of the largest velocity above which the velocity's input grows logarithmically."""
_WEIGHT = 0.5
"""Standard deviation of a unit's weights, for inputs of unit RMS."""


def learn(
    model: Model, force: NDArray, without: NDArray, folds: Sequence[NDArray], seed: int = 0
) -> tuple[Network, NDArray]:
    """Fit the learned term to the residual of a model on fitted data."""
    # ``force`` is the model's, (n_samples,), N; ``without`` that of the same model fitted without
    # each fold, (n_folds, n_samples). Returned are the term, and the residual of every fold, N,
    # after a term that was fitted without it.
    data = model.data
    states = _states(library(data))
    known = {"x": data.x, "v": data.v} | {f"m_{k}": along(s, data) for k, s in enumerate(states)}
    codes = _inputs(float(np.max(np.abs(data.v))), states)
    u = np.stack([run(code, known) for code in codes], axis=1)
    random = np.random.default_rng(seed)
    weights = _WEIGHT * random.standard_normal((u.shape[1], LEARNED_UNITS))
    weights /= np.sqrt(np.mean(u**2, axis=0))[:, np.newaxis]
    offset = random.standard_normal(LEARNED_UNITS)
    at = u @ weights
    features = np.tanh(at + offset) + np.tanh(at - offset)
    current = data.current / (float(np.max(np.abs(data.current))) or 1.0)
    n_powers = len(model.parameterisation.currents) if np.ptp(current) > 0 else 1
    columns = np.hstack([features * (current**p)[:, np.newaxis] for p in range(n_powers)])
    columns = data.record(columns)
    if EACH_RUN in model.effects:
        columns = columns - run_means(data, columns)
    columns *= data.weight[:, np.newaxis]

    def left_out(penalty: float) -> NDArray:
        residual = np.zeros(len(data.x))
        for fold, modelled in zip(folds, without, strict=True):
            missed = (modelled - data.force) * data.weight
            c = _ridge(columns[~fold], missed[~fold], penalty)
            residual[fold] = (missed + columns @ c)[fold] / data.weight[fold]
        return residual

    results = {penalty: left_out(penalty) for penalty in LEARNED_PENALTIES}
    best = min(results, key=lambda penalty: float(results[penalty] @ results[penalty]))
    coefficients = _ridge(columns, (force - data.force) * data.weight, best)
    network = Network(
        states,
        tuple(zip(codes, np.max(np.abs(u), axis=0).tolist(), strict=True)),
        np.column_stack([offset, weights.T]),
        coefficients.reshape(n_powers, LEARNED_UNITS),
    )
    return network, results[best]


def _ridge(columns: NDArray, residual: NDArray, penalty: float) -> NDArray:
    """Coefficients of columns that take a residual away, penalised in units of their size."""
    size = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    size[~(size > 0)] = 1.0
    scaled = columns / size
    square = scaled.T @ scaled + penalty * np.eye(len(size))
    return -np.linalg.solve(square, scaled.T @ residual) / size


def _states(terms: Sequence[Term]) -> tuple[Term, ...]:
    """Some of the hysteretic states: friction and flow at two scales, and relaxation."""

    def of(kind: str) -> list[Term]:
        return [term for term in terms if term.rate and f"s, {kind}" in term.text]

    friction, flow, relaxation = of("friction"), of("flow"), of("relaxation")
    return friction[1], friction[3], flow[1], flow[5], relaxation[1]


def _inputs(speed: float, states: Sequence[Term]) -> list[str]:
    """Python code of the network's inputs."""
    memories = [f"m_{k} / {term.numbers[0].value:.6g}" for k, term in enumerate(states[:4])]
    return ["x", f"np.arcsinh(v / {_STEEP * speed:.6g})", *memories, "m_4"]
