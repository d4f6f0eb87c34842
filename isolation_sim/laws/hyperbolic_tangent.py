"""Hyperbolic tangent law of an MR damper, of Kwok and others.

``F = k x + c v + alpha tanh(beta v + delta sign(x)) + F0``. The jump at x = 0 is smoothed over the
length x_s, a declared parameter: ``tanh(delta sign(x))`` is ``h = tanh(delta) tanh(x / x_s)`` here,
and the addition theorem gives ``tanh(beta v + arctanh h)``. The law has no internal state. At rest
alpha h is a spring and gives its energy back; the part of the velocity always dissipates.
"""

from typing import Any

import numpy as np

from .law import Law, Quantity


def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
    """Spring, dashpot and saturating force (Kwok et al. 2006, Eqs 6 and 7)."""
    k, c, alpha, beta, delta, x_s, F0 = parameters
    h = np.tanh(delta) * np.tanh(x / x_s)
    t = np.tanh(beta * v)
    return k * x + c * v + alpha * (t + h) / (1 + t * h) + F0


def stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:
    """Energy of the spring and of the saturating force at rest."""
    k, _, alpha, _, delta, x_s, F0 = parameters
    # log cosh that does not overflow
    size = np.fabs(x / x_s)
    log_cosh = size + np.log1p(np.exp(-2 * size)) - np.log(2.0)
    return k * x**2 / 2 + alpha * np.tanh(delta) * x_s * log_cosh + F0 * x


LAW = Law(
    name="hyperbolic_tangent",
    title="Hyperbolic tangent",
    parameters=(
        Quantity("k", "N/m", "stiffness", lower=0.0),
        Quantity("c", "N s/m", "viscous damping", lower=0.0),
        Quantity("alpha", "N", "force at which the hysteretic part saturates", lower=0.0),
        Quantity("beta", "s/m", "slope of the hysteretic part against the velocity", lower=0.0),
        # tanh(5) is 1 to four digits: beyond it the width of the loop no longer changes
        Quantity("delta", "1", "width of the hysteretic part", lower=0.0, upper=5.0),
        Quantity("x_s", "m", "length that smooths the jump at x = 0", lower=0.0, divides=True),
        Quantity("F0", "N", "initial force"),
    ),
    force=force,
    stored_energy=stored_energy,
    source="Kwok et al. (2006), Eqs 6 and 7",
    example={
        "k": (2000.0, 300.0), "c": 600.0, "alpha": (150.0, 80.0), "beta": 60.0, "delta": 0.8,
        "x_s": 0.001, "F0": 0.0,
    },
)  # fmt: skip
