"""Processing of an acceleration history: removal of drift, change of the sampling step."""

from __future__ import annotations

import math
import operator
from fractions import Fraction

import numpy as np

from ground_motions import integration
from ground_motions.checks import FloatArray, few_enough, positive
from ground_motions.errors import InputError

_HIGHEST_ORDER = 10
_POLES = 4


def correct_baseline(
    acceleration: FloatArray, dt: float, order: int, highpass_hz: float | None = None
) -> FloatArray:
    """Take a polynomial and, if asked for, low frequencies from an acceleration."""
    result = remove_polynomial(acceleration, dt, order)
    if highpass_hz is not None:
        # The polynomial goes last too: cutting the filter's pads off leaves a little velocity.
        result = remove_polynomial(highpass(result, dt, highpass_hz), dt, order)
    return result


def remove_polynomial(acceleration: FloatArray, dt: float, order: int) -> FloatArray:
    """Subtract the polynomial that ends the velocity at zero and minimises its mean square."""
    accepted = f"a whole number from 0 to {_HIGHEST_ORDER}"
    try:
        degree = operator.index(order)
    except TypeError:
        raise InputError("order", repr(order), accepted) from None
    if not 0 <= degree <= _HIGHEST_ORDER:
        raise InputError("order", repr(order), accepted)

    n = len(acceleration)
    basis = np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, n), min(degree, n - 1))
    basis_velocity = integration.velocity(basis, dt)
    velocity = integration.velocity(acceleration, dt)
    # The constant term alone ends the velocity at zero; the other terms, each freed of its own
    # final velocity, then reduce the mean square.
    share = basis_velocity[-1, 1:] / basis_velocity[-1, 0]
    free = basis[:, 1:] - share
    free_velocity = basis_velocity[:, 1:] - np.outer(basis_velocity[:, 0], share)
    constant = velocity[-1] / basis_velocity[-1, 0]
    remainder = velocity - constant * basis_velocity[:, 0]
    weights = np.linalg.lstsq(free_velocity, remainder, rcond=None)[0]
    result: FloatArray = acceleration - constant - free @ weights
    return result


def highpass(acceleration: FloatArray, dt: float, corner_hz: float) -> FloatArray:
    """High-pass filter without phase shift, over zero pads that are then cut off again."""
    from scipy.signal import butter, sosfiltfilt

    corner = positive("highpass_hz (Hz)", corner_hz)
    nyquist = 0.5 / dt
    if corner >= nyquist:
        raise InputError(
            "highpass_hz (Hz)", f"{corner:g}", f"below the Nyquist frequency, {nyquist:g} Hz"
        )
    pad = math.ceil(1.5 * _POLES / corner / dt)
    sections = butter(_POLES, corner, "highpass", fs=1.0 / dt, output="sos")
    filtered: FloatArray = sosfiltfilt(sections, np.pad(acceleration, pad), padlen=0)
    return filtered[pad:-pad]


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
