"""Find a moving average in the force channel of sinusoidal tests.

The harmonics of a hysteretic force fall smoothly. A moving average over a part of a cycle
multiplies them by ``sinc(k w)``: the one whose period is averaged vanishes, and those above return.
No law has such a gap at the same harmonic at several amplitudes and frequencies.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from .run_table import TestRun

_WIDTHS = np.geomspace(1 / 20, 1 / 6, 61)
"""Widths of the average that are compared, as parts of a cycle."""
_HIGHEST = 25
"""Highest harmonic."""
_SINUSOIDAL = 0.05
"""Largest part of the displacement that may be higher harmonics."""
_CYCLES = 3
"""Fewest cycles of a run."""
_LEAST_RUNS = 4
_VARIED = 1.5
"""Ratio of the largest to the least amplitude and frequency from which a device's own gap moves."""
_NONLINEAR = 0.01
"""Least third harmonic of the force; a force without one says nothing of the channel."""
_EXPLAINED = 0.4
"""Part of the squared misfit of a smooth fall that the average may leave. 0.21 on the MR
damper of the shared data; no false alarm in 81 clean campaigns of all laws, random parameters."""
_AGREE = 0.8
"""Share of the runs in which the average must leave less than ``_LESS`` of the misfit."""
_LESS = 0.6
_ERROR = 0.1
"""Deviation of a harmonic's logarithm from a smooth fall."""


class _Harmonics(NamedTuple):
    frequency: float  # Hz
    amplitude: float  # Of the displacement, m
    orders: NDArray  # Odd numbers
    force: NDArray  # Of each order, N
    floor: float  # Of the noise, N


class Averaging(NamedTuple):
    """Moving average in the force channel of some runs."""

    widths: NDArray  # (n_runs,): Averaging time of each run's force, s; 0 if it is not averaged
    # Averaging times, s, if few runs do not decide; a fitted law then decides
    suspected: NDArray


def find_averaging(runs: Sequence[TestRun]) -> Averaging:
    """Find the averaging time of each run's force."""
    harmonics = [_harmonics(run) for run in runs]
    none, widths = np.zeros(len(runs)), np.zeros(len(runs))
    known = [one for one in harmonics if one is not None]
    if not known:
        return Averaging(none, none)
    varied = len(known) >= _LEAST_RUNS and all(
        max(values) > _VARIED * min(values)
        for values in ([one.frequency for one in known], [one.amplitude for one in known])
    )
    smooth = np.array([_misfit(one, 0.0) for one in known])
    averaged = np.array([[_misfit(one, width) for width in _WIDTHS] for one in known])
    best = int(np.argmin(averaged.sum(axis=0)))
    left = averaged[:, best]
    clear = left.sum() < _EXPLAINED * smooth.sum() and np.mean(left < _LESS * smooth) >= _AGREE
    for k, one in enumerate(harmonics):
        if one is not None:
            widths[k] = _WIDTHS[best] / one.frequency
    suspicious = clear or left.sum() < _LESS * smooth.sum()
    return Averaging(widths if varied and clear else none, widths if suspicious else none)


def averaging_note(widths: NDArray) -> str:
    """Describe the averaging times of the runs' force, (n_runs,), s; empty if there is none."""
    some = 1e3 * widths[widths > 0]
    if not len(some):
        return ""
    which = "all runs" if len(some) == len(widths) else f"{len(some)} of {len(widths)} runs"
    return (
        f"{which}: the force channel is a moving average over the same part of each cycle "
        f"({some.min():.3g} to {some.max():.3g} ms), which cuts harmonics off; simulated forces "
        "are averaged alike"
    )


def _harmonics(run: TestRun) -> _Harmonics | None:
    """Odd harmonics of a sinusoidal run; None if it is not one."""
    time, n = run.time - run.time[0], len(run.time)
    window = np.hanning(n)
    x = window * (run.displacement - np.mean(run.displacement))
    step = 1 / (8 * n * run.step)
    near = step * (int(np.argmax(np.abs(np.fft.rfft(x, 8 * n)))) + np.linspace(-1, 1, 21))
    frequency = float(near[np.argmax(_amplitudes(x, time, near))])
    highest = min(_HIGHEST, int(0.4 / (frequency * run.step))) if frequency > 0 else 0
    if frequency * time[-1] < _CYCLES or highest < 15:
        return None
    own = _amplitudes(x, time, frequency * np.array([1, 2, 3, 5, 7]))
    if np.linalg.norm(own[1:]) > _SINUSOIDAL * own[0]:
        return None
    orders = np.arange(1, highest + 1, 2)
    force = window * (run.force - np.mean(run.force))
    size = _amplitudes(force, time, frequency * orders)
    if size[1] < _NONLINEAR * size[0]:
        return None
    between = _amplitudes(force, time, frequency * (orders + 0.5))
    floor = max(float(np.median(between[1:])), 1e-4 * float(size[0]))
    return _Harmonics(frequency, float(own[0]), orders, size, floor)


def _amplitudes(values: NDArray, time: NDArray, frequencies: NDArray) -> NDArray:
    """Size of the Fourier integral of windowed values at some frequencies."""
    return np.abs(np.exp(-2j * np.pi * np.outer(frequencies, time)) @ values)


def _misfit(one: _Harmonics, width: float) -> float:
    """Squared misfit of a smooth fall behind an average over a part of a cycle."""
    gain = np.log(np.maximum(np.abs(np.sinc(width * one.orders)), 1e-9))
    measured = np.log(np.maximum(one.force, one.floor))
    weight = 1 / np.hypot(_ERROR, one.floor / np.maximum(one.force, one.floor))
    # the fall: a power and an exponential of the order, none of which rises
    columns = np.stack(
        [np.ones(len(gain)), -np.ones(len(gain)), -np.log(one.orders), -0.1 * one.orders], axis=1
    )
    sure = weight * np.where(gain > np.log(0.02), 1.0, 0.1)
    values, _ = nnls(columns * sure[:, np.newaxis], (measured - gain) * sure)
    expected = 0.5 * np.log(np.exp(2 * (columns @ values + gain)) + one.floor**2)
    return float(np.sum(((expected - measured) * weight) ** 2))


def moving_average(values: NDArray, samples: float) -> NDArray:
    """Average over so many samples about each one; less near the ends. Along the first axis."""
    # exact for values interpolated between samples
    n = len(values)
    integral = np.zeros_like(values)
    np.cumsum(0.5 * (values[1:] + values[:-1]), axis=0, out=integral[1:])
    half = min(0.5 * samples, 0.5 * (n - 1))
    whole = int(half)
    part = half - whole
    average = np.empty_like(values)
    # as many samples to both sides as there are before the nearer end
    near = min(whole + 1, (n + 1) // 2)
    widths = 2 * np.arange(1, near).reshape(-1, *[1] * (values.ndim - 1))
    average[[0, -1]] = values[[0, -1]]
    average[1:near] = integral[2 : 2 * near : 2][: near - 1] / widths
    average[-2 : -near - 1 : -1] = (integral[-1] - integral[-3 : -2 * near - 1 : -2]) / widths

    def shifted(array: NDArray, samples: int) -> NDArray:
        return array[near + samples : n - near + samples]

    middle = average[near : n - near]
    if len(middle):
        np.subtract(shifted(integral, whole), shifted(integral, -whole), out=middle)
        beside = shifted(values, whole) + shifted(values, -whole)
        middle += part * (1 - 0.5 * part) * beside
        beyond = shifted(values, whole + 1) + shifted(values, -whole - 1)
        middle += 0.5 * part**2 * beyond
        middle /= 2 * half
    return average
