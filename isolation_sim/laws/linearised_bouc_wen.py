"""Linearised Bouc-Wen law of an MR elastomer in shear.

``F = k1 x + C v + k2 z``, ``z' = C_e v - k_e z``, with k_e >= 0. The paper writes ``+ k_e z`` and
prints positive k_e throughout: its transfer function

    F/x = k1 + k2 i omega C_e / (i omega - k_e) + i omega C

has the storage stiffness ``k1 + k2 C_e omega^2 / (omega^2 + k_e^2)`` and the loss stiffness
``omega (C - k2 k_e C_e / (omega^2 + k_e^2))`` (Eqs 9-11 print other denominators), but in time z
would grow without bound. The law uses -k_e. This keeps the storage stiffness and changes the sign
of the second term of the loss stiffness. ``published_stiffness`` is that of the paper, and
``Device.linearised`` that of the law. Z is a Maxwell branch of stiffness k2 C_e. Only the product
of k2 and C_e matters: fix one of them in a fit.
"""

from collections.abc import Collection
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from ..errors import InputError
from .current_dependence import CurrentDependence
from .device import Device
from .in_plan import each_direction
from .law import Law, Quantity, Redundancy, Spring
from .published import (
    LINEARISED_AMPLITUDES_MM,
    LINEARISED_DOUBTFUL,
    LINEARISED_FIELDS_T,
    LINEARISED_FREQUENCIES_HZ,
    LINEARISED_PARAMETERS,
)

CORRUPT = (0.2, 0.1, 20.0)
"""Field (T), amplitude (mm) and frequency (Hz) of the column with K1 = 0.999958 N/mm."""

_SI = {"C": 1e3, "k1": 1e3, "k2": 1.0, "C_e": 1e3, "k_e": 1.0}


def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
    """Spring, dashpot and linearised hysteresis (Eq 4)."""
    (z,) = states
    C, k1, k2, _, _ = parameters
    return k1 * x + C * v + k2 * z


def rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
    """Rate of the hysteretic variable (Eq 3 with S_e = 0 and -k_e)."""
    (z,) = states
    _, _, _, C_e, k_e = parameters
    return (C_e * v - k_e * z,)


def stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:
    """Energy of the spring and of the branch; the branch loses k2 k_e z^2 / C_e."""
    (z,) = states
    _, k1, k2, C_e, _ = parameters
    return k1 * x**2 / 2 + k2 / C_e * z**2 / 2


def storage_stiffness(k1: Any, k2: Any, C_e: Any, k_e: Any, omega: Any) -> Any:
    """Part of the force in phase with the deformation, over it (Eq 10 mended)."""
    return k1 + k2 * C_e * omega**2 / (omega**2 + k_e**2)


def loss_stiffness(C: Any, k2: Any, C_e: Any, k_e: Any, omega: Any) -> Any:
    """Part of the force a quarter period ahead of the deformation, over it (Eq 11 mended)."""
    return omega * (C - k2 * k_e * C_e / (omega**2 + k_e**2))


def published_stiffness(C: Any, k1: Any, k2: Any, C_e: Any, k_e: Any, omega: Any) -> Any:
    """Transfer function from deformation to force as the paper has it (Eq 8)."""
    return k1 + k2 * 1j * omega * C_e / (1j * omega - k_e) + 1j * C * omega


def columns() -> dict[str, np.ndarray]:
    """Table 1 as one row per loading condition."""
    keys = list(product(LINEARISED_FIELDS_T, LINEARISED_AMPLITUDES_MM, LINEARISED_FREQUENCIES_HZ))
    table = dict(zip(("field_T", "amplitude_mm", "frequency_Hz"), np.array(keys).T, strict=True))
    table |= {name: np.ravel(values) for name, values in LINEARISED_PARAMETERS.items()}
    C, k1, k2, C_e, k_e = (table[name] for name in LAW.parameter_names)
    stiffness = published_stiffness(C, k1, k2, C_e, k_e, 2 * np.pi * table["frequency_Hz"])
    return table | {"storage": stiffness.real, "loss": stiffness.imag}


def regression(
    drop: Collection[tuple[float, float, float]] = (),
) -> dict[str, tuple[dict[str, float], float]]:
    """Regress the storage and loss stiffness of Table 1 linearly on the loading condition."""
    table = columns()
    keys = list(zip(table["field_T"], table["amplitude_mm"], table["frequency_Hz"], strict=True))
    dropped = {tuple(column) for column in drop}
    for column in dropped - set(keys):
        raise InputError(
            f"no column {column} in Table 1; expected: field (T), amplitude (mm), frequency (Hz)"
        )
    keep = np.array([key not in dropped for key in keys])
    inputs = [table[name] for name in ("amplitude_mm", "field_T", "frequency_Hz")]
    matrix = np.column_stack([*inputs, np.ones(len(keep))])[keep]
    result = {}
    for name in ("storage", "loss"):
        values = table[name][keep]
        slopes = np.linalg.lstsq(matrix, values, rcond=None)[0]
        left = np.sum((values - matrix @ slopes) ** 2)
        share = 1 - left / np.sum((values - values.mean()) ** 2)
        named = dict(zip(("A", "B", "f", "constant"), slopes.tolist(), strict=True))
        result[name] = (named, float(share))
    return result


def condition(field_T: float, amplitude_mm: float, frequency_hz: float) -> Device:
    """Build the model identified for one loading condition (Table 1)."""
    try:
        at = (
            LINEARISED_FIELDS_T.index(field_T),
            LINEARISED_AMPLITUDES_MM.index(amplitude_mm),
            LINEARISED_FREQUENCIES_HZ.index(frequency_hz),
        )
    except ValueError:
        raise InputError(
            f"no test at {field_T:g} T, {amplitude_mm:g} mm, {frequency_hz:g} Hz; expected: "
            "0, 0.2, 0.3 or 0.4 T, 0.1, 0.15 or 0.2 mm, 6, 10, 14 or 20 Hz"
        ) from None
    values = {
        name: _SI[name] * LINEARISED_PARAMETERS[name][at[0]][at[1]][at[2]]
        for name in LAW.parameter_names
    }
    where = f"{field_T:g} T, {amplitude_mm:g} mm, {frequency_hz:g} Hz"
    source = f"dynamic stiffness of MR elastomers, Table 1: {where}"
    doubt = LINEARISED_DOUBTFUL.get((field_T, amplitude_mm, frequency_hz))
    return Device(
        law=LAW,
        current=CurrentDependence.constant(values),
        tested_deformation=1e-3 * amplitude_mm,
        source=f"{source}; {doubt}" if doubt else source,
    )


def field_0_tesla() -> Device:
    """Build the model without field at 0.15 mm and 10 Hz."""
    return condition(0.0, 0.15, 10.0)


def field_0p4_tesla() -> Device:
    """Build the model at the largest field, 0.4 T, at 0.15 mm and 10 Hz."""
    return condition(0.4, 0.15, 10.0)


LAW = Law(
    name="linearised_bouc_wen",
    title="Linearised Bouc-Wen",
    states=(Quantity("z", "1", "hysteretic variable"),),
    parameters=(
        Quantity("C", "N s/m", "viscous damping", lower=0.0),
        Quantity("k1", "N/m", "stiffness", lower=0.0),
        Quantity("k2", "N", "hysteretic force at z = 1", lower=0.0),
        Quantity("C_e", "1/m", "slope of z at rest", lower=0.0, divides=True),
        Quantity("k_e", "1/s", "decay rate of z", lower=0.0),
    ),
    force=force,
    rates=rates,
    stored_energy=stored_energy,
    plan=each_direction(force, rates, stored_energy, n_states=1),
    source="A study of the dynamic stiffness of MR elastomers, Eqs 3-8 mended",
    redundancy=Redundancy("k2", 1.0, ("k2", "C_e")),
    springs=(Spring("k1", ("x",)), Spring("k2", ("z",))),
    sets={"field_0_tesla": field_0_tesla, "field_0p4_tesla": field_0p4_tesla},
    conditions={
        f"{B:g}T_{A:g}mm_{f:g}Hz": partial(condition, B, A, f)
        for B, A, f in product(
            LINEARISED_FIELDS_T, LINEARISED_AMPLITUDES_MM, LINEARISED_FREQUENCIES_HZ
        )
    },
)
