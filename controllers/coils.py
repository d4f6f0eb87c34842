"""Coils: the elements that they drive, and the limits of their currents."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from isolation_sim.errors import InputError
from isolation_sim.simulation.control import RunContext
from isolation_sim.structures import Element, IsolatedStructure


def driven_elements(nominal: IsolatedStructure, name: str) -> tuple[Element, ...]:
    """Elements that a coil drives."""
    driven = tuple(element for element in nominal.elements if element.channel is not None)
    if not driven:
        raise without_coil(name, "the nominal model")
    return driven


def motion_of_driven(nominal: IsolatedStructure, name: str) -> tuple[str, ...]:
    """Outputs of the motion of the driven elements."""
    return tuple(
        f"{element.name}_{quantity}"
        for element in driven_elements(nominal, name)
        for quantity in ("deformation_m", "velocity_m_s")
    )


def highest_tested(context: RunContext) -> NDArray:
    """Highest current within the supply's limits at which the devices were tested."""
    highest = np.clip(context.tested, context.low, context.high)
    if np.isinf(highest).any():
        raise InputError(
            f"nothing says how high the current of coil {np.argmax(np.isinf(highest))} may be; "
            "expected: tested_current_A or current_range_A of the devices, or high_A of the driver "
            "(in Python: Device(..., tested_current=), CoilDriver(high=))"
        )
    return highest


def lowest(context: RunContext) -> NDArray:
    """Lowest current of the supply; 0 where it has no limit."""
    return np.where(np.isfinite(context.low), context.low, 0.0)


def coil_table(context: RunContext) -> NDArray:
    """Lag (s), slew (A/s), lowest, highest and initial current (A) of each coil."""
    driver, low, high = context.driver, lowest(context), highest_tested(context)
    initial = np.clip(0.0 if driver.initial is None else driver.initial, low, high)
    return np.column_stack(np.broadcast_arrays(driver.lag, driver.slew, low, high, initial))


def without_coil(name: str, structure: str) -> InputError:
    """Build the error of a controller whose structure, or nominal model, has no coil."""
    return InputError(
        f"{name}: no element of {structure} is driven by a coil; expected: isolators whose law has "
        "a current, or the controller passive_off"
    )
