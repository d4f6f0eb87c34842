"""The ``[[controller]]``, ``[driver]``, ``[sensors]`` and ``[simulation]`` sections."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo, model_validator

from ..registry import controller
from ..simulation.control import CoilDriver, Control, Sensors
from ..validation import NonNegative, Number, Positive, Registered, Section, WholeNumber, absolute


class ControllerEntry(Section):
    """A controller by its registry name; every key but ``name`` and ``label`` is its setting."""

    name: Annotated[
        Registered, Field(description="isolation-sim list controllers, file.py:CLASS or unit.fmu")
    ]
    label: Annotated[
        str | None, Field(min_length=1, description="name in reports; name by default")
    ] = None
    settings: dict[str, Any] = Field(default_factory=dict)

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_keys(cls, data: Any, info: ValidationInfo) -> Any:
        # the controller checks the names of its settings when it is built
        if not isinstance(data, dict):
            return data
        own = {key: data[key] for key in ("name", "label") if key in data}
        settings = {key: value for key, value in data.items() if key not in (*own, "settings")}
        return own | {"settings": _with_place(settings, info) | data.get("settings", {})}

    @property
    def shown(self) -> str:
        """The label; by default the name without the path of its file."""
        inside = self.name.rpartition(":")[2]
        return self.label or (Path(inside).stem if inside.endswith(".fmu") else inside)

    def build(self) -> Control:
        """Return the controller."""
        return controller(self.name, **self.settings)


def _with_place(settings: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
    """Make file paths absolute; the names of these settings end in ``file``."""
    paths = {
        key: str(absolute(value, info))
        for key, value in settings.items()
        if key.endswith("file") and isinstance(value, str)
    }
    return settings | paths


class Driver(Section):
    """The coils and their supply: rate = clip((command - current) / lag, slew)."""

    lag_s: Annotated[NonNegative, Field(description="time constant; 0 is an ideal supply")] = 0.0
    slew_A_per_s: Annotated[
        Positive | None, Field(description="largest rate; unlimited if left out")
    ] = None
    low_A: Annotated[
        Number | None, Field(description="limit of the supply; that of the device by default")
    ] = None
    high_A: Annotated[
        Number | None, Field(description="limit of the supply; that of the device by default")
    ] = None
    initial_A: Annotated[
        Number | None,
        Field(description="current before the first command; by default 0, or the nearest limit"),
    ] = None
    step_A: Annotated[
        NonNegative, Field(description="commands are rounded to multiples of it; 0 for no rounding")
    ] = 0.0

    def build(self) -> CoilDriver:
        """Return the driver."""
        slew = float("inf") if self.slew_A_per_s is None else self.slew_A_per_s
        return CoilDriver(self.lag_s, slew, self.low_A, self.high_A, self.initial_A, self.step_A)


class SensorSet(Section):
    """Sensors of the controllers."""

    delay_s: Annotated[NonNegative, Field(description="age of a measurement")] = 0.0
    sampling_s: Annotated[
        Positive | None,
        Field(
            description="of the sensors' own clock; if left out, samples arrive at the decisions"
        ),
    ] = None
    seed: Annotated[WholeNumber, Field(description="of noise and dropout")] = 0
    dropout: Annotated[
        float,
        Field(ge=0, lt=1, description="probability that a sample is lost; the last one is held"),
    ] = 0.0
    compensation_s: Annotated[
        NonNegative, Field(description="measured motion is extrapolated over this time")
    ] = 0.0
    noise: Annotated[
        dict[str, NonNegative],
        Field(
            description="standard deviation by output, or by quantity: displacement_m, "
            "velocity_m_s, acceleration_m_s2, drift_m, deformation_m, force_N"
        ),
    ] = Field(default_factory=dict)

    def build(self) -> Sensors:
        """Return the sensors."""
        return Sensors(
            self.noise, self.delay_s, self.sampling_s, self.seed, self.dropout, self.compensation_s
        )


class Simulation(Section):
    """Options of the runs."""

    tolerance: Annotated[
        float, Field(ge=1e-12, le=1e-2, description="accuracy, relative to each quantity's peak")
    ] = 1e-6
    current_outside: Annotated[
        Literal["refuse", "clamp"],
        Field(description="commands outside the limits: refuse, or clamp and count"),
    ] = "refuse"
    computation_delay_s: Annotated[
        NonNegative, Field(description="delay from a decision to its command")
    ] = 0.0
    criteria: Annotated[
        list[Registered],
        Field(description="further ones: isolation-sim list criteria, or file.py:CRITERION"),
    ] = Field(default_factory=list)
    fixed_base: Annotated[
        bool, Field(description="also simulate the building with a fixed base on rigid ground")
    ] = False
