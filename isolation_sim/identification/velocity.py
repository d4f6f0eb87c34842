"""Velocity and acceleration from sampled, noisy displacement."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import InputError

MINIMUM_SAMPLES = 5
_DEGREE = 4
_KEPT_ENERGY = 0.999
# of the shortest period kept: a quartic through three tenths of a period errs by under 0.2 %
_WINDOW_PERIODS = 0.3
# white noise passes this many medians in one line of a thousand million
_NOISE_MARGIN = 30.0
# of the square of a normal variable
_MEDIAN_OF_SQUARE = 0.4549


def differentiate(displacement: Any, step: float) -> np.ndarray:
    """Return the velocity of a uniformly sampled displacement.

    Savitzky-Golay: the slope of a quartic fitted to a window around each sample. The window
    follows the data. Lines of the displacement's periodogram that stand above its noise floor
    (median of the upper half of the frequencies) make the signal; the highest frequency needed for
    99.9 % of the signal's velocity energy is kept, and the window is three tenths of its period. A
    sinusoid so sampled keeps its velocity to 0.2 %; data without visible noise at high frequency
    get five points, a central difference of fourth order.

    Parameters
    ----------
    displacement : array_like, shape (n,), m
        Samples; five or more.
    step : float, s
        Time between samples.

    Returns
    -------
    numpy.ndarray, shape (n,), m/s

    Raises
    ------
    InputError
        If there are fewer than five samples, one is not finite, or the step is not positive.
    """
    return smooth(displacement, step)[1]


def smooth(displacement: Any, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return displacement, velocity and acceleration from a sampled displacement.

    Parameters
    ----------
    displacement : array_like, shape (n,), m
        Samples; five or more.
    step : float, s
        Time between samples.

    Returns
    -------
    tuple of numpy.ndarray, shape (n,), m, m/s, m/s^2
        Value and slope of the quartics that `differentiate` fits. Their curvature would be mostly
        noise; the acceleration is that of the sine series through the samples, each term reduced
        by the part of its power that is noise (Wiener). A cubic with the ends' values and
        curvatures goes first, so that the series converges fast.

    Raises
    ------
    InputError
        As `differentiate`.
    """
    x = np.asarray(displacement, dtype=float)
    if x.ndim != 1 or x.size < MINIMUM_SAMPLES or not np.all(np.isfinite(x)):
        raise InputError(
            f"displacement of shape {x.shape}; accepted: {MINIMUM_SAMPLES} or more finite samples"
        )
    if not (np.isfinite(step) and step > 0):
        raise InputError(f"step {step!r} s; accepted: a positive number")
    from scipy.signal import savgol_filter

    window = smoothing_window(x)
    value, slope, curvature = (
        np.asarray(savgol_filter(x, window, _DEGREE, deriv=order, delta=step)) for order in range(3)
    )
    ends = (value[0], value[-1], curvature[0], curvature[-1])
    return value, slope, _acceleration(x, step, ends)


def _acceleration(x: np.ndarray, step: float, ends: tuple[float, ...]) -> np.ndarray:
    """Second derivative by a sine series; see `smooth`. Ends: values, then curvatures."""
    from scipy.fft import dst, idst

    n = x.size
    duration = (n - 1) * step
    t = np.linspace(0.0, duration, n)
    first, last, bend_first, bend_last = ends
    c2, c3 = bend_first / 2, (bend_last - bend_first) / (6 * duration)
    c1 = (last - first) / duration - c2 * duration - c3 * duration**2
    terms = dst((x - (first + t * (c1 + t * (c2 + t * c3))))[1:-1], type=1)
    power = terms**2
    noise = np.median(power[power.size // 2 :]) / _MEDIAN_OF_SQUARE
    near = np.convolve(power, np.full(3, 1 / 3), mode="same")
    terms *= np.maximum(1 - 4 * noise / np.maximum(near, 1e-300), 0.0)
    seen = np.flatnonzero(near > _NOISE_MARGIN * noise)
    if seen.size:
        terms[seen[-1] + 3 :] = 0.0
    omega = np.pi * np.arange(1, n - 1) / duration
    series = np.concatenate([[0.0], idst(-(omega**2) * terms, type=1), [0.0]])
    return bend_first + (bend_last - bend_first) * t / duration + series


def smoothing_window(x: np.ndarray) -> int:
    """Odd number of samples to fit a quartic to; see `differentiate`.

    Parameters
    ----------
    x : numpy.ndarray, shape (n,)
        Samples of the displacement.

    Returns
    -------
    int
    """
    longest = x.size - 1 + x.size % 2
    line = np.linspace(x[0], x[-1], x.size)
    power = np.abs(np.fft.rfft((x - line) * np.hanning(x.size))) ** 2
    floor = np.median(power[power.size // 2 :])
    frequency = np.arange(power.size)  # cycles in the whole series
    energy = frequency**2 * np.where(power > _NOISE_MARGIN * floor, power, 0.0)
    if not np.any(energy):
        return MINIMUM_SAMPLES
    highest = np.searchsorted(np.cumsum(energy), _KEPT_ENERGY * energy.sum())
    samples = int(_WINDOW_PERIODS * x.size / max(highest, 1))
    return int(np.clip(samples - 1 + samples % 2, MINIMUM_SAMPLES, longest))
