"""Residuals of some time of a building record, weighted by its noise.

The covariance of both noises at each frequency, inverted, makes residuals of unit variance from
what is noise alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .noise import NoiseFloor, covariance, smoothed, spectra
from .record import BuildingRecord

LEAST_ERROR = 3e-3
"""No sensor's calibration is believed to be better than this share of what it shows."""


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
    felt = spectra(floor.draws[:, samples], len(frequencies))
    shown = spectra(record.values[np.newaxis, samples], len(frequencies))[0]
    inexact = LEAST_ERROR**2 / 2 * smoothed(np.abs(shown) ** 2)
    missed = model_error**2 * np.mean(record.values[samples] ** 2, axis=0)
    own = (floor.sensors**2 + missed + inexact)[:, :, np.newaxis] * np.eye(len(missed))
    whitening = np.linalg.inv(np.linalg.cholesky(covariance(felt) + own))
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
    spectrum = spectra(residual[np.newaxis], len(whitening))[0]
    white = np.einsum("fij,fj->fi", whitening, spectrum)
    return np.stack([white.real, white.imag], axis=-1)
