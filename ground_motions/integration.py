"""Exact integrals of a piecewise-linear acceleration that starts from rest."""

from __future__ import annotations

import numpy as np

from ground_motions.checks import FloatArray


def velocity(acceleration: FloatArray, dt: float) -> FloatArray:
    """Return the velocity at the samples."""
    result = np.zeros_like(acceleration)
    np.cumsum(0.5 * dt * (acceleration[:-1] + acceleration[1:]), axis=0, out=result[1:])
    return result


def displacement(acceleration: FloatArray, dt: float) -> FloatArray:
    """Return the displacement at the samples."""
    result = np.zeros_like(acceleration)
    steps = dt * velocity(acceleration, dt)[:-1]
    steps += dt**2 / 6.0 * (2.0 * acceleration[:-1] + acceleration[1:])
    np.cumsum(steps, axis=0, out=result[1:])
    return result


def squared(acceleration: FloatArray, dt: float) -> FloatArray:
    """Return the running integral of the squared acceleration at the samples."""
    start, end = acceleration[:-1], acceleration[1:]
    result = np.zeros_like(acceleration)
    np.cumsum(dt / 3.0 * (start**2 + start * end + end**2), out=result[1:])
    return result


def peak_velocity(acceleration: FloatArray, dt: float) -> float:
    """Return the largest absolute velocity, at samples or between them."""
    v = velocity(acceleration, dt)
    start, end = acceleration[:-1], acceleration[1:]
    crossing = start * end < 0.0  # velocity turns where the acceleration crosses zero
    fraction = start[crossing] / (start[crossing] - end[crossing])
    between = v[:-1][crossing] + 0.5 * dt * start[crossing] * fraction
    return float(np.max(np.abs(np.concatenate((v, between)))))


def peak_displacement(acceleration: FloatArray, dt: float) -> float:
    """Return the largest absolute displacement, at samples or between them."""
    v, d = velocity(acceleration, dt)[:-1], displacement(acceleration, dt)
    start, change = acceleration[:-1], np.diff(acceleration)
    # Displacement turns where the velocity v + dt (start s + change s^2 / 2), 0 < s < 1, is zero;
    # the two roots are written so that neither loses digits.
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt((dt * start) ** 2 - 2.0 * dt * change * v)
        q = -0.5 * (dt * start + np.copysign(root, start))
        s = np.stack((q / (0.5 * dt * change), v / q))
    s = np.where((s > 0.0) & (s < 1.0), s, 0.0)  # a root elsewhere is no turn: take the sample
    between = d[:-1] + dt * v * s + dt**2 * (0.5 * start * s**2 + change * s**3 / 6.0)
    return float(np.max(np.abs(np.append(between, d[-1]))))
