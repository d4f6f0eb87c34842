"""Random series with a given power spectral density."""

from __future__ import annotations

import numpy as np

from ground_motions.checks import FloatArray
from ground_motions.errors import InputError


def random_phases(psd: FloatArray, count: int, dt: float, seed: int) -> FloatArray:
    """Return a zero-mean series by the spectral representation: fixed amplitudes, random phases.

    Parameters
    ----------
    psd : (count // 2 + 1,) ndarray
        One-sided power spectral density at `frequencies`, x^2/Hz for a series in x. The value at
        0 Hz is passed over.
    count : int
        Number of samples, two or more.
    dt : float
        Sampling step, s.
    seed : int
        Seed of NumPy's default generator; the phases are uniform.

    Returns
    -------
    (count,) ndarray
        The series, in x. Its period is ``count * dt``; before any tapering its periodogram equals
        the target at every frequency below Nyquist, whatever the seed.

    Raises
    ------
    InputError
        If the seed is not one that NumPy takes.

    Notes
    -----
    M. Shinozuka and G. Deodatis, Applied Mechanics Reviews 44 (1991) 191-204.
    """
    try:
        generator = np.random.default_rng(seed)
    except (TypeError, ValueError):
        raise InputError("seed", repr(seed), "a whole number, 0 or above") from None
    phase = generator.uniform(0.0, 2.0 * np.pi, len(psd))
    amplitude = np.sqrt(2.0 * psd / (count * dt))
    amplitude[0] = 0.0
    if count % 2 == 0:
        amplitude[-1] = 0.0  # at Nyquist a cosine of random phase has no fixed amplitude
    series: FloatArray = np.fft.irfft(0.5 * count * amplitude * np.exp(1j * phase), count)
    return series


def frequencies(count: int, dt: float) -> FloatArray:
    """Return the frequencies at which `random_phases` takes a density.

    Parameters
    ----------
    count : int
        Number of samples.
    dt : float
        Sampling step, s.

    Returns
    -------
    (count // 2 + 1,) ndarray
        Frequencies from 0 to Nyquist, Hz.
    """
    return np.fft.rfftfreq(count, dt)
