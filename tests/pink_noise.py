"""Noise that grows towards low frequencies, for tests."""

import numpy as np


def pink_noise(random, n):
    """Noise of unit variance whose power is 1 over the frequency."""
    lines = np.arange(n // 2 + 1)
    spectrum = random.standard_normal((2, len(lines))).T @ (1, 1j) / np.sqrt(np.maximum(lines, 1))
    spectrum[0] = 0.0
    noise = np.fft.irfft(spectrum, n)
    return noise / np.std(noise)
