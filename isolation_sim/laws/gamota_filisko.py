"""Bingham body with viscoelastic arms, of Gamota and Filisko.

In series: a Bingham body (friction F_c beside a dashpot c0), a spring k1 beside a dashpot c1, and a
spring k2. The force is that of the spring k2; below F_c the Bingham body is rigid. Written with
the springs' extensions as states, the body's velocity follows from the force,
``(|F| - F_c) sign(F) / c0`` where ``|F| > F_c``, so that nothing jumps.
"""

from typing import Any

import numpy as np

from .law import Law, Quantity


def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
    """Force of the series spring k2."""
    _, e2 = states
    _, _, k2, _, _, F0 = parameters
    return k2 * e2 + F0


def rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
    """Rates of the springs' extensions: the three bodies share the velocity (Eqs 8-10)."""
    e1, e2 = states
    k1, c1, k2, F_c, c0, _ = parameters
    carried = k2 * e2
    arm = (carried - k1 * e1) / c1
    flow = (carried - (np.fabs(carried + F_c) - np.fabs(carried - F_c)) / 2) / c0
    return arm, v - arm - flow


def stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:
    """Energy of both springs."""
    e1, e2 = states
    k1, _, k2, _, _, F0 = parameters
    return k1 * e1**2 / 2 + k2 * e2**2 / 2 + F0 * x


LAW = Law(
    name="gamota_filisko",
    title="Bingham body with viscoelastic arms",
    states=(
        Quantity("e1", "m", "extension of spring k1"),
        Quantity("e2", "m", "extension of spring k2"),
    ),
    parameters=(
        Quantity("k1", "N/m", "spring in parallel with dashpot c1", lower=0.0),
        Quantity("c1", "N s/m", "dashpot in parallel with spring k1", lower=0.0, divides=True),
        Quantity("k2", "N/m", "spring in series", lower=0.0),
        Quantity("F_c", "N", "yield force of the Bingham body", lower=0.0),
        Quantity("c0", "N s/m", "dashpot of the Bingham body", lower=0.0, divides=True),
        Quantity("F0", "N", "initial force"),
    ),
    force=force,
    rates=rates,
    stored_energy=stored_energy,
    source="Gamota & Filisko (1991)",
    example={
        "k1": (20000.0, 3000.0), "c1": 900.0, "k2": (50000.0, 10000.0), "F_c": (60.0, 20.0),
        "c0": 700.0, "F0": 0.0,
    },
)  # fmt: skip
