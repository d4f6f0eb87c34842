"""First look at measured data: what is wrong with them before any model is asked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..identification.run_table import TestRun
from .decisions import CLIPPED, DRIFT

if TYPE_CHECKING:
    from .building.record import BuildingRecord

_LARGEST_DEFORMATION = 1.0
"""m."""
_LOW, _HIGH = 0.2, 3.0
"""Hz: where an isolated building moves enough to compare accelerations with its displacement."""


def data_notes(runs: Sequence[TestRun]) -> list[str]:
    """Say what looks wrong in the runs."""
    notes = []
    for run in runs:
        for what in ("displacement", "force"):
            values = getattr(run, what)
            part = clipped(values)
            if part:
                notes.append(
                    f"{run.name}: {what} stands still at an extreme for {part} samples in a row, "
                    "as a clipped channel does"
                )
        if np.max(np.abs(run.displacement)) > _LARGEST_DEFORMATION:
            notes.append(
                f"{run.name}: deformation reaches {np.max(np.abs(run.displacement)):.3g} m; "
                "is its unit right?"
            )
        drift = _drift(run.displacement)
        if abs(drift) > DRIFT:
            notes.append(
                f"{run.name}: the displacement's middle moves by {100 * drift:.0f} % of its range "
                "during the test"
            )
    gaps = {round(run.step, 9) for run in runs}
    if len(gaps) > 1:
        listed = ", ".join(f"{1e3 * g:.3g}" for g in sorted(gaps))
        notes.append(f"sampling intervals differ: {listed} ms")
    return notes


def clipped(values: NDArray) -> int:
    """Find the longest stretch of equal samples at an extreme."""
    longest = 0
    if np.unique(np.diff(values)).size < 8:
        return 0  # a channel of few levels says nothing
    for extreme in (values.max(), values.min()):
        at = np.flatnonzero(values == extreme)
        if at.size < CLIPPED:
            continue
        breaks = np.flatnonzero(np.diff(at) > 1)
        lengths = np.diff(np.concatenate([[-1], breaks, [at.size - 1]]))
        longest = max(longest, int(lengths.max()))
    return longest if longest >= CLIPPED else 0


def _drift(values: NDArray) -> float:
    """Change of the mid-range from the first to the last third, relative to the range."""
    third = len(values) // 3
    size = float(np.ptp(values))
    first, last = values[:third], values[-third:]
    if min(np.ptp(first), np.ptp(last)) < 0.9 * size:
        return 0.0  # a test whose size changes has no steady middle
    middle = [0.5 * (float(part.max()) + float(part.min())) for part in (first, last)]
    return (middle[1] - middle[0]) / size


def record_problems(record: BuildingRecord) -> tuple[str, ...]:
    """Find what is suspicious in a record."""
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
