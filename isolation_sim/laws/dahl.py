"""Dahl friction beside a spring and a dashpot.

``F = k x + c v + sigma z``, ``z' = v - sigma / F_c |v| z``: a spring sigma that slips at F_c at any
velocity. Not in the papers; for comparison.
"""

from typing import Any

import numpy as np

from .law import Law, Quantity, Spring


def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
    """Spring, dashpot and friction."""
    (z,) = states
    k, c, sigma, _ = parameters
    return k * x + c * v + sigma * z


def rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
    """Rate of the deflection before slip."""
    (z,) = states
    _, _, sigma, F_c = parameters
    return (v - sigma / F_c * np.fabs(v) * z,)


def stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:
    """Energy of spring and deflection; friction loses (sigma z)^2 |v| / F_c."""
    (z,) = states
    k, _, sigma, _ = parameters
    return k * x**2 / 2 + sigma * z**2 / 2


LAW = Law(
    name="dahl",
    title="Dahl friction in parallel with spring and dashpot",
    states=(Quantity("z", "m", "deflection before slip"),),
    parameters=(
        Quantity("k", "N/m", "stiffness", lower=0.0),
        Quantity("c", "N s/m", "viscous damping", lower=0.0),
        Quantity("sigma", "N/m", "stiffness of the friction before slip", lower=0.0),
        Quantity("F_c", "N", "friction force", lower=0.0, divides=True),
    ),
    force=force,
    rates=rates,
    stored_energy=stored_energy,
    source="Dahl (1968), exponent 1",
    springs=(Spring("k", ("x",)), Spring("sigma", ("z",))),
    example={"k": (20000.0, 3000.0), "c": 300.0, "sigma": (40000.0, 10000.0), "F_c": 150.0},
)
