"""Linear-quadratic regulator, clipped to the forces of the isolators."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ground_motions import STANDARD_GRAVITY
from isolation_sim.errors import ControllerError
from isolation_sim.simulation.control import RunContext
from isolation_sim.structures import IsolatedStructure, Structure
from isolation_sim.structures.modes import undamped_modes

from .brysons_rule import BrysonsRule
from .coils import driven_elements
from .compiled import CompiledController, Decision
from .force_tracking import MOTION, follow_device, force_tracking, nearest_currents
from .settings import Number, Optional, SearchRange, setting

_MOST_NEWTON = 100
"""Most steps of Newton's method for a Riccati equation; about 10 are needed."""

# settings: these, the gains, the elements' directions, then those of the force tracking
N_DOFS, N_ELEMENTS, HEAD = range(3)


def _decide(
    t: float, measured: NDArray, settings: NDArray, memory: NDArray, command: NDArray,
    combined_force: Callable, combined_range: Callable, state_rates: Callable,
) -> None:  # fmt: skip
    """Target forces from the state, then the currents nearest to them."""
    # Measured: displacements (m), velocities (m/s) and coil currents (A). Memory: that of the force
    # tracking.
    n, m = int(settings[N_DOFS]), int(settings[N_ELEMENTS])
    gains = settings[HEAD : HEAD + 2 * n * m]
    directions = settings[HEAD + 2 * n * m : HEAD + 3 * n * m]
    tracking = settings[HEAD + 3 * n * m :]
    h = t - memory[0]
    memory[0] = t
    for e in range(m):
        new_x = new_v = force = 0.0
        for i in range(n):
            new_x += directions[e * n + i] * measured[i]
            new_v += directions[e * n + i] * measured[n + i]
        for i in range(2 * n):
            force += gains[e * 2 * n + i] * measured[i]
        # the coil current has been the measured one since the last decision
        follow_device(e, new_x, new_v, h, tracking, memory, measured[2 * n :], state_rates)
        memory[MOTION + 2 * m + e] = force
    nearest_currents(tracking, memory, command, combined_force, combined_range)


class ClippedLQR(BrysonsRule):
    """Linear-quadratic regulator, clipped to the forces of the isolators.

    The regulator is designed on the structure with its isolators linearised at a reference current.
    Its control forces are added to those of these reference isolators. The force of an isolator
    varies little about such a spring and dashpot, so that most control forces are within its range.
    A regulator of the whole isolator force would be penalised for carrying the building. Weights
    follow Bryson's rule: each output is divided by its largest acceptable value, and the squares
    are added.

    The target force goes through the inverse of the nominal law, with device states integrated
    along the measured deformation, and is clipped to the nearest possible force. The defaults are
    tuned (``studies/tuned/clipped_lqr.toml``).
    """

    name = "clipped_lqr"
    title = "Clipped LQR"
    observed_by = "clipped_lqg"
    source = "Dyke et al. 1996 (clipped optimal control); Bryson and Ho 1975 (weights)"

    presets: ClassVar = {
        "published": {
            "largest_displacement": 0.2, "largest_velocity": 0.3, "largest_acceleration": 1.0,
            "largest_force": 0.05,
        },
    }  # fmt: skip
    largest_displacement = 1.168
    largest_velocity = 4.149
    largest_acceleration = 0.1137

    largest_force: float = setting(
        0.3415, "acceptable control force of an isolator over the structure's weight",
        Number(above=0), search=SearchRange(0.002, 0.5),
    )  # fmt: skip
    reference: float | None = setting(
        None,
        "current at which the isolators are linearised; None for the middle of the range",
        Optional(Number()),
        "A",
    )

    def measures(self, nominal: IsolatedStructure) -> tuple[str, ...]:
        """All displacements and velocities."""
        names = nominal.structure.names
        return (*(f"{q}_displacement_m" for q in names), *(f"{q}_velocity_m_s" for q in names))

    def decision(self, context: RunContext) -> Decision:
        """Gains, laws and limits in one array."""
        nominal = context.nominal
        tracking = force_tracking(driven_elements(nominal, self.name), context)
        gains = self.force_gains(nominal, tracking.reference(self.reference))
        directions = [element.direction for element in tracking.elements]
        head = [nominal.structure.n_dofs, len(tracking.elements)]
        parts = [head, gains, directions, tracking.settings]
        settings = np.concatenate([np.ravel(np.asarray(part, float)) for part in parts])
        return Decision(_decide, settings, tracking.memory, tracking.model)

    def force_gains(self, nominal: IsolatedStructure, reference: NDArray) -> NDArray:
        """Target force of each driven element per unit of each displacement and velocity."""
        frequency, linear = linear_model(nominal, reference)
        driven = driven_elements(nominal, self.name)
        passive = []
        for element in driven:
            k = element.device.linearised(float(reference[element.channel or 0]), frequency)
            viscous = k.imag / (2 * np.pi * frequency)
            passive.append([*(k.real * element.direction), *(viscous * element.direction)])
        rows = np.array([element.direction for element in driven])
        return np.array(passive) - self._regulator(linear, rows)

    def _regulator(self, linear: Structure, rows: NDArray) -> NDArray:
        """LQR gain, (n_driven, 2 n_dofs): forces along ``rows`` are minus the gain times state."""
        n, m = linear.n_dofs, len(rows)
        inverse = np.linalg.inv(linear.mass)
        # forces in units of the largest acceptable one keep the Riccati equation well scaled
        unit = self.largest_force * linear.isolated_mass * STANDARD_GRAVITY
        on_acceleration = -unit * inverse @ rows.T
        acceleration = -inverse @ np.hstack([linear.stiffness, linear.damping])
        a = np.vstack([np.eye(n, 2 * n, k=n), acceleration])
        b = np.vstack([np.zeros((n, m)), on_acceleration])
        outputs = self.weighted_outputs(linear, rows)
        through = np.zeros((len(outputs), m))
        through[-n:] = on_acceleration / self.largest_acceleration
        weights = outputs.T @ outputs, np.eye(m) + through.T @ through, outputs.T @ through
        with designing(self):
            return unit * regulator_gain(a, b, *weights)


def regulator_gain(a: NDArray, b: NDArray, q: NDArray, r: NDArray, s: NDArray) -> NDArray:
    """Linear-quadratic regulator of a cost with a cross weight."""
    import control

    cross = np.linalg.solve(r, s.T)
    reduced = q - s @ cross
    try:
        gain, _, _ = control.lqr(a - b @ cross, b, (reduced + reduced.T) / 2, r)
    except ValueError:
        return gain_by_newton(a, b, q, r, s)
    return np.asarray(gain) + cross


def gain_by_newton(a: NDArray, b: NDArray, q: NDArray, r: NDArray, s: NDArray) -> NDArray:
    """Regulator of a stable plant, by Kleinman's iteration (1968) from no control."""
    # each step is one Lyapunov equation, which also many devices at one place leave well scaled
    from scipy.linalg import solve_continuous_lyapunov

    if np.linalg.eigvals(a).real.max() >= 0:
        raise ValueError("the structure on these isolators is not stable")
    gain = np.zeros(b.T.shape)
    for _ in range(_MOST_NEWTON):
        before, closed = gain, a - b @ gain
        weight = q - s @ gain - gain.T @ s.T + gain.T @ r @ gain
        cost = solve_continuous_lyapunov(closed.T, -(weight + weight.T) / 2)
        gain = np.linalg.solve(r, b.T @ cost + s.T)
        if np.abs(gain - before).max() <= 1e-9 * np.abs(gain).max():
            return gain
    raise ValueError("Newton's method does not converge")


@contextmanager
def designing(controller: CompiledController) -> Iterator[None]:
    """Raise an error of one line, with the acceptable values, if a design has no solution."""
    try:
        yield
    except ValueError as error:
        largest = ", ".join(
            f"{name} = {getattr(controller, name):g}"
            for name in controller.settings
            if name.startswith("largest_")
        )
        reason = str(error).partition(";")[0]
        raise ControllerError(
            f"{controller.name} cannot be designed with {largest} ({reason}); expected: a smaller "
            "largest_force, or a larger largest_acceleration"
        ) from None


def linear_model(nominal: IsolatedStructure, currents: NDArray) -> tuple[float, Structure]:
    """Structure with its isolators linearised at its own first frequency."""
    frequency = 1.0
    # the isolators' stiffness changes slowly with the frequency: a few rounds agree to 1e-6
    for _ in range(8):
        linear = nominal.linearised(currents.tolist() or 0.0, frequency)
        frequency = float(undamped_modes(linear.mass, linear.stiffness)[0][0] / (2 * np.pi))
    return frequency, linear
