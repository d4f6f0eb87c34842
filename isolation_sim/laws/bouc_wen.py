"""Conventional Bouc-Wen law.

``F = k x + c v + alpha z + F0``, ``z' = A v - beta |v| |z|^(n-1) z - gamma v |z|^n``.

Scaling z moves a factor between A, alpha, beta and gamma: one of them is redundant, so hold one
(A = 1, for one) when fitting. From rest z stays within ``(A / (beta + gamma))^(1/n)`` as long as
beta + gamma > 0; otherwise it grows without bound under loading. Where gamma > beta, a state beyond
``(A / (gamma - beta))^(1/n)`` runs away in finite time; only a current that changes A, beta or
gamma can put it there.

No stored energy: ``alpha z^2 / (2 A)`` is one where ``|gamma| <= beta``, but elsewhere within the
bounds it gives energy back that was never there, and the true one has no closed form for every n
(see ``improved_bouc_wen`` for n = 2).
"""

from typing import Any

import numpy as np

from .law import Law, Quantity, Redundancy

# keeps log(0) and 0^(n - 2) out of derivatives at rest; changes no value above 1e-148
_TINY = 1e-300


def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
    """Spring, dashpot and hysteretic force (002 Eq 19, 001 Eq 19 with F0 = 0)."""
    (z,) = states
    k, c, alpha, _, _, _, _, F0 = parameters
    return k * x + c * v + alpha * z + F0


def rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
    """Rate of the hysteretic variable (002 Eq 20)."""
    (z,) = states
    _, _, _, A, beta, gamma, n, _ = parameters
    # |z|^(n-1), so written that its derivatives need no second power
    shape = np.exp((n - 1) / 2 * np.log(z * z + _TINY))
    return (A * v - (beta * np.fabs(v) * z + gamma * v * np.fabs(z)) * shape,)


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
    redundancy=Redundancy("A", 1.0, ("alpha", "A", "beta", "gamma")),
)
