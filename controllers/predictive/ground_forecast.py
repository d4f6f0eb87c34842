"""The ground motion ahead: known as far as the warning goes, then expected."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ground_motions import Record

from .ground_kernel import DRIFT, PRIOR
from .prediction import Prediction


class GroundForecast:
    """Ground acceleration over the horizon, and how far it may leave accelerations astray."""

    # What drives the ground is an autoregressive model, learnt as the motion arrives; its velocity
    # comes back to zero (``ground_kernel``).
    # prediction: Of the structure, over the horizon.
    # coils: (n_channels, 5): Lag (s), slew (A/s), lowest, highest and initial current (A) of each
    # coil.
    # step: From one sample to the next, s.
    # n_steps: Samples ahead.
    # order: Of the autoregressive model; 0 for none.
    # settling: Time in which the velocity comes back; None for never, s.
    # fading: Time in which the forecast of the autoregressive model fades; None for never, s.
    # records: What a warning tells, one a direction; None without one.

    def __init__(
        self, prediction: Prediction, coils: NDArray, step: float, n_steps: int, order: int,
        settling: float | None, fading: float | None, records: tuple[Record, ...] | None,
    ):  # fmt: skip
        n_directions = len(prediction.nominal.structure.directions)
        # (n_steps + 1, n_directions), m/s^2: From the last measurement on
        self.acceleration = np.zeros((n_steps + 1, n_directions))
        self.known = 1  # Samples of it that are known
        self._records, self._forecast = records, prediction.module.forecast
        self._between, self._n_sub, self._step = prediction.between, prediction.n_sub, step
        # (n_steps * n_sub + 1, n_directions), m/s^2: The same at the ends of the prediction's
        # substeps
        self.path = self._between(self.acceleration)
        # until a coil has answered, a lag and a decision later
        reach = min(int(np.ceil(coils[:, 0].max() / step - 1e-9)) + 1, len(prediction.block))
        # (reach + 1, n_accelerations, 2), m/s^2: Standard deviations of the levels' accelerations,
        # for what the ground does unforeseen, that many samples behind what is known, at the coils'
        # lowest and highest currents; as far as it takes a coil to answer
        self.strays = np.zeros((reach + 1, prediction.n_accelerations, 2))
        pulses = [prediction.pulses(coils[:, k].copy(), reach) for k in (2, 3)]
        pull = 0.0 if settling is None else 1.0 / settling
        faded = 1.0 if fading is None else float(np.exp(-step / fading))
        past, coefficients = np.zeros((2, n_directions, order))
        covariance = np.tile(PRIOR * np.eye(order), (n_directions, 1, 1))
        end = np.zeros((n_directions, 2))
        # (n_directions,), m/s: Of the ground, at the last of these samples
        self.velocity = end[:, 1]
        self._model = (
            np.zeros((n_directions, 2)), end, (pull, step, float(np.exp(-step / DRIFT)), faded),
            np.zeros(n_steps + 1), past, coefficients, covariance, np.zeros(order),
            np.zeros((n_directions, 1)), self.acceleration, np.stack(pulses, axis=1),
            np.zeros(reach), self.strays,
        )  # fmt: skip

    def look(self, measured: NDArray, at: NDArray) -> None:
        """Learn from one more sample, and look ahead."""
        self.acceleration[0] = measured
        self.known = 1 + len(at)
        n = self._n_sub
        between = np.add.outer(at, self._step * (np.arange(1, n + 1) / n - 1)).ravel()
        known = np.zeros((len(between), self.acceleration.shape[1]))
        for d, record in enumerate(self._records or ()):
            known[:, d] = np.interp(between, record.time, record.acceleration, right=0.0)
        self.acceleration[1 : self.known] = known[n - 1 :: n]
        self._forecast(self.known, *self._model)
        self.path = self._between(self.acceleration)
        self.path[1 : len(known) + 1] = known
