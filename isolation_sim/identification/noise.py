"""Noise of sampled signals, estimated from the signals themselves."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_UPPER_BAND = 0.6
"""Part of the Nyquist frequency above which a device's response is taken to be negligible."""
_BAND = 2 ** (1 / 3), 8
"""Ratio of the ends of a band of a spectrum, and its least number of lines."""
_ALIKE = 2.5
"""Ratio of the powers of bands up to which they are one plateau; medians of few lines scatter."""
_ABOVE = 4.0
"""Ratio of a plateau's power to that of the highest frequencies from which it is one."""
_SMALL = 0.01
"""Share of a signal's RMS up to which a plateau is noise and no motion."""


def white_noise(signal: NDArray) -> float:
    """Standard deviation of a signal's white noise."""
    power, size = _spectrum(signal)
    band = power[int(_UPPER_BAND * len(power)) :]
    # the power of a noise line is exponentially distributed: median = ln 2 times mean
    return float(np.sqrt(np.median(band) / np.log(2) / size))


class SensorNoise(NamedTuple):
    """Noise of a displacement: white up to a corner, of which it tells the whole.

    Attributes
    ----------
    deviation : float
        Standard deviation of white noise that is as strong up to the corner.
    corner : float
        Share of the Nyquist frequency: 1 for white noise.
    """

    deviation: float
    corner: float


def sensor_noise(displacement: NDArray) -> SensorNoise:
    """Estimate the noise of a displacement beside its motion."""
    # Below the corner of an amplifier's low-pass noise leaves a plateau in the spectrum, between
    # the motion, whose power falls with the frequency, and the corner. It is the widest one, of an
    # octave at least, that is far stronger than the highest frequencies; nearly all power lies
    # below it.
    power, size = _spectrum(displacement)
    total, n = float(power.sum()), power.size
    highest = size * white_noise(displacement) ** 2
    ratio, least = _BAND
    ends = [max(int(np.searchsorted(np.cumsum(power), (1 - _SMALL**2) * total)), least)]
    while ends[-1] + least <= n:
        ends.append(min(int(max(ends[-1] * ratio, ends[-1] + least)), n))
    levels = np.array([np.median(power[a:b]) / np.log(2) for a, b in pairwise(ends)])
    widest, result = 2.0, SensorNoise(np.sqrt(highest / size), 1.0)
    for i in range(len(levels)):
        for j in range(i + 2, len(levels) + 1):
            if levels[i:j].max() > _ALIKE * levels[i:j].min():
                break
            level = float(np.median(power[ends[i] : ends[j]]) / np.log(2))
            is_noise = _ABOVE * highest < level and level * ends[j] < _SMALL**2 * total
            if is_noise and ends[j] >= widest * ends[i]:
                widest = ends[j] / ends[i]
                result = SensorNoise(np.sqrt(level / size), ends[j] / n)
    return result


def _spectrum(signal: NDArray) -> tuple[NDArray, float]:
    """Power of the lines of a signal about the line through its ends, and that of the window."""
    n = len(signal)
    window = np.hanning(n)
    line = np.linspace(signal[0], signal[-1], n)
    power: NDArray = np.abs(np.fft.rfft((signal - line) * window)) ** 2
    return power, float(np.sum(window**2))


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
