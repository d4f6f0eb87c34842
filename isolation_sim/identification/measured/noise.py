"""Noise of sampled signals, estimated from the signals themselves."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import comb
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

_UPPER_BAND = 0.6
"""Part of the Nyquist frequency above which a device's response is taken to be negligible."""
_MANY_A_CYCLE = 100.0
"""Samples a mean cycle from which the highest frequencies hold no motion."""
_BEYOND = 0.1, 16
"""Part of a spectrum, at its upper end, that lies beyond the corner of a low-pass, and its least
number of lines. A corner is often at 0.4 of the sampling rate, against aliasing."""
_BAND = 2 ** (1 / 3), 8
"""Ratio of the ends of a band of a spectrum, and its least number of lines."""
_WIDE = 2.3
"""Least ratio of the ends of a plateau: ramps behind a servo look like one, too, up to 2.2, in
13 runs of three generators."""
_ALIKE = 2.5
"""Ratio of the powers of bands up to which they are one plateau; medians of few lines scatter."""


class _Limits(NamedTuple):
    """What makes a plateau in a spectrum noise."""

    above: float  # Least ratio of its power to that of the highest frequencies
    small: float  # Largest share of the signal's RMS


_DISPLACEMENT = _Limits(4.0, 0.01)
_FORCE = _Limits(12.0, 0.03)
"""Its sensor is less exact, and its harmonics reach far."""
_SHOWN = 0.25
"""Share of the runs that must show a channel's corner."""
_AGREE = 1.5
"""Factor on the middle one within which half of the corners must lie."""
_STEADY = 0.8
"""Least deviation of a plateau by its median over that by its squares. Of noise it is 1, above 0.9
in 95 % of runs; of a force that turns sharply where the motion reverses, 0.6 to 0.75."""
_ENDS = 115.0
"""Over the number of lines, excess of the power at the ends of a run over that in its middle half
that noise has once in a thousand times, by simulation. A soft start of a sinusoid has more."""
_MISSING = 0.25
"""Share of the others' noise power below which a run has none of it."""
_UNLIKE = 2.0
"""Factor by which noise at the highest frequencies exceeds that between two samples if steps make
it."""
_FEWEST_CYCLES, _SINUSOIDAL = 4, 0.995
"""Cycles of a sinusoidal run, and share of its power at one frequency, from which the harmonics of
its force are distinguished from noise: they look like a plateau where lines are few."""
_WIDTH = 1.6
"""Lines on each side of a harmonic that belong to it, behind the window."""
_MOVING, _FEWEST_BANDS = 0.98, 4
"""Share of the power of the velocity up to whose frequency a device moves; bands above twice this
frequency that noise needs."""
_UNEVEN_LEVELS = 0.85
"""Deviation of the logarithm of a spectrum from that of noise with a 1/f part, from which it is
another. Convention, seen on two generators: noise 0.1 to 0.8, a ripple or a bump along the stroke
0.9 to 1.7."""
_ORDER = 4
"""Order of the low-pass of noise that is drawn."""
_NEAR_STEPS, _WHOLE = 5.5, 0.05
"""Distances between levels of a rounded signal, in steps, that tell its step, and how near to whole
numbers all of them lie."""
_UNEVEN = 0.2
"""Share of the changing samples with a third difference above which a signal is rounded, and not
made of ramps: of rounded sinusoids it is 0.4 and more. Convention."""


def white_noise(signal: NDArray) -> float:
    """Standard deviation of a signal's white noise."""
    power, size = _spectrum(signal)
    return float(np.sqrt(_highest(power) / size))


def fast_part(displacement: NDArray) -> float:
    """Share of the RMS velocity near the highest frequencies; 0 where they look like noise."""
    power, _ = _spectrum(displacement)
    lines = np.arange(power.size)
    velocity = power * lines**2
    first = int(_UPPER_BAND * power.size)
    middle = (first + power.size) // 2
    if np.median(power[first:middle]) <= _ALIKE * np.median(power[middle:]):
        return 0.0
    # noise behind a low-pass of many samples a cycle falls there, too
    if not velocity.any() or 2 * power.size > _MANY_A_CYCLE * np.sqrt(velocity.sum() / power.sum()):
        return 0.0
    return float(np.sqrt(velocity[first:].sum() / velocity.sum()))


def rounding_step(signal: NDArray) -> float:
    """Step of a signal whose rounded values recur, as in a periodic test; 0 for any other."""
    levels = np.unique(signal)
    if len(levels) < 3 or len(signal) < 2 * len(levels):
        return 0.0
    steps = np.diff(levels)
    near = steps[steps < _NEAR_STEPS * steps.min()]
    step = float(near.sum() / np.round(near / steps.min()).sum())
    if not np.allclose(steps / step, np.round(steps / step), 0.0, _WHOLE):
        return 0.0
    # ramps at a constant rate have such levels too; rounded, they would not be smooth
    third = np.abs(np.diff(signal, 3))
    moving = np.abs(np.lib.stride_tricks.sliding_window_view(np.diff(signal), 3)).any(axis=1)
    return step if np.mean(third[moving] > step / 2) > _UNEVEN else 0.0


class SensorNoise(NamedTuple):
    """White noise that is as strong as a sensor's below the corner of its low-pass.

    Attributes
    ----------
    deviation : float
        Its standard deviation.
    corner : float
        Share of the Nyquist frequency in which it has the sensor's variance: 1 for white noise.
    rounded : bool
        Whether it is rounding that recurs in every cycle.
    """

    deviation: float
    corner: float
    rounded: bool = False


def cycles_of(displacement: NDArray) -> float:
    """Number of cycles of a sinusoidal motion; 0 if they are few or it is none."""
    centred = displacement - displacement.mean()
    power = np.abs(np.fft.rfft(centred * np.hanning(centred.size))) ** 2
    k = int(np.argmax(power))
    if k < _FEWEST_CYCLES or power[k - 2 : k + 3].sum() < _SINUSOIDAL * power.sum():
        return 0.0
    near = np.sqrt(power[k - 1 : k + 2])
    return float(k + (near[2] - near[0]) / near.sum() * 4 / 3)


def _between_harmonics(n: int, cycles: float) -> NDArray:
    """Lines of a spectrum without those of a sinusoid's harmonics."""
    lines = np.arange(n)
    if cycles == 0.0:
        return lines
    return lines[np.abs(lines - cycles * np.round(lines / cycles)) > _WIDTH]


def sensor_noise(
    signal: NDArray,
    limits: _Limits = _DISPLACEMENT,
    cycles: float = 0.0,
    known: NDArray | float = 0.0,
) -> SensorNoise:
    """Estimate the noise of a signal that is smooth otherwise, and small as a share of it.

    Of a sinusoidal motion with so many ``cycles`` the harmonics are left out. The noise is that
    beside a ``known`` part of the signal.
    """
    # Below the corner of an amplifier's low-pass noise leaves a plateau in the spectrum, between
    # the motion, whose power falls with the frequency, and the corner. It is the widest one, of an
    # octave and more, that is far stronger than the highest frequencies; nearly all power lies
    # below it.
    total = float(_spectrum(signal)[0].sum())
    signal = signal - known
    power, size = _spectrum(signal)
    motion = int(np.searchsorted(np.cumsum(power), power.sum() - limits.small**2 * total))
    lines = _between_harmonics(power.size, cycles)
    power, motion, n = power[lines], int(np.searchsorted(lines, motion)), lines.size
    highest = _highest(power)
    part, fewest = _BEYOND
    beyond_corner = float(np.median(power[-max(int(part * n), fewest) :]) / np.log(2))
    ends, levels = _bands(power, max(motion, _BAND[1]))
    # rounding that recurs in every cycle has a spectrum of lines, which the median passes by
    rounding = rounding_step(signal) / np.sqrt(12)
    widest, result = _WIDE, SensorNoise(np.sqrt(highest / size), 1.0)
    for i in range(len(levels)):
        for j in range(i + 2, len(levels) + 1):
            most = levels[i:j].max()
            if most > _ALIKE * levels[i:j].min():
                break
            # the median of all lines is not above those of the bands
            if ends[j] < widest * ends[i] or most <= limits.above * beyond_corner:
                continue
            level = float(np.median(power[ends[i] : ends[j]]) / np.log(2))
            if (
                level > limits.above * beyond_corner
                and level * ends[j] < limits.small**2 * total
                and _steady(signal, lines[ends[i] : ends[j]])
            ):
                widest = ends[j] / ends[i]
                beyond = np.minimum(levels[j:], level) @ np.diff(ends[j:])
                result = SensorNoise(np.sqrt(level / size), (ends[j] + beyond / level) / n)
    if result.deviation < rounding:
        return SensorNoise(rounding, 1.0, rounded=True)
    return result


def _bands(power: NDArray, first: int) -> tuple[list[int], NDArray]:
    """Ends of the bands of a spectrum from a line on, and the mean power of each by its median."""
    ratio, least = _BAND
    ends = [first]
    while ends[-1] + least <= power.size:
        ends.append(min(int(max(ends[-1] * ratio, ends[-1] + least)), power.size))
    return ends, np.array([np.median(power[a:b]) / np.log(2) for a, b in pairwise(ends)])


def slow_noise(residual: NDArray, displacement: NDArray) -> float:
    """Standard deviation of noise whose power is constant, or grows as 1/f towards low frequencies.

    It is that of a residual above the frequencies of the motion. What a law misses grows faster
    towards them. Zero where too little of the spectrum lies above them, or it is not that of noise.
    """
    power, size = _spectrum(residual)
    moving = _spectrum(displacement)[0] * np.arange(power.size) ** 2
    top = int(np.searchsorted(np.cumsum(moving), _MOVING * np.sum(moving)))
    ends, levels = _bands(power, 2 * (top + 2))
    if len(levels) < _FEWEST_BANDS or not levels.all():
        return 0.0
    of_levels = np.stack([np.ones(len(levels)), 1 / np.sqrt(np.multiply(ends[1:], ends[:-1]))], 1)
    fitted = levels
    for _ in range(3):  # the levels scatter in proportion to the noise
        white, slow = nnls(of_levels / fitted[:, np.newaxis], levels / fitted)[0]
        fitted = of_levels @ (white, slow)
    if np.std(np.log(levels / fitted)) > _UNEVEN_LEVELS:
        return 0.0
    lines = np.arange(1, power.size)
    return float(np.sqrt(2 * np.sum(white + slow / lines) / len(residual) / size))


def steady_noise(signal: NDArray) -> float:
    """Standard deviation of the noise of a signal that may have kinks, which are none."""
    sensor = sensor_noise(signal)
    white = sensor.corner == 1 and not sensor.rounded
    return min(float(sensor.deviation), noise_beside_steps(signal) if white else np.inf)


def _steady(signal: NDArray, lines: NDArray) -> bool:
    """Whether these lines of a signal's spectrum are as strong at all times, as those of noise."""
    # a force that turns sharply at reversals has a plateau too, but its power lies at these times
    window = np.hanning(len(signal))
    spectrum = np.fft.rfft((signal - np.linspace(signal[0], signal[-1], len(signal))) * window)
    middle = window > 0.5

    def filtered(lines: NDArray) -> NDArray:
        chosen = np.zeros_like(spectrum)
        chosen[lines] = spectrum[lines]
        return np.fft.irfft(chosen, len(signal))

    # and so has a motion that begins softly, at its ends; lines beside the motion hold its skirt
    upper = lines[len(lines) // 2 :]
    windowed = filtered(upper)
    inside, outside = (
        np.sum(windowed[one] ** 2) / np.sum(window[one] ** 2) for one in (middle, ~middle)
    )
    if outside > (1 + _ENDS / len(upper)) * inside:
        return False
    part = filtered(lines)[middle] / window[middle]
    return bool(np.median(np.abs(part)) / 0.6745 > _STEADY * np.sqrt(np.mean(part**2)))


class ChannelNoise(NamedTuple):
    """Noise of one channel in several runs.

    Attributes
    ----------
    deviation : (n_runs,)
        Standard deviations.
    corner : float, Hz
        Of its low-pass; infinite for white noise.
    """

    deviation: NDArray
    corner: float


def channel_noise(
    forces: Sequence[NDArray],
    steps: Sequence[float],
    displacements: Sequence[NDArray] = (),
    known: Sequence[NDArray] = (),
) -> ChannelNoise:
    """Estimate the noise of the force channel, which has one amplifier for all runs.

    It is that beside a ``known`` part of the force, such as that of a fitted law.
    """
    cycles = [cycles_of(one) for one in displacements] or [0.0] * len(forces)
    parts = known or [np.zeros(1)] * len(forces)
    each = [
        sensor_noise(force, _FORCE, n, part)
        for force, n, part in zip(forces, cycles, parts, strict=True)
    ]
    forces = [force - part for force, part in zip(forces, parts, strict=True)]
    corner = _shared_corner(forces, steps, each)
    shown = np.array([one.corner < 1 for one in each])
    if np.isfinite(corner):
        # a run in which the force hides the plateau has the noise of the others
        own = np.array([one.deviation for one in each]) * np.sqrt([one.corner for one in each])
        own = np.where(shown | (corner >= 0.5 / np.array(steps)), own, np.median(own[shown]))
    else:
        own = np.array([white_noise(force) for force in forces])
        # a force with steps has high frequencies of its own, at few samples; that of a coarse
        # converter has equal samples
        beside = np.array([noise_beside_steps(force) for force in forces])
        own = np.where((0 < beside) & (beside < own / _UNLIKE), beside, own)
    return ChannelNoise(own, corner)


def displacement_noise(displacements: Sequence[NDArray], steps: Sequence[float]) -> NDArray:
    """Standard deviation of white noise as strong as that of the displacement in each run."""
    each = [sensor_noise(one) for one in displacements]
    own = np.array([one.deviation for one in each])
    corner = _shared_corner(displacements, steps, each)
    if np.isfinite(corner):
        # a run whose motion hides the plateau has the noise of the others, or less if it is quieter
        shown = np.array([one.corner < 1 for one in each])
        most = np.median(own[shown] ** 2 * np.array(steps)[shown])
        for k in np.flatnonzero(~shown & (corner < 0.5 / np.array(steps))).tolist():
            density = min(_below(displacements[k], steps[k], corner), most)
            own[k] = max(own[k], np.sqrt(density / steps[k]))
    return own


def _shared_corner(
    signals: Sequence[NDArray], steps: Sequence[float], each: Sequence[SensorNoise]
) -> float:
    """Corner of the low-pass that all runs of a channel share, Hz; infinite if there is none."""
    nyquist = 0.5 / np.array(steps)
    shown = np.array([one.corner < 1 for one in each])
    if not (shown.any() and np.sum(shown) >= _SHOWN * len(each)):
        return np.inf
    corners = (np.array([one.corner for one in each]) * nyquist)[shown]
    corner = float(np.median(corners))
    if np.median(np.abs(np.log(corners / corner))) > np.log(_AGREE):
        return np.inf
    density = np.array([one.deviation for one in each]) ** 2 * np.array(steps)
    missing = [
        _below(signals[k], steps[k], corner) < _MISSING * np.median(density[shown])
        for k in np.flatnonzero(~shown & (corner < nyquist)).tolist()
    ]
    # the instrument's noise is in all runs: these may show that it is none
    return np.inf if np.sum(missing) >= np.sum(shown) else corner


def _below(signal: NDArray, step: float, corner: float) -> float:
    """Power density of a signal in the octave below a corner, as that of white noise."""
    power, size = _spectrum(signal)
    end = int(2 * step * corner * len(power))
    return float(np.median(power[end // 2 : end + 1]) / np.log(2) / size * step)


def noise_beside_steps(signal: NDArray, left_out: NDArray | None = None, order: int = 4) -> float:
    """Standard deviation of white noise by the median of a signal's differences of an order."""
    # those with a sample that is left out do not count. Differences of lower order still hold a
    # force of few samples a cycle, those of higher order more of the steps; the variance of white
    # noise grows by the sum of the binomial squares
    change = np.abs(np.diff(signal, order))
    if left_out is not None:
        windows = np.lib.stride_tricks.sliding_window_view(left_out, order + 1)
        change = change[~windows.any(axis=1)]
    return (
        float(np.median(change) / 0.6745 / np.sqrt(comb(2 * order, order))) if change.size else 0.0
    )


def coloured_noise(random: np.random.Generator, n: int, step: float, corner: float) -> NDArray:
    """Draw noise of unit variance behind a low-pass, (n,)."""
    values = random.standard_normal(n)
    if corner >= 0.5 / step:
        return values
    from scipy.signal import butter, sosfilt

    values = sosfilt(butter(_ORDER, 2 * corner * step, output="sos"), values)
    return values / max(float(np.std(values)), 1e-300)


def _highest(power: NDArray) -> float:
    """Mean power of the lines of the highest frequencies."""
    # the power of a noise line is exponentially distributed: median = ln 2 times mean
    return float(np.median(power[int(_UPPER_BAND * len(power)) :]) / np.log(2))


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
