"""Ground motion that a controller with preview knows ahead of its decisions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ground_motions import Record


@dataclass(frozen=True)
class Preview:
    """Ground accelerations after a decision; none without records."""

    times: NDArray  # (n,): Times after a decision, s
    records: tuple[Record, ...]  # One per direction

    def known(self, t: float, measurement: object) -> NDArray:
        """A measurement at a time (s), followed by the accelerations ahead (m/s^2)."""
        ahead = [
            np.interp(t + self.times, record.time, record.acceleration, right=0.0)
            for record in self.records
        ]
        return np.concatenate([np.asarray(measurement, dtype=float), *ahead])

    def names(self, measured: tuple[str, ...]) -> tuple[str, ...]:
        """Names of the accelerations ahead, by those of the measured ones."""
        return tuple(
            f"{name[: -len('_m_s2')]}_in_{t:.6g}_ms_m_s2"
            for name in measured
            for t in 1e3 * self.times
        )
