"""Fractional viscoelasticity: a spring-pot, as a sum of Maxwell branches.

The spring-pot's complex stiffness is ``k (i f / 1 Hz)^a``: stiffness and loss grow with the same
weak power of the frequency, and their ratio ``tan(a pi / 2)`` is constant, much as measured
elastomers do. From

    (i omega)^a = sin(a pi) / pi * integral over s of e^(a s) i omega / (i omega + e^s)

the trapezoidal rule over ``e^s = 2 pi e^(j h)``, j = -3..3, gives seven Maxwell branches; what lies
below them acts as a spring and what lies above as a dashpot, both again from the integral:

    F = k sin(a pi) / pi * (e^(-a b) / a x + e^((a - 1) b) / (1 - a) v / (2 pi)
                            + sum h e^(a j h) q_j),       q_j' = v - 2 pi e^(j h) q_j

Every coefficient is positive for 0 < a < 1, so the approximation is passive for each exponent.
With h and b chosen for it, the complex stiffness is wrong by at most 0.95 % from 0.02 to 50 Hz for
every exponent within the bounds (test: ``test_spring_pot``). Outside it turns into a spring below
and a dashpot above. Not in the papers; for comparison.
"""

from typing import Any

import numpy as np

from .in_plan import each_direction
from .law import Law, Quantity, Spring

BAND_HZ = (0.02, 50.0)
"""Frequencies within which the approximation holds."""

WORST_ERROR = 0.0095
"""Largest relative error of the complex stiffness within ``BAND_HZ``, over all exponents."""

_STEP = 1.7563796
_END = (3 + 0.5267) * _STEP
_BRANCHES = tuple(float(j * _STEP) for j in range(-3, 4))
_DECAYS = tuple(float(2 * np.pi * np.exp(s)) for s in _BRANCHES)


def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
    """Spring, dashpot and seven Maxwell branches."""
    k, a = parameters
    spring, dashpot, branches = _coefficients(k, a)
    total = spring * x + dashpot * v
    for stiffness, q in zip(branches, states, strict=True):
        total = total + stiffness * q
    return total


def rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
    """Rates of the branches' spring extensions."""
    return tuple(v - decay * q for decay, q in zip(_DECAYS, states, strict=True))


def stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:
    """Energy of the eight springs."""
    k, a = parameters
    spring, _, branches = _coefficients(k, a)
    total = spring * x**2 / 2
    for stiffness, q in zip(branches, states, strict=True):
        total = total + stiffness * q**2 / 2
    return total


def _coefficients(k: Any, a: Any) -> tuple:
    """Spring (N/m), dashpot (N s/m) and the branches' springs (N/m)."""
    scale = k * np.sin(np.pi * a) / np.pi
    spring = scale * np.exp(-a * _END) / a
    dashpot = scale * np.exp((a - 1) * _END) / (1 - a) / (2 * np.pi)
    return spring, dashpot, tuple(scale * _STEP * np.exp(a * s) for s in _BRANCHES)


LAW = Law(
    name="spring_pot",
    title="Spring-pot (fractional, seven Maxwell branches)",
    states=tuple(Quantity(f"q{j}", "m", f"extension of branch {j}'s spring") for j in range(1, 8)),
    parameters=(
        Quantity("k", "N/m", "modulus of the complex stiffness at 1 Hz", lower=0.0),
        Quantity("a", "1", "exponent (0 a spring, 1 a dashpot)", lower=0.01, upper=0.99),
    ),
    force=force,
    rates=rates,
    stored_energy=stored_energy,
    plan=each_direction(force, rates, stored_energy, n_states=7),
    source="fractional power by the trapezoidal rule over its relaxation spectrum",
    springs=(Spring("k", ("x", *(f"q{j}" for j in range(1, 8)))),),
    example={"k": (20000.0, 3000.0), "a": (0.1, 0.05)},
)
