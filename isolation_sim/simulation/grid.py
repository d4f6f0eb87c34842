"""The time grid: a record's samples and a controller's instants, divided into segments."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

MOST_INTERVALS = 4
"""Largest number of grid intervals of one step."""


@dataclass(frozen=True)
class Grid:
    """Grid points and segments of a run."""

    time: NDArray  # (n_points,): Grid points, s
    samples: NDArray  # (n_samples,) int: Grid point of each sample of the record
    # (n_segments + 1, 3) int: First grid point, class and number of intervals of each segment; the
    # last row is the end
    segments: NDArray
    spans: NDArray  # (n_classes,): Length of a class of segments, s
    intervals: NDArray  # (n_classes,) int: Number of grid intervals of a class of segments
    # (n_segments, 3) int: Indices of the measurement, the decision and the new command at the
    # segment's start; -1 for none
    events: NDArray

    @cached_property
    def lengths(self) -> NDArray:
        """Intervals between grid points, s, (n_points - 1,); exactly equal within a class."""
        _, kind, count = self.segments[:-1].T
        return np.repeat((self.spans / self.intervals)[kind], count)

    @cached_property
    def longest(self) -> float:
        """Longest interval between grid points, s."""
        return float(self.lengths.max())

    @cached_property
    def segment_of(self) -> NDArray:
        """Segment of each interval between grid points, (n_points - 1,) int array."""
        return np.repeat(np.arange(len(self.segments) - 1), self.segments[:-1, 2])


def make_grid(
    n_samples: int,
    dt: float,
    measurement_times: ArrayLike = (),
    decision_times: ArrayLike = (),
    command_times: ArrayLike = (),
) -> Grid:
    """Merge a record's samples with the instants of measurements, decisions and commands."""
    instants = measurement_times, decision_times, command_times
    # instants closer than a millionth of a sample are merged
    unit = dt * 1e-6
    ticks = np.round(np.arange(n_samples) * dt / unit).astype(np.int64)
    event_ticks = [np.round(np.asarray(t, float) / unit).astype(np.int64) for t in instants]
    event_ticks = [t[t < ticks[-1]] for t in event_ticks]
    points = np.unique(np.concatenate([ticks, *event_ticks]))
    stops = np.zeros(len(points), bool)
    stops[0] = stops[-1] = True
    for t in event_ticks:
        stops[np.searchsorted(points, t)] = True
    lengths = np.diff(points)
    # a change of spacing (an instant between samples) also ends a segment
    stops[1:-1] |= lengths[1:] != lengths[:-1]
    first, count = _cut(np.flatnonzero(stops))
    # one number for length and count; rows would be sorted ten times as slowly
    keys, kind = np.unique(lengths[first] * (MOST_INTERVALS + 1) + count, return_inverse=True)
    span, intervals = np.divmod(keys, MOST_INTERVALS + 1)
    segments = np.column_stack([first, kind, count])
    segments = np.vstack([segments, [len(points) - 1, 0, 0]]).astype(np.int64)
    events = np.full((len(first), 3), -1, np.int64)
    for column, t in enumerate(event_ticks):
        events[np.searchsorted(first, np.searchsorted(points, t)), column] = np.arange(len(t))
    return Grid(
        time=points * unit,
        samples=np.searchsorted(points, ticks),
        segments=segments,
        spans=span * intervals * unit,
        intervals=intervals,
        events=events,
    )


def _cut(stops: NDArray) -> tuple[NDArray, NDArray]:
    """Divide the parts between stops into segments with a power of two of intervals."""
    first: list[NDArray] = []
    count: list[NDArray] = []
    start, left = stops[:-1].copy(), np.diff(stops)
    size = MOST_INTERVALS
    while size:
        whole = left // size
        number = np.arange(whole.sum()) - np.repeat(np.cumsum(whole) - whole, whole)
        first.append(np.repeat(start, whole) + number * size)
        count.append(np.full(len(number), size))
        start, left = start + whole * size, left - whole * size
        size //= 2
    order = np.argsort(np.concatenate(first))
    return np.concatenate(first)[order], np.concatenate(count)[order]
