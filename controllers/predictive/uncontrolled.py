"""What would have been without current: the scale of what control can achieve."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from isolation_sim.structures import IsolatedStructure

from .prediction import Prediction


class Uncontrolled:
    """The model believed in, at its coils' lowest currents, under the ground motion seen.

    Parameters
    ----------
    belief : IsolatedStructure
        The model.
    coils : numpy.ndarray, shape (n_channels, 5)
        Lag (s), slew (A/s), lowest, highest and initial current (A) of each coil.
    step : float, s
        From one sample of the ground motion to the next.

    Attributes
    ----------
    peaks : numpy.ndarray, shape (2,)
        Largest displacement of a base (m) and largest acceleration (m/s^2) so far.
    """

    def __init__(self, belief: IsolatedStructure, coils: NDArray, step: float):
        self._model = Prediction(belief, coils, step, np.zeros(1, int))
        self._low = coils[:, 2].copy()
        self._z: NDArray = np.zeros(self._model.rows.shape[-1])
        self._states = self._model.initial_states()
        self._ground: NDArray | None = None
        self.peaks = np.zeros(2)

    def follow(self, ground: NDArray, strength: NDArray) -> None:
        """Go on to the last known sample of the ground motion.

        Parameters
        ----------
        ground : numpy.ndarray, shape (n_known, n_directions), m/s^2
            Known samples from now on, as many as at every call before.
        strength : numpy.ndarray, shape (n_devices,)
            Each device's force over that of the belief.
        """
        p = self._model
        p.strength[:] = strength
        # but for the first time, only the last of them is new
        path = ground if self._ground is None else np.stack([self._ground, ground[-1]])
        for k in range(len(path) - 1):
            self._z, self._states, _ = p.carried(
                self._z, self._states, self._low, self._low[np.newaxis], path[k : k + 2]
            )
            self.peaks = np.maximum(self.peaks, p.largest(1))
        self._ground = ground[-1].copy()
