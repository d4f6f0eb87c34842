"""Errors of a building's model as they are reported: relative to what was measured."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .causes import TYPICAL_PERIOD
from .fit import Comparison, Outcome


def relative_errors(comparison: Comparison, outcome: Outcome, held_out: bool) -> NDArray:
    """Error of each channel: RMS of the residual over RMS of what was measured.

    Parameters
    ----------
    comparison : Comparison
        The records.
    outcome : Outcome
        The model.
    held_out : bool
        Whether of the data not fitted.

    Returns
    -------
    numpy.ndarray, shape (n_channels,)
    """
    squares = 0.0, 0.0
    for part in comparison.held_out if held_out else comparison.fitted:
        residual = comparison.residual(outcome.found, part.record)[part.samples]
        measured = part.record.values[part.samples]
        squares = squares[0] + (residual**2).sum(axis=0), squares[1] + (measured**2).sum(axis=0)
    return np.sqrt(squares[0] / squares[1])


def pooled(errors: NDArray) -> float:
    """One error of all channels, each counted alike.

    Parameters
    ----------
    errors : numpy.ndarray, shape (n_channels,)
        Relative errors.

    Returns
    -------
    float
    """
    return float(np.sqrt(np.mean(errors**2)))


def relative_noise(comparison: Comparison) -> float:
    """Error that noise alone leaves, relative like the errors.

    Parameters
    ----------
    comparison : Comparison
        The records.

    Returns
    -------
    float
    """
    floors = zip(comparison.floors, comparison.records, strict=True)
    return pooled(np.array([f.total / np.sqrt(np.mean(r.values**2, axis=0)) for f, r in floors]))


def excess_error(comparison: Comparison, outcome: Outcome) -> float:
    """Error that a model has beyond the noise, on data not fitted.

    Parameters
    ----------
    comparison : Comparison
        The records.
    outcome : Outcome
        The model.

    Returns
    -------
    float
        Relative like the errors; 0 where there is less than noise.
    """
    floors = dict(zip((r.name for r in comparison.records), comparison.floors, strict=True))
    beyond, measured = np.zeros((2, len(comparison.records[0].channels)))
    for part in comparison.held_out:
        residual = comparison.residual(outcome.found, part.record)[part.samples]
        noise = len(residual) * floors[part.record.name].total ** 2
        beyond += (residual**2).sum(axis=0) - noise
        measured += len(residual) * part.rms**2
    return float(np.sqrt(max(float(np.mean(beyond / measured)), 0.0)))


def gain_interval(comparison: Comparison, before: Outcome, after: Outcome) -> tuple[float, float]:
    """95 % interval of the reduction of the error on data not fitted.

    Parameters
    ----------
    comparison : Comparison
        The records.
    before, after : Outcome
        The model without and with causes.

    Returns
    -------
    tuple of float
        As fractions of the error before, by resampling blocks of a period of the isolated building.
    """
    blocks = []
    for part in comparison.held_out:
        per_block = max(int(TYPICAL_PERIOD / part.record.ground.dt), 1)
        scale = part.rms
        sums = []
        for outcome in (before, after):
            residual = comparison.residual(outcome.found, part.record)[part.samples] / scale
            n = len(residual) // per_block
            squares = (residual[: n * per_block] ** 2).sum(axis=1)
            sums.append(squares.reshape(n, per_block).sum(axis=1))
        blocks.append(np.array(sums).T)
    table = np.concatenate(blocks)
    draws = np.random.default_rng(0).integers(len(table), size=(1000, len(table)))
    left, right = table[draws].sum(axis=1).T
    low, high = np.quantile(1 - np.sqrt(right / left), (0.025, 0.975))
    return float(low), float(high)
