"""Lyapunov's direct method: the current for the fastest decrease of a weighted energy."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from isolation_sim.simulation.control import RunContext

from .brysons_rule import BrysonsRule
from .clipped_lqr import linear_model
from .coils import driven_elements
from .compiled import Decision
from .estimating import Estimating
from .force_tracking import COILS, N_DEVICES, N_NUMBERS, device_force
from .observers.kalman import TRACKING, kalman_memory, kalman_update
from .observers.observer import N_DOFS, N_ELEMENTS
from .settings import Number, SearchRange, setting

# settings: where the observer's begin; the softening; the rate of the energy with each element's
# force, per unit of displacement and velocity; the observer's
START, SOFTENING, ROWS = range(3)


def _decide(
    t: float, measured: NDArray, settings: NDArray, memory: NDArray, command: NDArray,
    combined_force: Callable, state_rates: Callable,
) -> None:  # fmt: skip
    """Currents by their effect on the energy: the lowest where a higher one would raise it."""
    # Measured: accelerations (m/s^2), deformations (m) and coil currents (A). Memory: that of
    # ``kalman_update``.
    observer = settings[int(settings[START]) :]
    kalman_update(t, measured, observer, memory, combined_force, state_rates)
    z, devices = memory[1:], memory[kalman_memory(observer) :]
    tracking = observer[int(observer[TRACKING]) :]
    m, width = int(observer[N_ELEMENTS]), 2 * int(observer[N_DOFS])
    limits = tracking[COILS + m + int(tracking[N_DEVICES] * tracking[N_NUMBERS]) :]
    for c in range(len(command)):
        low, high, change = limits[2 * c], limits[2 * c + 1], 0.0
        for e in range(m):
            if tracking[COILS + e] == c:
                rise = 0.0
                for i in range(width):
                    rise += settings[ROWS + e * width + i] * z[i]
                stronger = device_force(e, high, tracking, devices, combined_force)
                weaker = device_force(e, low, tracking, devices, combined_force)
                change += rise * (stronger - weaker)
        # a band of no width would divide 0 by 0 at rest
        part = min(max(-change, 0.0) / max(settings[SOFTENING], 1e-30), 1.0)
        command[c] = low + part * (high - low)


class Lyapunov(Estimating, BrysonsRule):
    """Lyapunov's direct method: the current for the fastest decrease of a weighted energy.

    The energy is z' P z / 2 over displacements and velocities. P is chosen so that the energy
    decreases by the squared, scaled outputs at a reference current. The current is the lowest if
    more force, by the nominal law, would slow the decrease of the energy. Otherwise it is
    proportional to the gain in the decay rate under the highest current, up to that current. A
    softening of 0 gives the switching of Jansen and Dyke. With the energy of the structure in place
    of P, this is the on-off rule of maximum dissipation. The defaults are tuned
    (``studies/tuned/lyapunov.toml``): the current is nearly always the lowest.
    """

    name = "lyapunov"
    title = "Lyapunov"
    source = "Leitmann 1994; Jansen and Dyke 2000 (control based on Lyapunov stability theory)"

    largest_displacement = 2.0
    largest_velocity = 7.877
    largest_acceleration = 10.0

    presets: ClassVar = {
        "published": {
            "largest_displacement": 0.1, "largest_velocity": 0.15, "largest_acceleration": 1.0,
            "softening": 350.0,
        },
    }  # fmt: skip

    softening: float = setting(
        1e5, "gain in the decay rate of the energy that needs the full current; proportional "
        "below; 0 for switching", Number(at_least=0), "1/s", SearchRange(10.0, 1e5),
    )  # fmt: skip

    def decision(self, context: RunContext) -> Decision:
        """Dependence of the energy on the forces, then the observer."""
        driven_elements(context.nominal, self.name)
        observer = self.observer(context)
        estimating = observer.decision()
        rows = self.energy_rows(context, observer.reference)
        head = [ROWS + rows.size, self.softening]
        settings = np.concatenate([head, rows.ravel(), estimating.settings])
        return Decision(_decide, settings, estimating.memory, estimating.devices)

    def energy_rows(self, context: RunContext, currents: NDArray) -> NDArray:
        """Rate of the energy per unit of each element's force, displacement and velocity."""
        from scipy.linalg import solve_continuous_lyapunov

        nominal = context.nominal
        _, linear = linear_model(nominal, currents)
        n, rows = linear.n_dofs, nominal.element_rows
        inverse = np.linalg.inv(linear.mass)
        acceleration = -inverse @ np.hstack([linear.stiffness, linear.damping])
        a = np.vstack([np.eye(n, 2 * n, k=n), acceleration])
        outputs = self.weighted_outputs(linear, rows)
        p = solve_continuous_lyapunov(a.T, -outputs.T @ outputs)
        return -(rows @ inverse) @ p[n:]
