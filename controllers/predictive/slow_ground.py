"""Ground motion that is slow for the stiffest building: it is followed at the highest current."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FELT, TRIGGER = 0.01, 0.1
"""Ground accelerations, m/s^2: from the first on it moves, from the second on its period counts."""
SPAN = 0.1
"""Time over which the rate of the acceleration is measured, s; over a sample it would be noise."""
GROWTH = 0.4
"""Time that a stronger swing is given to reach its peak before its rate counts, s."""
AMPLIFIED = 2.0
"""Acceleration of the floors over the ground's above which the building does not follow it."""
FAST = 0.4
"""Share of the limit below which a period counts at once."""


class SlowGround:
    """Whether all of the ground motion so far has been slow."""

    # A building that is stiff for a ground motion follows it, with little deformation and no more
    # acceleration than the ground's. One that has become soft under it cannot be stiffened any
    # more: an isolator that stiffens while it is deformed jolts the building. So it starts stiff,
    # and is released for good as soon as the ground shows a short period.
    # The period of the motion is that of the sinusoid with its peaks: 2 pi times the peak
    # acceleration over the peak rate of acceleration.
    # step: From one sample to the next, s.
    # limit: Shortest period that is slow, s.

    def __init__(self, step: float, limit: float):
        self._limit = limit
        self._span = max(round(SPAN / step), 1)
        self._time = self._span * step
        self._samples: list[NDArray] = []
        self._rates = [0.0] * (round(GROWTH / step) + 1)
        self._peak = 0.0
        self._released = limit == 0.0

    def follow(self, sample: NDArray, floors: float = 0.0) -> bool:
        """Take one more sample into account."""
        # before the first sample the ground was at rest
        full = len(self._samples) == self._span
        before = self._samples[0] if full else np.zeros_like(sample)
        rate = float(np.linalg.norm(sample - before)) / self._time
        self._samples = [*self._samples, sample.copy()][-self._span :]
        self._rates = [*self._rates[1:], max(self._rates[-1], rate)]
        self._peak = max(self._peak, float(np.linalg.norm(sample)))
        around = 2.0 * np.pi * self._peak
        short = around < self._limit * self._rates[0]
        shorter = around < FAST * self._limit * self._rates[-1]
        amplified = floors > AMPLIFIED * self._peak
        self._released |= self._peak > TRIGGER and (short or shorter or amplified)
        return self._peak > FELT and not self._released
