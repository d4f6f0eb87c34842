"""Compiled response of a damped oscillator to piecewise-linear ground acceleration.

Imported only when a spectrum is asked for, since Numba takes a second to load. Quantities are
scaled by the circular frequency w to accelerations: ``u`` is w^2 times the displacement relative
to the ground, ``v`` is w times the relative velocity, and time is the angle w t. All scaled
quantities are m/s2, so nothing here depends on the period but the angle of a step.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def response_history(acceleration, propagator, damping):
    """Return the scaled response at the samples, from rest."""
    p = propagator
    n = len(acceleration)
    out = np.zeros((3, n))
    u, v = 0.0, 0.0
    for i in range(n - 1):
        a = acceleration[i]
        da = acceleration[i + 1] - a
        u, v = (
            p[0, 0] * u + p[0, 1] * v + p[0, 2] * a + p[0, 3] * da,
            p[1, 0] * u + p[1, 1] * v + p[1, 2] * a + p[1, 3] * da,
        )
        out[0, i + 1] = u
        out[1, i + 1] = v
        out[2, i + 1] = -2.0 * damping * v - u
    return out


@njit(cache=True, nogil=True)
def _extremum(p, q, r, s, damping, frequency, angle):
    """Return |x| where x = exp(-z t)(p cos wt + q sin wt) + r + s t turns, 0 < t < angle."""
    # The caller has seen the derivative change sign, so Newton's method is held in a bracket. The
    # place needs only half the digits: x is flat there.
    p1, q1 = -damping * p + frequency * q, -damping * q - frequency * p
    p2, q2 = -damping * p1 + frequency * q1, -damping * q1 - frequency * p1
    low, high = 0.0, angle
    rising = p1 + s < 0.0
    t = 0.5 * angle
    for _ in range(60):
        decay, c, si = math.exp(-damping * t), math.cos(frequency * t), math.sin(frequency * t)
        slope = decay * (p1 * c + q1 * si) + s
        if (slope < 0.0) == rising:
            low = t
        else:
            high = t
        curvature = decay * (p2 * c + q2 * si)
        following = t - slope / curvature if curvature != 0.0 else low
        if not low < following < high:
            following = 0.5 * (low + high)
        moved = abs(following - t)
        t = following
        if moved <= 1e-9 * angle:
            break
    wave = p * math.cos(frequency * t) + q * math.sin(frequency * t)
    return abs(math.exp(-damping * t) * wave + r + s * t)


@njit(cache=True, nogil=True)
def _inner_peaks(peaks, u, v, u1, v1, a, da, damping, angle):
    """Return the peaks, raised by turning points within a substep that starts at u, v."""
    z = damping
    frequency = math.sqrt(1.0 - z * z)
    peak_u, peak_v, peak_a = peaks
    # Derivatives of v and of the absolute acceleration -2 z v - u, at both ends.
    w, w1 = -2.0 * z * v - u - a, -2.0 * z * v1 - u1 - (a + da)
    y, y1 = -2.0 * z * w - v, -2.0 * z * w1 - v1
    if v * v1 >= 0.0 and w * w1 >= 0.0 and y * y1 >= 0.0:
        return peaks
    # Closed form of u within the substep: decaying cosine and sine over a straight line. The
    # amplitudes bound each quantity; most turning points cannot reach the peak.
    s = -da / angle
    r = -a - 2.0 * z * s
    c = u - r
    d = (v - s + z * c) / frequency
    c1, d1 = -z * c + frequency * d, -z * d - frequency * c
    line = max(abs(r), abs(r + s * angle))
    if v * v1 < 0.0 and math.hypot(c, d) + line > peak_u:
        peak_u = max(peak_u, _extremum(c, d, r, s, z, frequency, angle))
    if w * w1 < 0.0 and math.hypot(c1, d1) + abs(s) > peak_v:
        peak_v = max(peak_v, _extremum(c1, d1, s, 0.0, z, frequency, angle))
    if y * y1 < 0.0:
        cy, dy = -2.0 * z * c1 - c, -2.0 * z * d1 - d
        if math.hypot(cy, dy) + line + 2.0 * z * abs(s) > peak_a:
            peak_a = max(peak_a, _extremum(cy, dy, -2.0 * z * s - r, -s, z, frequency, angle))
    return peak_u, peak_v, peak_a


@njit(cache=True, nogil=True)
def response_peaks(acceleration, propagator, damping, angle, substeps, free_steps):
    """Return the peaks of the scaled response, located between substeps too."""
    p = propagator
    z = damping
    # Within a substep hypot(u, v) grows by at most its angle times the ground acceleration, and
    # |2 z v + u| <= sqrt(1 + 4 z^2) hypot(u, v): most substeps cannot reach a peak.
    share = 1.0 / math.sqrt(1.0 + 4.0 * z * z)
    samples = len(acceleration)
    peaks = (0.0, 0.0, 0.0)
    u, v = 0.0, 0.0
    for i in range(samples):
        first, da, count = 0.0, 0.0, free_steps
        if i < samples - 1:
            first, count = acceleration[i], substeps
            da = (acceleration[i + 1] - first) / substeps
        highest = angle * max(abs(first), abs(first + da * count))
        for j in range(count):
            a = first + j * da
            u1 = p[0, 0] * u + p[0, 1] * v + p[0, 2] * a + p[0, 3] * da
            v1 = p[1, 0] * u + p[1, 1] * v + p[1, 2] * a + p[1, 3] * da
            limit = min(peaks[0], peaks[1], share * peaks[2]) - highest
            if limit <= 0.0 or u * u + v * v > limit * limit:
                peaks = (
                    max(peaks[0], abs(u1)),
                    max(peaks[1], abs(v1)),
                    max(peaks[2], abs(2.0 * z * v1 + u1)),
                )
                peaks = _inner_peaks(peaks, u, v, u1, v1, a, da, z, angle)
            u, v = u1, v1
    return np.array(peaks)
