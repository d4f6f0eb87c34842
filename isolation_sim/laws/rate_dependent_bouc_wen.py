"""Bouc-Wen law whose damping thins with the velocity and whose hysteresis relaxes.

``F = k x + c v_c arcsinh(v / v_c) + F_y w + F0``: the dashpot is Eyring's, of damping c at rest,
which grows with the logarithm of the velocity beyond v_c. The Bouc-Wen element
(``normalised_bouc_wen``) relaxes at the rate r: ``w' = ... - r w``. Without relaxation and for a
large v_c it is the Bouc-Wen law.
"""

from typing import Any

import numpy as np

from . import normalised_bouc_wen
from .law import Law, Quantity


def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
    """Spring, thinning dashpot and hysteretic force."""
    (w,) = states
    k, c, v_c, F_y, _, _, _, _, F0 = parameters
    return k * x + c * v_c * np.arcsinh(v / v_c) + F_y * w + F0


def rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
    """Rate of the hysteretic variable."""
    (w,) = states
    _, _, _, _, rho, sigma, n, r, _ = parameters
    return (normalised_bouc_wen.rate(v, w, rho, sigma, n) - r * w,)


def stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:
    """Energy of the spring and of the hysteretic element."""
    (w,) = states
    k, _, _, F_y, rho, _, _, _, F0 = parameters
    return k * x**2 / 2 + normalised_bouc_wen.energy(w, F_y, rho) + F0 * x


LAW = Law(
    name="rate_dependent_bouc_wen",
    title="Rate-dependent Bouc-Wen",
    states=(normalised_bouc_wen.STATE,),
    parameters=(
        Quantity("k", "N/m", "stiffness", lower=0.0),
        Quantity("c", "N s/m", "viscous damping at rest", lower=0.0),
        Quantity("v_c", "m/s", "velocity from which damping thins", lower=0.0, divides=True),
        *normalised_bouc_wen.PARAMETERS,
        Quantity("r", "1/s", "rate of relaxation of the hysteretic force", lower=0.0),
        Quantity("F0", "N", "initial force"),
    ),
    force=force,
    rates=rates,
    stored_energy=stored_energy,
    source="Ikhouane & Rodellar (2007); Eyring (1936)",
    example={
        "k": (20000.0, 3000.0), "c": 700.0, "v_c": 0.02, "F_y": (150.0, 80.0), "rho": 900.0,
        "sigma": 0.6, "n": 1.8, "r": 0.5, "F0": 0.0,
    },
)  # fmt: skip
