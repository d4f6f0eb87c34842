"""Standard solid of three parameters: a spring in series with a spring beside a dashpot.

``F = k1 y``, ``k1 y = k0 (x - y) + c0 (v - y')``. Complex stiffness
``k1 (k0 + i omega c0) / (k0 + k1 + i omega c0)``, at every amplitude.
"""

from typing import Any

from .current_dependence import CurrentDependence
from .device import Device
from .in_plan import each_direction
from .law import Law, Quantity, Spring
from .published import LI_LI, LI_LI_BASE_MODEL, SI_LI_LI


def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
    """Force of the series spring k1."""
    (y,) = states
    _, _, k1 = parameters
    return k1 * y


def rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
    """Rate of the series spring's extension (Eq 10)."""
    (y,) = states
    c0, k0, k1 = parameters
    return (v + (k0 * x - (k0 + k1) * y) / c0,)


def stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:
    """Energy of both springs."""
    (y,) = states
    _, k0, k1 = parameters
    return k1 * y**2 / 2 + k0 * (x - y) ** 2 / 2


def base_model() -> Device:
    """Build the upper branch of the base model of the paper's parameter study (Section 4.1)."""
    values = {name: SI_LI_LI[name] * LI_LI_BASE_MODEL[name] for name in LAW.parameter_names}
    return Device(
        law=LAW,
        current=CurrentDependence.constant(values),
        tested_deformation=8e-3,
        source=f"{LI_LI}, Section 4.1, upper branch",
    )


LAW = Law(
    name="standard_solid",
    title="Standard solid (three parameters)",
    states=(Quantity("y", "m", "extension of spring k1"),),
    parameters=(
        Quantity("c0", "N s/m", "dashpot in parallel with spring k0", lower=0.0, divides=True),
        Quantity("k0", "N/m", "spring in parallel with dashpot c0", lower=0.0),
        Quantity("k1", "N/m", "spring in series with k0 and c0", lower=0.0),
    ),
    force=force,
    rates=rates,
    stored_energy=stored_energy,
    source="Li & Li, Eqs 9 and 10",
    springs=(Spring("k1", ("y",)), Spring("k0", ("x",), less="y")),
    sets={"base_model": base_model},
    plan=each_direction(force, rates, stored_energy, n_states=1),
)
