"""Rests within a test, such as the holds of a relaxation test."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

_WINDOWS = (0.5, 0.3)
"""s: in the long one a device may creep; in the short one, two thirds of the shortest rest, it is
still."""
_LEAST_SAMPLES = 16
_SLOW = 4e-3
"""Speed over the largest one up to which a device rests. A sinusoid above 0.005 Hz is faster within
a quarter of a second about its crest."""
_SCATTER = 5e-3
"""Scatter about the line, over the largest displacement, up to which it may be noise."""
_ROUNDING = 1e-4
"""The same up to which it is noise of any sensor."""
_MOVES = 5.0
"""Distance from the line over the scatter of the middle of a rest, from which the device moves."""
_CREEPS = 3.0
"""Speed in a rest over its standard deviation by noise, from which a device creeps."""
_Motion = tuple[NDArray, NDArray, NDArray]


def hold_still(
    x: NDArray, v: NDArray, a: NDArray, step: float, noise: float = np.inf
) -> _Motion:  # fmt: skip
    """Give a device that rests the constant velocity of the line through its displacement.

    x is smoothed; ``noise`` is the standard deviation, m, that it had before: it scatters less in a
    rest.
    """
    # Noise of a velocity that is zero in truth drives every state that grows with |v|: a Bouc-Wen
    # law would relax in a rest.
    rests = list(_rests(x, v, step, noise))
    if not rests:
        return x, v, a
    x, v, a = x.copy(), v.copy(), a.copy()
    for rest_samples in rests:
        rest = _trimmed(x, rest_samples, noise if np.isfinite(noise) else 0.0)
        time = step * np.arange(rest.stop - rest.start)
        slope, first = np.polyfit(time, x[rest], 1)
        chance = noise / np.linalg.norm(time - np.mean(time))
        if np.isfinite(chance) and abs(slope) < _CREEPS * chance:
            slope, first = 0.0, np.mean(x[rest])
        x[rest], v[rest], a[rest] = first + slope * time, slope, 0.0
    return x, v, a


def _trimmed(x: NDArray, rest: slice, noise: float) -> slice:
    """Leave out the ends of a rest in which the device still moves, or moves again."""
    time = np.arange(rest.stop - rest.start)
    quarter = len(time) // 4
    middle = slice(quarter, len(time) - quarter)
    line = np.polynomial.Polynomial.fit(time[middle], x[rest][middle], 1)
    distance = np.abs(x[rest] - line(time))
    scatter = float(np.sqrt(np.mean(distance[middle] ** 2)))
    # a low-pass rings behind a stop, within the noise
    moves = np.flatnonzero(distance > max(_MOVES * scatter, noise))
    before, after = moves[moves < quarter], moves[moves >= middle.stop]
    # smoothing is least certain at the ends of a run
    first = int(before[-1]) + 1 if before.size and rest.start > 0 else 0
    end = int(after[0]) if after.size and rest.stop < len(x) else len(time)
    return slice(rest.start + first, rest.start + end)


def _rests(x: NDArray, v: NDArray, step: float, noise: float) -> Iterator[slice]:
    """Segments in which a line through every window is nearly level and close to the samples."""
    rests = np.zeros(len(x) + 2, int)
    for window in _WINDOWS:
        n = max(round(window / step), _LEAST_SAMPLES)
        if len(x) <= 2 * n:
            continue
        time = step * (np.arange(n) - (n - 1) / 2)
        inertia = float(time @ time)
        centred = x - np.mean(x)
        slopes = np.correlate(centred, time, "valid") / inertia
        mean, square = (_window_means(values, n) for values in (centred, centred**2))
        creep = slopes**2 * inertia / n if window == _WINDOWS[0] else 0.0
        scatter = np.sqrt(np.maximum(square - mean**2 - creep, 0.0))
        level = np.abs(slopes) < _SLOW * float(np.percentile(np.abs(v), 99))
        # a device moves off slowly, and a friction follows less than what may be noise
        largest = float(np.max(np.abs(x)))
        level &= scatter < min(_SCATTER * largest, max(noise, _ROUNDING * largest))
        for first, end in _stretches(np.concatenate([[False], level, [False]])):
            # at its crest a sinusoid is level for a moment; a test begins and ends at rest
            if end - first >= n // 2 or first == 0 or end == len(level):
                rests[first + 1 : end + n] = 1
    yield from (slice(int(first), int(end)) for first, end in _stretches(rests))


def _stretches(marked: NDArray) -> NDArray:
    """First and end of the stretches that are marked, beside an unmarked sample at each end."""
    return np.flatnonzero(np.diff(marked.astype(int))).reshape(-1, 2)


def _window_means(values: NDArray, n: int) -> NDArray:
    """Means of so many samples in a row."""
    integral = np.concatenate([[0.0], np.cumsum(values)])
    means: NDArray = (integral[n:] - integral[:-n]) / n
    return means
