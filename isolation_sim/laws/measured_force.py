"""A device with an external force: the physical substructure of a hybrid test."""

from __future__ import annotations

from typing import Any

from .current_dependence import CurrentDependence
from .device import Device
from .law import Law, Quantity


def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
    """The measured force, independent of the motion."""
    (f,) = parameters
    return f + 0.0 * x + 0.0 * v


_MEASURED = Law(
    name="measured_force",
    title="Measured force",
    source="a laboratory",
    parameters=(Quantity("f", "N", "measured force"),),
    force=force,
)


def measured_force() -> Device:
    """Return a device whose force is given from outside, in place of its coil current.

    With it a building is the numerical half of a hybrid test and the isolator in the laboratory the
    physical one: ``Simulator(building.on(measured_force()), ...)`` takes the measured restoring
    force, N, where other simulators take the current, A, and holds it over the step.

    Returns
    -------
    Device
    """
    dependence = CurrentDependence.polynomial({"f": (0.0, 1.0)}, _MEASURED.parameter_names)
    return Device(_MEASURED, dependence, source="measured")
