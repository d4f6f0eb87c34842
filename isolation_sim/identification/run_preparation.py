"""Preparation of runs for a fit: wrong samples are interpolated, long runs are thinned."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .campaign import Campaign
from .measured.run_table import TestRun
from .measured.velocity import cycle_time, smooth

_WINDOW = 15
"""Samples of the running median; a spike or dropout is shorter than half of it."""
_FAR = 0.3
"""Distance from the running median over the channel's range from which a sample is wrong."""
_USUAL = 20.0
"""The same over the usual distance."""
_BESIDE = 0.1
"""Distance of the samples beside a spike over its own, at most: an impact rises and falls."""
_MOST = 0.01
"""Share of samples beyond which what stands out belongs to the signal."""


def spikes(values: NDArray, least: float = 0.0) -> NDArray:
    """Places of wrong samples, (n,) int: single ones, or a few of one value.

    They are ``least`` or more off the running median.
    """
    from scipy.ndimage import median_filter

    median = median_filter(values, _WINDOW, mode="mirror")
    off = np.abs(values - median)
    low, high = np.quantile(median, (0.01, 0.99))
    least = max(_FAR * float(high - low), _USUAL * float(np.median(off)), least)
    far = np.flatnonzero(off > least) if least > 0 else np.zeros(0, int)
    groups = np.split(far, np.flatnonzero(np.diff(far) > 1) + 1) if far.size else []
    # the samples beside a spike may be far off the median, too, where the signal is steep
    groups = [group[off[group] > _BESIDE * off[group].max()] for group in groups]

    def is_wrong(group: NDArray) -> bool:
        beside = [group[0] - 1, group[-1] + 1]
        if beside[0] < 0 or beside[1] == len(values):
            return False  # a run may begin with a transient of the device
        alike = bool(np.all(values[group] == values[group[0]]))
        together = group[-1] - group[0] < len(group)
        return alike and together and bool(np.all(off[beside] < _BESIDE * off[group].min()))

    wrong = [group for group in groups if is_wrong(group)]
    samples = np.concatenate(wrong) if wrong else np.zeros(0, int)
    return samples if len(samples) <= max(_MOST * len(values), 1) else np.zeros(0, int)


def repaired(campaign: Campaign) -> tuple[Campaign, list[str]]:
    """Interpolate the wrong samples of a campaign's runs; describe these and its columns."""
    # a current may be exactly constant
    usual = max(float(np.quantile(np.abs(run.current), 0.95)) for run in campaign.runs)
    every = [_without_spikes(run, max(_FAR * usual, 1e-9)) for run in campaign.runs]
    notes = [note for _, own in every for note in own]
    if notes:
        campaign = replace(campaign, runs=tuple(run for run, _ in every))
    gaps = [note for run in campaign.runs for note in run.gap_notes]
    return campaign, [*campaign.column_notes, *gaps, *notes]


def _without_spikes(run: TestRun, least_current: float) -> tuple[TestRun, list[str]]:
    """Interpolate wrong samples of displacement, force and current, if there are any."""
    channels, notes = {}, []
    for what, least in (("displacement", 0.0), ("force", 0.0), ("current", least_current)):
        values = getattr(run, what)
        wrong = spikes(values, least)
        if not wrong.size:
            continue
        places = np.arange(len(values))
        right = np.delete(places, wrong)
        channels[what] = np.interp(places, right, values[right])
        number = "1 sample lies" if len(wrong) == 1 else f"{len(wrong)} samples lie"
        notes.append(
            f"{run.name}: {number} far off the others in the {what}, first at "
            f"{run.time[wrong[0]]:.4g} s; interpolated"
        )
    if "displacement" in channels and not run.velocity_measured:
        channels["velocity"] = smooth(channels["displacement"], run.step)[1]
    return replace(run, **channels) if channels else run, notes


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
