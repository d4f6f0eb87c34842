"""Residuals of a part of a building record, weighted by its noise.

The covariance of both noises at each frequency, inverted, makes residuals of unit variance from
what is noise alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.fft import prev_fast_len

from ...identification.least_squares import orthonormal
from ..decisions import LEAST_SENSOR_ERROR
from .noise import NoiseFloor, covariance, smooth_spectrum, spectra
from .record import BuildingRecord


@dataclass(frozen=True, eq=False)
class Segment:
    """Some time of a record with the weights of its residuals."""

    record: BuildingRecord  # The whole record
    samples: slice  # The time
    frequencies: NDArray  # (n_frequencies,), Hz: The building's band
    # (n_frequencies, n_residuals, n_channels): Turns Fourier coefficients of residuals into
    # uncorrelated ones of unit variance
    whitening: NDArray
    # (n_examples, n_cells): Mean square that examples of noise alone leave in each cell, a
    # channel's residual in a band
    noise_cells: NDArray
    # (2 n_frequencies n_residuals, n): Orthonormal weighted residuals that are left out
    left_out: NDArray | None = None

    def whiten(self, residual: NDArray) -> NDArray:
        """Weight a record's residual (n, n_channels) by the noise, (n_frequencies, n_channels, 2).

        Real and imaginary parts have unit variance for noise alone.
        """
        white = _whiten(residual[self.transformed], self.whitening)
        if self.left_out is None:
            return white
        along = self.left_out.T @ white.ravel()
        return white - (self.left_out @ along).reshape(white.shape)

    def whiten_noise(self, floor: NoiseFloor) -> NDArray:
        """Weight residuals of noise alone, (n_examples, n_frequencies, n_residuals, 2)."""
        return np.array([self.whiten(example) for example in floor.examples])

    def halves(self, whitened: NDArray) -> NDArray:
        """Mean square of a weighted residual before and after half of the measured energy, (2,)."""
        measured = self.record.values[self.transformed] / self.rms
        energy = np.cumsum((measured**2).sum(axis=1))
        middle = int(np.clip(np.searchsorted(energy, energy[-1] / 2), 1, len(energy) - 1))
        trajectory = np.fft.irfft(whitened[..., 0] + 1j * whitened[..., 1], len(energy), axis=0)
        return np.array([np.mean(half**2) for half in np.split(trajectory, [middle])])

    @property
    def transformed(self) -> slice:
        """The time of the residuals' Fourier coefficients."""
        return _transformed(self.samples, len(self.record))

    @property
    def rms(self) -> NDArray:
        """RMS of each measured channel, (n_channels,), in its unit."""
        return np.sqrt(np.mean(self.record.values[self.samples] ** 2, axis=0))

    @property
    def cell_sizes(self) -> NDArray:
        """Number of frequencies in each cell, (n_cells,)."""
        return np.repeat(np.diff(band_edges(len(self.frequencies))), self.whitening.shape[1])

    @property
    def expected(self) -> NDArray:
        """Mean square that noise alone leaves in each cell, (n_cells,)."""
        return self.noise_cells.mean(axis=0)

    @property
    def noise_cost(self) -> float:
        """Sum of squared weighted residuals that noise alone leaves."""
        return float(2 * np.sum(self.expected * self.cell_sizes))

    @property
    def noise_variance(self) -> float:
        """Variance of this sum."""
        return float(np.var(2 * self.noise_cells @ self.cell_sizes, ddof=1))


def without_channel(segment: Segment, floor: NoiseFloor, channel: int) -> Segment:
    """Leave out what any signal in one channel explains: one residual fewer than channels."""
    # unitary, its first column along what the channel shows
    basis = np.linalg.qr(segment.whitening[:, :, channel : channel + 1], mode="complete")[0]
    whitening = basis[:, :, 1:].conj().swapaxes(1, 2) @ segment.whitening
    cells = [cell_means(_whiten(one[segment.transformed], whitening)) for one in floor.examples]
    return replace(segment, whitening=whitening, noise_cells=np.array(cells))


def without_force(segment: Segment, floor: NoiseFloor, response: NDArray, ends: NDArray) -> Segment:
    """Leave out what forces explain, and what motion at both ends of the time adds.

    ``response`` (n_frequencies, n_channels, n_forces) is that of the channels, and ``ends``
    (n_frequencies, n_channels, n) that to the motion at an end.
    """
    basis = np.linalg.qr(segment.whitening @ response, mode="complete")[0]
    rest = basis[:, :, response.shape[2] :].conj().swapaxes(1, 2)
    whitening = rest @ segment.whitening
    # a constant force moves the free base without end
    whitening[0] = 0.0
    added = whitening @ ends
    added = np.stack([added.real, added.imag], axis=2).reshape(-1, added.shape[2])
    left_out = orthonormal(added / np.maximum(np.linalg.norm(added, axis=0), 1e-300))
    result = replace(segment, whitening=whitening, left_out=left_out)
    cells = [cell_means(one) for one in result.whiten_noise(floor)]
    return replace(result, noise_cells=np.array(cells))


def make_segment(
    record: BuildingRecord, samples: slice, floor: NoiseFloor, model_error: float = 0.0
) -> Segment:
    """Work out the weights of some time of a record."""
    transformed = _transformed(samples, len(record))
    frequencies = np.fft.rfftfreq(transformed.stop - transformed.start, record.dt)
    frequencies = frequencies[frequencies <= floor.band]
    felt = spectra(floor.draws[:, transformed], len(frequencies))
    shown = spectra(record.values[np.newaxis, transformed], len(frequencies))[0]
    inexact = LEAST_SENSOR_ERROR**2 / 2 * smooth_spectrum(np.abs(shown) ** 2)
    missed = model_error**2 * np.mean(record.values[samples] ** 2, axis=0)
    noise = floor.sensor_noise(frequencies) ** 2
    own = (noise + missed + inexact)[:, :, np.newaxis] * np.eye(len(missed))
    whitening = np.linalg.inv(np.linalg.cholesky(covariance(felt) + own))
    # noise alone is judged with its estimate's errors, so that they raise no alarm
    cells = [cell_means(_whiten(one[transformed], whitening)) for one in floor.examples]
    return Segment(record, samples, frequencies, whitening, np.array(cells))


def _transformed(samples: slice, n: int) -> slice:
    """Some of ``n`` samples less the few at their end that slow an FFT down, eightfold if prime."""
    begin, end, _ = samples.indices(n)
    return slice(begin, begin + prev_fast_len(end - begin))


def cell_means(whitened: NDArray) -> NDArray:
    """Mean square of each channel's residual in each band, bands from below, (n_cells,)."""
    edges = band_edges(len(whitened))
    power = (whitened**2).sum(axis=2)
    sums = [power[a:b].mean(axis=0) / 2 for a, b in pairwise(edges)]
    return np.concatenate(sums)


def band_edges(n: int) -> NDArray:
    """Bounds of the bands in which residuals are compared, (n_bands + 1,), of growing width."""
    edges, width = [0], 8
    while edges[-1] + 3 * width < n:
        edges.append(edges[-1] + width)
        width *= 2
    return np.array([*edges, n])


def _whiten(residual: NDArray, whitening: NDArray) -> NDArray:
    spectrum = spectra(residual[np.newaxis], len(whitening))[0]
    white = np.einsum("fij,fj->fi", whitening, spectrum)
    return np.stack([white.real, white.imag], axis=-1)
