"""Displacement, velocity and acceleration from sampled, noisy displacement."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...errors import InputError
from .noise import SensorNoise, sensor_noise

MINIMUM_SAMPLES = 5
_CUT_OFFS = 100
# numbers that a processor keeps near
_AT_ONCE = 30_000
# the low-pass passes 1 / (1 + (f / cut-off)^8): a Butterworth filter of order 4, back and forth
_POWER = 8
# periods of the cut-off over which a quartic tells the ends' values and curvatures
_END_PERIODS = 0.75
_DEGREE = 4
# the cubic has to leave less than this part of what the line leaves
_CLEARLY = 0.8
# multiples of the cut-off within which that is decided: beyond it all is noise
_NEAR = 1.5
# Hz, of the mains; share of it by which they stray; multiples of them that are looked for
_MAINS, _HUM_NEAR, _HUM_ORDERS = (50.0, 60.0), 2e-3, 3
# lines beside theirs, over whose strongest it has to stand out by a factor; its largest amplitude
# over the range; where it may lie between two lines
_HUM_BESIDE, _HUM_CLEARLY, _HUM_LARGEST = (4, 5, 6, 7, 8), 4.0, 2e-3
_BETWEEN = np.linspace(-0.6, 0.6, 25)
# of the square of a normal variable
_MEDIAN_OF_SQUARE = 0.4549


def cycle_time(size: float, speed: float) -> float:
    """Period of a sinusoid with a motion's RMS displacement, m, and velocity, m/s; in s."""
    return 2 * np.pi * size / max(speed, 1e-300)


class _Series(NamedTuple):
    """A cubic, by its coefficients in time, and a sine series; what filtering leaves wrong."""

    cubic: np.ndarray
    terms: np.ndarray
    cut_off: float
    wrong: float


def smooth(displacement: Any, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return displacement, velocity and acceleration from a uniformly sampled displacement."""
    # The samples are a sine series about a line through their ends, or about a cubic that has the
    # ends' curvatures as well; so the series converges fast without a window, and motion that
    # starts or stops abruptly counts in full. The series is low-passed without phase at the
    # frequency that leaves the least expected error of the velocity: the signal cut off plus the
    # noise let through, by Stein's unbiased estimate, with the noise of ``sensor_noise``. The cubic
    # is taken where it leaves clearly less. Data without visible noise are not filtered. Hum of the
    # mains is no motion, but a cut-off would follow it; its lines are subtracted first.
    x = np.asarray(displacement, dtype=float)
    if x.ndim != 1 or x.size < MINIMUM_SAMPLES or not np.all(np.isfinite(x)):
        raise InputError(
            f"displacement of shape {x.shape}; expected: {MINIMUM_SAMPLES} or more finite samples"
        )
    if not (np.isfinite(step) and step > 0):
        raise InputError(f"step {step!r} s; expected: a positive number")
    from scipy.fft import dct, idst

    # in units of the step and of the largest value
    size = float(np.max(np.abs(x))) or 1.0
    x = _without_hum(x, step)
    cubic, terms, cut_off, _ = _series(x / size, sensor_noise(x / size))
    n = x.size
    t = np.arange(n)
    omega = np.pi * np.arange(1, n - 1) / (n - 1)
    terms = terms / (1 + (omega / cut_off) ** _POWER)
    line = np.polynomial.Polynomial(cubic)
    value, slope, bend = line(t), line.deriv(1)(t), line.deriv(2)(t)
    value[1:-1] += idst(terms, type=1)
    slope += dct(np.concatenate([[0.0], omega * terms, [0.0]]), type=1) / (2 * (n - 1))
    bend[1:-1] -= idst(omega**2 * terms, type=1)
    return size * value, size * slope / step, size * bend / step**2


def _without_hum(x: np.ndarray, step: float) -> np.ndarray:
    """Samples without the lines of the mains that stand out and are far smaller than the motion."""
    n = x.size
    width = 1 / (n * step)
    window = np.hanning(n)
    window *= 2 / window.sum()
    windowed = window * (x - np.linspace(x[0], x[-1], n))
    lines = np.abs(np.fft.rfft(windowed))
    motion = int(np.argmax(lines))
    # its harmonics do not stand out from each other
    apart = {*_HUM_BESIDE, *(m * motion + k for m in (1, 2) for k in (-2, -1, 0, 1, 2))}
    apart = {k for k in apart if k >= _HUM_BESIDE[0]}
    for mains in (m * order for m in _MAINS for order in range(1, _HUM_ORDERS + 1)):
        low, high = (round(mains * (1 + near) / width) for near in (-_HUM_NEAR, _HUM_NEAR))
        if low <= _HUM_BESIDE[-1] or high + _HUM_BESIDE[-1] >= lines.size:
            continue
        k = low - 1 + int(np.argmax(lines[low - 1 : high + 2]))
        beside = [lines[at] for one in apart for at in (k - one, k + one) if 0 < at < lines.size]
        if _HUM_CLEARLY * max(beside) < lines[k] < _HUM_LARGEST * np.ptp(x):
            waves = np.exp(2j * np.pi * np.outer(width * (k + _BETWEEN), step * np.arange(n)))
            amplitudes = waves.conj() @ windowed
            best = int(np.argmax(np.abs(amplitudes)))
            x = x - (amplitudes[best] * waves[best]).real
    return x


def _series(x: np.ndarray, sensor: SensorNoise) -> _Series:
    """Sine series of samples, about their ends, with the better of both kinds of ends."""
    first, last = float(x[0]), float(x[-1])
    result = _about(x, sensor, first, last)
    # the ends' values are noisy samples until a cut-off is known
    width = _END_PERIODS * 2 * np.pi / result.cut_off
    count = int(np.clip(width, _DEGREE + 1, x.size))
    ends = [_end(x[:count]), _end(x[::-1][:count])]
    (first, bend_first), (last, bend_last) = ends
    line = _about(x, sensor, first, last)
    cubic = _about(x, sensor, first, last, bend_first, bend_last)
    # curvatures bring noise of their own
    return cubic if cubic.wrong < _CLEARLY * line.wrong else line


def _end(x: np.ndarray) -> tuple[float, float]:
    """Value and curvature at the first of some samples, by a quartic through them."""
    fitted = np.polynomial.Polynomial.fit(np.arange(x.size), x, _DEGREE)
    return float(fitted(0)), float(fitted.deriv(2)(0))


def _about(
    x: np.ndarray, sensor: SensorNoise, first: float, last: float, bend_first: float = 0.0,
    bend_last: float = 0.0,
) -> _Series:  # fmt: skip
    """Sine series about the cubic with some values and curvatures at its ends."""
    from scipy.fft import dst

    n = x.size
    c2, c3 = bend_first / 2, (bend_last - bend_first) / (6 * (n - 1))
    c1 = (last - first) / (n - 1) - (n - 1) * (c2 + (n - 1) * c3)
    cubic = np.array([first, c1, c2, c3])
    terms = dst((x - np.polynomial.Polynomial(cubic)(np.arange(n)))[1:-1], type=1)
    power = terms**2
    omega = np.pi * np.arange(1, n - 1) / (n - 1)
    noise = np.full(n - 2, float(np.median(power[power.size // 2 :])) / _MEDIAN_OF_SQUARE)
    plateau = 2 * (n - 1) * sensor.deviation**2
    if sensor.rounded:
        noise = np.maximum(noise, plateau)
    elif sensor.corner < 1:
        # beyond the corner there is nothing else
        noise = np.where(omega < np.pi * sensor.corner, plateau, np.minimum(plateau, power))
    by_velocity, sharp = omega**2, omega**_POWER
    signal, random = by_velocity * (power - noise), by_velocity * noise
    # with passed = 1 / divisor: (1 - passed)^2 signal + passed^2 random; some cut-offs at once
    bent, risks = sharp**2 * signal, []
    cut_offs = np.geomspace(omega[0], omega[-1], _CUT_OFFS)
    for some in np.array_split(cut_offs, np.ceil(_CUT_OFFS * n / _AT_ONCE)):
        factor = some[:, np.newaxis] ** -_POWER
        divisor = sharp * factor
        divisor += 1
        divisor *= divisor
        part = bent * factor**2
        part += random
        part /= divisor
        # sums, since BLAS would divide a dot product among processors that others use
        risks.extend(np.sum(part, axis=1))
    k = int(np.argmin(risks))
    best = float(cut_offs[k]) if risks[k] < np.sum(random) else np.inf
    passed = 1 / (1 + (omega / best) ** _POWER)
    wrong = omega**2 * ((1 - passed) ** 2 * power + passed**2 * noise)
    return _Series(cubic, terms, best, float(np.sum(wrong[omega < _NEAR * best])))
