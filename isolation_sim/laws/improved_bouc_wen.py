"""Improved nine-parameter Bouc-Wen law of the magnetorheological fluid-elastomer isolator.

Deformation x is positive in extension:

    F = (1 - eps(x)) k x + f(x, v) c v + theta z,   eps = d for x >= 0, else 0
    z' = alpha v - beta |v| |z| z - gamma v |z|^2
    f = min(1, max(0, O (W - x)))      for v < 0
    f = min(1, max(0, O (W' + x)))     for v >= 0,   W' = (1 - d) W

which is the corrected Eq 22 with one line per direction. The damping vanishes when the deformation
returns from beyond W, and develops again over the length 1/O. W is printed in mm, and O in N/m
although it is 1/m. Theta is a force, and alpha, beta, gamma are 1/m. A scale factor of z moves
between alpha, theta and beta, gamma. One of the four is redundant: fix one in a fit.

The state here is ``w = z / z_m``, ``z_m = (alpha / (beta + gamma))^(1/2)``, which stays within -1
to 1. At a constant current this is equivalent. When the current changes, w is continuous and not z.
With a continuous z, a state of 0.31 (the yield value at 0 A) would be beyond 0.105 at 0.5 A, where
z diverges in finite time because Table 4 has gamma > beta.

The stored energy is that of the springs, ``(1 - eps) k x^2 / 2``, and the work returned by
unloading to z = 0, ``theta / (2 (beta - gamma)) log(1 + (beta - gamma) z^2 / alpha)``. Loading
dissipates ``2 beta theta |z|^3 |v| / (alpha + (beta - gamma) z^2)``. Unloading dissipates nothing.
(The usual ``theta z^2 / (2 alpha)`` is not a stored energy if gamma > beta.)

The stiffness has a corner at x = 0. The law linearised at rest is that of extension.

In plan the device extends along x. Between extension and compression the loss of stiffness
follows the angle a of the deformation, ``eps = d (1 + cos a) / 2``, and so does W with the angle b
of the velocity, ``W (1 - d (1 + cos b) / 2)``. Both interpolations are ours: along x the law is
exactly the one above, along y it has the mean stiffness. The spring is the gradient of
``(1 - eps) k r^2 / 2``, the damping acts along the velocity and goes by the deformation along it,
and w follows the form of Park, Wen and Ang with the product of the vectors (see ``bouc_wen``).
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .current_dependence import CurrentDependence
from .device import Device
from .in_plan import length
from .law import InPlan, Law, Quantity, Redundancy, StateScaling
from .published import TAO, TAO_CURRENTS_A, TAO_IMPROVED

# keeps 0/0 out of log1p(u) / u; changes no value above 1e-284
_TINY = 1e-300


def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
    """Asymmetric spring, stepped damping and hysteretic force (Eqs 21-23 mended)."""
    (w,) = states
    alpha, beta, gamma, theta, k, c, d, W, O = parameters  # noqa: E741
    forward = v >= 0
    reach = O * (forward * ((1 - d) * W + x) + (1 - forward) * (W - x))
    step = reach * (reach > 0) * (reach < 1) + (reach >= 1)
    yielded = theta * np.sqrt(alpha / (beta + gamma))
    return _stiffness(x, k, d) * x + step * c * v + yielded * w


def rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
    """Rate of the hysteretic variable over its yield value."""
    (w,) = states
    alpha, beta, gamma, *_ = parameters
    shape = (beta * np.fabs(v) * w + gamma * v * np.fabs(w)) / (beta + gamma)
    return (np.sqrt(alpha * (beta + gamma)) * (v - shape * np.fabs(w)),)


def stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:
    """Energy of the spring, and the energy returned by unloading the hysteretic element."""
    *_, k, _, d, _, _ = parameters
    return _stiffness(x, k, d) * x**2 / 2 + _hysteretic_energy(states[0], parameters)


def plan_force(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Asymmetric spring, stepped damping along the velocity, hysteretic force."""
    alpha, beta, gamma, theta, k, c, d, W, O = parameters  # noqa: E741
    r, speed = length(x[0], x[1]), length(v[0], v[1])
    reach = O * (W * (1 - d * (1 + v[0] / speed) / 2) + (x[0] * v[0] + x[1] * v[1]) / speed)
    damping = c * (reach * (reach > 0) * (reach < 1) + (reach >= 1))
    yielded = theta * np.sqrt(alpha / (beta + gamma))
    along = k * (1 - d / 2 - d * x[0] / (4 * r))
    return (
        along * x[0] - d / 4 * k * r + damping * v[0] + yielded * states[0],
        along * x[1] + damping * v[1] + yielded * states[1],
    )


def plan_rates(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Rate of the hysteretic vector over its yield value."""
    w_x, w_y = states
    alpha, beta, gamma, *_ = parameters
    loading = v[0] * w_x + v[1] * w_y
    decay = (beta * np.fabs(loading) + gamma * loading) / (beta + gamma)
    slope = np.sqrt(alpha * (beta + gamma))
    return slope * (v[0] - decay * w_x), slope * (v[1] - decay * w_y)


def plan_energy(x: tuple, states: tuple, parameters: tuple) -> Any:
    """Energy of the spring, and the energy returned by unloading the hysteretic element."""
    *_, k, _, d, _, _ = parameters
    r, size = length(x[0], x[1]), length(states[0], states[1])
    spring = k * ((1 - d / 2) * r**2 - d / 2 * r * x[0]) / 2
    return spring + _hysteretic_energy(size, parameters)


def _hysteretic_energy(w: Any, parameters: tuple) -> Any:
    _, beta, gamma, theta, *_ = parameters
    u = (beta - gamma) / (beta + gamma) * w**2
    u = u + (u == 0) * _TINY
    return theta * w**2 / (2 * (beta + gamma)) * np.log1p(u) / u


def _stiffness(x: Any, k: Any, d: Any) -> Any:
    return k * (1 - d * (x >= 0))


def _largest(values: Mapping[str, NDArray]) -> NDArray:
    """Largest z from rest."""
    return np.sqrt(values["alpha"] / np.maximum(values["beta"] + values["gamma"], _TINY))


def _powers(values: Mapping[str, NDArray]) -> dict[str, Any]:
    """Powers of a factor on z in each parameter."""
    return {"alpha": 1, "beta": -1, "gamma": -1, "theta": -1}


def table_4() -> Device:
    """Build the identified model, linearly interpolated between its six currents (Table 4)."""
    rows = TAO_IMPROVED | {"W": tuple(1e-3 * value for value in TAO_IMPROVED["W"])}
    return Device(
        law=LAW,
        current=CurrentDependence.table(TAO_CURRENTS_A, rows),
        current_range=(TAO_CURRENTS_A[0], TAO_CURRENTS_A[-1]),
        tested_deformation=1e-3,
        tested_current=TAO_CURRENTS_A[-1],
        source=f"{TAO}, Table 4; identified at 1 mm, 0.5 Hz",
    )


LAW = Law(
    name="improved_bouc_wen",
    title="Improved Bouc-Wen (nine parameters)",
    states=(Quantity("w", "1", "hysteretic variable over its yield value"),),
    parameters=(
        Quantity("alpha", "1/m", "slope of z at rest", lower=0.0, divides=True),
        Quantity("beta", "1/m", "decay of z when loading and unloading", lower=0.0, divides=True),
        Quantity("gamma", "1/m", "decay of z when loading, growth when unloading", lower=0.0),
        Quantity("theta", "N", "hysteretic force at z = 1", lower=0.0),
        Quantity("k", "N/m", "stiffness in compression", lower=0.0),
        Quantity("c", "N s/m", "viscous damping", lower=0.0),
        Quantity("d", "1", "share of the stiffness lost in extension", lower=0.0, upper=1.0),
        Quantity("W", "m", "deformation from which return is undamped", lower=0.0),
        Quantity("O", "1/m", "inverse length over which damping comes back", lower=0.0),
    ),
    force=force,
    rates=rates,
    stored_energy=stored_energy,
    plan=InPlan(plan_force, plan_rates, plan_energy),
    source="Tao et al., Eqs 20-23 mended",
    redundancy=Redundancy(
        "alpha",
        1e3,
        ("alpha", "beta", "gamma", "theta"),
        StateScaling("alpha", {"beta": 1.0, "gamma": 1.0}, {}, _largest, _powers),
    ),
    sets={"table_4": table_4},
)
