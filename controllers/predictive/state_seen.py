"""Inputs of a predictive decision: the measured motion, or an observer's estimate.

``decision`` is the same for all of them, so that Numba compiles it once.
"""

from __future__ import annotations

from collections.abc import Callable

from numpy.typing import NDArray

from ..device_model import FORCE_SCALE
from ..force_tracking import COILS, N_NUMBERS
from ..observers.extended import DEVICES, extended_update
from ..observers.kalman import TRACKING, kalman_update
from ..observers.observer import N_DOFS, N_ELEMENTS, N_Y
from .decision import (
    COIL_TABLE,
    FORCE_SCALES,
    LEARNS,
    MOTION_SEEN,
    NUMBERS,
    OBSERVED,
    OBSERVER_MEMORY,
    OBSERVER_SCALES,
    OBSERVER_SETTINGS,
    PATH,
    decide_by_motion,
)
from .flat_arrays import array1, array2


def decide(
    t: float, measured: NDArray, settings: NDArray, memory: NDArray, command: NDArray,
    device_side: Callable, state_rates: Callable,
) -> None:  # fmt: skip
    """Decide by measured displacements and velocities."""
    # Measured: accelerations (m/s^2) if the force scale is learnt, displacements (m), velocities
    # (m/s), ground accelerations (m/s^2), coil currents (A), known ground accelerations (m/s^2)
    motion = array1(memory, MOTION_SEEN)
    learns = array1(settings, NUMBERS)[LEARNS] == 1.0
    first = len(motion) // 2 if learns else 0
    for k in range(len(motion)):
        motion[k] = measured[first + k]
    decide_by_motion(
        t, measured, measured[first + len(motion) :], settings, memory, command, device_side,
        state_rates,
    )  # fmt: skip


def decide_kalman(
    t: float, measured: NDArray, settings: NDArray, memory: NDArray, command: NDArray,
    device_side: Callable, state_rates: Callable, combined_force: Callable,
) -> None:  # fmt: skip
    """Decide by a Kalman filter's estimate."""
    # Measured, here and with the extended filter: accelerations (m/s^2), deformations (m), then
    # ground accelerations and the rest as without a filter
    rest = put_observed(measured, settings, memory)
    kalman_update(
        t, array1(memory, OBSERVED), array1(memory, OBSERVER_SETTINGS),
        array1(memory, OBSERVER_MEMORY), combined_force, state_rates,
    )  # fmt: skip
    take_estimate(memory)
    decide_by_motion(
        t, measured, measured[rest:], settings, memory, command, device_side, state_rates
    )
    expect_forces(TRACKING, settings, memory)


def decide_extended(
    t: float, measured: NDArray, settings: NDArray, memory: NDArray, command: NDArray,
    device_side: Callable, state_rates: Callable, tangent: Callable,
) -> None:  # fmt: skip
    """Decide by an extended Kalman filter's estimate."""
    rest = put_observed(measured, settings, memory)
    extended_update(
        t, array1(memory, OBSERVED), array1(memory, OBSERVER_SETTINGS),
        array1(memory, OBSERVER_MEMORY), tangent,
    )  # fmt: skip
    take_estimate(memory)
    decide_by_motion(
        t, measured, measured[rest:], settings, memory, command, device_side, state_rates
    )
    expect_forces(DEVICES, settings, memory)


def put_observed(measured: NDArray, settings: NDArray, memory: NDArray) -> int:
    """Assemble the observer's inputs; the ground accelerations begin at the result."""
    observed, observer = array1(memory, OBSERVED), array1(memory, OBSERVER_SETTINGS)
    n_channels = array2(settings, COIL_TABLE).shape[0]
    ground, n_y = int(observer[N_DOFS] + observer[N_ELEMENTS]), int(observer[N_Y])
    coils = ground + array2(memory, PATH).shape[0]
    for k in range(n_y):
        observed[k] = measured[k]
    for c in range(n_channels):
        observed[n_y + c] = measured[coils + c]
    return ground


def take_estimate(memory: NDArray) -> None:
    """Displacements and velocities, the first entries of every observer's state."""
    motion, estimate = array1(memory, MOTION_SEEN), array1(memory, OBSERVER_MEMORY)
    for k in range(len(motion)):
        motion[k] = estimate[1 + k]


def expect_forces(tracking_at: int, settings: NDArray, memory: NDArray) -> None:
    """Scale the observer's forces by the force-scale estimate."""
    observer = array1(memory, OBSERVER_SETTINGS)
    scales, force_scales = array1(settings, OBSERVER_SCALES), array1(memory, FORCE_SCALES)
    tracking = observer[int(observer[tracking_at]) :]
    first = COILS + len(scales) + FORCE_SCALE
    for e in range(len(scales)):
        tracking[first + e * int(tracking[N_NUMBERS])] = scales[e] * force_scales[e]
