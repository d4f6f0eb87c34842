"""Spring with a cubic part beside a dashpot: ``F = k x + k3 x^3 + c v``."""

from typing import Any

from isolation_sim.laws.law import Law, Quantity, Spring


def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
    """Spring, stiffening spring and viscous force."""
    k, k3, c = parameters
    return k * x + k3 * x**3 + c * v


def stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:
    """Energy of both springs."""
    k, k3, _ = parameters
    return k * x**2 / 2 + k3 * x**4 / 4


LAW = Law(
    name="cubic",
    title="Cubic spring beside a dashpot",
    parameters=(
        Quantity("k", "N/m", "stiffness about rest", lower=0.0),
        Quantity("k3", "N/m^3", "growth of the stiffness", lower=0.0),
        Quantity("c", "N s/m", "viscous damping", lower=0.0),
    ),
    force=force,
    stored_energy=stored_energy,
    source="Duffing",
    springs=(Spring("k", ("x",)), Spring("k3", ("x",), power=3.0)),
    example={"k": (2000.0, 300.0), "k3": 1e7, "c": 100.0},
)
