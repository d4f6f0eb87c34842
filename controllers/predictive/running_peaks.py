"""Peaks so far of a response sampled at equal steps, for Numba.

Between samples the response is the parabola through the last three samples. A change of current
ends it: both sides count, and a new parabola begins.
"""

from __future__ import annotations

from numpy.typing import NDArray


def count_peaks(
    outputs: NDArray, n_displacements: int, n_accelerations: int, peaks: NDArray
) -> None:
    """Raise the largest displacement (m) and acceleration (m/s^2) to those of one instant."""
    for o in range(n_displacements + n_accelerations):
        kind = 0 if o < n_displacements else 1
        peaks[kind] = max(peaks[kind], abs(outputs[o]))


def follow_peaks(
    outputs: NDArray, n_displacements: int, n_accelerations: int, past: NDArray, peaks: NDArray
) -> None:
    """Advance to the next sample."""
    # past: (2, n_outputs): the last sample and the one before; peaks: (3,): displacement,
    # acceleration, and how many past samples there are
    count_peaks(outputs, n_displacements, n_accelerations, peaks)
    for o in range(n_displacements + n_accelerations):
        if peaks[2] == 2.0:
            kind = 0 if o < n_displacements else 1
            turn = past[1, o] - 2.0 * past[0, o] + outputs[o]
            rise = outputs[o] - past[1, o]
            if abs(rise) < 2.0 * abs(turn):
                peaks[kind] = max(peaks[kind], abs(past[0, o] - rise * rise / (8.0 * turn)))
        past[1, o], past[0, o] = past[0, o], outputs[o]
    peaks[2] = min(peaks[2] + 1.0, 2.0)


def change_peaks(
    outputs: NDArray, n_displacements: int, n_accelerations: int, past: NDArray, peaks: NDArray
) -> None:
    """Take the values just after a change of current."""
    count_peaks(outputs, n_displacements, n_accelerations, peaks)
    for o in range(n_displacements + n_accelerations):
        past[0, o] = outputs[o]
    peaks[2] = 1.0
