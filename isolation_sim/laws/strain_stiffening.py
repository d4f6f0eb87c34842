"""Modified five-parameter strain-stiffening law of the MR elastomer isolator.

In plan, springs and dashpots act along vectors: the stiffening spring's force is ``alpha |z|^2 z``,
along its extension z, and grows with the length of z whatever the direction.
"""

from typing import Any

from .current_dependence import CurrentDependence
from .device import Device
from .law import InPlan, Law, Quantity, Spring
from .published import LI_LI, LI_LI_BASE_MODEL, LI_LI_GENERALISED, SI_LI_LI


def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
    """Add the standard solid branch and a cubic spring in series with a dashpot (Eq 11)."""
    y, z = states
    _, _, _, k1, alpha = parameters
    return k1 * y + alpha * z**3


def rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
    """Rates of both branches' spring extensions (Eqs 10 and 14)."""
    y, z = states
    c0, k0, c1, k1, alpha = parameters
    return v + (k0 * x - (k0 + k1) * y) / c0, v - alpha / c1 * z**3


def stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:
    """Energy of the three springs."""
    y, z = states
    _, k0, _, k1, alpha = parameters
    return k1 * y**2 / 2 + k0 * (x - y) ** 2 / 2 + alpha * z**4 / 4


def plan_force(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Both branches along vectors; the spring stiffens by the length of its extension."""
    y_x, z_x, y_y, z_y = states
    _, _, _, k1, alpha = parameters
    stiffness = alpha * (z_x**2 + z_y**2)
    return k1 * y_x + stiffness * z_x, k1 * y_y + stiffness * z_y


def plan_rates(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Rates of the extensions along x, then along y."""
    y_x, z_x, y_y, z_y = states
    c0, k0, c1, k1, alpha = parameters
    decay = alpha / c1 * (z_x**2 + z_y**2)
    return (
        v[0] + (k0 * x[0] - (k0 + k1) * y_x) / c0,
        v[0] - decay * z_x,
        v[1] + (k0 * x[1] - (k0 + k1) * y_y) / c0,
        v[1] - decay * z_y,
    )


def plan_energy(x: tuple, states: tuple, parameters: tuple) -> Any:
    """Energy of the three springs."""
    y_x, z_x, y_y, z_y = states
    _, k0, _, k1, alpha = parameters
    beside = (x[0] - y_x) ** 2 + (x[1] - y_y) ** 2
    return (k1 * (y_x**2 + y_y**2) + k0 * beside) / 2 + alpha * (z_x**2 + z_y**2) ** 2 / 4


def generalised() -> Device:
    """Build the published model of the laboratory isolator against the current (Table 2)."""
    alpha, slope = LI_LI_GENERALISED["alpha"]
    return Device(
        law=LAW,
        current=CurrentDependence.polynomial(
            {name: [SI_LI_LI[name] * c for c in row] for name, row in LI_LI_GENERALISED.items()}
        ),
        current_range=(0.0, -alpha / slope),
        tested_deformation=8e-3,
        tested_current=3.0,
        source=f"{LI_LI}, Table 2; tested at 0-3 A, 2-8 mm",
    )


def base_model() -> Device:
    """Build the base model of the paper's parameter study (Section 4.1)."""
    return Device(
        law=LAW,
        current=CurrentDependence.constant(
            {name: SI_LI_LI[name] * value for name, value in LI_LI_BASE_MODEL.items()}
        ),
        tested_deformation=8e-3,
        source=f"{LI_LI}, Section 4.1",
    )


LAW = Law(
    name="strain_stiffening",
    title="Strain stiffening (modified, five parameters)",
    states=(
        Quantity("y", "m", "extension of spring k1"),
        Quantity("z", "m", "extension of the strain-stiffening spring"),
    ),
    parameters=(
        Quantity("c0", "N s/m", "dashpot in parallel with spring k0", lower=0.0, divides=True),
        Quantity("k0", "N/m", "spring in parallel with dashpot c0", lower=0.0),
        Quantity(
            "c1", "N s/m", "dashpot in series with the stiffening spring", lower=0.0, divides=True
        ),
        Quantity("k1", "N/m", "spring in series with k0 and c0", lower=0.0),
        Quantity("alpha", "N/m^3", "strain-stiffening spring", lower=0.0),
    ),
    force=force,
    rates=rates,
    stored_energy=stored_energy,
    source="Li & Li, Eqs 10-14",
    springs=(
        Spring("k1", ("y",)),
        Spring("k0", ("x",), less="y"),
        Spring("alpha", ("z",), power=3.0),
    ),
    sets={"generalised": generalised, "base_model": base_model},
    plan=InPlan(plan_force, plan_rates, plan_energy),
)
