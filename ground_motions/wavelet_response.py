"""Compiled response of oscillators to wavelets at given instants; see `matching`."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def responses_at(accelerations, first, propagators, oscillators, samples):
    """Return the scaled displacement of oscillators at given instants under every motion."""
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
