"""A controller that another tool wrote as a functional mock-up unit, ``name = "my.fmu"``."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from isolation_sim.errors import InputError, check_name
from isolation_sim.io.fmu import Unit
from isolation_sim.simulation.control import RunContext
from isolation_sim.simulation.outputs import output_names
from isolation_sim.structures import IsolatedStructure

from .controller import Controller
from .settings import NamesByName, setting


class UnitController(Controller):
    """Commands from a functional mock-up unit (FMI 2.0 or 3.0, co-simulation), through FMPy."""

    # At each decision the unit is given what is measured and steps on by the period; its outputs
    # then are the commands. A unit that decides at the start of its step, as those that isolation-
    # sim exports, so adds no delay; one that integrates over the step adds a period.

    file: ClassVar[str]
    title = "Functional mock-up unit"

    variables: dict[str, str] = setting(
        {},
        "names here by the unit's own: what is measured by input, coil0_command_A by output",
        NamesByName(),
    )

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self._unit = Unit(self.file)
        own = (*self._unit.inputs, *self._unit.outputs)
        for name in self.variables:
            check_name(f"variable of {self.file}", name, own)
        self._measured = {name: self.variables.get(name, name) for name in self._unit.inputs}

    def measures(self, nominal: IsolatedStructure) -> tuple[str, ...]:
        """Return the outputs that correspond to the unit's inputs."""
        known = (*output_names(nominal), *_coils(nominal, "current"))
        for name, measured in self._measured.items():
            if measured not in known:
                raise InputError(
                    f"{self.file}: input {name!r} is given {measured!r}, which is no output; "
                    f'expected: variables = {{ {name} = "{known[0]}" }} or another output'
                )
        currents = _coils(nominal, "current")
        return tuple(dict.fromkeys(m for m in self._measured.values() if m not in currents))

    def reset(self, context: RunContext) -> None:
        """Restart the unit."""
        own = {self.variables.get(name, name): name for name in self._unit.outputs}
        commands = _coils(context.nominal, "command")
        for command in commands:
            if command not in own:
                raise InputError(
                    f"{self.file}: no output is {command}; expected: variables = "
                    f'{{ {next(iter(self._unit.outputs), "output")} = "{command}" }}'
                )
        self._commands = [own[command] for command in commands]
        self._period, self._low, self._high = context.period, context.low, context.high
        self._unit.start()

    def current(self, t: float, measurement: Any) -> NDArray:
        """Advance the unit by one step."""
        inputs = {name: getattr(measurement, own) for name, own in self._measured.items()}
        commands = self._unit.step(t, self._period, inputs, self._commands)
        return np.clip(commands, self._low, self._high)


def of_file(file: Path) -> type[UnitController]:
    """Class of controllers of a unit's file."""
    return type(file.stem, (UnitController,), {"file": str(file), "name": str(file)})


def _coils(isolated: IsolatedStructure, quantity: str) -> tuple[str, ...]:
    return tuple(f"coil{c}_{quantity}_A" for c in range(isolated.n_channels))
