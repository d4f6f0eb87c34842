"""Hybrid hyperbolic sine and Gaussian law of the MR elastomer isolator.

The printed law jumps by twice the Gaussian at every reversal of the velocity, which no integrator
can resolve. The sign of the velocity is therefore ``tanh(v / v_s)`` here. The smoothing velocity
``v_s`` is a parameter, 1 mm/s by default.

The default set is the mean of the paper's Tables 1-4, fitted again. The printed generalised model
has a misprint in the slope of beta, .0034. It is available as the set ``generalised_printed``.

In plan, the backbone acts along the deformation and grows with its length r. The loop's thickness
acts along the velocity v: ``gamma exp(-r^2 / (2 sigma^2)) tanh(|v| / v_s)``.
"""

from functools import partial
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial

from ..errors import InputError
from .current_dependence import CurrentDependence
from .device import Device
from .in_plan import length
from .law import InPlan, Law, Quantity, no_rates
from .published import (
    CURRENTS_A,
    YU,
    YU_ALPHA_N,
    YU_BETA_PER_MM,
    YU_DOUBTFUL,
    YU_GAMMA_N,
    YU_GENERALISED_PRINTED,
    YU_SIGMA_SQUARED_MM2,
)

SMOOTHING_VELOCITY = 1e-3
"""Default v_s in m/s."""


def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
    """Hyperbolic sine backbone plus a Gaussian loop thickness (Eq 30)."""
    alpha, beta, gamma, sigma_squared, F0, v_s = parameters
    thickness = gamma * np.exp(-(x**2) / (2 * sigma_squared))
    return alpha * np.sinh(beta * x) + thickness * np.tanh(v / v_s) + F0


def stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:
    """Energy of the backbone; cosh - 1 as a square, which keeps its digits near rest."""
    alpha, beta, _, _, F0, _ = parameters
    return 2 * alpha / beta * np.sinh(beta * x / 2) ** 2 + F0 * x


def plan_force(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Backbone along the deformation, loop thickness along the velocity; F0 is along x."""
    alpha, beta, gamma, sigma_squared, F0, v_s = parameters
    r, speed = length(x[0], x[1]), length(v[0], v[1])
    backbone = alpha * np.sinh(beta * r) / r
    thickness = gamma * np.exp(-(r**2) / (2 * sigma_squared)) * np.tanh(speed / v_s) / speed
    return backbone * x[0] + thickness * v[0] + F0, backbone * x[1] + thickness * v[1]


def plan_energy(x: tuple, states: tuple, parameters: tuple) -> Any:
    """Energy of the backbone."""
    alpha, beta, _, _, F0, _ = parameters
    return 2 * alpha / beta * np.sinh(beta * length(x[0], x[1]) / 2) ** 2 + F0 * x[0]


_SI = {"alpha": 1.0, "beta": 1e3, "gamma": 1.0, "sigma_squared": 1e-6}
_ADDED: dict[str, tuple[float, ...]] = {"F0": (0.0,), "v_s": (SMOOTHING_VELOCITY,)}
_TABLES = {
    "alpha": YU_ALPHA_N,
    "beta": YU_BETA_PER_MM,
    "gamma": YU_GAMMA_N,
    "sigma_squared": YU_SIGMA_SQUARED_MM2,
}


def _generalised(printed: dict[str, tuple[float, ...]], source: str) -> Device:
    rows = {name: tuple(_SI[name] * c for c in row) for name, row in printed.items()}
    return Device(
        law=LAW,
        current=CurrentDependence.polynomial(rows | _ADDED),
        # gamma's parabola peaks at 2.73-2.76 A: beyond the tested 3 A it only falls
        current_range=(0.0, 3.0),
        tested_deformation=8e-3,
        tested_current=3.0,
        source=source,
    )


def generalised_printed() -> Device:
    """Build the published model against the current, as printed (Eqs 26-29), misprint included."""
    return _generalised(YU_GENERALISED_PRINTED, f"{YU}, Eqs 26-29 as printed")


def generalised_refitted() -> Device:
    """The model that the paper describes: means of its Tables 1-4, fitted by least squares."""
    rows = {
        name: Polynomial.fit(
            CURRENTS_A, np.mean(list(table.values()), axis=0), len(YU_GENERALISED_PRINTED[name]) - 1
        ).convert()
        for name, table in _TABLES.items()
    }
    coefficients = {name: tuple(row.coef.tolist()) for name, row in rows.items()}
    return _generalised(coefficients, f"{YU}, Tables 1-4 averaged and refitted")


def condition(amplitude_mm: float, frequency_hz: float, current_A: float | None = None) -> Device:
    """Build the model identified for one loading condition (Tables 1-4)."""
    key = (float(amplitude_mm), float(frequency_hz))
    if key not in YU_ALPHA_N:
        raise InputError(
            f"no test at {amplitude_mm:g} mm, {frequency_hz:g} Hz; expected: 2, 4 or 8 mm and "
            "1, 2 or 4 Hz"
        )
    rows = {name: tuple(_SI[name] * c for c in table[key]) for name, table in _TABLES.items()}
    source = f"Yu et al., Tables 1-4: {key[0]:g} mm, {key[1]:g} Hz"
    if current_A is None:
        added = {name: value * len(CURRENTS_A) for name, value in _ADDED.items()}
        current = CurrentDependence.table(CURRENTS_A, rows | added)
        doubts = [YU_DOUBTFUL[*key, each] for each in CURRENTS_A if (*key, each) in YU_DOUBTFUL]
        source = "; ".join([source, *doubts])
        tested = (CURRENTS_A[0], CURRENTS_A[-1])
        return Device(LAW, current, tested, 1e-3 * key[0], tested[-1], source=source)
    if current_A not in CURRENTS_A:
        raise InputError(f"no test at {current_A:g} A; expected: 0, 1, 2 or 3 A")
    column = CURRENTS_A.index(current_A)
    constants: dict[str, tuple[float, ...]] = {name: (row[column],) for name, row in rows.items()}
    doubt = YU_DOUBTFUL.get((*key, float(current_A)))
    return Device(
        law=LAW,
        current=CurrentDependence.polynomial(constants | _ADDED),
        tested_deformation=1e-3 * key[0],
        source=f"{source}, {current_A:g} A" + (f"; {doubt}" if doubt else ""),
    )


LAW = Law(
    name="hybrid",
    title="Hybrid hyperbolic sine and Gaussian",
    parameters=(
        Quantity("alpha", "N", "backbone force", lower=0.0),
        Quantity("beta", "1/m", "backbone curvature", lower=0.0, divides=True),
        Quantity("gamma", "N", "half height of the loop at rest", lower=0.0),
        Quantity("sigma_squared", "m^2", "width of the loop, squared", lower=0.0, divides=True),
        Quantity("F0", "N", "initial force"),
        Quantity(
            "v_s", "m/s", "velocity that smooths the jump at reversal", lower=0.0, divides=True
        ),
    ),
    force=force,
    stored_energy=stored_energy,
    plan=InPlan(plan_force, no_rates, plan_energy),
    source="Yu et al., Eqs 5 and 30",
    sets={"generalised_refitted": generalised_refitted, "generalised_printed": generalised_printed},
    conditions={
        **{f"{A:g}mm_{f:g}Hz": partial(condition, A, f) for A, f in YU_ALPHA_N},
        **{
            f"{A:g}mm_{f:g}Hz_{current:g}A": partial(condition, A, f, current)
            for A, f in YU_ALPHA_N
            for current in CURRENTS_A
        },
    },
)
