"""Sliding bearing of Constantinou, Mokha and Reinhorn, flat or curved, for two directions.

``F = k x + Q z`` with the friction by the speed and a vector z that ends on the unit circle,

    Q = F_max - (F_max - F_min) exp(-a |v|)
    u_y z' = v - z (|z.v| + z.v) / 2

k is the load over the radius of the dish, zero for a flat one; F_max and F_min are the load times
the coefficients of friction. The friction follows the speed at once, and falls before each
reversal. 3D-BASIS and the friction isolator of SAP2000 and ETABS have this law, with the product of
the vectors taken direction by direction. In ``friction_pendulum`` the mobilised friction itself
is the state, and follows a vertical load that changes.

No stored energy is declared: what unloading returns depends on its speed.
"""

import numpy as np

from .in_plan import along_a_line, length
from .law import InPlan, Law, Quantity


def plan_force(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Restoring force and friction along x and y."""
    k, F_max, F_min, a, _ = parameters
    friction = F_max - (F_max - F_min) * np.exp(-a * length(v[0], v[1]))
    return k * x[0] + friction * states[0], k * x[1] + friction * states[1]


def plan_rates(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Rates of the hysteretic variables."""
    *_, u_y = parameters
    z_x, z_y = states
    along = z_x * v[0] + z_y * v[1]
    slip = (np.fabs(along) + along) / 2
    return (v[0] - z_x * slip) / u_y, (v[1] - z_y * slip) / u_y


PLAN = InPlan(plan_force, plan_rates, None)
LAW = Law(
    name="sliding_bearing",
    title="Sliding bearing (Constantinou, Mokha and Reinhorn)",
    states=(Quantity("z", "1", "friction over that in slip"),),
    parameters=(
        Quantity("k", "N/m", "restoring stiffness: load over radius", lower=0.0),
        Quantity("F_max", "N", "friction at high speed", lower=0.0),
        Quantity("F_min", "N", "friction at low speed", lower=0.0),
        Quantity("a", "s/m", "rate at which the friction changes with the speed", lower=0.0),
        Quantity("u_y", "m", "deformation before slip", lower=0.0, divides=True),
    ),
    **along_a_line(PLAN, n_states=1),
    source="Constantinou, Mokha and Reinhorn (1990)",
    plan=PLAN,
    example={
        "k": (20000.0, 3000.0), "F_max": (400.0, 100.0), "F_min": 200.0, "a": 10.0, "u_y": 0.003,
    },
)  # fmt: skip
