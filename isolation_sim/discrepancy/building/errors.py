"""Errors of a building's model as they are reported: relative to the measured values."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .causes.candidate import TYPICAL_PERIOD
from .comparison import BuildingComparison, FittedBuilding


def relative_errors(
    comparison: BuildingComparison, outcome: FittedBuilding, held_out: bool
) -> NDArray:
    """Error of each channel: RMS of the residual over RMS of the measured value."""
    return _relative([
        (
            comparison.residual(outcome.cause_values, segment.record)[segment.samples],
            segment.record.values[segment.samples],
        )
        for segment in comparison.segments(held_out)
    ])  # fmt: skip


def mean_error(comparison: BuildingComparison, outcome: FittedBuilding, held_out: bool) -> float:
    """One relative error of all channels that show a signal, each counted alike."""
    return _pooled(relative_errors(comparison, outcome, held_out)[comparison.seen])


def pooled_error(parts: Sequence[tuple[NDArray, NDArray]], seen: NDArray) -> float:
    """One relative error of errors and measured values, each (n, n_channels)."""
    return _pooled(_relative(parts)[seen])


def _relative(parts: Sequence[tuple[NDArray, NDArray]]) -> NDArray:
    """RMS of errors over that of measured values, channel by channel."""
    error, measured = (sum((one[k] ** 2).sum(axis=0) for one in parts) for k in (0, 1))
    return np.sqrt(error / measured)


def _pooled(errors: NDArray) -> float:
    return float(np.sqrt(np.mean(errors**2))) if errors.size else float("nan")


def relative_noise(comparison: BuildingComparison, held_out: bool) -> float:
    """Error that noise alone leaves, relative like the errors."""
    noise, measured = np.zeros((2, len(comparison.records[0].channels)))
    for segment in comparison.segments(held_out):
        n = len(range(*segment.samples.indices(len(segment.record))))
        noise += n * comparison.floor_of(segment.record).total ** 2
        measured += n * segment.rms**2
    return _pooled(np.sqrt(noise / measured)[comparison.seen])


def least_noise(comparison: BuildingComparison) -> float:
    """Error that noise alone leaves in the stronger part of the data, relative like the errors."""
    return min(relative_noise(comparison, held_out) for held_out in (False, True))


def excess_error(
    comparison: BuildingComparison, outcome: FittedBuilding, held_out: bool = True
) -> float:
    """Error that a model has beyond the noise, by default on data not fitted.

    It is relative to the stronger part of a record: what a weak end misses may come from before.
    """
    beyond, measured = np.zeros((2, len(comparison.records[0].channels)))
    parts = comparison.fitted + comparison.held_out
    for segment in comparison.segments(held_out):
        residual = comparison.residual(outcome.cause_values, segment.record)[segment.samples]
        noise = len(residual) * comparison.floor_of(segment.record).total ** 2
        beyond += (residual**2).sum(axis=0) - noise
        of_record = [one.rms for one in parts if one.record.name == segment.record.name]
        measured += len(residual) * np.max(of_record, axis=0) ** 2
    excess = (beyond / measured)[comparison.seen]
    return float(np.sqrt(max(float(np.mean(excess)), 0.0))) if excess.size else 0.0


def largest_excess(comparison: BuildingComparison, outcome: FittedBuilding) -> float:
    """The larger of these errors, on fitted and on held-out data."""
    return max(excess_error(comparison, outcome, held_out) for held_out in (False, True))


def squared_blocks(comparison: BuildingComparison, outcomes: Sequence[FittedBuilding]) -> NDArray:
    """Squared relative residual of each outcome in blocks of a period, (n_blocks, n_outcomes)."""
    blocks = []
    for segment in comparison.held_out:
        per_block = max(int(TYPICAL_PERIOD / segment.record.dt), 1)
        sums = []
        for outcome in outcomes:
            residual = comparison.residual(outcome.cause_values, segment.record)[segment.samples]
            n = len(residual) // per_block
            shown = (residual / segment.rms)[: n * per_block, comparison.seen]
            squares = (shown**2).sum(axis=1)
            sums.append(squares.reshape(n, per_block).sum(axis=1))
        blocks.append(np.array(sums).T)
    return np.concatenate(blocks)
