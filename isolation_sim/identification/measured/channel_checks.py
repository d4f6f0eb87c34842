"""Checks of the channels of measured runs, each on its own: clipped, noisy, coarse or drifting."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .noise import noise_beside_steps, rounding_step, white_noise
from .run_table import TestRun

_CLIPPED = 6
"""Equal extreme samples in a row from which a channel counts as clipped. Convention."""
_SEEN = 3.0
"""Noise over a channel's resolution from which equal samples in a row are no chance. Theory."""
_WHITE = 0.7
"""Noise by differences of order six over that of order four: 1 of white noise. Convention."""
_DRIFT = 0.1
"""Drift of a channel's middle, relative to its range, that is noted. Convention."""
_DRIFT_ERRORS = 4.0
"""Standard errors of the trend of the cycles' middles that a drift must exceed. Chance exceeds them
in one of 60 tests of six cycles and in one of 250 of ten (Student's t). Theory."""
_NOISY = 0.3
"""White noise of a channel over its RMS from which it is noted. Convention."""
_COARSE = 0.02
"""Step of a quantised channel over its RMS that is noted. Convention."""
_ROUNDED = 8.0
"""Steps of a rounded channel by which a peak falls within half its flat length: 3, and noise."""
_STILL, _RELAXED = 0.02, 0.5
"""Change of the force of a held device over its range, and in the second half of the time over that
in the first."""


def clipped_channels(runs: Sequence[TestRun]) -> Iterator[str]:
    """Channels that stand still at an extreme."""
    for run, what, values in _channels(runs):
        part = clipped(values)
        if part and not (what == "displacement" and _holds(run.force, part)):
            left_out = what == "force" and clipped_samples(values).any()
            yield (
                f"{run.name}: {what} stands still at an extreme for {part.stop - part.start} "
                "samples in a row, as a clipped channel does"
                + ("; its samples there do not count" if left_out else "")
            )


def _holds(force: NDArray, part: slice) -> bool:
    """Whether a force stands still or relaxes, as that of a device whose deformation is held."""
    # behind a clipped channel the motion goes on, and the force changes until the end
    n = part.stop - part.start
    later = force[part][n // 10 :]
    begin, middle, end = (float(np.mean(each)) for each in np.array_split(later, 5)[::2])
    if np.ptp([begin, middle, end]) < _STILL * np.ptp(force):
        return True
    return abs(end - middle) < _RELAXED * abs(middle - begin)


def noisy_channels(runs: Sequence[TestRun]) -> Iterator[str]:
    """Channels of much white noise."""
    for run, what, values in _channels(runs):
        share = white_noise(values) / rms(values)
        if share > _NOISY:
            yield f"{run.name}: noise is {100 * share:.0f} % of the {what}: it can show little"


def coarse_channels(runs: Sequence[TestRun]) -> Iterator[str]:
    """Channels of few levels."""
    for run, what, values in _channels(runs):
        step, size = rounding_step(values), float(np.std(values))
        if step > _COARSE * size:
            share = 100 * step / size
            yield f"{run.name}: {what} has steps of {share:.2g} % of its RMS: coarsely quantised"


def drifting_channels(runs: Sequence[TestRun]) -> Iterator[str]:
    """Channels whose middle moves."""
    for run, what, values in _channels(runs):
        moved = _drift(values)
        if abs(moved) > _DRIFT:
            yield (
                f"{run.name}: the {what}'s middle moves by {100 * moved:.0f} % of its range during "
                "the test"
            )


def clipped(values: NDArray) -> slice | None:
    """Find the longest stretch of equal samples at an extreme, if it is as a clipped channel's."""
    stretches = [part for _, part in _clipped_extremes(values)]
    return max(stretches, key=lambda part: part.stop - part.start, default=None)


def clipped_samples(values: NDArray) -> NDArray:
    """Whether each sample lies at a limit of its channel, (n,) bool; where noise shows it."""
    at_limit = np.isin(values, [extreme for extreme, _ in _clipped_extremes(values)])
    if not at_limit.any():
        return at_limit
    # without noise the force of a perfectly plastic device stands still, too; it is smooth, so that
    # differences of a higher order have less of it
    noise, higher = (noise_beside_steps(values, at_limit, order) for order in (4, 6))
    resolution = float(np.min(np.diff(np.unique(values))))
    is_noise = higher > _WHITE * noise > _WHITE * _SEEN * resolution
    return at_limit if is_noise else np.zeros_like(at_limit)


def _clipped_extremes(values: NDArray) -> Iterator[tuple[float, slice]]:
    """Extremes at which a channel is clipped, each with its longest stretch of equal samples."""
    if np.unique(np.diff(values)).size < 8:
        return  # a channel of few levels says nothing
    step, n = float(np.median(np.diff(np.unique(values)))), len(values)
    for extreme in (values.max(), values.min()):
        at = np.flatnonzero(values == extreme)
        if at.size < _CLIPPED:
            continue
        breaks = np.flatnonzero(np.diff(at) > 1)
        ends = np.concatenate([[-1], breaks, [at.size - 1]])
        k = int(np.argmax(np.diff(ends)))
        first, last = int(at[ends[k] + 1]), int(at[ends[k + 1]])
        if last - first < _CLIPPED - 1:
            continue
        # the peak of a rounded channel is flat, too, but it begins and ends gently
        beside = [max(first - (last - first) // 2, 0), min(last + (last - first) // 2, n - 1)]
        if np.mean(np.abs(values[beside] - extreme)) > _ROUNDED * step:
            yield float(extreme), slice(first, last + 1)


def _drift(values: NDArray) -> float:
    """Change of the mid-range from the first to the last third, relative to the range."""
    thirds = np.array_split(values, 3)
    sizes = [float(np.ptp(part)) for part in thirds]
    if min(sizes) < 0.9 * max(sizes):
        return 0.0  # a test whose size changes has no steady middle
    first, second, last = (0.5 * (float(part.max()) + float(part.min())) for part in thirds)
    steady = (second - first) * (last - second) > 0
    return (last - first) / max(sizes) if steady and _is_trend(_cycle_middles(values)) else 0.0


def _cycle_middles(values: NDArray) -> NDArray:
    """Mid-range of each cycle, from one rise through the middle to the next."""
    from_middle = values - np.mean(values)
    outside = np.flatnonzero(np.abs(from_middle) > 0.1 * np.ptp(values))  # noise is no cycle
    rises = outside[1:][np.diff(np.sign(from_middle[outside])) > 0]
    cycles = [values[a:b] for a, b in pairwise(rises)]
    return np.array([0.5 * (float(cycle.max()) + float(cycle.min())) for cycle in cycles])


def _is_trend(middles: NDArray) -> bool:
    """Whether the cycles' middles move by more than chance; few cycles cannot tell it."""
    n = len(middles)
    if n < 4:
        return True
    at = np.arange(n) - (n - 1) / 2
    slope = float(at @ middles / (at @ at))
    scatter = middles - np.mean(middles) - slope * at
    error = np.sqrt(float(scatter @ scatter) / (n - 2) / float(at @ at))
    return abs(slope) > _DRIFT_ERRORS * error


def rms(values: NDArray) -> float:
    """Root of the mean square; above zero, so that it can divide."""
    return float(np.sqrt(np.mean(values**2))) or 1e-300


def _channels(runs: Sequence[TestRun]) -> Iterator[tuple[TestRun, str, NDArray]]:
    for run in runs:
        yield run, "displacement", run.displacement
        yield run, "force", run.force
