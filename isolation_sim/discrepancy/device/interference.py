"""Periodic interference: one frequency in all tests, whatever their own.

It either adds to the measured force (a pump, the mains in a cable) or modulates it (the supply of
the coil or of the bridge). It is found in the periodograms of the residual, and of the residual
times the modelled force, that runs with different motions have in common.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...identification.measured_runs import MeasuredRuns
from ..decisions import (
    INTERFERENCE_HARMONICS,
    INTERFERENCE_LINE,
    INTERFERENCE_LOWEST,
    INTERFERENCE_RUNS,
    INTERFERENCE_SHARE,
    INTERFERENCE_SIDEBANDS,
)

_FINE = 16
"""Frequencies within the width of a line in the longest run, at least. Effort."""


@dataclass(frozen=True, eq=False)
class Interference:
    """A periodic disturbance of the measured force."""

    frequency: float  # Hz
    modulates: bool  # Whether it multiplies the force or adds to it
    force: NDArray  # (n_samples,): What it does to the measured force, N
    size: float  # RMS over RMS of the measured force


def interference(data: MeasuredRuns, modelled: NDArray) -> Interference | None:
    """Look for a periodic disturbance that all runs share; ``modelled`` is the law's force, N."""
    if len(data.dt) < 3:
        return None
    modelled = data.bounded(modelled)
    residual = data.force - modelled
    best: Interference | None = None
    for modulates in (False, True):
        carrier = modelled if modulates else np.ones_like(modelled)
        frequency = _common_line(data, residual * carrier)
        if frequency is None:
            continue
        frequency = _refine(data, residual * carrier, frequency)
        force = _fit_line(data, residual, carrier, frequency)
        size = data.relative(force, np.ones(len(force), bool))
        if float(force @ force) < INTERFERENCE_SHARE * float(residual @ residual):
            continue
        if best is None or size > best.size:
            best = Interference(frequency, modulates, force, size)
    return best


def _common_line(data: MeasuredRuns, signal: NDArray) -> float | None:
    """Frequency that stands out in the runs' periodograms taken together."""
    sizes, frequencies = _common_grid(data, 4)
    longest = float(np.max(data.lengths * data.dt))
    logs = []
    for run, dt, size in zip(data.runs, data.dt, sizes, strict=True):
        own_frequencies = np.fft.rfftfreq(size, dt)
        duration = (run.stop - run.start) * dt
        lines, weights = _strong_lines(data.x[run], dt)
        main = _own_frequency(lines, weights, duration)
        own = _own_lines(lines, weights, main, duration, own_frequencies)
        part = signal[run] - np.mean(signal[run])
        power = np.abs(np.fft.rfft(part * np.hanning(len(part)), size)) ** 2
        # over the neighbourhood, so that broad humps do not count
        width = max(int(size * dt / longest + 1e-6) * 24, 9)
        around = np.exp(_running_mean(np.log(power + 1e-300), width))
        # nor multiples of the motion's frequency, as reversals of the motion make
        beside = _cycles_beside(power, size * dt, main)
        around = np.maximum(around, beside * INTERFERENCE_SIDEBANDS / INTERFERENCE_LINE)
        own |= own_frequencies > 0.9 / (2 * dt)
        ratio = np.where(own, np.nan, np.log(power / around + 1e-300))
        logs.append(_on_grid(ratio, frequencies * size * dt))
    table = np.stack(logs)
    band = frequencies > INTERFERENCE_LOWEST
    # where most runs have lines of their own nothing can be said
    band &= np.sum(np.isfinite(table), axis=0) >= _enough(data)
    if not band.any():
        return None
    common = np.full(len(frequencies), -np.inf)
    common[band] = _quantile(table[:, band], INTERFERENCE_RUNS)
    k = int(np.argmax(common))
    return float(frequencies[k]) if common[k] > np.log(INTERFERENCE_LINE) else None


def _common_grid(data: MeasuredRuns, fine: int) -> tuple[list[int], NDArray]:
    """Length of each run's transform, and frequencies (Hz), ``fine`` or more to a line's width."""
    longest = float(np.max(data.lengths * data.dt))
    # a whole number of samples but for rounding
    sizes = [fine << (int(np.ceil(longest / dt - 1e-6)) - 1).bit_length() for dt in data.dt]
    step = min(1 / (size * dt) for size, dt in zip(sizes, data.dt, strict=True))
    # nothing can be said where most runs end
    highest = 0.5 / float(np.sort(data.dt)[_enough(data) - 1])
    return sizes, step * np.arange(round(highest / step) + 1)


def _enough(data: MeasuredRuns) -> int:
    """Number of runs that must have a frequency."""
    return max(3, len(data.dt) // 2)


def _on_grid(values: NDArray, places: NDArray) -> NDArray:
    """Values of a run's own grid at the nearest places; not a number beyond its end."""
    at = np.rint(places).astype(int)
    return np.where(at < len(values), values[np.minimum(at, len(values) - 1)], np.nan)


def _quantile(table: NDArray, part: float) -> NDArray:
    """Quantile of each column's numbers; NumPy's own, one column after another, takes seconds."""
    ordered = np.sort(table, axis=0)  # what is not a number goes last
    place = part * (np.sum(np.isfinite(table), axis=0) - 1)
    below = place.astype(int)
    columns = np.arange(table.shape[1])
    low, high = ordered[below, columns], ordered[np.ceil(place).astype(int), columns]
    return low + (place - below) * (high - low)


def _own_lines(
    lines: NDArray, weights: NDArray, main: float, duration: float, frequencies: NDArray
) -> NDArray:
    """Where a run's own motion and its multiples make lines."""
    near = 2.0 / duration
    own = frequencies < lines.max() + near
    if len(lines) <= 8:
        main = float(np.sum(lines * weights) / np.sum(weights))
    elif main > 0:  # of varying amplitude
        near = max(near, float(np.max(np.abs(lines - main)[lines < 1.5 * main])))
    for k in range(1, INTERFERENCE_HARMONICS if main > 0 else 1):
        own |= np.abs(frequencies - k * main) < near
    return own


def _strong_lines(x: NDArray, dt: float) -> tuple[NDArray, NDArray]:
    """Frequencies (Hz) of most of a run's motion, and the power there."""
    power = np.abs(np.fft.rfft((x - np.mean(x)) * np.hanning(len(x)))) ** 2
    strong = power > 1e-3 * power.max()
    return np.fft.rfftfreq(len(x), dt)[strong], power[strong]


def _own_frequency(lines: NDArray, weights: NDArray, duration: float) -> float:
    """Frequency of a sinusoid or of one whose amplitude varies, Hz; 0 of any other motion."""
    weights = weights * (lines > 0)  # half a cycle more leaves a mean behind the window
    strongest = float(lines[np.argmax(weights)])
    # Hann's window spreads a line over two places to each side, of few cycles beyond half of it
    near = np.abs(lines - strongest) < max(0.5 * strongest, 2.01 / duration)
    if np.sum(weights[near]) < 0.95 * np.sum(weights) or strongest < 1.99 / duration:
        return 0.0
    return float(np.sum((lines * weights)[near]) / np.sum(weights[near]))


def _cycles_beside(power: NDArray, duration: float, frequency: float) -> NDArray:
    """Largest power one and two cycles of the motion beside each frequency."""
    beside = np.zeros_like(power)
    for cycles in (1, 2) if frequency > 0 else ():
        shift = round(cycles * frequency * duration)
        beside[shift:] = np.maximum(beside[shift:], power[: len(power) - shift])
        beside[: len(power) - shift] = np.maximum(beside[: len(power) - shift], power[shift:])
    return beside


def _running_mean(values: NDArray, width: int) -> NDArray:
    total = np.cumsum(np.concatenate([np.zeros(1), values]))
    at = np.arange(len(values))
    low, high = np.maximum(at - width, 0), np.minimum(at + width + 1, len(values))
    return (total[high] - total[low]) / (high - low)


def _refine(data: MeasuredRuns, signal: NDArray, near: float) -> float:
    """Frequency of most power near a line: short runs leave it open for the long ones."""
    sizes, frequencies = _common_grid(data, _FINE)
    width = 1 / float(np.min(data.lengths * data.dt))
    frequencies = frequencies[np.abs(frequencies - near) < width]
    power = np.zeros(len(frequencies))
    for run, n, dt, size in zip(data.runs, data.lengths, data.dt, sizes, strict=True):
        part = signal[run] - np.mean(signal[run])
        own = np.abs(np.fft.rfft(part, size)) ** 2 / n
        power += np.nan_to_num(_on_grid(own, frequencies * size * dt))
    return float(frequencies[int(np.argmax(power))])


def _fit_line(data: MeasuredRuns, residual: NDArray, carrier: NDArray, frequency: float) -> NDArray:
    """The disturbance, with an amplitude and phase of its own in every run."""
    force = np.zeros_like(residual)
    for run, dt in zip(data.runs, data.dt, strict=True):
        angle = 2 * np.pi * frequency * dt * np.arange(run.stop - run.start)
        design = np.stack([np.cos(angle), np.sin(angle)], axis=1) * carrier[run, np.newaxis]
        force[run] = design @ np.linalg.lstsq(design, residual[run], rcond=None)[0]
    return force
