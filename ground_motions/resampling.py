"""Change of the sampling step."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from ground_motions.checks import FloatArray, few_enough
from ground_motions.errors import InputError

_LARGEST = 1000  # numerator or denominator of a coarsening ratio; sets the filter's length


def resample(samples: FloatArray, dt: float, new_dt: float) -> FloatArray:
    """Return samples at another step: interpolated if finer, filtered first if coarser.

    Notes
    -----
    The filter is SciPy's polyphase one (linear phase, Kaiser window) at the new Nyquist frequency.
    """
    duration = (len(samples) - 1) * dt
    few_enough(duration / new_dt, f"{duration:g} s resampled to {new_dt:g} s")
    count = math.floor(duration / new_dt * (1.0 + 1e-12)) + 1
    if count < 3:
        raise InputError("dt (s)", f"{new_dt:g}", f"at most half the duration ({duration:g} s)")
    if new_dt < dt:
        return np.interp(np.arange(count) * new_dt, np.arange(len(samples)) * dt, samples)

    from scipy.signal import resample_poly

    ratio = Fraction(new_dt / dt).limit_denominator(_LARGEST)
    if ratio.numerator > _LARGEST or not math.isclose(ratio, new_dt / dt, rel_tol=1e-9):
        raise InputError(
            "dt (s)",
            f"{new_dt:g}, {new_dt / dt:g} times the present step",
            f"a coarser step that is a fraction of whole numbers up to {_LARGEST} times as long",
        )
    coarse: FloatArray = resample_poly(samples, ratio.denominator, ratio.numerator, padtype="line")
    return coarse[:count]
