"""Forecast of the ground motion by a model that is identified during the motion, for Numba."""

from __future__ import annotations

import math

from numpy.typing import NDArray

FORGETTING = 0.999
"""Forgetting factor per sample: a memory of 1000 samples."""
PRIOR = 1e-2
"""Prior variance of a coefficient."""
RECENT = 0.98
"""Forgetting factor of the mean square of the model's errors."""
DRIFT = 10.0
"""Memory of the ground's velocity, s, so that an accelerometer's offset does not accumulate."""


def ground_innovation(new: float, motion: NDArray, returning: tuple) -> float:
    """Innovation: the ground acceleration plus the term that returns its velocity to zero."""
    pull, h, velocity_decay, _ = returning
    motion[1] = velocity_decay * (motion[1] + 0.5 * h * (motion[0] + new))
    motion[0] = new
    return new + pull * motion[1]


def least_squares_update(
    new: float, past: NDArray, coefficients: NDArray, covariance: NDArray, gain: NDArray,
    noise: NDArray,
) -> None:  # fmt: skip
    """Recursive least squares of an autoregressive model; all arrays in place."""
    order = len(past)
    error, spread = new, FORGETTING
    for a in range(order):
        error -= coefficients[a] * past[a]
        gain[a] = 0.0
        for b in range(order):
            gain[a] += covariance[a, b] * past[b]
        spread += past[a] * gain[a]
    noise[0] = RECENT * noise[0] + (1.0 - RECENT) * error * error
    for a in range(order):
        coefficients[a] += gain[a] / spread * error
        for b in range(order):
            covariance[a, b] = (covariance[a, b] - gain[a] * gain[b] / spread) / FORGETTING
    # no update under quiet ground: without excitation, forgetting would let the covariance grow
    trace = 0.0
    for a in range(order):
        trace += covariance[a, a]
    if trace > order * 100.0 * PRIOR:
        for a in range(order):
            for b in range(order):
                covariance[a, b] *= order * 100.0 * PRIOR / trace
    for a in range(order - 1, 0, -1):
        past[a] = past[a - 1]
    if order > 0:
        past[0] = new


def extrapolate(
    known: int, coefficients: NDArray, past: NDArray, ground: NDArray, motion: NDArray,
    returning: tuple, innovations: NDArray,
) -> None:  # fmt: skip
    """Extrapolate a ground acceleration by its expected values."""
    pull, h, velocity_decay, forecast_decay = returning
    most = 0.0
    for a in range(len(past)):
        most = max(most, abs(past[a]))
    for k in range(1, len(ground)):
        if k >= known:
            value = 0.0
            for a in range(len(past)):
                at = k - 1 - a
                value += coefficients[a] * (innovations[at] if at > 0 else past[max(-at, 0)])
            value = forecast_decay * min(max(value, -most), most)
            coasting = velocity_decay * (motion[1] + 0.5 * h * motion[0])
            ground[k] = (value - pull * coasting) / (1.0 + 0.5 * h * velocity_decay * pull)
        innovations[k] = ground_innovation(ground[k], motion, returning)
        if k < known:
            most = max(most, abs(innovations[k]))


def forecast_deviation(
    coefficients: NDArray, noise: NDArray, pulses: NDArray, shape: NDArray, deviations: NDArray
) -> None:
    """Standard deviation of accelerations from their forecast."""
    deviations[:] = 0.0
    for d in range(coefficients.shape[0]):
        # an innovation of one sample and its expected continuation
        for k in range(len(shape)):
            shape[k] = 1.0 if k == 0 else 0.0
            for a in range(min(coefficients.shape[1], k)):
                shape[k] += coefficients[d, a] * shape[k - 1 - a]
        for i in range(2):
            for o in range(deviations.shape[1]):
                variance = 0.0
                for k in range(len(shape)):
                    response = 0.0
                    for j in range(k + 1):
                        response += shape[j] * pulses[2 * d + i, k - j, o]
                    variance += response * response * noise[d, 0]
                    deviations[k + 1, o, i] += variance
    for k in range(deviations.shape[0]):
        for o in range(deviations.shape[1]):
            for i in range(2):
                deviations[k, o, i] = math.sqrt(deviations[k, o, i])


def look_ahead(
    measured: NDArray, ahead: NDArray, n_sub: int, returning: tuple, model: tuple, pulses: NDArray,
    acceleration: NDArray, path: NDArray, deviations: NDArray,
) -> None:  # fmt: skip
    """Update by one more sample, then forecast beyond the known ground motion."""
    # ahead: (n_directions * n_known * n_sub,): known accelerations, at the substeps' ends
    # acceleration: (n_directions, n_steps + 1), m/s^2: from the last measurement on
    # path: (n_directions, n_steps * n_sub + 1), m/s^2: the same at the substeps' ends, on lines
    # deviations: (reach + 1, n_accelerations, 2), m/s^2: ``forecast_deviation``
    motion, end, past, coefficients, covariance, noise, gain, innovations, shape = model
    n_directions, n_steps = acceleration.shape[0], acceleration.shape[1] - 1
    n_known = len(ahead) // n_directions
    for d in range(n_directions):
        acceleration[d, 0] = path[d, 0] = measured[d]
        for k in range(n_known):
            path[d, k + 1] = ahead[d * n_known + k]
        known = n_known // n_sub + 1
        for k in range(1, known):
            acceleration[d, k] = path[d, k * n_sub]
        now = ground_innovation(measured[d], motion[d], returning)
        least_squares_update(now, past[d], coefficients[d], covariance[d], gain, noise[d])
        end[d, 0], end[d, 1] = motion[d, 0], motion[d, 1]
        extrapolate(
            known, coefficients[d], past[d], acceleration[d], end[d], returning, innovations
        )
        for k in range(known - 1, n_steps):
            rise = acceleration[d, k + 1] - acceleration[d, k]
            for sub in range(1, n_sub + 1):
                path[d, k * n_sub + sub] = acceleration[d, k] + rise * (sub / n_sub)
    forecast_deviation(coefficients, noise, pulses, shape, deviations)
