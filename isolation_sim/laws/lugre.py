"""LuGre friction beside a spring and a dashpot, in the form of Yu et al.

``F = k0 x + c0 v + (beta / alpha) y + (epsilon / alpha) y' + F0``, ``y' = alpha (v - |v| y)``.
Eq 21 prints y in place of y' behind epsilon, with which beta and epsilon would be one parameter.
In the usual symbols z = y / alpha, sigma_0 = beta, sigma_1 = epsilon, and the friction force
beta / alpha does not depend on the speed. The state stays within -1 to 1.
"""

from typing import Any

import numpy as np

from .law import Law, Quantity, Spring


def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
    """Spring, dashpot, bristles and their damping (Eq 21 mended)."""
    (y,) = states
    k0, c0, alpha, beta, epsilon, F0 = parameters
    return k0 * x + c0 * v + beta / alpha * y + epsilon * (v - np.fabs(v) * y) + F0


def rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
    """Rate of the bristles' relative deflection (Eq 22 mended)."""
    (y,) = states
    _, _, alpha, _, _, _ = parameters
    return (alpha * (v - np.fabs(v) * y),)


def stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:
    """Energy of spring and bristles; while |y| <= 1 friction loses beta |v| y^2 / alpha or more."""
    (y,) = states
    k0, _, alpha, beta, _, F0 = parameters
    return k0 * x**2 / 2 + beta / 2 * (y / alpha) ** 2 + F0 * x


LAW = Law(
    name="lugre",
    title="LuGre friction in parallel with spring and dashpot",
    states=(Quantity("y", "1", "bristle deflection over that at slip"),),
    parameters=(
        Quantity("k0", "N/m", "stiffness", lower=0.0),
        Quantity("c0", "N s/m", "viscous damping", lower=0.0),
        Quantity("alpha", "1/m", "inverse deflection at slip", lower=0.0, divides=True),
        Quantity("beta", "N/m", "bristle stiffness", lower=0.0),
        Quantity("epsilon", "N s/m", "bristle damping", lower=0.0),
        Quantity("F0", "N", "initial force"),
    ),
    force=force,
    rates=rates,
    stored_energy=stored_energy,
    source="Yu et al., Eqs 21 and 22 mended",
    springs=(Spring("k0", ("x",)), Spring("beta", ("y",))),
    example={
        "k0": (20000.0, 3000.0), "c0": 300.0, "alpha": 800.0, "beta": (50000.0, 10000.0),
        "epsilon": 40.0, "F0": 0.0,
    },
)  # fmt: skip
