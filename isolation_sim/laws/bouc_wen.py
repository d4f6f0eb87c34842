"""Conventional Bouc-Wen law.

``F = k x + c v + alpha z + F0``, ``z' = A v - beta |v| |z|^(n-1) z - gamma v |z|^n``.

A scale factor of z moves between A, alpha, beta and gamma. One of them is redundant: fix one in a
fit, for example A = 1. From rest z stays within ``(A / (beta + gamma))^(1/n)`` if beta + gamma > 0.
Otherwise it grows without bound under loading. If gamma > beta, a state beyond
``(A / (gamma - beta))^(1/n)`` diverges in finite time. Only a current that changes A, beta or gamma
can cause such a state.

No stored energy is declared. ``alpha z^2 / (2 A)`` is a stored energy if ``|gamma| <= beta``. For
other parameters it would return more energy than was stored, and the true stored energy has no
closed form for every n (see ``improved_bouc_wen`` for n = 2).

In plan ``z' = A v - |z|^(n-2) (beta |v.z| + gamma v.z) z`` for vectors z and v: the form of Park,
Wen and Ang, with the product of the vectors in place of that of each direction. So it is the same
in every direction, and in sliding ``|z|`` tends to ``(A / (beta + gamma))^(1/n)`` exactly: the
interaction curve is a circle for every n. See ``park_wen_ang`` for the form as published.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .in_plan import power_of_length
from .law import InPlan, Law, Quantity, Redundancy, StateScaling

# keeps log(0) and 0^(n - 2) out of derivatives at rest; changes no value above 1e-148
_TINY = 1e-300


def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
    """Spring, dashpot and hysteretic force (Yu et al., Eq 19; Tao et al., Eq 19 with F0 = 0)."""
    (z,) = states
    k, c, alpha, _, _, _, _, F0 = parameters
    return k * x + c * v + alpha * z + F0


def rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
    """Rate of the hysteretic variable (Yu et al., Eq 20)."""
    (z,) = states
    _, _, _, A, beta, gamma, n, _ = parameters
    # |z|^(n-1), so written that its derivatives need no second power
    shape = np.exp((n - 1) / 2 * np.log(z * z + _TINY))
    return (A * v - (beta * np.fabs(v) * z + gamma * v * np.fabs(z)) * shape,)


def plan_force(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Spring, dashpot and hysteretic force along x and y; the initial force is along x."""
    k, c, alpha, _, _, _, _, F0 = parameters
    z_x, z_y = states
    return k * x[0] + c * v[0] + alpha * z_x + F0, k * x[1] + c * v[1] + alpha * z_y


def plan_rates(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Rate of the hysteretic vector."""
    z_x, z_y = states
    _, _, _, A, beta, gamma, n, _ = parameters
    loading = v[0] * z_x + v[1] * z_y
    decay = (beta * np.fabs(loading) + gamma * loading) * power_of_length(z_x, z_y, n - 2)
    return A * v[0] - decay * z_x, A * v[1] - decay * z_y


def _largest(values: Mapping[str, NDArray]) -> NDArray:
    """Largest z from rest."""
    A, beta, gamma, n = (values[name] for name in ("A", "beta", "gamma", "n"))
    return (A / np.maximum(beta + gamma, _TINY)) ** (1 / n)


def _powers(values: Mapping[str, NDArray]) -> dict[str, Any]:
    """Powers of a factor on z in each parameter."""
    decay = 1 - values["n"]
    return {"alpha": -1, "A": 1, "beta": decay, "gamma": decay}


LAW = Law(
    name="bouc_wen",
    title="Bouc-Wen",
    states=(Quantity("z", "m", "hysteretic variable"),),
    parameters=(
        Quantity("k", "N/m", "stiffness", lower=0.0),
        Quantity("c", "N s/m", "viscous damping", lower=0.0),
        Quantity("alpha", "N/m", "hysteretic stiffness", lower=0.0),
        Quantity("A", "1", "slope of z at rest", lower=0.0),
        Quantity("beta", "1/m^n", "decay of z when loading and unloading", lower=0.0),
        Quantity("gamma", "1/m^n", "decay of z when loading, growth when unloading"),
        Quantity("n", "1", "smoothness of yielding", lower=1.0, upper=10.0),
        Quantity("F0", "N", "initial force"),
    ),
    force=force,
    rates=rates,
    source="Yu et al., Eqs 19 and 20; Tao et al., Eq 19",
    redundancy=Redundancy(
        "A", 1.0, ("alpha", "A", "beta", "gamma"),
        StateScaling(
            "gamma", {"A": 1.0, "beta": -1.0}, {"alpha": "N", "A": "1/m", "beta": "1/m"},
            _largest, _powers,
        ),
    ),
    plan=InPlan(plan_force, plan_rates, None),
    example={
        "k": (20000.0, 3000.0), "c": 300.0, "alpha": (40000.0, 10000.0), "A": 1.0,
        "beta": 5000.0, "gamma": (3000.0, -1000.0), "n": 1.7, "F0": 0.0,
    },
)  # fmt: skip
