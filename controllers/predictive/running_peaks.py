"""Peaks so far of a response that is known at equal steps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


class RunningPeaks:
    """Largest displacement and acceleration so far, between the samples too."""

    # Between samples the response is taken to be the parabola through the last three. A change of
    # current breaks it off: both of its sides count, and a new parabola begins.
    # n_displacements, n_accelerations: Numbers of outputs of either kind; displacements come first.

    def __init__(self, n_displacements: int, n_accelerations: int):
        self._kinds = [0, n_displacements, n_displacements + n_accelerations]
        self._past: list[NDArray] = []
        self.peaks = np.zeros(2)  # (2,): Largest displacement (m) and acceleration (m/s^2)

    def follow(self, outputs: NDArray) -> None:
        """Go on to the next sample."""
        now = outputs[: self._kinds[-1]].copy()
        self._count(np.abs(now))
        if len(self._past) == 2:
            first, middle = self._past
            turn = first - 2.0 * middle + now
            rise = now - first
            inside = np.abs(rise) < 2.0 * np.abs(turn)
            bulge = np.divide(rise**2, 8.0 * turn, out=np.zeros_like(turn), where=inside)
            self._count(np.abs(middle - bulge))
        self._past = [*self._past[-1:], now]

    def change(self, outputs: NDArray) -> None:
        """Take the values just after a change of current."""
        now = outputs[: self._kinds[-1]].copy()
        self._count(np.abs(now))
        self._past = [now]

    def _count(self, sizes: NDArray) -> None:
        self.peaks = np.maximum(self.peaks, np.maximum.reduceat(sizes, self._kinds[:-1]))
