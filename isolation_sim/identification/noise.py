"""Noise of sampled signals, estimated from the signals themselves."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

_UPPER_BAND = 0.6
"""Part of the Nyquist frequency above which a device's response is taken to be negligible."""


def white_noise(signal: NDArray) -> float:
    """Standard deviation of a signal's white noise."""
    n = len(signal)
    window = np.hanning(n)
    line = np.linspace(signal[0], signal[-1], n)
    power = np.abs(np.fft.rfft((signal - line) * window)) ** 2
    band = power[int(_UPPER_BAND * len(power)) :]
    # the power of a noise line is exponentially distributed: median = ln 2 times mean
    return float(np.sqrt(np.median(band) / np.log(2) / np.sum(window**2)))


def correlation_time(residual: NDArray, starts: NDArray) -> float:
    """Samples over which a residual counts as one: the sum of its autocorrelation."""
    total, variance = 0.0, 0.0
    shortest = int(np.min(np.diff(starts)))
    most = max(shortest // 4, 1)
    products = np.zeros(most)
    for a, b in pairwise(starts):
        r = residual[a:b]
        size = 1 << (2 * len(r) - 1).bit_length()
        spectrum = np.abs(np.fft.rfft(r, size)) ** 2
        products += np.fft.irfft(spectrum, size)[:most]
        variance += float(r @ r)
    if variance == 0.0:
        return 1.0
    # up to the first lag that is no longer positive
    correlation = products / products[0]
    end = int(np.argmax(correlation <= 0)) or most
    total = 1.0 + 2.0 * float(np.sum(correlation[1:end]))
    return max(total, 1.0)
