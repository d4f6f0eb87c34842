"""Fluid viscous damper with a flexible brace: nonlinear dashpot and spring in series.

``F = k y``, ``y' = v - v_d``, where the dashpot moves at v_d under ``F = c |v_d|^alpha sgn v_d``.
The exponent is 0.15 to 1 for dampers of structures, and 2 for a plain orifice. ``alpha = 1`` is the
Maxwell law. OpenSees has this law as ``ViscousDamper``, SAP2000 and ETABS as the exponential
damper. In plan the dashpot moves along the force, as dampers all around do together.

Below a millionth of the force at 1 m/s the dashpot is linear: the power has no slope at zero.
"""

from typing import Any

from .in_plan import along_a_line
from .law import InPlan, Law, Quantity

_LINEAR = 1e-6
"""Force over that at 1 m/s."""


def plan_force(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Force of the spring along x and y, which is also that of the dashpot."""
    k, *_ = parameters
    return k * states[0], k * states[1]


def plan_rates(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Rates of the spring's extension: the velocity minus that of the dashpot."""
    k, c, alpha = parameters
    F_x, F_y = k * states[0] / c, k * states[1] / c
    mobility = (F_x**2 + F_y**2 + _LINEAR**2) ** ((1 / alpha - 1) / 2)
    return v[0] - F_x * mobility, v[1] - F_y * mobility


def plan_energy(x: tuple, states: tuple, parameters: tuple) -> Any:
    """Energy of the spring."""
    k, *_ = parameters
    return k * (states[0] ** 2 + states[1] ** 2) / 2


PLAN = InPlan(plan_force, plan_rates, plan_energy)
LAW = Law(
    name="viscous_damper",
    title="Fluid viscous damper (nonlinear dashpot and spring in series)",
    states=(Quantity("y", "m", "extension of the spring"),),
    parameters=(
        Quantity("k", "N/m", "stiffness of the brace", lower=0.0),
        Quantity("c", "N s^alpha/m^alpha", "damping", lower=0.0, divides=True),
        Quantity("alpha", "1", "exponent of the velocity", lower=0.1, upper=2.0),
    ),
    **along_a_line(PLAN, n_states=1),
    source="Makris and Constantinou (1991); Soong and Constantinou (1994)",
    plan=PLAN,
    example={"k": (20000.0, 3000.0), "c": 300.0, "alpha": 0.5},
)
