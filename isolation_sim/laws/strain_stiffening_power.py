"""Modified strain-stiffening law whose stiffening spring has the general odd power of Eq 7.

``F = k1 y + f(z)``, ``k1 y = k0 (x - y) + c0 (v - y')``, ``z' = v - f(z) / c1`` with
``f(z) = alpha sign(z) |z / 1 mm|^p``. Both cases of Eq 7 are ``sign(x) |x|^(n/m)``: for odd n and m
``x^(n/m)`` is odd, and for even n ``|x| x^((n - m) / m)`` is odd.

``alpha`` is the force of the spring at 1 mm, in N, which equals the paper's number in N/mm^p. Its
size depends little on ``p`` in a fit, unlike that of a coefficient in N/m^p.

In plan, springs and dashpots act along vectors. The stiffening spring has the force
``alpha (|z| / 1 mm)^p`` along its extension z.
"""

from typing import Any

from ..errors import InputError
from .current_dependence import CurrentDependence
from .device import Device
from .law import InPlan, Law, Quantity, Spring
from .published import LI_LI, LI_LI_BASE_MODEL, LI_LI_GENERALISED, SI_LI_LI
from .strain_stiffening import LAW as CUBIC

REFERENCE = 1e-3
"""Extension in m at which ``alpha`` is the force."""

# keeps log(0) and 0^(p - 3) out of derivatives at rest; changes no value above 1e-148
_TINY = 1e-300


def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
    """Add the standard solid branch and the stiffening branch (Eqs 7 and 11)."""
    y, z = states
    _, _, _, k1, alpha, p = parameters
    return k1 * y + _spring(z, alpha, p)


def rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
    """Rates of both branches' spring extensions (Eqs 10 and 14)."""
    y, z = states
    c0, k0, c1, k1, alpha, p = parameters
    return v + (k0 * x - (k0 + k1) * y) / c0, v - _spring(z, alpha, p) / c1


def stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:
    """Energy of the three springs."""
    y, z = states
    _, k0, _, k1, alpha, p = parameters
    stiffening = _spring(z, alpha, p) * z / (p + 1)
    return k1 * y**2 / 2 + k0 * (x - y) ** 2 / 2 + stiffening


def plan_force(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Both branches along vectors; the spring stiffens by the length of its extension."""
    y_x, z_x, y_y, z_y = states
    _, _, _, k1, alpha, p = parameters
    stiffness = _plan_stiffness(z_x, z_y, alpha, p)
    return k1 * y_x + stiffness * z_x, k1 * y_y + stiffness * z_y


def plan_rates(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Rates of the extensions along x, then along y."""
    y_x, z_x, y_y, z_y = states
    c0, k0, c1, k1, alpha, p = parameters
    decay = _plan_stiffness(z_x, z_y, alpha, p) / c1
    return (
        v[0] + (k0 * x[0] - (k0 + k1) * y_x) / c0,
        v[0] - decay * z_x,
        v[1] + (k0 * x[1] - (k0 + k1) * y_y) / c0,
        v[1] - decay * z_y,
    )


def plan_energy(x: tuple, states: tuple, parameters: tuple) -> Any:
    """Energy of the three springs."""
    y_x, z_x, y_y, z_y = states
    _, k0, _, k1, alpha, p = parameters
    beside = (x[0] - y_x) ** 2 + (x[1] - y_y) ** 2
    stiffening = _plan_stiffness(z_x, z_y, alpha, p) * (z_x**2 + z_y**2) / (p + 1)
    return (k1 * (y_x**2 + y_y**2) + k0 * beside) / 2 + stiffening


def _plan_stiffness(z_x: Any, z_y: Any, alpha: Any, p: Any) -> Any:
    squared = (z_x**2 + z_y**2) / REFERENCE**2
    return alpha / REFERENCE * (squared + _TINY) ** ((p - 1) / 2)


def _spring(z: Any, alpha: Any, p: Any) -> Any:
    ratio = z / REFERENCE
    return alpha * ratio * (ratio * ratio + _TINY) ** ((p - 1) / 2)


_SI = {name: SI_LI_LI[name] for name in ("c0", "k0", "c1", "k1")} | {"alpha": 1.0, "p": 1.0}


def power(n: int, m: int) -> float:
    """Exponent of Eq 7, refused where the equation does not define a spring."""
    whole = all(isinstance(number, int) for number in (n, m))
    if not whole or m < 1 or m % 2 == 0 or n < m:
        raise InputError(f"power {n!r}/{m!r}; expected: integers n >= m >= 1 with m odd (Eq 7)")
    return n / m


def generalised() -> Device:
    """Build the published model of the laboratory isolator (Table 2), which has p = 3."""
    alpha, slope = LI_LI_GENERALISED["alpha"]
    rows = LI_LI_GENERALISED | {"p": (3.0,)}
    return Device(
        law=LAW,
        current=CurrentDependence.polynomial(
            {name: [_SI[name] * c for c in row] for name, row in rows.items()}
        ),
        current_range=(0.0, -alpha / slope),
        tested_deformation=8e-3,
        tested_current=3.0,
        source=f"{LI_LI}, Table 2; tested at 0-3 A, 2-8 mm",
    )


def base_model(n: int = 3, m: int = 1) -> Device:
    """Build the base model of the paper's parameter study (Section 4.1) with any power."""
    values = LI_LI_BASE_MODEL | {"p": power(n, m)}
    return Device(
        law=LAW,
        current=CurrentDependence.constant({name: _SI[name] * v for name, v in values.items()}),
        tested_deformation=8e-3,
        source=f"{LI_LI}, Section 4.1, power {n}/{m}",
    )


LAW = Law(
    name="strain_stiffening_power",
    title="Strain stiffening (modified, any odd power)",
    states=CUBIC.states,
    parameters=(
        *CUBIC.parameters[:4],
        Quantity("alpha", "N", "force of the strain-stiffening spring at 1 mm", lower=0.0),
        Quantity("p", "1", "power n/m of the strain-stiffening spring", lower=1.0, upper=15.0),
    ),
    force=force,
    rates=rates,
    stored_energy=stored_energy,
    source="Li & Li, Eqs 7 and 10-14",
    springs=(*CUBIC.springs[:2], Spring("alpha", ("z",), power="p")),
    sets={"generalised": generalised, "base_model": base_model},
    plan=InPlan(plan_force, plan_rates, plan_energy),
)
