"""Spring and dashpot side by side."""

from typing import Any

from .in_plan import each_direction
from .law import Law, Quantity, Spring


def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
    """Spring force plus viscous force."""
    k, c = parameters
    return k * x + c * v


def stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:
    """Energy of the spring."""
    k, _ = parameters
    return k * x**2 / 2


LAW = Law(
    name="kelvin_voigt",
    title="Kelvin-Voigt (spring and dashpot in parallel)",
    parameters=(
        Quantity("k", "N/m", "stiffness", lower=0.0),
        Quantity("c", "N s/m", "viscous damping", lower=0.0),
    ),
    force=force,
    stored_energy=stored_energy,
    source="Kelvin, Voigt",
    springs=(Spring("k", ("x",)),),
    plan=each_direction(force, stored_energy=stored_energy),
    example={"k": (20000.0, 3000.0), "c": 800.0},
)
