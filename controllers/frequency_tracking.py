"""Move the isolation frequency away from the ground's dominant frequency."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from isolation_sim.simulation.control import RunContext
from isolation_sim.structures import IsolatedStructure

from .coils import driven_elements, highest_tested, lowest
from .compiled import CompiledController, Decision
from .observers.observer import ground_outputs
from .settings import Number, SearchRange, setting
from .sliding_mode import carried_masses

N_FREQUENCIES = 64
N_CURRENTS = 31
SLOWEST, FASTEST = 0.1, 10.0
"""Hz; between them the best currents are tabulated, at equal ratios."""
# settings: these, then the table of currents, one row per coil
FORGETTING, CORNER, THRESHOLD, SETTLING, N_DIRECTIONS, TABLE = range(6)
# memory: last instant, the two coefficients, the inverse covariance (symmetric, 3 numbers), the
# mean square; each direction's states of the low-pass and last two filtered accelerations; each
# coil's current
LAST, COEFFICIENTS, COVARIANCE, POWER, FILTERED = 0, 1, 3, 6, 7
PER_DIRECTION = 4
LOW_PASS_DAMPING = 0.5**0.5


def dominant_frequency(cosine: float, decay: float, h: float) -> float:
    """Frequency of the peak of a second-order autoregression's spectrum."""
    # the derivative of |1 - cosine e^{-iw} - decay e^{-2iw}|^2 by cos(w) vanishes at the peak
    argument = cosine * (decay - 1.0) / (4.0 * decay) if decay < 0.0 else 1.0
    return math.acos(min(max(argument, -1.0), 1.0)) / (2.0 * math.pi * h)


def follow_regression(filtered: NDArray, memory: NDArray, forgotten: float) -> float:
    """Recursive least squares with exponential forgetting; what is still to be forgotten."""
    y, y1, y2 = filtered[0], filtered[2], filtered[3]
    retained = 1.0 - forgotten
    p11, p12, p22 = memory[COVARIANCE], memory[COVARIANCE + 1], memory[COVARIANCE + 2]
    g1, g2 = p11 * y1 + p12 * y2, p12 * y1 + p22 * y2
    known = y1 * g1 + y2 * g2
    scale = retained + known
    miss = y - memory[COEFFICIENTS] * y1 - memory[COEFFICIENTS + 1] * y2
    memory[COEFFICIENTS] += g1 * miss / scale
    memory[COEFFICIENTS + 1] += g2 * miss / scale
    filtered[3], filtered[2] = y1, y
    # without ground motion there is no update and no forgetting
    if known <= forgotten:
        return forgotten
    memory[COVARIANCE] = (p11 - g1 * g1 / scale) / retained
    memory[COVARIANCE + 1] = (p12 - g1 * g2 / scale) / retained
    memory[COVARIANCE + 2] = (p22 - g2 * g2 / scale) / retained
    return 0.0


def _decide(
    t: float, measured: NDArray, settings: NDArray, memory: NDArray, command: NDArray
) -> None:
    """Track the frequency of the ground motion, and look up the current."""
    # Measured: ground acceleration in each direction (m/s^2), then the coil currents (A).
    h = t - memory[LAST]
    memory[LAST] = t
    n_directions = int(settings[N_DIRECTIONS])
    if h > 0.0:
        retained = math.exp(-h / settings[FORGETTING])
        # the directions have common coefficients, and together forget once
        forgotten, square = 1.0 - retained, 0.0
        for d in range(n_directions):
            filtered = memory[FILTERED + d * PER_DIRECTION :]
            # low-pass of second order, stepped implicitly: stable for any corner
            w = settings[CORNER] * h
            rate = filtered[1] + w * (measured[d] - filtered[0])
            filtered[1] = rate / (1.0 + 2.0 * LOW_PASS_DAMPING * w + w * w)
            filtered[0] += w * filtered[1]
            forgotten = follow_regression(filtered, memory, forgotten)
            square += measured[d] * measured[d]
        memory[POWER] = retained * memory[POWER] + (1.0 - retained) * square
    frequency = SLOWEST
    if h > 0.0:
        frequency = dominant_frequency(memory[COEFFICIENTS], memory[COEFFICIENTS + 1], h)
    place = math.log(max(frequency, SLOWEST) / SLOWEST) / math.log(FASTEST / SLOWEST)
    k = int(min(place, 1.0) * (N_FREQUENCIES - 1) + 0.5)
    present = FILTERED + n_directions * PER_DIRECTION
    for c in range(len(command)):
        row = settings[TABLE + c * (N_FREQUENCIES + 1) :]
        # no frequency without ground motion: the current at the end of each row
        quiet = math.sqrt(memory[POWER]) < settings[THRESHOLD]
        target = row[N_FREQUENCIES] if quiet else row[k]
        left = math.exp(-h / settings[SETTLING])
        memory[present + c] = left * memory[present + c] + (1.0 - left) * target
        command[c] = memory[present + c]


class FrequencyTracking(CompiledController):
    """Move the isolation frequency away from the ground's dominant frequency.

    The frequency is that of a second-order autoregression of the ground's acceleration, fitted
    recursively with forgetting, after a low-pass that keeps what isolators can respond to. All
    directions of the ground have common coefficients. From the devices linearised at every current,
    the current is tabulated at which a rigid building on them amplifies a motion of this frequency
    least. The preset ``tuned`` (``studies/tuned/frequency_tracking.toml``) is not surely better on
    unseen motions.
    """

    name = "frequency_tracking"
    title = "Frequency tracking"
    source = (
        "Narasimhan and Nagarajaiah 2005 (variable-stiffness isolators, tracked by short-time "
        "Fourier transform); Behrooz, Wang and Gordaninejad 2014 (MR elastomer isolators)"
    )

    presets: ClassVar = {
        "tuned": {"forgetting": 8.931, "corner": 9.953, "threshold": 0.0317, "settling": 0.269},
    }

    forgetting: float = setting(
        2.0, "time constant of the exponential forgetting", Number(above=0), "s",
        SearchRange(0.2, 20.0),
    )  # fmt: skip
    corner: float = setting(
        2.0,
        "corner frequency of the low-pass filter",
        Number(above=0),
        "Hz",
        SearchRange(0.3, 10.0),
    )
    threshold: float = setting(
        0.02, "RMS ground acceleration below which the current is the lowest",
        Number(at_least=0), "m/s^2", SearchRange(0.002, 1.0),
    )  # fmt: skip
    settling: float = setting(
        3.0, "time constant of the current; a deformed isolator that stiffens at once pushes the "
        "building", Number(above=0), "s", SearchRange(0.1, 30.0),
    )  # fmt: skip

    def measures(self, nominal: IsolatedStructure) -> tuple[str, ...]:
        """Ground acceleration in every direction."""
        return ground_outputs(nominal)

    def decision(self, context: RunContext) -> Decision:
        """Filters and table; the frequency is unknown at the start."""
        driven_elements(context.nominal, self.name)
        table = np.stack([self.best_currents(context, c) for c in range(len(context.low))])
        quiet = lowest(context)[:, np.newaxis]
        n_directions = len(self.measures(context.nominal))
        own = [
            self.forgetting, 2 * np.pi * self.corner, self.threshold, self.settling, n_directions
        ]  # fmt: skip
        memory = np.concatenate(
            [np.zeros(FILTERED + n_directions * PER_DIRECTION), lowest(context)]
        )
        memory[[COVARIANCE, COVARIANCE + 2]] = 1e4
        settings = np.concatenate([own, np.hstack([table, quiet]).ravel()])
        return Decision(_decide, settings, memory)

    def best_currents(self, context: RunContext, channel: int) -> NDArray:
        """Best current at each tabulated frequency."""
        low, high = lowest(context), highest_tested(context)
        currents = np.linspace(low[channel], high[channel], N_CURRENTS)
        driven = driven_elements(context.nominal, self.name)
        masses = carried_masses(context.nominal, (low + high) / 2)
        own = [
            (e.device, mass) for e, mass in zip(driven, masses, strict=True) if e.channel == channel
        ]
        frequencies = np.geomspace(SLOWEST, FASTEST, N_FREQUENCIES)
        specific = np.zeros((N_FREQUENCIES, N_CURRENTS), dtype=complex)
        for device, mass in own:
            for k, frequency in enumerate(frequencies):
                for i, current in enumerate(currents):
                    stiffness = device.linearised(float(current), float(frequency))
                    specific[k, i] += stiffness / mass / len(own)
        squares = np.square(2 * np.pi * frequencies)[:, np.newaxis]
        amplification = np.abs(specific / (specific - squares))
        return currents[np.argmin(amplification, axis=1)]
