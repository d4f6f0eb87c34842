"""Maxwell law: spring and dashpot in series.

``F = k y``, ``y' = v - k y / c``. Complex stiffness ``k i omega c / (k + i omega c)``.
"""

from typing import Any

from .in_plan import each_direction
from .law import Law, Quantity, Spring


def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
    """Force of the spring, which is also that of the dashpot."""
    (y,) = states
    k, _ = parameters
    return k * y


def rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
    """Rate of the spring's extension: the velocity minus that of the dashpot."""
    (y,) = states
    k, c = parameters
    return (v - k * y / c,)


def stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:
    """Energy of the spring."""
    (y,) = states
    k, _ = parameters
    return k * y**2 / 2


LAW = Law(
    name="maxwell",
    title="Maxwell (spring and dashpot in series)",
    states=(Quantity("y", "m", "extension of the spring"),),
    parameters=(
        Quantity("k", "N/m", "stiffness", lower=0.0),
        Quantity("c", "N s/m", "viscous damping", lower=0.0, divides=True),
    ),
    force=force,
    rates=rates,
    stored_energy=stored_energy,
    source="Maxwell",
    springs=(Spring("k", ("y",)),),
    plan=each_direction(force, rates, stored_energy, n_states=1),
    example={"k": (20000.0, 3000.0), "c": 800.0},
)
