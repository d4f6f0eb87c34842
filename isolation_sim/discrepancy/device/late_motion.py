"""Measured motion at other instants than the samples: a displacement recorded late or early."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...identification.measured_runs import MeasuredRuns


def late_motion(
    data: MeasuredRuns, x: NDArray, v: NDArray, delay: float, longest: float
) -> tuple[NDArray, NDArray]:
    """Displacement and velocity, m and m/s, a time before each sample, of up to ``longest`` s."""
    # Between samples both are Hermite's cubics, through displacement and velocity, and through
    # velocity and acceleration.
    late = np.empty((2, len(x)))
    for run, dt, period in zip(data.runs, data.dt, data.periods, strict=True):
        most = int(np.ceil(longest / dt)) + 1
        motion = np.stack([x[run], v[run], data.a[run]])
        known = np.hstack([_before(motion, most, dt, period), motion, _after(motion, most, dt)])
        at = np.arange(motion.shape[1]) + most - np.clip(delay / dt, 1 - most, most - 1)
        k = np.floor(at).astype(np.int64)
        share = at - k
        for row in (0, 1):
            late[row, run] = _cubic(known[row], known[row + 1] * dt, k, share)
    return late[0], late[1]


def _cubic(values: NDArray, slopes: NDArray, k: NDArray, share: NDArray) -> NDArray:
    """Hermite's cubic a share of the way from sample k to the next; slopes are per sample."""
    begin, rise = values[k], values[k + 1] - values[k]
    second = 3 * rise - 2 * slopes[k] - slopes[k + 1]
    third = slopes[k] + slopes[k + 1] - 2 * rise
    return begin + share * (slopes[k] + share * (second + share * third))


def _before(motion: NDArray, n: int, dt: float, period: float) -> NDArray:
    """Motion before a run, (3, n): that of its first cycle if it goes on from one, else rest."""
    cycle = round(float(period) / dt)
    if 0 < cycle < motion.shape[1]:
        return motion[:, np.arange(-n, 0) % cycle]
    rest = np.zeros((3, n))
    rest[0] = motion[0, 0]
    return rest


def _after(motion: NDArray, n: int, dt: float) -> NDArray:
    """Motion after a run, (3, n): as it went on where it was nearest to its end before."""
    last, seconds = motion[:, -1:], dt * np.arange(1, n + 1)
    if motion.shape[1] <= 2 * n:
        x, v, _ = last
        return np.stack([x + v * seconds, np.full(n, v), np.zeros(n)])
    size = np.std(motion, axis=1, keepdims=True) + 1e-300
    away = np.sum(((motion[:, : -n - 1] - last) / size) ** 2, axis=0)
    at = int(np.argmin(away))
    after = motion[:, at + 1 : at + 1 + n].copy()
    gap = last - motion[:, at : at + 1]
    after[0] += gap[0] + gap[1] * seconds
    after[1] += gap[1]
    return after
