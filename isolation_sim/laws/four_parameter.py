"""Standard solid beside a strain-stiffening spring: four parameters.

``F = k1 y + alpha x^3``, ``k1 y = k0 (x - y) + c0 (v - y')``. The stiffening spring has no dashpot
in series. The loop therefore stiffens at a fixed deformation for every amplitude. In plan its force
is ``alpha r^2`` times the deformation, with the radial deformation r.
"""

from typing import Any

from .current_dependence import CurrentDependence
from .device import Device
from .law import InPlan, Law, Quantity, Spring
from .published import LI_LI, LI_LI_BASE_MODEL, SI_LI_LI
from .standard_solid import LAW as STANDARD_SOLID


def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
    """Add the standard solid branch and a cubic spring (Eq 8)."""
    (y,) = states
    _, _, k1, alpha = parameters
    return k1 * y + alpha * x**3


def rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
    """Rate of the series spring's extension (Eq 10)."""
    (y,) = states
    c0, k0, k1, _ = parameters
    return (v + (k0 * x - (k0 + k1) * y) / c0,)


def stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:
    """Energy of the three springs."""
    (y,) = states
    _, k0, k1, alpha = parameters
    return k1 * y**2 / 2 + k0 * (x - y) ** 2 / 2 + alpha * x**4 / 4


def plan_force(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """The same along vectors; the spring stiffens by the radial deformation."""
    _, _, k1, alpha = parameters
    stiffness = alpha * (x[0] ** 2 + x[1] ** 2)
    return tuple(k1 * y + stiffness * u for u, y in zip(x, states, strict=True))


def plan_rates(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Rates of the series spring's extension along x and y."""
    c0, k0, k1, _ = parameters
    along = zip(x, v, states, strict=True)
    return tuple(w + (k0 * u - (k0 + k1) * y) / c0 for u, w, y in along)


def plan_energy(x: tuple, states: tuple, parameters: tuple) -> Any:
    """Energy of the three springs."""
    _, k0, k1, alpha = parameters
    both = zip(x, states, strict=True)
    linear = sum(k1 * y**2 + k0 * (u - y) ** 2 for u, y in both)
    return linear / 2 + alpha * (x[0] ** 2 + x[1] ** 2) ** 2 / 4


def base_model() -> Device:
    """Build the base model of the paper's parameter study (Section 4.1) without its dashpot c1."""
    values = {name: SI_LI_LI[name] * LI_LI_BASE_MODEL[name] for name in LAW.parameter_names}
    return Device(
        law=LAW,
        current=CurrentDependence.constant(values),
        tested_deformation=8e-3,
        source=f"{LI_LI}, Section 4.1, without c1",
    )


LAW = Law(
    name="four_parameter",
    title="Strain stiffening (four parameters)",
    states=STANDARD_SOLID.states,
    parameters=(
        *STANDARD_SOLID.parameters,
        Quantity("alpha", "N/m^3", "strain-stiffening spring", lower=0.0),
    ),
    force=force,
    rates=rates,
    stored_energy=stored_energy,
    source="Li & Li, Eqs 8-10",
    springs=(*STANDARD_SOLID.springs, Spring("alpha", ("x",), power=3.0)),
    sets={"base_model": base_model},
    plan=InPlan(plan_force, plan_rates, plan_energy),
)
