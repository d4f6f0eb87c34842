"""Whether a building record hangs together: units, clipping, time shift, drift, a start at rest."""

from __future__ import annotations

import numpy as np

from ..checks import clipped
from .record import BuildingRecord

_LOW, _HIGH = 0.2, 3.0
"""Hz: where an isolated building moves enough to compare accelerations with its displacement."""


def record_problems(record: BuildingRecord) -> tuple[str, ...]:
    """Find what is suspicious in a record.

    Parameters
    ----------
    record : BuildingRecord
        The data.

    Returns
    -------
    tuple of str
        A sentence each; none if nothing is.
    """
    found = []
    signals = {"ground_acceleration_m_s2": record.ground.acceleration, **record.response}
    for name, values in signals.items():
        n_flat = clipped(values)
        if n_flat:
            found.append(f"{name} stays at its peak for {n_flat} samples: clipped?")
        start = np.sqrt(np.mean(values[: max(len(values) // 100, 8)] ** 2))
        if start > 0.3 * np.sqrt(np.mean(values**2)):
            found.append(f"{name} does not start at rest, as the simulation does")
    slope, lag = _against_displacement(record)
    if not 0.7 < slope < 1.4:
        found.append(
            f"the base's acceleration relative to the ground is {slope:.2f} times that of the "
            "isolators' displacement: a unit, a sign, or a base that does not stand on the ground"
        )
    elif abs(lag) > record.ground.dt:
        late = "behind" if lag > 0 else "ahead of"
        found.append(
            f"the isolators' displacement is {1e3 * abs(lag):.0f} ms {late} the accelerations"
        )
    return tuple(found)


def _against_displacement(record: BuildingRecord) -> tuple[float, float]:
    """Relative acceleration over the displacement's, and how late the displacement is, s.

    From the phase and size of their cross-spectrum, weighted by its size.
    """
    n, dt = len(record.ground), record.ground.dt
    frequency = np.fft.rfftfreq(n, dt)
    used = (frequency > _LOW) & (frequency < _HIGH)
    omega = 2 * np.pi * frequency[used]
    base = record.response["base_acceleration_m_s2"]
    relative = np.fft.rfft(base - record.ground.acceleration)[used]
    accelerated = -(omega**2) * np.fft.rfft(record.values[:, -1])[used]
    cross = relative * accelerated.conj()
    power = float(np.sum(np.abs(accelerated) ** 2))
    if power == 0:
        return 0.0, 0.0
    lag = float(np.sum(omega * np.abs(cross) * np.angle(cross)) / np.sum(omega**2 * np.abs(cross)))
    aligned = cross * np.exp(-1j * omega * lag)
    return float(aligned.real.sum() / power), lag
