"""The noise of a building record, from the record itself, and residuals weighted by it.

Two noises are told apart: each sensor's own, and what the noise of the measured ground motion does
to the simulation that is driven by it. The first is white; its size is seen above the building's
band, where the simulation misses nothing else. The second is shared by all channels and lives
around the building's modes; it is simulated. Their covariance at each frequency, inverted, makes
residuals of unit variance from what is noise alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...structures import IsolatedStructure
from .model import BuildingModel
from .record import BuildingRecord

LEAST_NOISE = 1e-3
"""No sensor is believed to be better than this share of the RMS that it shows."""
LEAST_ERROR = 3e-3
"""Nor is a sensor's calibration believed to be better than this share of what it shows."""
_WINDOW = 0.5
"""s: over which the noise's size is taken, so that neither shaking nor impacts count for all."""
_DRAWS, _SMOOTHING = 32, 4


@dataclass(frozen=True, eq=False)
class Part:
    """Some time of a record with the weights of its residuals.

    Attributes
    ----------
    record : BuildingRecord
        The whole record.
    samples : slice
        The time.
    frequencies : numpy.ndarray, shape (n_frequencies,), Hz
        The building's band.
    whitening : numpy.ndarray, shape (n_frequencies, n_channels, n_channels)
        Turns Fourier coefficients of residuals into uncorrelated ones of unit variance.
    noise_cells : numpy.ndarray, shape (n_examples, n_cells)
        Mean square that examples of noise alone leave in each cell, a channel's residual in a
        band.
    """

    record: BuildingRecord
    samples: slice
    frequencies: NDArray
    whitening: NDArray
    noise_cells: NDArray

    def whitened(self, residual: NDArray) -> NDArray:
        """Weight a residual.

        Parameters
        ----------
        residual : numpy.ndarray, shape (n, n_channels)
            Of the whole record, in the channels' units.

        Returns
        -------
        numpy.ndarray, shape (n_frequencies, n_channels, 2)
            Real and imaginary parts, each of unit variance for noise alone.
        """
        return _whitened(residual[self.samples], self.whitening)

    def halves(self, whitened: NDArray) -> NDArray:
        """Tell where in its time a weighted residual is.

        Parameters
        ----------
        whitened : numpy.ndarray, shape (n_frequencies, n_channels, 2)
            As ``whitened`` returns it.

        Returns
        -------
        numpy.ndarray, shape (2,)
            Mean square before and after half of the measured energy.
        """
        measured = self.record.values[self.samples] / self.rms
        energy = np.cumsum((measured**2).sum(axis=1))
        middle = int(np.clip(np.searchsorted(energy, energy[-1] / 2), 1, len(energy) - 1))
        course = np.fft.irfft(whitened[..., 0] + 1j * whitened[..., 1], len(energy), axis=0)
        return np.array([np.mean(half**2) for half in np.split(course, [middle])])

    @property
    def rms(self) -> NDArray:
        """RMS of each measured channel, (n_channels,), in its unit."""
        return np.sqrt(np.mean(self.record.values[self.samples] ** 2, axis=0))

    @property
    def cell_sizes(self) -> NDArray:
        """Number of frequencies in each cell, (n_cells,)."""
        return np.repeat(np.diff(band_edges(len(self.frequencies))), len(self.record.channels))

    @property
    def expected(self) -> NDArray:
        """Mean square that noise alone leaves in each cell, (n_cells,)."""
        return self.noise_cells.mean(axis=0)

    @property
    def noise_cost(self) -> float:
        """Sum of squared weighted residuals that noise alone leaves."""
        return float(2 * np.sum(self.expected * self.cell_sizes))


@dataclass(frozen=True, eq=False)
class NoiseFloor:
    """Noise of one record.

    Attributes
    ----------
    sensors : numpy.ndarray, shape (n_channels,)
        Standard deviation of each channel's noise, in its unit.
    ground : float, m/s^2
        Standard deviation of the noise of the measured ground motion.
    total : numpy.ndarray, shape (n_channels,)
        RMS that both leave in a channel's residual, in its unit.
    band : float, Hz
        Highest frequency that is compared.
    draws : numpy.ndarray, shape (n_draws, n, n_channels)
        What the ground's noise does to the simulation, simulated.
    examples : numpy.ndarray, shape (n_draws, n, n_channels)
        Residuals of noise alone; as far off the weights as the noise's estimate may be.
    """

    sensors: NDArray
    ground: float
    total: NDArray
    band: float
    draws: NDArray
    examples: NDArray


def highest_frequency(isolated: IsolatedStructure, dt: float) -> float:
    """Upper end of the band in which building and simulation are compared.

    Parameters
    ----------
    isolated : IsolatedStructure
        The engineer's model.
    dt : float, s
        Sampling interval.

    Returns
    -------
    float, Hz
        Half as much again as the highest natural frequency; 0.6 of the Nyquist frequency at most,
        so that noise is left to be seen above it.
    """
    current = 0.0
    if isolated.n_channels:
        low, high = isolated.current_range()
        current = float(np.clip(0.0, low, high))
    linear = isolated.linearised(current)
    squares = np.linalg.eigvals(np.linalg.solve(linear.mass, linear.stiffness)).real
    return float(min(1.5 * np.sqrt(squares.max()) / (2 * np.pi), 0.6 * 0.5 / dt))


def white_noise(values: NDArray, dt: float, band: float, quantile: float) -> NDArray:
    """Size of the white noise in signals, from what they hold above a band.

    Parameters
    ----------
    values : numpy.ndarray, shape (n, n_channels)
        Signals or residuals.
    dt : float, s
        Sampling interval.
    band : float, Hz
        Frequency below which they hold more than noise.
    quantile : float
        Which of the windows of half a second counts: 0.5 for a median, which impacts do not move;
        less where the signal itself fills most of the time.

    Returns
    -------
    numpy.ndarray, shape (n_channels,)
        Standard deviation of noise that is white over all frequencies.
    """
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
    """Estimate the noise of a record.

    Parameters
    ----------
    model : BuildingModel
        What is simulated.
    record : BuildingRecord
        The data.

    Returns
    -------
    NoiseFloor
    """
    dt, measured = record.ground.dt, record.values
    band = highest_frequency(model.nominal, dt)
    predicted = model.predict(record)
    residual = measured - predicted if np.isfinite(predicted).all() else measured
    least = LEAST_NOISE * np.sqrt(np.mean(measured**2, axis=0))
    # where the simulation misses more up there than it explains, the signal itself is no worse
    sensors = np.minimum(
        white_noise(residual, dt, band, 0.5), white_noise(measured, dt, band, 0.5)
    )
    sensors = np.maximum(sensors, least)
    shaking = record.ground.acceleration[:, np.newaxis]
    most = float(white_noise(shaking, dt, band, 0.1)[0])
    draws = _simulated_noise(model, record, most, predicted)
    felt = _felt(draws[:_DRAWS], sensors, int(band * dt * len(measured)))
    share = _ground_share(residual, sensors, felt)
    examples: list[NDArray] = []
    for draw in share * draws[_DRAWS:]:
        own = np.random.default_rng(len(examples)).standard_normal(draw.shape)
        own *= sensors / white_noise(own, dt, band, 0.5)
        # from this example the ground's noise would have been estimated differently
        guess = max(_ground_share(own - draw, sensors, felt), share / 2)
        examples.append(own - draw * share / guess)
    ground, draws = share * most, share * draws[:_DRAWS]
    total = np.sqrt(sensors**2 + np.mean(draws**2, axis=(0, 1)))
    return NoiseFloor(sensors, ground, total, band, draws, np.array(examples))


def _simulated_noise(
    model: BuildingModel, record: BuildingRecord, size: float, predicted: NDArray
) -> NDArray:
    """What noise of the ground's sensor does to the simulation, (n_draws, n, n_channels)."""
    random = np.random.default_rng(1)
    ground, draws = record.ground, []
    if not np.isfinite(predicted).all():
        return np.zeros((2 * _DRAWS, *predicted.shape))
    for _ in range(2 * _DRAWS):
        noise = size * random.standard_normal(len(ground))
        shaken = replace(ground, acceleration=ground.acceleration + noise)
        draws.append(model.predict(record, shaken) - predicted)
    return np.nan_to_num(np.array(draws))


def _felt(draws: NDArray, sensors: NDArray, n: int) -> tuple[NDArray, NDArray]:
    """How much noise of the ground's sensor does to the channels, and in what proportion.

    Variance over that of the channels' own noise, (n_frequencies,), and the unit vector of it.
    """
    spectra = _spectra(draws, n) / sensors
    covariance = _smoothed(np.einsum("dfi,dfj->fij", spectra, spectra.conj()) / (2 * len(draws)))
    direction = np.linalg.eigh(covariance)[1][:, :, -1]
    # not smoothed: beside a peak it would be too much, and the noise found too little
    strength = np.mean(np.abs(np.einsum("fi,dfi->df", direction.conj(), spectra)) ** 2, axis=0) / 2
    return strength, direction


def _ground_share(
    residual: NDArray, sensors: NDArray, felt: tuple[NDArray, NDArray]
) -> float:
    """Noise of the ground's sensor over the most that it can be, from what channels share.

    Strong shaking is never without fast motion, so that what lies above the band bounds the noise
    of the ground's sensor but seldom is it. The residual's part along what such noise does to the
    channels tells more; the median over frequencies leaves out where something else is wrong.
    """
    strength, direction = felt
    spectrum = _spectra(residual[np.newaxis], len(strength))[0] / sensors
    found = np.abs((direction.conj() * spectrum).sum(1)) ** 2
    used = strength > 1.0
    if used.sum() < 16:
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(30):
        middle = (low + high) / 2
        # half of what is distributed exponentially with mean 2 lies below 2 ln 2
        if np.median(found[used] / (1 + middle * strength[used])) > 2 * np.log(2):
            low = middle
        else:
            high = middle
    return float(np.sqrt(high))


def make_part(
    record: BuildingRecord, samples: slice, floor: NoiseFloor, model_error: float = 0.0
) -> Part:
    """Work out the weights of some time of a record.

    Parameters
    ----------
    record : BuildingRecord
        The data.
    samples : slice
        The time.
    floor : NoiseFloor
        Its noise.
    model_error : float
        Error to be expected of any model, as a share of what each channel shows. It weighs like
        noise, but is none: residuals are still judged by what noise alone would leave.

    Returns
    -------
    Part
    """
    dt = record.ground.dt
    n = len(range(*samples.indices(len(record.ground))))
    frequencies = np.fft.rfftfreq(n, dt)
    frequencies = frequencies[frequencies <= floor.band]
    draws = floor.draws[:, samples]
    spectra = _spectra(draws, len(frequencies))
    products = np.einsum("dfi,dfj->fij", spectra, spectra.conj()) / (2 * len(draws))
    shown = _spectra(record.values[np.newaxis, samples], len(frequencies))[0]
    inexact = LEAST_ERROR**2 / 2 * _smoothed(np.abs(shown) ** 2)
    missed = model_error**2 * np.mean(record.values[samples] ** 2, axis=0)
    own = (floor.sensors**2 + missed + inexact)[:, :, np.newaxis] * np.eye(len(missed))
    covariance = _smoothed(products) + own
    whitening = np.linalg.inv(np.linalg.cholesky(covariance))
    # noise alone is judged with its estimate's errors, so that they raise no alarm
    cells = [cell_means(_whitened(one[samples], whitening)) for one in floor.examples]
    return Part(record, samples, frequencies, whitening, np.array(cells))


def cell_means(whitened: NDArray) -> NDArray:
    """Mean square of each channel's residual in each band.

    Parameters
    ----------
    whitened : numpy.ndarray, shape (n_frequencies, n_channels, 2)
        As ``Part.whitened`` returns it.

    Returns
    -------
    numpy.ndarray, shape (n_bands * n_channels,)
        Bands from below, the channels of each side by side.
    """
    edges = band_edges(len(whitened))
    power = (whitened**2).sum(axis=2)
    sums = [power[a:b].mean(axis=0) / 2 for a, b in pairwise(edges)]
    return np.concatenate(sums)


def band_edges(n: int) -> NDArray:
    """Bounds of the bands in which residuals are judged, each about twice as wide as the last.

    Parameters
    ----------
    n : int
        Number of frequencies.

    Returns
    -------
    numpy.ndarray of int, shape (n_bands + 1,)
    """
    edges, width = [0], 8
    while edges[-1] + 3 * width < n:
        edges.append(edges[-1] + width)
        width *= 2
    return np.array([*edges, n])


def _whitened(residual: NDArray, whitening: NDArray) -> NDArray:
    spectrum = _spectra(residual[np.newaxis], len(whitening))[0]
    white = np.einsum("fij,fj->fi", whitening, spectrum)
    return np.stack([white.real, white.imag], axis=-1)


def _spectra(values: NDArray, n_frequencies: int) -> NDArray:
    """Fourier coefficients whose real and imaginary parts have the variance of white noise."""
    n = values.shape[1]
    spectra = np.fft.rfft(values, axis=1)[:, :n_frequencies] / np.sqrt(n / 2)
    spectra[:, 0] /= np.sqrt(2)
    return spectra


def _smoothed(products: NDArray) -> NDArray:
    """Mean over neighbouring frequencies; fewer at the ends, always as many on either side."""
    n = len(products)
    total = np.concatenate([np.zeros_like(products[:1]), np.cumsum(products, axis=0)])
    reach = np.minimum(_SMOOTHING, np.minimum(np.arange(n), n - 1 - np.arange(n)))
    low, high = np.arange(n) - reach, np.arange(n) + reach + 1
    return (total[high] - total[low]) / (high - low).reshape(-1, *[1] * (products.ndim - 1))
