"""What would have been without current: the scale of what control can achieve."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from isolation_sim.structures import IsolatedStructure

from .prediction import Prediction
from .running_peaks import RunningPeaks


class Uncontrolled:
    """The model believed in, at its coils' lowest currents, under the ground motion seen.

    Parameters
    ----------
    belief : IsolatedStructure
        The model.
    coils : numpy.ndarray, shape (n_channels, 5)
        Lag (s), slew (A/s), lowest, highest and initial current (A) of each coil.
    step : float, s
        From one decision to the next.
    longest : float, s
        Longest substep of the integration.

    """

    def __init__(self, belief: IsolatedStructure, coils: NDArray, step: float, longest: float):
        self._model = Prediction(belief, coils, step, np.zeros(1, int), longest)
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
        """Go on to the last known sample of the ground motion.

        Parameters
        ----------
        ground : numpy.ndarray, shape (n_steps * n_sub + 1, n_directions), m/s^2
            What is known at the ends of the prediction's substeps from now on, of as many steps as
            at every call before.
        strength : numpy.ndarray, shape (n_devices,)
            Each device's force over that of the belief.
        """
        p = self._model
        p.strength[:] = strength
        path, n = ground, p.n_sub
        if self._ground is not None:  # only the last step is new
            path = ground[-n - 1 :]
            if len(ground) == 1:
                path = p.between(np.stack([self._ground, ground[-1]]))
        for k in range(0, len(path) - 1, n):
            self._z, self._states, _ = p.carried(
                self._z, self._states, self._low, self._low[np.newaxis], path[k : k + n + 1]
            )
            self._seen.follow(p.y[1])
        self._ground = ground[-1].copy()
