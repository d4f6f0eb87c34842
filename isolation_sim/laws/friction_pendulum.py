"""Single friction pendulum, with friction that depends on the speed, for two directions.

``F = N (x / R + f)`` with the vertical load N, the effective radius R and the friction f, a vector.
Friction is elastic and perfectly plastic: before slip it follows the deformation with the stiffness
``mu_max / u_y``, and it returns radially onto the circle of the coefficient of friction,

    f = z min(1, mu / |z|)
    z' = (mu_max / u_y) v - (z - f) / tau
    mu = mu_max - (mu_max - mu_min) exp(-a |v|)

so that the corner between sticking and sliding is sharp, as in OpenSees's singleFPBearing. The state
z leaves the circle by ``(mu_max / u_y) |v| tau`` and comes back within the time tau (Duvaut and
Lions); the force does not leave it. The corner is the sharper, the smaller tau is; fixed steps need
one above half of their length. The coefficient is that of Constantinou, Mokha and Reinhorn.

With the vertical load as a third deformation, ``N = W (1 + x[2])``, and none in uplift. The stored
energy is then that under the present load; work of a load that changes is booked with the loss.
"""

from typing import Any

import numpy as np

from .in_plan import along_a_line, length
from .law import InPlan, Law, Quantity


def _friction(v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Friction over the vertical load, on or within the circle of the coefficient."""
    _, _, mu_max, mu_min, a, *_ = parameters
    z_x, z_y = states
    mu = mu_max - (mu_max - mu_min) * np.exp(-a * length(v[0], v[1]))
    inside = np.fmin(1.0, mu / length(z_x, z_y))
    return inside * z_x, inside * z_y


def plan_force(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Restoring force of the pendulum and friction, along x and y."""
    W, R, *_ = parameters
    f_x, f_y = _friction(v, states, parameters)
    return W * (x[0] / R + f_x), W * (x[1] / R + f_y)


def plan_rates(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Rate of the elastic friction: the deformation, and the radial return in slip."""
    _, _, mu_max, _, _, u_y, tau = parameters
    z_x, z_y = states
    f_x, f_y = _friction(v, states, parameters)
    stiffness = mu_max / u_y
    return stiffness * v[0] - (z_x - f_x) / tau, stiffness * v[1] - (z_y - f_y) / tau


def plan_energy(x: tuple, states: tuple, parameters: tuple) -> Any:
    """Energy of the pendulum and of the deformation before slip."""
    W, R, mu_max, _, _, u_y, _ = parameters
    z_x, z_y = states
    before_slip = u_y / mu_max * (z_x**2 + z_y**2)
    return W * ((x[0] ** 2 + x[1] ** 2) / R + before_slip) / 2


def _load(change: Any) -> Any:
    return np.fmax(1 + change, 0.0)


def axial_force(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Forces under the present vertical load."""
    f_x, f_y = plan_force(x[:2], v[:2], states, parameters)
    return _load(x[2]) * f_x, _load(x[2]) * f_y, 0.0 * x[2]


def axial_rates(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Rate of the elastic friction, whatever the load."""
    return plan_rates(x[:2], v[:2], states, parameters)


def axial_energy(x: tuple, states: tuple, parameters: tuple) -> Any:
    """Stored energy under the present vertical load."""
    return _load(x[2]) * plan_energy(x[:2], states, parameters)


PLAN = InPlan(plan_force, plan_rates, plan_energy)
LAW = Law(
    name="friction_pendulum",
    title="Friction pendulum, friction by speed",
    states=(Quantity("z", "1", "elastic friction over the vertical load, before its return"),),
    parameters=(
        Quantity("W", "N", "mean vertical load", lower=0.0),
        Quantity("R", "m", "effective radius", lower=0.0, divides=True),
        Quantity("mu_max", "1", "coefficient of friction at high speed", lower=0.0, divides=True),
        Quantity("mu_min", "1", "coefficient of friction at low speed", lower=0.0, divides=True),
        Quantity("a", "s/m", "rate at which the coefficient changes with the speed", lower=0.0),
        Quantity("u_y", "m", "deformation before slip", lower=0.0, divides=True),
        Quantity("tau", "s", "time of the return onto the circle", lower=0.0, divides=True),
    ),
    **along_a_line(PLAN, n_states=1),
    source="Constantinou, Mokha and Reinhorn (1990)",
    plan=PLAN,
    axial=InPlan(axial_force, axial_rates, axial_energy),
    example={
        "W": 10000.0, "R": 1.5, "mu_max": 0.1, "mu_min": 0.05, "a": 30.0, "u_y": 0.002,
        "tau": 0.002,
    },
)  # fmt: skip
