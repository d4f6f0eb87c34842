"""Runs with many more samples than a fit needs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .campaign import Campaign
from .run_table import TestRun
from .velocity import cycle_time

MOST_SAMPLES = 300_000
"""Samples of a campaign beyond which its runs are thinned."""
LONGEST_STEP = 5e-3
"""Step of a thinned run, s, at most: coils lag by 10 ms and more."""
SAMPLES_PER_CYCLE = 100
"""Samples of a cycle that remain at least."""


def thin_runs(campaign: Campaign) -> tuple[Campaign, list[str]]:
    """Keep every k-th sample of long runs, of all runs about as many; and a note of it."""
    # Velocities have been derived from all samples.
    total = sum(run.time.size for run in campaign.runs)
    share = MOST_SAMPLES / len(campaign.runs)
    every = [_every(run, share) if total > MOST_SAMPLES else 1 for run in campaign.runs]
    if max(every) == 1:
        return campaign, []
    runs = tuple(_thinned(run, k) for run, k in zip(campaign.runs, every, strict=True))
    left = sum(run.time.size for run in runs)
    note = f"{left} of {total} samples are used: of long runs one in {max(every)} at most"
    return replace(campaign, runs=runs), [note]


def _every(run: TestRun, samples: float) -> int:
    cycle = cycle_time(float(np.std(run.displacement)), float(np.std(run.velocity)))
    longest = min(LONGEST_STEP, cycle / SAMPLES_PER_CYCLE)
    # as steps are given: 5 ms are 4.9999 steps of 1 ms
    return max(min(round(run.time.size / samples), int(longest / run.step + 1e-6)), 1)


def _thinned(run: TestRun, every: int) -> TestRun:
    some = slice(None, None, every)
    return replace(
        run,
        time=run.time[some],
        displacement=run.displacement[some],
        velocity=run.velocity[some],
        force=run.force[some],
        current=run.current[some],
        acceleration=None if run.acceleration is None else run.acceleration[some],
        temperature=None if run.temperature is None else run.temperature[some],
    )
