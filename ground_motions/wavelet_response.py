"""Compiled response of oscillators to wavelets at given instants; see `matching`."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def responses_at(accelerations, first, propagators, oscillators, samples):
    """Return the scaled displacement of oscillators at given instants under every motion.

    Parameters
    ----------
    accelerations : (w, n) ndarray
        Ground acceleration of each motion, linear between samples, m/s2.
    first : (w,) ndarray of int
        Sample at which each motion begins; the oscillators are at rest until then.
    propagators : (m, 2, 4) ndarray
        Of each oscillator over a sample; see `ground_motions.oscillator.response_history`.
    oscillators, samples : (r,) ndarray of int
        Oscillator and instant of each response; those of one oscillator stand together, in time.

    Returns
    -------
    (r, w) ndarray
        Circular frequency squared times the displacement relative to the ground, m/s2.
    """
    out = np.zeros((len(samples), len(accelerations)))
    for j in range(len(accelerations)):
        a = accelerations[j]
        u, v, k = 0.0, 0.0, first[j]
        for r in range(len(samples)):
            p = propagators[oscillators[r]]
            if r == 0 or oscillators[r] != oscillators[r - 1]:
                u, v, k = 0.0, 0.0, first[j]
            while k < samples[r]:
                here = a[k]
                change = a[k + 1] - here
                u, v = (
                    p[0, 0] * u + p[0, 1] * v + p[0, 2] * here + p[0, 3] * change,
                    p[1, 0] * u + p[1, 1] * v + p[1, 2] * here + p[1, 3] * change,
                )
                k += 1
            out[r, j] = u
    return out
