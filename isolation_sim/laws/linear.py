"""Linear spring."""

from typing import Any

from .in_plan import each_direction
from .law import Law, Quantity, Spring


def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
    """Hooke's law."""
    (k,) = parameters
    return k * x


def stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:
    """Energy of the spring."""
    (k,) = parameters
    return k * x**2 / 2


LAW = Law(
    name="linear",
    title="Linear spring",
    parameters=(Quantity("k", "N/m", "stiffness", lower=0.0),),
    force=force,
    stored_energy=stored_energy,
    source="Hooke",
    springs=(Spring("k", ("x",)),),
    plan=each_direction(force, stored_energy=stored_energy),
    example={"k": (20000.0, 3000.0)},
)
