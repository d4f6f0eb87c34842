"""Velocity from sampled, noisy displacement."""

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
    x = np.asarray(displacement, dtype=float)
    if x.ndim != 1 or x.size < MINIMUM_SAMPLES or not np.all(np.isfinite(x)):
        raise InputError(
            f"displacement of shape {x.shape}; accepted: {MINIMUM_SAMPLES} or more finite samples"
        )
    if not (np.isfinite(step) and step > 0):
        raise InputError(f"step {step!r} s; accepted: a positive number")
    from scipy.signal import savgol_filter

    return np.asarray(savgol_filter(x, _window(x), _DEGREE, deriv=1, delta=step))


def _window(x: np.ndarray) -> int:
    """Odd number of samples to fit a quartic to; see `differentiate`."""
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
