"""The cycles of a sinusoidal test: frequency, centre line, whole cycles, harmonics."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...errors import InputError

MINIMUM_CYCLES = 3
MINIMUM_SAMPLES_A_CYCLE = 16
# share of the first harmonic in the power of the first five: 0.986 for a triangular test
_SINUSOIDAL, _HARMONICS = 0.99, 5
_AMPLITUDE_TOLERANCE = 0.05


def find_frequency(time: np.ndarray, displacement: np.ndarray) -> float:
    """Return the frequency of a sinusoid in noise, offset and drift."""
    # Least squares of offset, line and sinusoid, refined from the largest line of the periodogram:
    # it needs no whole number of cycles.
    from scipy.optimize import minimize_scalar

    span = time[-1] - time[0]
    step = span / (time.size - 1)
    # drift is nearly constant in the differences, where its mean takes nothing from a sinusoid;
    # power times frequency stands between slow drift, loud in the one, and noise, loud in the other
    change = np.diff(displacement)
    power = np.abs(np.fft.rfft((change - change.mean()) * np.hanning(change.size))) ** 2
    frequency = np.fft.rfftfreq(change.size, step)
    with np.errstate(divide="ignore", invalid="ignore"):
        power = np.where(frequency > 0, power / np.sin(np.pi * frequency * step), 0.0)
    power[frequency < 1.0 / span] = 0.0
    start = frequency[int(np.argmax(power))]

    def left(f: float) -> float:
        return _residual(time, displacement, f)

    width = 1.0 / span
    result = minimize_scalar(
        left,
        bounds=(max(start - width, 0.3 * width), start + width),
        method="bounded",
        options={"xatol": 1e-9 * start},
    )
    return float(result.x)


def _residual(time: np.ndarray, y: np.ndarray, frequency: float) -> float:
    s = (time - time.mean()) / np.ptp(time)
    columns = [np.ones_like(s), s]
    if frequency > 0:
        phase = 2 * np.pi * frequency * (time - time[0])
        columns += [np.cos(phase), np.sin(phase)]
    basis = np.stack(columns, axis=1)
    coefficients = np.linalg.lstsq(basis, y, rcond=None)[0]
    return float(np.sum((y - basis @ coefficients) ** 2))


def require_cycles(time: np.ndarray, frequency: float, skip: int) -> None:
    """Refuse a record that cannot hold enough cycles, or holds too few samples of each."""
    span = time[-1] - time[0]
    samples = (time.size - 1) / (span * frequency)
    if samples < MINIMUM_SAMPLES_A_CYCLE * (1 - 1e-9):
        raise InputError(
            f"{samples:.3g} samples a cycle of {frequency:.4g} Hz; expected: "
            f"{MINIMUM_SAMPLES_A_CYCLE} or more"
        )
    n = int(span * frequency + 1e-9)
    if n - skip < MINIMUM_CYCLES:
        raise _too_few(time, frequency, n, skip)


def _too_few(time: np.ndarray, frequency: float, n: int, skip: int) -> InputError:
    skipped = f" after {skip} skipped" if skip else ""
    return InputError(
        f"{max(n - skip, 0)} whole cycles of {frequency:.4g} Hz in {np.ptp(time):.4g} s{skipped}; "
        f"expected: {MINIMUM_CYCLES} or more"
    )


def centre_line(time: np.ndarray, y: np.ndarray, period: float) -> np.ndarray:
    """Return offset and slow drift: the mean over one period about each sample."""
    from scipy.interpolate import CubicHermiteSpline

    area = np.concatenate([[0.0], np.cumsum((y[1:] + y[:-1]) / 2 * np.diff(time))])
    integral = CubicHermiteSpline(time, area, y)
    line = (integral(time + period / 2) - integral(time - period / 2)) / period
    early, late = time[0] + period / 2, time[-1] - period / 2
    inside = (time >= early) & (time <= late)
    for outside, near in (
        (time < early, inside & (time <= early + period)),
        (time > late, inside & (time >= late - period)),
    ):
        line[outside] = np.polynomial.Polynomial.fit(time[near], line[near], 1)(time[outside])
    return np.asarray(line)


def whole_cycles(
    time: np.ndarray, displacement: np.ndarray, frequency: float, skip: int
) -> np.ndarray:
    """Return the times at which the displacement peaks, one per whole cycle."""
    period = 1.0 / frequency
    coefficients = harmonics(time, displacement, frequency, time[0], 1)
    peak = float(np.angle(coefficients[0])) / (2 * np.pi) * period
    first = time[0] + peak % period
    if first - period / 4 < time[0] - 1e-9 * period:
        first += period
    n = int(np.floor((time[-1] - first + period / 4) * frequency + 1e-9))
    if n - skip < MINIMUM_CYCLES:
        raise _too_few(time, frequency, n, skip)
    return first + period * np.arange(skip, n)


def harmonics(
    time: np.ndarray, y: np.ndarray, frequency: float, origin: float, count: int
) -> np.ndarray:
    """Return the complex amplitudes of a series by least squares, with an offset beside them."""
    phase = 2 * np.pi * frequency * (time - origin)
    turns = np.vander(np.exp(1j * phase), count + 1, increasing=True)
    basis = np.hstack([turns.real, turns.imag[:, 1:]])
    fitted: Any = np.linalg.lstsq(basis, y, rcond=None)[0]
    return np.asarray(fitted[1 : count + 1] + 1j * fitted[count + 1 :])


def steady_cycles(
    time: np.ndarray, displacement: np.ndarray, frequency: float, peaks: np.ndarray
) -> np.ndarray:
    """Separate the cycles of a test from rest and ramps before and after it."""
    period = 1.0 / frequency
    amplitudes, shares = np.zeros(peaks.size), np.zeros(peaks.size)
    for k, peak in enumerate(peaks):
        inside = (time >= peak - period / 4) & (time < peak + 3 * period / 4)
        count = min(_HARMONICS, int(np.count_nonzero(inside)) // 4)
        sizes = np.abs(harmonics(time[inside], displacement[inside], frequency, peak, count))
        amplitudes[k] = sizes[0]
        shares[k] = sizes[0] ** 2 / max(np.sum(sizes**2), np.finfo(float).tiny)
    moving = amplitudes >= np.max(amplitudes) / 2
    share = float(np.median(shares[moving]))
    if share < _SINUSOIDAL:
        raise InputError(
            f"a sinusoid of {frequency:.4g} Hz carries {100 * share:.1f} % of the displacement's "
            f"power in its harmonics; expected: a sinusoidal test, {100 * _SINUSOIDAL:.0f} % or "
            "more"
        )
    usual = float(np.median(amplitudes[moving]))
    steady = np.abs(amplitudes - usual) <= _AMPLITUDE_TOLERANCE * usual
    if np.count_nonzero(steady) < MINIMUM_CYCLES:
        raise InputError(
            f"{np.count_nonzero(steady)} of {steady.size} whole cycles of {frequency:.4g} Hz have "
            f"an amplitude within {100 * _AMPLITUDE_TOLERANCE:.0f} % of the median {usual:.4g} m; "
            f"expected: {MINIMUM_CYCLES} or more"
        )
    return steady
