"""Pulses of near-fault ground motion, as closed forms.

Every sample is the second difference of the closed form's displacement over three points a step
apart. The piecewise-linear record then ends with the very velocity (zero) and displacement of the
closed form, also where its acceleration jumps. What oscillates in its acceleration falls short by
the share (pi dt / period)^2 / 3, in its velocity by twice that.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ground_motions.argument_types import checked
from ground_motions.checks import FloatArray, choice, number, positive, sample_count, within
from ground_motions.errors import InputError
from ground_motions.record import Record
from ground_motions.synthesis import call_text

MAKRIS_KINDS = ("A", "B", "C1", "C2")
"""Kinds of `makris_pulse`."""


@checked
def mavroeidis_papageorgiou_pulse(
    peak_velocity: float,
    pulse_period: float,
    cycles: float = 2.0,
    phase: float = 0.0,
    dt: float = 0.01,
    *,
    before: float = 0.5,
    after: float = 0.5,
) -> Record:
    """Return the pulse of Mavroeidis and Papageorgiou.

    The velocity is ``A/2 (1 + cos(2 pi t / (g T))) cos(2 pi t / T + phase)`` for ``|t| < g T/2``.

    Parameters
    ----------
    peak_velocity : float
        Amplitude A of the velocity, m/s; the peak where the phase is a multiple of pi.
    pulse_period : float
        Prevailing period T, s.
    cycles : float
        Length of the pulse in periods, above 1: the paper's gamma, g above.
    phase : float
        Phase (nu), rad: 0 is symmetric in velocity, pi/2 antisymmetric.
    dt : float
        Sampling step, s.
    before, after : float
        Quiet time before and after the pulse, s, one step or more.

    Returns
    -------
    Record
        The motion. It ends with zero velocity; its final displacement is
        ``A T cos(phase) sin(pi g) / (2 pi (1 - g^2))``, zero for whole ``cycles``.

    Raises
    ------
    InputError
        If an argument is out of range.

    Notes
    -----
    G. P. Mavroeidis and A. S. Papageorgiou, "A mathematical representation of near-fault ground
    motions", Bulletin of the Seismological Society of America 93 (2003) 1099-1131.
    """
    amplitude = positive("peak_velocity (m/s)", peak_velocity)
    w = 2.0 * math.pi / positive("pulse_period (s)", pulse_period)
    gamma = number("cycles", cycles, "a finite number above 1")
    if gamma <= 1.0:
        raise InputError("cycles", repr(cycles), "a finite number above 1")
    nu = number("phase (rad)", phase, "a finite number")
    half = 0.5 * gamma * pulse_period

    def displacement(t: FloatArray) -> FloatArray:
        # The product of cosines as a sum of three, each integrated.
        t = np.clip(t, 0.0, 2.0 * half) - half
        total = np.zeros_like(t)
        for share, ratio in ((1.0, 1.0), (0.5, 1.0 - 1.0 / gamma), (0.5, 1.0 + 1.0 / gamma)):
            total += share / ratio * (np.sin(w * ratio * t + nu) + np.sin(w * ratio * half - nu))
        return amplitude / (2.0 * w) * total

    return _record(
        "mavroeidis_papageorgiou_pulse", displacement, 2.0 * half, dt, before, after,
        peak_velocity=peak_velocity, pulse_period=pulse_period, cycles=cycles, phase=phase,
    )  # fmt: skip


@checked
def makris_pulse(
    kind: str,
    peak_velocity: float,
    pulse_period: float,
    dt: float = 0.01,
    *,
    before: float = 0.5,
    after: float = 0.5,
) -> Record:
    """Return a cycloidal pulse of Makris.

    Parameters
    ----------
    kind : str
        ``"A"``: forward; velocity ``V/2 (1 - cos wt)`` over one period, leaves the displacement
        ``V T / 2``. ``"B"``: forward and back; velocity ``V sin wt`` over one period, returns.
        ``"C1"``, ``"C2"``: one or two main cycles; velocity ``V (sin(wt + p) - sin p)``, returns.
    peak_velocity : float
        Amplitude V of the velocity, m/s; kinds C peak at ``V (1 + sin p)``.
    pulse_period : float
        Period T, s.
    dt : float
        Sampling step, s.
    before, after : float
        Quiet time before and after the pulse, s, one step or more.

    Returns
    -------
    Record
        The motion. It ends with zero velocity, and with zero displacement but for kind A.

    Raises
    ------
    InputError
        If an argument is out of range, or the kind is unknown.

    Notes
    -----
    N. Makris, Earthquake Engineering and Structural Dynamics 26 (1997) 571-591; N. Makris and
    S.-P. Chang, ibid. 29 (2000) 85-107.
    """
    choice("kind", kind, MAKRIS_KINDS)
    velocity = positive("peak_velocity (m/s)", peak_velocity)
    w = 2.0 * math.pi / positive("pulse_period (s)", pulse_period)
    phase = _type_c_phase(int(kind[1])) if kind[0] == "C" else 0.0
    angle = (2.0 * int(kind[1]) + 1.0) * math.pi - 2.0 * phase if kind[0] == "C" else 2.0 * math.pi

    def displacement(t: FloatArray) -> FloatArray:
        x = np.clip(w * t, 0.0, angle)
        if kind == "A":
            moved = 0.5 * (x - np.sin(x))
        else:
            moved = math.cos(phase) - np.cos(x + phase) - x * math.sin(phase)
        return velocity / w * moved

    record = _record(
        "makris_pulse", displacement, angle / w, dt, before, after,
        kind=kind, peak_velocity=peak_velocity, pulse_period=pulse_period,
    )  # fmt: skip
    return replace(record, name=f"makris_pulse_{kind}")


def _type_c_phase(cycles: int) -> float:
    """Return the phase, rad, for which a type-C pulse of so many cycles returns to its place."""
    from scipy.optimize import brentq

    def left_over(phase: float) -> float:
        angle = (2.0 * cycles + 1.0) * math.pi - 2.0 * phase
        return 2.0 * math.cos(phase) - angle * math.sin(phase)

    return float(brentq(left_over, 0.0, 0.25 * math.pi, xtol=1e-15))


@checked
def ricker_pulse(
    peak_velocity: float,
    pulse_period: float,
    dt: float = 0.01,
    *,
    before: float = 0.5,
    after: float = 0.5,
) -> Record:
    """Return the symmetric Ricker wavelet in acceleration.

    The acceleration is ``a (1 - 2 x^2) exp(-x^2)`` with ``x = pi t / T``.

    Parameters
    ----------
    peak_velocity : float
        Peak of the velocity, m/s, reached ``T / (pi sqrt 2)`` before and after the middle.
    pulse_period : float
        Period T of the largest Fourier amplitude of the acceleration, s.
    dt : float
        Sampling step, s.
    before, after : float
        Quiet time before and after the pulse, s, one step or more. The pulse itself takes four
        periods, beyond which it is below 1e-16 of its peak.

    Returns
    -------
    Record
        The motion. It ends with zero velocity and displacement.

    Raises
    ------
    InputError
        If an argument is out of range.

    Notes
    -----
    N. Ricker, Bulletin of the Seismological Society of America 33 (1943) 197-228; as an
    earthquake pulse M. F. Vassiliou and N. Makris, ibid. 101 (2011) 596-618.
    """
    velocity = positive("peak_velocity (m/s)", peak_velocity)
    period = positive("pulse_period (s)", pulse_period)
    peak = velocity * math.sqrt(2.0 * math.e) * math.pi / period

    def displacement(t: FloatArray) -> FloatArray:
        x = math.pi * (t / period - 2.0)
        result: FloatArray = -peak * period**2 / (2.0 * math.pi**2) * np.exp(-(x**2))
        return result

    return _record(
        "ricker_pulse", displacement, 4.0 * period, dt, before, after,
        peak_velocity=peak_velocity, pulse_period=pulse_period,
    )  # fmt: skip


def _record(
    function: str,
    displacement: Callable[[FloatArray], FloatArray],
    length: float,
    dt: float,
    before: float,
    after: float,
    **arguments: Any,
) -> Record:
    """Sample a pulse whose displacement, m, is known at all times, s, from its start."""
    source = call_text(function, **arguments, dt=dt, before=before, after=after)
    dt = positive("dt (s)", dt)
    if length < 4.0 * dt:
        raise InputError("dt (s)", f"{dt:g}", f"at most {length / 4.0:g}, a quarter pulse")
    before, after = (
        within(label, value, dt * (1.0 - 1e-12), math.inf)
        for label, value in (("before (s)", before), ("after (s)", after))
    )
    count = sample_count(before + length + after, dt)
    time = np.arange(-1, count + 1) * dt - before
    return Record(np.diff(displacement(time), 2) / dt**2, dt, name=function, source=source)
