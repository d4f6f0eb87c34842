"""Random series with a power spectral density, and the source of a synthetic motion."""

from __future__ import annotations

from typing import Any

import numpy as np

from ground_motions.checks import FloatArray
from ground_motions.errors import InputError


def random_phases(psd: FloatArray, count: int, dt: float, seed: int) -> FloatArray:
    """Return a zero-mean series by the spectral representation: fixed amplitudes, random phases.

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


def call_text(function: str, **arguments: Any) -> str:
    """Return a call as text, the source of the motion that it makes."""
    return f"{function}({', '.join(f'{name}={value!r}' for name, value in arguments.items())})"


def frequencies(count: int, dt: float) -> FloatArray:
    """Return the frequencies at which `random_phases` takes a density."""
    return np.fft.rfftfreq(count, dt)
