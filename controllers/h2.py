"""H2 control from accelerations, designed with a ground filter and clipped to the isolators."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ground_motions import STANDARD_GRAVITY
from isolation_sim.simulation.control import RunContext
from isolation_sim.structures import IsolatedStructure

from .clipped_lqr import designing, regulator_gain
from .coils import driven_elements, motion_of_driven
from .compiled import CompiledController, Decision
from .force_tracking import MOTION, follow_device, force_tracking, nearest_currents
from .observers.ground_noise import GroundNoise
from .observers.nominal_linear_model import NominalLinearModel, nominal_linear_model
from .settings import Number, Optional, SearchRange, setting

# settings: these; the sampled controller's matrices; springs and dashpots of the reference
# isolators; the force tracking's
N_DOFS, N_X, N_U, OWN = range(4)


def _decide(
    t: float, measured: NDArray, settings: NDArray, memory: NDArray, command: NDArray,
    combined_force: Callable, combined_range: Callable, state_rates: Callable,
) -> None:  # fmt: skip
    """Target forces from accelerations, then the currents nearest to them."""
    # Measured: accelerations (m/s^2), each element's deformation (m) and velocity (m/s), coil
    # currents (A). Memory: the controller's state and scratch, then that of the force tracking.
    n, n_x, m = int(settings[N_DOFS]), int(settings[N_X]), int(settings[N_U])
    at = OWN
    a, b = settings[at : at + n_x * n_x], settings[at + n_x * n_x : at + n_x * (n_x + n)]
    at += n_x * (n_x + n)
    c, d = settings[at : at + m * n_x], settings[at + m * n_x : at + m * (n_x + n)]
    at += m * (n_x + n)
    passive, tracking = settings[at : at + 2 * m], settings[at + 2 * m :]
    state, spare, devices = memory[:n_x], memory[n_x : 2 * n_x], memory[2 * n_x :]

    h = t - devices[0]
    devices[0] = t
    for e in range(m):
        x, v = measured[n + 2 * e], measured[n + 2 * e + 1]
        follow_device(e, x, v, h, tracking, devices, measured[n + 2 * m :], state_rates)
        target = passive[2 * e] * x + passive[2 * e + 1] * v
        for j in range(n_x):
            target += c[e * n_x + j] * state[j]
        for j in range(n):
            target += d[e * n + j] * measured[j]
        devices[MOTION + 2 * m + e] = target
    for i in range(n_x):
        spare[i] = 0.0
        for j in range(n_x):
            spare[i] += a[i * n_x + j] * state[j]
        for j in range(n):
            spare[i] += b[i * n + j] * measured[j]
    for i in range(n_x):
        state[i] = spare[i]
    nearest_currents(tracking, devices, command, combined_force, combined_range)


@dataclass(frozen=True)
class WeightedPlant:
    """Design model of an H2 controller: unit white noise to scaled outputs."""

    a: NDArray  # (n, n): Dynamics
    # b1, b2: (n, n_w), (n, n_u): Of the noise and of the controls
    b1: NDArray
    b2: NDArray
    # c1, d12: (n_z, n), (n_z, n_u): Outputs to keep small, from state and controls
    c1: NDArray
    d12: NDArray
    # c2, d21, d22: (n_y, n), (n_y, n_w), (n_y, n_u): Measurements, from state, noise and controls;
    # no noise acts on state and measurements both, b1 d21' = 0
    c2: NDArray
    d21: NDArray
    d22: NDArray

    def controller(self) -> Any:
        """Optimal controller, from two Riccati equations by python-control.

        References
        ----------
        Doyle, Glover, Khargonekar and Francis 1989.
        """
        import control

        # a regulator for the outputs, an estimator for the noise; they are optimal together
        gain = regulator_gain(
            self.a, self.b2, self.c1.T @ self.c1, self.d12.T @ self.d12, self.c1.T @ self.d12
        )
        correction, _, _ = control.lqe(
            self.a, np.eye(len(self.a)), self.c2, self.b1 @ self.b1.T, self.d21 @ self.d21.T
        )
        a = self.a - self.b2 @ gain - correction @ (self.c2 - self.d22 @ gain)
        return control.ss(a, correction, -gain, np.zeros((len(gain), len(self.c2))))


class H2(CompiledController):
    """H2 control from accelerations, with a ground filter, clipped to the forces of the isolators.

    The linear controller minimises the mean square of base displacements, accelerations and control
    forces, each over its acceptable value, when white noise through Kanai and Tajimi's filter
    shakes the structure on isolators linearised at a reference current; its control forces are what
    is added to theirs. What it is fed is accelerations; the isolators' own motion is measured for
    the inverse of the law, as in ``clipped_lqr``. Defaults are tuned (``studies/tuned/h2.toml``).
    """

    name = "h2"
    title = "H2"
    source = "Doyle et al. 1989; Dyke et al. 1996 (clipped optimal control); Spencer et al. 1994"

    presets: ClassVar = {
        "published": {
            "largest_displacement": 0.2, "largest_acceleration": 0.6, "largest_force": 0.045,
            "ground_frequency": 15.0, "reference": None,
        },
    }  # fmt: skip

    largest_displacement: float = setting(
        0.1679, "acceptable isolator deformation", Number(above=0), "m", SearchRange(0.02, 2.0)
    )
    largest_acceleration: float = setting(
        0.1397, "acceptable absolute acceleration of a level", Number(above=0), "m/s^2",
        SearchRange(0.06, 6.0),
    )  # fmt: skip
    largest_force: float = setting(
        0.002, "acceptable control force of an isolator over the structure's weight",
        Number(above=0), search=SearchRange(0.002, 0.5),
    )  # fmt: skip
    ground_intensity: float = setting(
        0.1, "one-sided density of the ground's white noise, (m/s^2)^2/Hz", Number(above=0)
    )
    ground_frequency: float = setting(
        60.0, "circular frequency of the ground", Number(above=0), "rad/s", SearchRange(2.0, 60.0)
    )
    ground_damping: float = setting(0.6, "damping ratio of the ground", Number(above=0))
    acceleration_noise: float = setting(
        0.02, "standard deviation of an accelerometer's noise", Number(above=0), "m/s^2"
    )
    reference: float | None = setting(
        0.1954, "current at which the isolators are linearised; None for the middle of the range",
        Optional(Number()), "A", SearchRange(0.0, 3.0, "linear"),
    )  # fmt: skip

    def measures(self, nominal: IsolatedStructure) -> tuple[str, ...]:
        """All levels' accelerations, and deformation and velocity of each driven element."""
        accelerations = (f"{dof}_acceleration_m_s2" for dof in nominal.structure.names)
        return (*accelerations, *motion_of_driven(nominal, self.name))

    def decision(self, context: RunContext) -> Decision:
        """Sampled controller, reference isolators and devices in one array."""
        import control

        nominal = context.nominal
        tracking = force_tracking(driven_elements(nominal, self.name), context)
        reference = tracking.reference(self.reference)
        plant, unit, linear = self.plant(nominal, reference, context.period)
        with designing(self):
            sampled = control.sample_system(plant.controller(), context.period, "bilinear")
        head = [nominal.structure.n_dofs, len(sampled.A), len(tracking.elements)]
        passive = linear.passive[nominal.control_devices]
        parts = [sampled.A, sampled.B, unit * sampled.C, unit * sampled.D, passive]
        own = np.concatenate([np.ravel(part) for part in parts])
        memory = np.concatenate([np.zeros(2 * len(sampled.A)), tracking.memory])
        settings = np.concatenate([head, own, tracking.settings])
        return Decision(_decide, settings, memory, tracking.model)

    def plant(
        self, nominal: IsolatedStructure, reference: NDArray, period: float
    ) -> tuple[WeightedPlant, float, NominalLinearModel]:
        """Assemble the design model."""
        ground = GroundNoise(self.ground_intensity, self.ground_frequency, self.ground_damping)
        linear = nominal_linear_model(nominal, reference, ground)
        driven = nominal.control_devices
        unit = self.largest_force * nominal.structure.isolated_mass * STANDARD_GRAVITY
        on_state, on_acceleration = unit * linear.b[:, driven], unit * linear.d[:, driven]
        n_y, (n_x, n_w), n_u = len(linear.c), linear.g.shape, int(driven.sum())
        largest = self.largest_acceleration
        plant = WeightedPlant(
            a=linear.a,
            b1=np.hstack([np.sqrt(ground.density) * linear.g, np.zeros((n_x, n_y))]),
            b2=on_state,
            c1=np.vstack([
                linear.deformations[driven] / self.largest_displacement,
                linear.c / largest,
                np.zeros((n_u, n_x)),
            ]),
            d12=np.vstack([np.zeros((n_u, n_u)), on_acceleration / largest, np.eye(n_u)]),
            c2=linear.c,
            d21=np.hstack([
                np.zeros((n_y, n_w)), self.acceleration_noise * np.sqrt(period) * np.eye(n_y)
            ]),
            d22=on_acceleration,
        )  # fmt: skip
        return plant, unit, linear
