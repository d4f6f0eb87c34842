"""The noise of a building record, from the record itself.

Two noises are told apart: each sensor's own, and what the noise of the measured ground motion does
to the simulation that is driven by it. The first is white; its size is seen above the building's
band, where the simulation misses nothing else. The second is shared by all channels and lives
around the building's modes; it is simulated.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ...structures import IsolatedStructure
from ..decisions import LEAST_SENSOR_NOISE
from .model import BuildingModel
from .record import BuildingRecord

_WINDOW = 0.5
"""s: over which the noise's size is taken, so that neither shaking nor impacts count for all."""
_DRAWS, _SMOOTHING = 32, 4


@dataclass(frozen=True, eq=False)
class NoiseFloor:
    """Noise of one record."""

    sensors: NDArray  # (n_channels,): Standard deviation of each channel's noise, in its unit
    # (n_directions,): Standard deviation of the noise of the measured ground motion, m/s^2
    ground: NDArray
    total: NDArray  # (n_channels,): RMS that both leave in a channel's residual, in its unit
    band: float  # Highest frequency that is compared, Hz
    # (n_draws, n, n_channels): What the ground's noise does to the simulation, simulated
    draws: NDArray
    # (n_draws, n, n_channels): Residuals of noise alone; as far off the weights as the noise's
    # estimate may be
    examples: NDArray


def highest_frequency(isolated: IsolatedStructure, dt: float) -> float:
    """Upper end of the band in which building and simulation are compared, Hz."""
    # Half as much again as the highest natural frequency, and at most 0.6 of the Nyquist frequency,
    # so that noise can be seen above it.
    current = 0.0
    if isolated.n_channels:
        low, high = isolated.current_range()
        current = float(np.clip(0.0, low, high))
    linear = isolated.linearised(current)
    squares = np.linalg.eigvals(np.linalg.solve(linear.mass, linear.stiffness)).real
    return float(min(1.5 * np.sqrt(squares.max()) / (2 * np.pi), 0.6 * 0.5 / dt))


def white_noise(values: NDArray, dt: float, band: float, quantile: float) -> NDArray:
    """Standard deviation of the white noise in signals (n, n_channels), from above a band (Hz)."""
    # ``quantile`` chooses among windows of half a second: 0.5 for the median, which impacts do not
    # move; less if the signal fills most of the time.
    size = _window_quantile(values, dt, band, quantile)
    return size / _window_quantile(_unit_noise(len(values)), dt, band, quantile)


def _window_quantile(values: NDArray, dt: float, band: float, quantile: float) -> NDArray:
    # the mean slope between the ends would leak into all frequencies
    ramp = np.linspace(0.0, 1.0, len(values))[:, np.newaxis]
    flat = values - values[0] - (values[-1] - values[0]) * ramp
    spectrum = np.fft.rfft(flat, axis=0)
    spectrum[np.fft.rfftfreq(len(values), dt) < band] = 0.0
    fast = np.fft.irfft(spectrum, len(values), axis=0)
    per_window = max(round(_WINDOW / dt), 8)
    windows = len(values) // per_window
    squares = (fast[: windows * per_window] ** 2).reshape(windows, per_window, -1).mean(axis=1)
    return np.sqrt(np.quantile(squares, quantile, axis=0))


@lru_cache(maxsize=8)
def _unit_noise(n: int) -> NDArray:
    """White noise of unit variance that a quantile is compared with."""
    return np.random.default_rng(0).standard_normal((n, 1))


def noise_floor(model: BuildingModel, record: BuildingRecord) -> NoiseFloor:
    """Estimate the noise of a record."""
    dt, measured = record.dt, record.values
    band = highest_frequency(model.nominal, dt)
    predicted = model.predict(record)
    residual = measured - predicted if np.isfinite(predicted).all() else measured
    least = LEAST_SENSOR_NOISE * np.sqrt(np.mean(measured**2, axis=0))
    # where the simulation misses more up there than it explains, the signal itself is no worse
    sensors = np.minimum(white_noise(residual, dt, band, 0.5), white_noise(measured, dt, band, 0.5))
    sensors = np.maximum(sensors, least)
    shaking = np.column_stack([motion.acceleration for motion in record.ground])
    most = white_noise(shaking, dt, band, 0.1)
    draws = _simulated_noise(model, record, most, predicted)
    felt = _felt(draws[:_DRAWS], sensors, int(band * dt * len(measured)), len(most))
    share = float(_ground_shares(residual[np.newaxis], sensors, felt)[0])
    shaken = share * draws[_DRAWS:]
    own = np.empty_like(shaken)
    for k in range(len(own)):
        own[k] = np.random.default_rng(k).standard_normal(own[k].shape)
        own[k] *= sensors / white_noise(own[k], dt, band, 0.5)
    # from these examples the ground's noise would have been estimated differently
    guesses = np.maximum(_ground_shares(own - shaken, sensors, felt), share / 2)
    examples = own - shaken * (share / guesses)[:, np.newaxis, np.newaxis]
    ground, draws = share * most, share * draws[:_DRAWS]
    total = np.sqrt(sensors**2 + np.mean(draws**2, axis=(0, 1)))
    return NoiseFloor(sensors, ground, total, band, draws, examples)


def _simulated_noise(
    model: BuildingModel, record: BuildingRecord, sizes: NDArray, predicted: NDArray
) -> NDArray:
    """Errors of the simulation by noise of the ground's sensors, (n_draws, n, n_channels)."""
    random = np.random.default_rng(1)
    draws = []
    if not np.isfinite(predicted).all():
        return np.zeros((2 * _DRAWS, *predicted.shape))
    for _ in range(2 * _DRAWS):
        shaken = []
        for motion, size in zip(record.ground, sizes, strict=True):
            noise = size * random.standard_normal(len(record))
            shaken.append(replace(motion, acceleration=motion.acceleration + noise))
        draws.append(model.predict(record, shaken) - predicted)
    return np.nan_to_num(np.array(draws))


def _felt(draws: NDArray, sensors: NDArray, n: int, n_directions: int) -> tuple[NDArray, NDArray]:
    """Size and proportions of the errors in the channels by noise of the ground's sensors."""
    # Variance over that of the channels' own noise, (n_frequencies, n_directions), and the unit
    # vectors of it, (n_frequencies, n_channels, n_directions).
    felt = spectra(draws, n) / sensors
    vectors = np.linalg.eigh(covariance(felt))[1][:, :, -n_directions:]
    # not smoothed: beside a peak it would be too much, and the noise found too little
    along = np.einsum("fic,dfi->dfc", vectors.conj(), felt)
    return np.mean(np.abs(along) ** 2, axis=0) / 2, vectors


def _ground_shares(residuals: NDArray, sensors: NDArray, felt: tuple[NDArray, NDArray]) -> NDArray:
    """Noise of the ground's sensors over its upper limits, from the part that channels share."""
    # Strong shaking is never without fast motion, so that what lies above the band bounds the noise
    # of the ground's sensor but seldom is it. The residual's part along what such noise does to the
    # channels tells more; the median over frequencies leaves out where something else is wrong.
    variance, vectors = felt
    used = variance > 1.0
    if used.sum() < 16:
        return np.ones(len(residuals))
    spectrum = spectra(residuals, len(variance)) / sensors
    along = np.einsum("fcd,rfc->rfd", vectors.conj(), spectrum)
    result, variance = np.abs(along[:, used]) ** 2, variance[used]
    low, high = np.zeros(len(residuals)), np.ones(len(residuals))
    for _ in range(30):
        middle = (low + high) / 2
        # half of what is distributed exponentially with mean 2 lies below 2 ln 2
        medians = np.median(result / (1 + middle[:, np.newaxis] * variance), axis=1)
        more = medians > 2 * np.log(2)
        low, high = np.where(more, middle, low), np.where(more, high, middle)
    return np.sqrt(high)


def spectra(values: NDArray, n_frequencies: int) -> NDArray:
    """First Fourier coefficients of signals (n_signals, n, n_channels), scaled to white noise."""
    # Real and imaginary parts have the variance of white noise.
    n = values.shape[1]
    result = np.fft.rfft(values, axis=1)[:, :n_frequencies] / np.sqrt(n / 2)
    result[:, 0] /= np.sqrt(2)
    return result


def covariance(examples: NDArray) -> NDArray:
    """Smoothed covariance of the channels, (n_frequencies, n_channels, n_channels)."""
    products = np.einsum("dfi,dfj->fij", examples, examples.conj())
    return smooth_spectrum(products / (2 * len(examples)))


def smooth_spectrum(products: NDArray) -> NDArray:
    """Mean over neighbouring frequencies; fewer at the ends, always as many on either side."""
    n = len(products)
    total = np.concatenate([np.zeros_like(products[:1]), np.cumsum(products, axis=0)])
    reach = np.minimum(_SMOOTHING, np.minimum(np.arange(n), n - 1 - np.arange(n)))
    low, high = np.arange(n) - reach, np.arange(n) + reach + 1
    return (total[high] - total[low]) / (high - low).reshape(-1, *[1] * (products.ndim - 1))
