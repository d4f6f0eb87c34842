"""Phenomenological model of an MR damper of Spencer, Dyke, Sain and Carlson.

``F = c1 y' + k1 (x - x0)``, ``c1 y' = F_y w + c0 (v - y') + k0 (x - y)``: a Bouc-Wen element with
spring and dashpot, in series with a dashpot c1 that rounds the force at low speed, beside the
accumulator's spring k1. The Bouc-Wen element is in normalised form (``normalised_bouc_wen``).
"""

from typing import Any

from . import normalised_bouc_wen
from .law import Law, Quantity


def _inner_velocity(x: Any, v: Any, y: Any, w: Any, k0: Any, c0: Any, c1: Any, F_y: Any) -> Any:
    return (F_y * w + c0 * v + k0 * (x - y)) / (c0 + c1)


def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
    """Force of the series dashpot and of the accumulator (Spencer et al. 1997, Eq 11)."""
    y, w = states
    k0, c0, k1, c1, x0, F_y, _, _, _ = parameters
    return c1 * _inner_velocity(x, v, y, w, k0, c0, c1, F_y) + k1 * (x - x0)


def rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
    """Rates of the inner displacement and of the hysteretic variable (Eqs 9 and 10)."""
    y, w = states
    k0, c0, _, c1, _, F_y, rho, sigma, n = parameters
    inner = _inner_velocity(x, v, y, w, k0, c0, c1, F_y)
    return inner, normalised_bouc_wen.rate(v - inner, w, rho, sigma, n)


def stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:
    """Energy of both springs and of the hysteretic element."""
    y, w = states
    k0, _, k1, _, x0, F_y, rho, _, _ = parameters
    springs = k0 * (x - y) ** 2 / 2 + k1 * (x - x0) ** 2 / 2
    return springs + normalised_bouc_wen.energy(w, F_y, rho)


LAW = Law(
    name="spencer",
    title="Spencer's phenomenological model",
    states=(Quantity("y", "m", "extension of dashpot c1"), normalised_bouc_wen.STATE),
    parameters=(
        Quantity("k0", "N/m", "stiffness beside the hysteretic element", lower=0.0),
        Quantity("c0", "N s/m", "viscous damping at large velocity", lower=0.0),
        Quantity("k1", "N/m", "stiffness of the accumulator", lower=0.0),
        Quantity("c1", "N s/m", "dashpot in series, at low velocity", lower=0.0, divides=True),
        Quantity("x0", "m", "deformation at which the accumulator is relaxed"),
        *normalised_bouc_wen.PARAMETERS,
    ),
    force=force,
    rates=rates,
    stored_energy=stored_energy,
    source="Spencer et al. (1997), Eqs 9-11; Ikhouane & Rodellar (2007)",
    example={
        "k0": (10000.0, 2000.0), "c0": (600.0, 100.0), "k1": 2000.0, "c1": (4000.0, 500.0),
        "x0": 0.0, "F_y": (150.0, 80.0), "rho": 900.0, "sigma": 0.6, "n": 1.8,
    },
)  # fmt: skip
