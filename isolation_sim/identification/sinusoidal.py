"""A sinusoidal test of a device, computed: its law integrated apart from the engine."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .loop_measures import LoopMeasures, loop_measures

if TYPE_CHECKING:
    from ..laws import Device


class Motion(NamedTuple):
    """Histories of a sinusoidal test; one column per case."""

    time: np.ndarray  # (n,), s: From the start of the motion
    # displacement, velocity, force: (n, ...), m, m/s and N: Of the device
    displacement: np.ndarray
    velocity: np.ndarray
    force: np.ndarray
    states: np.ndarray  # (n, n_states, ...): Internal states of the law, in their own units
    frequency: float  # Of the motion, Hz
    points: int  # Samples a cycle

    def last_cycle(self, *case: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Displacement, velocity and force of a case's last cycle, closed."""
        chosen: tuple = (slice(-self.points - 1, None), *case)
        return self.displacement[chosen], self.velocity[chosen], self.force[chosen]

    def measured(self, *case: int, skip: int = 0) -> LoopMeasures:
        """Measure a case's loops, without the first ``skip`` cycles."""
        chosen: tuple = (slice(None), *case)
        x, force = self.displacement[chosen], self.force[chosen]
        return loop_measures(self.time, x, force, frequency=self.frequency, skip=skip)


def sinusoidal(
    device: Device,
    amplitude: Any,
    current: Any = 0.0,
    frequency: float = 1.0,
    cycles: int = 20,
    points: int = 512,
    mean_deformation: Any = 0.0,
) -> Motion:
    """Move a device sinusoidally, many amplitudes and currents at once."""
    # The internal states start at rest: the device has relaxed at the mean deformation.
    amplitude, current, mean_deformation = np.broadcast_arrays(
        *(np.asarray(a, dtype=float) for a in (amplitude, current, mean_deformation))
    )
    size = amplitude.shape
    omega, h = 2 * np.pi * frequency, 1 / (frequency * points)
    parameters = device.parameters_at(current)

    n, law = points * cycles + 1, device.law
    # at the ends of the steps and half way
    phase = (omega * h / 2 * np.arange(2 * n - 1)).reshape(-1, *(1,) * len(size))
    x, v = mean_deformation + amplitude * np.sin(phase), amplitude * omega * np.cos(phase)

    states = np.zeros((n, len(law.states), *size))
    if law.rest is not None:
        for j, rest in enumerate(law.rest(parameters)):
            states[0, j] = rest

    def rates(half_step: int, y: np.ndarray) -> np.ndarray:
        return np.array(law.rates(x[half_step], v[half_step], tuple(y), parameters))

    for k in range(n - 1 if law.states else 0):
        y = states[k]
        a = rates(2 * k, y)
        b = rates(2 * k + 1, y + h / 2 * a)
        c = rates(2 * k + 1, y + h / 2 * b)
        d = rates(2 * k + 2, y + h * c)
        states[k + 1] = y + h / 6 * (a + 2 * b + 2 * c + d)
    x, v = x[::2], v[::2]
    force = law.force(x, v, tuple(np.moveaxis(states, 1, 0)), parameters)
    return Motion(h * np.arange(n), x, v, force, states, frequency, points)
