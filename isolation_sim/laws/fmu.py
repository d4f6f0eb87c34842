"""A device that another tool wrote as a functional mock-up unit, ``law = "my.fmu"``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .current_dependence import CurrentDependence
from .device import Device
from .law import Law, Quantity


def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
    """The state, which the unit sets."""
    (f,), (_, current) = states, parameters
    return f + 0.0 * x + 0.0 * v + 0.0 * current


def rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
    """Within a step the force goes in proportion to time."""
    rate, _ = parameters
    return (rate + 0.0 * v,)


def of_file(file: str | Path, variables: Mapping[str, str] | None = None) -> Law:
    """Law whose force a unit gives; ``simulate`` steps the two together."""

    def device() -> Device:
        names = law.parameter_names
        dependence = CurrentDependence.polynomial({"rate": (0.0,), "current": (0.0, 1.0)}, names)
        return Device(law, dependence, source=str(file))

    law = Law(
        name=str(file),
        title=f"Unit {Path(file).name}",
        source=str(file),
        parameters=(
            Quantity("rate", "N/s", "rate of the force, set by the unit in each step"),
            Quantity("current", "A", "coil current"),
        ),
        states=(Quantity("f", "N", "force of the unit"),),
        force=force,
        rates=rates,
        unit=str(file),
        unit_variables=dict(variables or {}),
        sets={"unit": device},
    )
    return law
