"""A nominal model whose devices are springs and dashpots that depend on the current."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from isolation_sim.laws import Device
from isolation_sim.laws.current_dependence import CurrentDependence
from isolation_sim.laws.kelvin_voigt import LAW
from isolation_sim.structures import IsolatedStructure

_KNOTS = 13
"""Currents at which a device is linearised; between them its numbers are interpolated."""


def spring_and_dashpot(
    nominal: IsolatedStructure, coils: NDArray, frequency: float
) -> IsolatedStructure:
    """Linearise every device about rest, at every current."""
    # The response is then linear at any fixed current, and bilinear with the current.
    elements = []
    for element in nominal.elements:
        low, high = (0.0, 0.0) if element.channel is None else coils[element.channel, 2:4]
        currents = np.linspace(low, high, _KNOTS) if high > low else np.array([low])
        stiffness = np.array([element.device.linearised(float(i), frequency) for i in currents])
        damping = stiffness.imag / (2 * np.pi * frequency)
        numbers = {"k": stiffness.real.tolist(), "c": damping.tolist()}
        device = Device(
            law=LAW,
            current=CurrentDependence.table(currents.tolist(), numbers),
            current_range=element.device.current_range,
            tested_current=element.device.tested_current,
            name=f"{element.device.name}, linearised",
        )
        elements.append(replace(element, device=device))
    return replace(nominal, elements=tuple(elements))
