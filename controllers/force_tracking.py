"""From target device forces to coil currents, inside a compiled decision.

The common part of controllers that compute target forces: the devices' states, integrated along
their motion, and the currents whose forces are nearest to the target forces.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from isolation_sim.simulation.control import RunContext
from isolation_sim.structures import Element

from .coils import highest_tested, lowest
from .current_map import nearest_current
from .device_model import DeviceModel
from .device_states import SCRATCH, follow_states

# the settings begin with these; then each device's coil (-1 for none) and numbers, and each coil's
# range
N_DEVICES, N_STATES_EACH, N_NUMBERS, COILS = range(4)
# the memory: last instant; each device's deformation, velocity, target force, weight and a row
# that picks it out; the devices' states; scratch
MOTION = 1


def coil_current(e: int, settings: NDArray, currents: NDArray) -> float:
    """Current in a device's coil."""
    coil = int(settings[COILS + e])
    return currents[coil] if coil >= 0 else 0.0


def follow_device(
    e: int, new_x: float, new_v: float, h: float, settings: NDArray, memory: NDArray,
    currents: NDArray, state_rates: Callable,
) -> None:  # fmt: skip
    """Store a device's new motion, and integrate its states."""
    m, n_states = int(settings[N_DEVICES]), int(settings[N_STATES_EACH])
    width, first = int(settings[N_NUMBERS]), COILS + m
    x, v = memory[MOTION : MOTION + m], memory[MOTION + m : MOTION + 2 * m]
    states = memory[MOTION + 5 * m : MOTION + (5 + n_states) * m]
    follow_states(
        e, (x[e], v[e]), (new_x, new_v), h, states[e * n_states : (e + 1) * n_states],
        coil_current(e, settings, currents), settings[first + e * width : first + (e + 1) * width],
        memory[MOTION + (5 + n_states) * m :], state_rates,
    )  # fmt: skip
    x[e], v[e] = new_x, new_v


def device_force(
    e: int, current: float, settings: NDArray, memory: NDArray, combined_force: Callable
) -> float:
    """Force of one device at its last motion."""
    m, n_states = int(settings[N_DEVICES]), int(settings[N_STATES_EACH])
    first = COILS + m
    numbers = settings[first : first + m * int(settings[N_NUMBERS])]
    x, v = memory[MOTION : MOTION + m], memory[MOTION + m : MOTION + 2 * m]
    alone = memory[MOTION + 4 * m : MOTION + 5 * m]
    states = memory[MOTION + 5 * m : MOTION + (5 + n_states) * m]
    alone[e] = 1.0
    force = combined_force(current, (alone, x, v, states, numbers))
    alone[e] = 0.0
    return force


def nearest_currents(
    settings: NDArray, memory: NDArray, command: NDArray, combined_force: Callable,
    combined_range: Callable,
) -> None:  # fmt: skip
    """Currents whose forces are nearest to the target forces."""
    m, n_states = int(settings[N_DEVICES]), int(settings[N_STATES_EACH])
    first = COILS + m
    numbers = settings[first : first + m * int(settings[N_NUMBERS])]
    limits = settings[first + m * int(settings[N_NUMBERS]) :]
    x, v = memory[MOTION : MOTION + m], memory[MOTION + m : MOTION + 2 * m]
    target = memory[MOTION + 2 * m : MOTION + 3 * m]
    weights = memory[MOTION + 3 * m : MOTION + 4 * m]
    states = memory[MOTION + 5 * m : MOTION + (5 + n_states) * m]
    for c in range(len(command)):
        low, high = limits[2 * c], limits[2 * c + 1]
        n_own = 0
        for e in range(m):
            weights[e] = 1.0 if settings[COILS + e] == c else 0.0
            n_own += int(weights[e])
        if n_own > 1:
            # forces of one coil's devices move along a line as its current changes, exactly if
            # they are affine in it: the target forces are projected onto that line
            length = 0.0
            for e in range(m):
                if weights[e] != 0.0:
                    at_high = device_force(e, high, settings, memory, combined_force)
                    weights[e] = at_high - device_force(e, low, settings, memory, combined_force)
                length += weights[e] * weights[e]
            for e in range(m):
                weights[e] = weights[e] / length**0.5 if length > 0.0 else 0.0
        projected = 0.0
        for e in range(m):
            projected += weights[e] * target[e]
        command[c] = nearest_current(
            combined_force, combined_range, projected, low, high, (weights, x, v, states, numbers)
        )[0]


@dataclass(frozen=True)
class ForceTracking:
    """Devices, limits and memory of the functions of this file."""

    elements: tuple[Element, ...]  # The devices' elements
    model: DeviceModel  # Their laws
    # low, high: (n_channels,), A: Range of each coil's current
    low: NDArray
    high: NDArray
    # settings, memory: As the functions of this file read them
    settings: NDArray
    memory: NDArray

    def reference(self, amperes: float | None) -> NDArray:
        """Currents to linearise at."""
        middle = (self.low + self.high) / 2
        return middle if amperes is None else np.full(len(middle), amperes)


def force_tracking(
    elements: Sequence[Element], context: RunContext, kind: type[DeviceModel] = DeviceModel
) -> ForceTracking:
    """Assemble the data that the functions of this file read."""
    low, high = lowest(context), highest_tested(context)
    model, m = kind([element.device for element in elements]), len(elements)
    settings = np.concatenate([
        [m, model.n_states, model.n_numbers],
        [-1.0 if e.channel is None else e.channel for e in elements],
        model.numbers,
        np.stack([low, high], axis=1).ravel(),
    ])  # fmt: skip
    memory = np.zeros(MOTION + 5 * m + (m + SCRATCH) * model.n_states)
    return ForceTracking(tuple(elements), model, low, high, settings, memory)
