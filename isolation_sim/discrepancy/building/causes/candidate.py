"""A cause that the model of an isolated building may lack: it adds a few numbers to the model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..channels import GROUND
from ..model import BuildingModel

Values = tuple[float, ...]
Change = Callable[[BuildingModel, Values], BuildingModel]
"""A model with a cause of some numbers in it."""
TYPICAL_PERIOD = 2.0
"""s: of isolated buildings, for the orders of magnitude that fits start from."""
EITHER_SIGN: tuple[Values, ...] = (0.05,), (-0.05,)
"""Relative errors from which fits start: in lightly damped or sliding motion, a step from the wrong
side leads nowhere."""


@dataclass(frozen=True)
class Parameter:
    """A number of a cause."""

    # name, unit: As reported, SI
    name: str
    unit: str
    # lower, upper: Bounds, in ``unit``
    lower: float = -np.inf
    upper: float = np.inf
    # Whether only its order of magnitude is known beforehand; its logarithm is fitted
    logarithmic: bool = False
    # Reported number over the fitted one; for what is fitted in a device's own scale
    factor: float = 1.0
    # Bounds at which the cause is a plainer one of the same name
    plain: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class Candidate:
    """A cause that may be put into a building's model."""

    name: str  # In the catalogue
    place: str  # Which storey or channel; empty where there is only one
    parameters: tuple[Parameter, ...]  # Fitted numbers
    starts: tuple[Values, ...]  # Values from which fits start
    apply: Change  # Puts it into a model, with the numbers given
    says: str  # Description for the report; names of its values in braces
    form: str = ""  # Variant of the cause
    # Fixed numbers to report beside the fitted ones: the storey's
    numbers: tuple[tuple[str, float], ...] = ()
    late: bool = False  # Whether it is only tried where no other cause explains the records
    last: bool = False  # Whether it must then leave far less than the others, too
    instead: bool = False  # Whether it is only tried where another form of it is best

    @property
    def of_sensor(self) -> bool:
        """Whether it changes a sensor's signal and not the motion of the building."""
        return self.name.startswith("sensor_") and not self.place.startswith(GROUND)

    @property
    def key(self) -> tuple[str, str]:
        """Key of a cause: a model contains it once at each place."""
        return self.name, self.place

    @property
    def label(self) -> str:
        """Name and place, to print."""
        return f"{self.name} ({self.place})" if self.place else self.name


def add_to(matrix: Literal["damping", "stiffness"], pattern: NDArray) -> Change:
    """A cause that adds a multiple of a pattern (n, n) to a matrix of the structure."""

    def apply(model: BuildingModel, values: Values) -> BuildingModel:
        return model.changed(**{matrix: getattr(model.structure, matrix) + values[0] * pattern})

    return apply


def set_fields(*fields: str) -> Change:
    """A cause whose numbers are fields of the model."""

    def apply(model: BuildingModel, values: Values) -> BuildingModel:
        numbers: dict[str, Any] = dict(zip(fields, values, strict=True))
        return replace(model, **numbers)

    return apply
