"""The response without current: normalisation of the response, and bound of the regret.

The nominal model at the lowest currents of its coils, under the measured ground motion.
"""

from __future__ import annotations

from collections.abc import Callable

from numpy.typing import NDArray

from .prediction_kernel import predict
from .running_peaks import count_peaks, follow_peaks


def follow_uncontrolled(
    begun: bool, n_known: int, sizes: tuple, lowest: NDArray, ground: NDArray, n_sub: int,
    plant: tuple, work: tuple, results: tuple, state: tuple, no_block: NDArray,
    device_side: Callable,
) -> None:  # fmt: skip
    """Integrate to the last known sample of the ground motion, and forecast beyond it."""
    # n_known: known samples after the present one; lowest, (n_ahead + 1, n_channels), A
    # peak_history, (1 + n_known + n_ahead, 2): largest displacement of a base (m) and acceleration
    # (m/s^2) from the motion's beginning up to each step from now on; step, (n_directions,
    # n_sub + 1): ground from the last call's last known sample on, if it is the only one
    z, s, past, peaks, peak_history, step = state
    n_displacements, n_accelerations = sizes
    y, values = results[0], work[0]
    n_ahead = peak_history.shape[0] - 1 - n_known
    # after the first call, only the last step is new
    n_new = 1 if begun else n_known
    if n_known == 0:
        for d in range(ground.shape[0]):
            rise = ground[d, 0] - step[d, 0]
            for sub in range(1, n_sub + 1):
                step[d, sub] = step[d, 0] + rise * (sub / n_sub)
    # one call for both, of which Numba compiles each apart: the new steps, then all of the forecast
    for k in range(n_new + 1 if n_ahead > 0 else n_new):
        n_steps = 1 if k < n_new else n_ahead
        alone = n_known == 0 and k < n_new
        first = 0 if alone else (n_known - n_new + k) * n_sub
        predict(
            n_steps, z, s, lowest[0], lowest, no_block, step if alone else ground, first, plant,
            work, results, device_side,
        )  # fmt: skip
        if k == n_new:
            break
        for m in range(len(z)):
            z[m] = values[0][m]
        for e in range(s.shape[0]):
            for q in range(s.shape[1]):
                s[e, q] = values[2][e, q]
        follow_peaks(y[1], n_displacements, n_accelerations, past, peaks)
        for kind in range(2):
            for j in range(n_known):
                peak_history[j, kind] = peak_history[j + 1, kind]
            peak_history[n_known, kind] = peaks[kind]
    for d in range(ground.shape[0]):
        step[d, 0] = ground[d, 0]
    for k in range(n_ahead):
        for kind in range(2):
            peak_history[n_known + k + 1, kind] = peak_history[n_known + k, kind]
        count_peaks(y[k + 1], n_displacements, n_accelerations, peak_history[n_known + k + 1])
