"""Single friction pendulum, with friction that depends on the speed, for two directions.

``F = N (x / R + f)`` with the vertical load N, the effective radius R and the mobilised friction f,
a vector. Before slip f follows the deformation with the stiffness ``mu_max / u_y``; in slip its
length tends to the coefficient of friction,

    f' = (mu_max / u_y) (v - f |f|^(n-2) (|f.v| + f.v) / (2 mu^n)) - f max(0, 1 - mu / |f|) / tau
    mu = mu_max - (mu_max - mu_min) exp(-a |v|)

so that the interaction curve is a circle of radius mu. Where the speed and with it mu falls, f
returns radially onto the circle within the time tau. A large n and a small tau make a sharp corner
between sticking and sliding, as in OpenSees's singleFPBearing. The coefficient is that of
Constantinou, Mokha and Reinhorn, the vector form that of Park, Wen and Ang with the product of the
vectors in place of that of each direction.

With the vertical load as a third deformation, ``N = W (1 + x[2])``, and none in uplift. The stored
energy is then that under the present load; work of a load that changes is booked with the loss.
"""

from typing import Any

import numpy as np

from .in_plan import along_a_line, length, power_of_length
from .law import InPlan, Law, Quantity, Redundancy


def plan_force(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Restoring force of the pendulum and friction, along x and y."""
    W, R, *_ = parameters
    f_x, f_y = states
    return W * (x[0] / R + f_x), W * (x[1] / R + f_y)


def plan_rates(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Rate of the mobilised friction."""
    _, _, mu_max, mu_min, a, u_y, n, tau = parameters
    f_x, f_y = states
    mu = mu_max - (mu_max - mu_min) * np.exp(-a * length(v[0], v[1]))
    loading = f_x * v[0] + f_y * v[1]
    used = power_of_length(f_x / mu, f_y / mu, n - 2)
    slip = used * (np.fabs(loading) + loading) / (2 * mu * mu)
    size = length(f_x, f_y)
    beyond = (size - mu + np.fabs(size - mu)) / (2 * size)
    stiffness = mu_max / u_y
    return (
        stiffness * (v[0] - f_x * slip) - f_x * beyond / tau,
        stiffness * (v[1] - f_y * slip) - f_y * beyond / tau,
    )


def plan_energy(x: tuple, states: tuple, parameters: tuple) -> Any:
    """Energy of the pendulum and of the deformation before slip."""
    W, R, mu_max, _, _, u_y, *_ = parameters
    f_x, f_y = states
    before_slip = u_y / mu_max * (f_x**2 + f_y**2)
    return W * ((x[0] ** 2 + x[1] ** 2) / R + before_slip) / 2


def _load(change: Any) -> Any:
    return np.fmax(1 + change, 0.0)


def axial_force(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Forces under the present vertical load."""
    f_x, f_y = plan_force(x[:2], v[:2], states, parameters)
    return _load(x[2]) * f_x, _load(x[2]) * f_y, 0.0 * x[2]


def axial_rates(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Rate of the mobilised friction, whatever the load."""
    return plan_rates(x[:2], v[:2], states, parameters)


def axial_energy(x: tuple, states: tuple, parameters: tuple) -> Any:
    """Stored energy under the present vertical load."""
    return _load(x[2]) * plan_energy(x[:2], states, parameters)


PLAN = InPlan(plan_force, plan_rates, plan_energy)
LAW = Law(
    name="friction_pendulum",
    title="Friction pendulum, friction by speed",
    states=(Quantity("f", "1", "mobilised friction over the vertical load"),),
    parameters=(
        Quantity("W", "N", "mean vertical load", lower=0.0),
        Quantity("R", "m", "effective radius", lower=0.0, divides=True),
        Quantity("mu_max", "1", "coefficient of friction at high speed", lower=0.0, divides=True),
        Quantity("mu_min", "1", "coefficient of friction at low speed", lower=0.0, divides=True),
        Quantity("a", "s/m", "rate at which the coefficient changes with the speed", lower=0.0),
        Quantity("u_y", "m", "deformation before slip", lower=0.0, divides=True),
        Quantity("n", "1", "smoothness of the start of slip", lower=1.0, upper=1000.0),
        Quantity("tau", "s", "time of the return where mu falls", lower=0.0, divides=True),
    ),
    **along_a_line(PLAN, n_states=1),
    # ten times the force: friction and slope are some per cent of the load
    redundancy=Redundancy("W", 10.0, ("W", "R", "mu_max", "mu_min"), of_data=True),
    smoothing={"n": 2.0, "tau": 0.01},
    source="Constantinou, Mokha and Reinhorn (1990); Park, Wen and Ang (1986)",
    plan=PLAN,
    axial=InPlan(axial_force, axial_rates, axial_energy),
    example={
        "W": 10000.0, "R": 1.5, "mu_max": 0.1, "mu_min": 0.05, "a": 30.0, "u_y": 0.002,
        "n": 2.0, "tau": 1.0,
    },
)  # fmt: skip
