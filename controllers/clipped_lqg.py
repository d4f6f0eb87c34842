"""The clipped regulator on an observer's estimate: clipped linear-quadratic Gaussian control."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from isolation_sim.simulation.control import RunContext

from .clipped_lqr import ClippedLQR
from .coils import driven_elements
from .compiled import Decision
from .estimating import Estimating
from .force_tracking import MOTION, nearest_currents
from .observers.extended import DEVICES, EACH, extended_update
from .observers.kalman import TRACKING, kalman_memory, kalman_update
from .observers.observer import N_DOFS, N_ELEMENTS, N_Z
from .settings import OneOf, setting

# settings: where the observer's begin; for the extended filter, where in the memory the force
# tracking begins; gains of all elements on displacements and velocities; the observer's
OBSERVER, DEVICE_STATES, GAINS = range(3)


def put_target(settings: NDArray, observer: NDArray, z: NDArray, devices: NDArray) -> None:
    """Pass the target forces to the force tracking."""
    width, m = 2 * int(observer[N_DOFS]), int(observer[N_ELEMENTS])
    for e in range(m):
        devices[MOTION + 2 * m + e] = 0.0
        for i in range(width):
            devices[MOTION + 2 * m + e] += settings[GAINS + e * width + i] * z[i]


def _decide(
    t: float, measured: NDArray, settings: NDArray, memory: NDArray, command: NDArray,
    combined_force: Callable, combined_range: Callable, state_rates: Callable,
) -> None:  # fmt: skip
    """Target forces from a Kalman filter's estimate, then the currents nearest to them."""
    # Measured: accelerations (m/s^2), deformations (m) and coil currents (A). Memory: that of
    # ``kalman_update``.
    observer = settings[int(settings[OBSERVER]) :]
    kalman_update(t, measured, observer, memory, combined_force, state_rates)
    devices = memory[kalman_memory(observer) :]
    put_target(settings, observer, memory[1:], devices)
    tracking = observer[int(observer[TRACKING]) :]
    nearest_currents(tracking, devices, command, combined_force, combined_range)


def _decide_extended(
    t: float, measured: NDArray, settings: NDArray, memory: NDArray, command: NDArray,
    combined_force: Callable, combined_range: Callable, tangent: Callable,
) -> None:  # fmt: skip
    """Target forces from an extended Kalman filter's estimate, then the nearest currents."""
    # Measured: accelerations (m/s^2), deformations (m) and coil currents (A). Memory: that of
    # ``extended_update``, then that of the force tracking.
    observer = settings[int(settings[OBSERVER]) :]
    extended_update(t, measured, observer, memory, tangent)
    n, m = int(observer[N_DOFS]), int(observer[N_ELEMENTS])
    z, devices = memory[1:], memory[int(settings[DEVICE_STATES]) :]
    rows = observer[int(observer[DEVICES]) - m * (n + 1) :]
    for e in range(m):
        devices[MOTION + e] = devices[MOTION + m + e] = 0.0
        for i in range(n):
            devices[MOTION + e] += rows[e * n + i] * z[i]
            devices[MOTION + m + e] += rows[e * n + i] * z[n + i]
    for k in range(m * int(observer[EACH])):
        devices[MOTION + 5 * m + k] = z[int(observer[N_Z]) + k]
    put_target(settings, observer, z, devices)
    tracking = observer[int(observer[DEVICES]) :]
    nearest_currents(tracking, devices, command, combined_force, combined_range)


class ClippedLQG(Estimating, ClippedLQR):
    """The clipped regulator on an observer's estimate.

    Displacements and velocities, which ``clipped_lqr`` takes as measured, are estimated from
    accelerometers and the isolators' displacement; the regulator is the same, with weights that
    allow for the coils' lag. With the extended filter the devices' internal states are estimated
    too, not followed. Defaults are tuned (``studies/tuned/clipped_lqg.toml``).
    """

    name = "clipped_lqg"
    title = "Clipped LQG"
    source = "Dyke et al. 1996 (clipped optimal control from accelerations); Kalman 1960"

    largest_displacement = 0.5853
    largest_velocity = 7.748
    largest_acceleration = 0.1134
    largest_force = 0.402

    presets: ClassVar = {
        "published": {
            "largest_displacement": 0.2, "largest_velocity": 2.5, "largest_acceleration": 0.35,
            "largest_force": 0.023,
        },
    }  # fmt: skip

    filter: str = setting("kalman", "type of the observer", OneOf(("kalman", "extended")))

    def decision(self, context: RunContext) -> Decision:
        """Gains, then the observer."""
        nominal = context.nominal
        driven_elements(nominal, self.name)
        observer = self.observer(context, self.filter)
        estimating, tracking = observer.decision(), observer.tracking
        own = self.force_gains(nominal, tracking.reference(self.reference))
        gains = np.zeros((len(nominal.elements), own.shape[1]))
        gains[nominal.control_devices] = own
        head = [GAINS + gains.size, len(estimating.memory)]
        settings = np.concatenate([head, gains.ravel(), estimating.settings])
        if self.filter == "kalman":
            return Decision(_decide, settings, estimating.memory, tracking.model)
        memory = np.concatenate([estimating.memory, tracking.memory])
        return Decision(_decide_extended, settings, memory, tracking.model)
