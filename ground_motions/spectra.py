"""Elastic response of a damped oscillator to a record: spectra and histories."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import numpy as np
import numpy.typing as npt

from ground_motions.argument_types import checked
from ground_motions.checks import FloatArray, positive, read_only, within
from ground_motions.errors import InputError

_SUBSTEPS_A_PERIOD = 20
_SHORTEST_PERIOD = 1e-3  # in samples; the oscillator is rigid to about 1e-5 there


class Motion(Protocol):
    """A ground motion at equal steps, such as a `Record`."""

    @property
    def acceleration(self) -> FloatArray:
        """Ground acceleration at the samples, m/s2."""

    @property
    def dt(self) -> float:
        """Step between samples, s."""

    @property
    def time(self) -> FloatArray:
        """Time of the samples, s."""

    @property
    def pga(self) -> float:
        """Peak ground acceleration, m/s2."""


@dataclass(frozen=True, eq=False)
class ResponseSpectrum:
    """Peak responses of oscillators over their natural period.

    Parameters
    ----------
    period : (m,) ndarray
        Undamped natural period, s.
    damping : float
        Damping ratio.
    sd : (m,) ndarray
        Peak displacement relative to the ground, m.
    sv : (m,) ndarray
        Peak velocity relative to the ground, m/s.
    sa : (m,) ndarray
        Peak absolute acceleration, m/s2.
    psv : (m,) ndarray
        Pseudo-velocity, circular frequency times ``sd``, m/s; 0 at period 0.
    psa : (m,) ndarray
        Pseudo-acceleration, circular frequency squared times ``sd``, m/s2; the peak ground
        acceleration at period 0.
    """

    period: FloatArray
    damping: float
    sd: FloatArray
    sv: FloatArray
    sa: FloatArray
    psv: FloatArray
    psa: FloatArray


@dataclass(frozen=True, eq=False)
class OscillatorResponse:
    """Response history of one oscillator at the record's samples.

    Parameters
    ----------
    time : (n,) ndarray
        Time, s.
    displacement : (n,) ndarray
        Displacement relative to the ground, m.
    velocity : (n,) ndarray
        Velocity relative to the ground, m/s.
    absolute_acceleration : (n,) ndarray
        Absolute acceleration of the mass, m/s2.
    """

    time: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    absolute_acceleration: FloatArray


@checked
def response_spectrum(
    record: Motion,
    periods: npt.ArrayLike,
    damping: float = 0.05,
    *,
    free_vibration: bool = True,
) -> ResponseSpectrum:
    """Return the elastic response spectrum of a record.

    Parameters
    ----------
    record : Record
        The ground motion, linear between samples.
    periods : (m,) array_like
        Undamped natural periods, s; 0 means a rigid oscillator, whose ``sa`` and ``psa`` are the
        peak ground acceleration.
    damping : float
        Damping ratio, 0 <= damping < 1.
    free_vibration : bool
        Whether the period of free vibration after the last sample counts, with the ground at
        zero acceleration. A long-period oscillator under a short motion peaks there; software
        that stops at the last sample misses it.

    Returns
    -------
    ResponseSpectrum
        Peaks at each period.

    Raises
    ------
    InputError
        If a period is negative, not finite, or above 0 but below a thousandth of the record's
        step; or the damping is out of range.

    Notes
    -----
    The response is exact for piecewise-linear acceleration (N. C. Nigam and P. C. Jennings,
    Bulletin of the Seismological Society of America 59 (1969) 909-922): a matrix exponential
    carries the state over substeps of at most a twentieth of the period. Peaks are those of the
    continuous response, not of its samples: wherever a derivative changes sign within a substep,
    the turning point is found in closed form.
    """
    from ground_motions.oscillator import response_peaks

    period, damping = _valid_periods(record, periods), _valid_damping(damping)
    sd, sv, sa = np.zeros((3, len(period)))
    psv, psa = np.zeros((2, len(period)))
    sa[period == 0.0] = psa[period == 0.0] = record.pga
    for i in np.flatnonzero(period):
        frequency = 2.0 * math.pi / period[i]
        substeps = math.ceil(_SUBSTEPS_A_PERIOD * record.dt / period[i])
        angle = frequency * record.dt / substeps
        free_steps = math.ceil(2.0 * math.pi / angle) if free_vibration else 0
        psa[i], v, sa[i] = response_peaks(
            record.acceleration, propagator(period[i], record.dt / substeps, damping), damping,
            angle, substeps, free_steps,
        )  # fmt: skip
        sd[i], sv[i], psv[i] = psa[i] / frequency**2, v / frequency, psa[i] / frequency
    return ResponseSpectrum(
        read_only(period), damping, *(read_only(peaks) for peaks in (sd, sv, sa, psv, psa))
    )


@checked
def oscillator_response(record: Motion, period: float, damping: float = 0.05) -> OscillatorResponse:
    """Return the response history of one oscillator, from rest, at the record's samples.

    Parameters
    ----------
    record : Record
        The ground motion, linear between samples.
    period : float
        Undamped natural period, s, above 0.
    damping : float
        Damping ratio, 0 <= damping < 1.

    Returns
    -------
    OscillatorResponse
        Exact response to the piecewise-linear motion at its samples.

    Raises
    ------
    InputError
        If the period is not above 0, or is below a thousandth of the record's step, or the
        damping is out of range.
    """
    from ground_motions.oscillator import response_history

    positive("period (s)", period)
    (period,), damping = _valid_periods(record, [period]), _valid_damping(damping)
    frequency = 2.0 * math.pi / period
    u, v, a = response_history(record.acceleration, propagator(period, record.dt, damping), damping)
    return OscillatorResponse(
        read_only(record.time),
        read_only(u / frequency**2),
        read_only(v / frequency),
        read_only(a),
    )


@lru_cache(maxsize=10_000)
def propagator(period: float, dt: float, damping: float) -> FloatArray:
    """Return the transition of an oscillator's scaled response over a step."""
    from scipy.linalg import expm

    angle = 2.0 * math.pi / period * dt
    generator = np.array(
        [
            [0.0, angle, 0.0, 0.0],
            [-angle, -2.0 * damping * angle, -angle, 0.0],
            [0.0, 0.0, 0.0, 1.0],
            [0.0, 0.0, 0.0, 0.0],
        ]
    )
    return read_only(expm(generator)[:2])


def _valid_damping(damping: float) -> float:
    return within("damping (ratio)", damping, 0.0, 1.0, open_high=True)


def _valid_periods(record: Motion, periods: npt.ArrayLike) -> FloatArray:
    accepted = f"0, or finite and {_SHORTEST_PERIOD * record.dt:g} s or longer"
    try:
        result = np.atleast_1d(np.array(periods, dtype=np.float64))
    except (TypeError, ValueError):
        raise InputError("periods (s)", "values that are not numbers", accepted) from None
    if result.ndim != 1:
        raise InputError("periods (s)", f"shape {result.shape}", "one row of numbers")
    good = np.isfinite(result) & ((result == 0.0) | (result >= _SHORTEST_PERIOD * record.dt))
    if not good.all():
        raise InputError("periods (s)", f"{result[~good][0]:g}", accepted)
    return result
