"""The response without current: scale of what control achieves, and bound of its regret."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from isolation_sim.structures import IsolatedStructure

from .prediction import Prediction
from .running_peaks import RunningPeaks


class Uncontrolled:
    """The nominal model at the lowest currents of its coils, under the measured ground motion."""

    # nominal: The model.
    # coils: (n_channels, 5): Lag (s), slew (A/s), lowest, highest and initial current (A) of each
    # coil.
    # step: From one decision to the next, s.
    # longest: Longest substep of the integration, s.

    def __init__(
        self, nominal: IsolatedStructure, coils: NDArray, step: float, longest: float,
        n_ahead: int = 0,  # Steps to forecast beyond the last known sample of the ground motion
    ):  # fmt: skip
        self._model = Prediction(nominal, coils, step, np.zeros(1, int), longest)
        self._ahead: Prediction | None = None
        if n_ahead:
            self._ahead = Prediction(nominal, coils, step, np.zeros(n_ahead, int), longest)
        self._held = np.tile(coils[:, 2], (n_ahead, 1))
        self._past = [np.zeros(2)]
        # (n_known + n_ahead, 2): Largest displacement of a base (m) and acceleration (m/s^2) from
        # the motion's beginning up to each step: the known samples from now on, then the forecast
        self.course = np.zeros((1 + n_ahead, 2))
        self._low = coils[:, 2].copy()
        self._z: NDArray = np.zeros(self._model.rows.shape[-1])
        self._states = self._model.initial_states()
        self._ground: NDArray | None = None
        self._seen = RunningPeaks(self._model.n_displacements, self._model.n_accelerations)

    @property
    def peaks(self) -> NDArray:
        """Largest displacement of a base (m) and acceleration (m/s^2) so far, shape (2,)."""
        return self._seen.peaks

    def follow(self, ground: NDArray, strength: NDArray) -> None:
        """Go on to the last known sample of the ground motion, and forecast beyond it."""
        p = self._model
        p.strength[:] = strength
        n = p.n_sub
        known = ground[: len(ground) - len(self._held) * n]
        path = known
        if self._ground is not None:  # only the last step is new
            path = known[-n - 1 :]
            if len(known) == 1:
                path = p.between(np.stack([self._ground, known[-1]]))
        for k in range(0, len(path) - 1, n):
            self._z, self._states, _ = p.carried(
                self._z, self._states, self._low, self._low[np.newaxis], path[k : k + n + 1]
            )
            self._seen.follow(p.y[1])
            self._past.append(self._seen.peaks)
        self._ground = known[-1].copy()
        self._past = self._past[-(len(known) // n + 1) :]
        self.course = np.array(self._past)
        if self._ahead is not None:
            q = self._ahead
            q.strength[:] = strength
            q.predict(self._z, self._states, self._low, self._held, ground[len(known) - 1 :])
            kinds = [0, q.n_displacements]
            sizes = np.abs(q.y[1:, : q.n_displacements + q.n_accelerations])
            ahead = np.maximum.reduceat(sizes, kinds, axis=1)
            self.course = np.maximum.accumulate(np.concatenate([self.course, ahead]))
