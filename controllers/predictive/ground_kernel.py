"""A model of the ground motion to come, identified as it arrives, for Numba."""

from __future__ import annotations

from numpy.typing import NDArray

FORGETTING = 0.995
"""Weight of a sample against the next one: a memory of 200 samples."""
PRIOR = 1e-2
"""Variance of a coefficient before anything is known."""


def learn(
    new: float, past: NDArray, coefficients: NDArray, covariance: NDArray, gain: NDArray
) -> None:
    """Recursive least squares of an autoregressive model; all arrays in place.

    Parameters
    ----------
    new : float, m/s^2
        Ground acceleration now.
    past : numpy.ndarray, shape (order,), m/s^2
        The samples before it, latest first; ``new`` joins them.
    coefficients : numpy.ndarray, shape (order,)
        Of the samples before, latest first.
    covariance : numpy.ndarray, shape (order, order)
        Theirs, over the variance of the noise; (s^2/m)^2.
    gain : numpy.ndarray, shape (order,)
        Scratch.
    """
    order = len(past)
    error, spread = new, FORGETTING
    for a in range(order):
        error -= coefficients[a] * past[a]
        gain[a] = 0.0
        for b in range(order):
            gain[a] += covariance[a, b] * past[b]
        spread += past[a] * gain[a]
    for a in range(order):
        coefficients[a] += gain[a] / spread * error
        for b in range(order):
            covariance[a, b] = (covariance[a, b] - gain[a] * gain[b] / spread) / FORGETTING
    # quiet ground teaches nothing: what is not excited must not be forgotten without end
    trace = 0.0
    for a in range(order):
        trace += covariance[a, a]
    if trace > order * 100.0 * PRIOR:
        for a in range(order):
            for b in range(order):
                covariance[a, b] *= order * 100.0 * PRIOR / trace
    for a in range(order - 1, 0, -1):
        past[a] = past[a - 1]
    past[0] = new


def foresee(known: int, coefficients: NDArray, past: NDArray, ground: NDArray) -> None:
    """Continue a ground acceleration by its expected values.

    Parameters
    ----------
    known : int
        Samples of ``ground`` that are known; 1 or more.
    coefficients : numpy.ndarray, shape (order,)
        Of the autoregressive model, latest sample first.
    past : numpy.ndarray, shape (order,), m/s^2
        Samples up to now, latest first.
    ground : numpy.ndarray, shape (n_steps + 1,), m/s^2
        From now on; filled in behind what is known, kept within the largest known value.
    """
    most = 0.0
    for value in past:
        most = max(most, abs(value))
    for k in range(known):
        most = max(most, abs(ground[k]))
    for k in range(known, len(ground)):
        value = 0.0
        for a in range(len(past)):
            at = k - 1 - a
            value += coefficients[a] * (ground[at] if at >= 0 else past[-at])
        ground[k] = min(max(value, -most), most)
