"""Biaxial Bouc-Wen law of Park, Wen and Ang, for lead-rubber bearings.

``F = k x + c v + Q z`` with vectors of two directions and

    u_y z_x' = v_x - z_x (beta |v_x z_x| + gamma v_x z_x + beta |v_y z_y| + gamma v_y z_y)

and the same for y. With beta + gamma = 1 the hysteretic force stays within the circle of radius Q.
Along x or along y the law is that of Bouc and Wen with n = 2.

The absolute values are taken direction by direction, so that the law is not quite the same in every
direction: in circular motion the force falls below Q while one of its components still opposes that
of the velocity. The in-plan form of ``bouc_wen`` takes the product of the vectors instead, as
OpenSees does in its elastomericBearingBoucWen, and stays on the circle.
"""

from typing import Any

import numpy as np

from .in_plan import along_a_line
from .law import InPlan, Law, Quantity


def plan_force(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Spring, dashpot and hysteretic force along x and y."""
    k, c, Q, *_ = parameters
    z_x, z_y = states
    return k * x[0] + c * v[0] + Q * z_x, k * x[1] + c * v[1] + Q * z_y


def plan_rates(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Rates of the hysteretic variables."""
    _, _, _, u_y, beta, gamma = parameters
    z_x, z_y = states
    along_x, along_y = v[0] * z_x, v[1] * z_y
    decay = beta * (np.fabs(along_x) + np.fabs(along_y)) + gamma * (along_x + along_y)
    return (v[0] - z_x * decay) / u_y, (v[1] - z_y * decay) / u_y


def plan_energy(x: tuple, states: tuple, parameters: tuple) -> Any:
    """Energy of the spring and of the deformation before yielding."""
    k, _, Q, u_y, _, _ = parameters
    z_x, z_y = states
    return k * (x[0] ** 2 + x[1] ** 2) / 2 + Q * u_y * (z_x**2 + z_y**2) / 2


PLAN = InPlan(plan_force, plan_rates, plan_energy)
LAW = Law(
    name="park_wen_ang",
    title="Biaxial Bouc-Wen (Park, Wen and Ang)",
    states=(Quantity("z", "1", "hysteretic force over Q"),),
    parameters=(
        Quantity("k", "N/m", "stiffness after yielding", lower=0.0),
        Quantity("c", "N s/m", "viscous damping", lower=0.0),
        Quantity("Q", "N", "characteristic strength: force at zero deformation", lower=0.0),
        Quantity("u_y", "m", "yield deformation", lower=0.0, divides=True),
        Quantity("beta", "1", "decay of z when loading and unloading", lower=0.0),
        Quantity("gamma", "1", "decay of z when loading, growth when unloading"),
    ),
    **along_a_line(PLAN, n_states=1),
    source="Park, Wen and Ang (1986)",
    plan=PLAN,
    example={
        "k": (20000.0, 3000.0), "c": 300.0, "Q": (800.0, 200.0), "u_y": 0.01, "beta": 0.6,
        "gamma": 0.4,
    },
)  # fmt: skip
