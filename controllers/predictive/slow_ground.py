"""Ground motion that is slow for the stiffest building: it is followed at the highest current.

A building that is stiff for a ground motion follows it, with little deformation and no more
acceleration than the ground's. One that has become soft under it cannot be stiffened any more: an
isolator that stiffens while it is deformed jolts the building. So it starts stiff, and is released
for good as soon as the ground shows a short period. The period of the motion is that of the
sinusoid with its peaks: 2 pi times the peak acceleration over the peak rate of acceleration.
"""

from __future__ import annotations

import math

from numpy.typing import NDArray

FELT, TRIGGER = 0.01, 0.1
"""Ground accelerations, m/s^2: from the first on it moves, from the second on its period counts."""
SPAN = 0.1
"""Time over which the rate of the acceleration is measured, s; over a sample it would be noise."""
GROWTH = 0.4
"""Time after the start of a stronger half cycle before its rate counts, s."""
AMPLIFIED = 2.0
"""Ratio of floor to ground acceleration above which the building does not follow the ground."""
FAST = 0.4
"""Share of the limit below which a period counts at once."""


def slow_lengths(step: float) -> tuple[int, int]:
    """Samples over which the rate is measured, and rates in memory."""
    return max(round(SPAN / step), 1), round(GROWTH / step) + 1


def follow_slow(
    sample: NDArray, floors: float, step: float, limit: float, samples: NDArray, rates: NDArray,
    state: NDArray,
) -> bool:  # fmt: skip
    """Whether all of the ground motion up to this sample has been slow."""
    # limit: shortest period that is slow, s; 0 for none. samples, (n, n_directions): the last ones,
    # at rest before the first; rates: the last ones; state: peak, and 1 once it is released
    last = samples.shape[0] - 1
    square, change = 0.0, 0.0
    for d in range(samples.shape[1]):
        square += sample[d] * sample[d]
        moved = sample[d] - samples[0, d]
        change += moved * moved
        for k in range(last):
            samples[k, d] = samples[k + 1, d]
        samples[last, d] = sample[d]
    rate = math.sqrt(change) / ((last + 1) * step)
    newest = len(rates) - 1
    for k in range(newest):
        rates[k] = rates[k + 1]
    rates[newest] = max(rates[newest], rate)
    peak = state[0] = max(state[0], math.sqrt(square))
    around = 2.0 * math.pi * peak
    short = around < limit * rates[0]
    shorter = around < FAST * limit * rates[newest]
    if limit == 0.0 or (peak > TRIGGER and (short or shorter or floors > AMPLIFIED * peak)):
        state[1] = 1.0
    return peak > FELT and state[1] == 0.0
