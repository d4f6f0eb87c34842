"""A sweep's plan: scenario and varied quantities, to and from TOML."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationError, ValidationInfo, field_validator, model_validator

from ..errors import InputError
from ..io.files import read_toml
from ..scenario import Scenario
from ..scenario.job import with_place
from ..validation import InputPath, Number, Positive, Section, WholeNumber, one_line
from .fields import with_defaults

Count = Annotated[int, Field(gt=0)]


class Vary(Section):
    """One varied quantity: a list of values, a range, or limits of a sample."""

    field: str | Annotated[list[str], Field(min_length=1)]
    label: Annotated[str | None, Field(min_length=1)] = None
    values: Annotated[list[Any] | None, Field(min_length=1)] = None
    names: list[str] | None = None
    low: Number | None = None
    high: Number | None = None
    count: Annotated[int, Field(ge=2)] | None = None
    step: Positive | None = None
    spacing: Literal["linear", "log"] = "linear"
    factor: bool = False

    @model_validator(mode="before")
    @classmethod
    def _complete(cls, data: Any, info: ValidationInfo) -> Any:
        if not isinstance(data, dict) or not isinstance(data.get("values"), list):
            return data
        field = data.get("field")
        if not isinstance(field, str):
            return data
        folder = (info.context or {}).get("folder", ".")
        try:
            values = [with_defaults(field, value, folder) for value in data["values"]]
        except ValidationError as error:
            raise InputError(one_line(error, data)) from None
        return data | {"values": values}

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        limits = self.low is not None and self.high is not None
        if (self.values is None) != limits or (self.values is not None and self.steps):
            raise InputError("expected: values, or low and high, with count, with step or alone")
        if self.count is not None and self.step is not None:
            raise InputError("count and step are both set; expected: at most one of them")
        if self.low is not None and self.high is not None:
            if not self.low < self.high:
                raise InputError("low and high", f"{self.low:g} and {self.high:g}", "low < high")
            if self.spacing == "log" and self.low <= 0:
                raise InputError("low", f"{self.low:g}, with log spacing", "above 0")
        if self.step is not None and self.spacing == "log":
            raise InputError("step needs linear spacing; expected with log spacing: count")
        if self.names is not None and len(self.names) != len(self.values or ()):
            raise InputError("names and values differ in number; expected: one name per value")
        return self

    @property
    def steps(self) -> bool:
        """Whether the limits are those of a range."""
        return self.count is not None or self.step is not None

    @property
    def sampled(self) -> bool:
        """Whether the limits are those of a sample."""
        return self.values is None and not self.steps

    @property
    def scaled_limits(self) -> tuple[float, float]:
        """Limits of the sampling; logarithms with log spacing."""
        assert self.low is not None and self.high is not None
        if self.spacing == "log":
            return math.log(self.low), math.log(self.high)
        return self.low, self.high

    @property
    def fields(self) -> tuple[str, ...]:
        """Fields that are set to the value."""
        return (self.field,) if isinstance(self.field, str) else tuple(self.field)


class Sample(Section):
    """Sampling of the quantities that have only limits."""

    method: Literal["latin_hypercube", "sobol", "saltelli", "morris"] = "latin_hypercube"
    count: Count
    seed: WholeNumber = 0


class CaseFile(Section):
    """User's cases: a CSV file with one column per field."""

    file: InputPath


class Seeds(Section):
    """Repetitions of every case; the seed of each is computed from the case."""

    count: Count
    base: WholeNumber = 0


class SweepPlan(Section):
    """All settings of a sweep.

    Every ``vary`` with values or a range is an axis. Quantities with only limits are sampled
    together and form one axis. A file of cases and repetitions are axes, too. The cases are all
    combinations; each is run with every controller of the scenario.
    """

    name: Annotated[str, Field(min_length=1)] = "sweep"
    scenario: Scenario = Scenario()
    vary: list[Vary] = Field(default_factory=list)
    sample: Sample | None = None
    cases: CaseFile | None = None
    seeds: Seeds | None = None
    energy: bool = False
    histories: bool | list[WholeNumber] = False
    floors: bool = False

    @field_validator("scenario", mode="before")
    @classmethod
    def _scenario_of(cls, value: Any, info: ValidationInfo) -> Any:
        folder = Path((info.context or {}).get("folder", "."))
        if isinstance(value, str):
            return Scenario.read(folder / value)
        return value

    @model_validator(mode="after")
    def _sample_has_limits(self) -> Self:
        sampled = [each.fields[0] for each in self.vary if each.sampled]
        if sampled and self.sample is None:
            raise InputError(
                f"{sampled[0]} has limits but no count; expected: count or step, or a [sample] "
                "section"
            )
        if self.sample is not None and not sampled:
            raise InputError("sample: no quantity is sampled; expected: a [[vary]] with low, high")
        if self.sample is not None and self.sample.method == "saltelli" and len(sampled) < 2:
            raise InputError("sample: saltelli needs two quantities with low and high or more")
        return self

    @classmethod
    def read(cls, path: str | Path) -> SweepPlan:
        """Read a plan.

        Parameters
        ----------
        path : str or pathlib.Path
            TOML file; paths in it are relative to its folder.

        Returns
        -------
        SweepPlan

        Raises
        ------
        InputError
            With the file, the key, its value and the expected value.
        """
        path = Path(path)
        data = read_toml(path, "a plan, such as isolation-sim sweep new writes")
        return cls.from_dict({"name": path.stem} | data, path.parent, str(path))

    @classmethod
    def from_dict(
        cls, data: dict[str, Any], folder: str | Path = ".", source: str = ""
    ) -> SweepPlan:
        """Build a plan from a table.

        Parameters
        ----------
        data : dict
            Keys and values of a plan's file.
        folder : str or pathlib.Path
            Base folder of relative paths.
        source : str
            Name of its source, for errors.

        Returns
        -------
        SweepPlan

        Raises
        ------
        InputError
            With the source, the key, its value and the expected value.
        """
        try:
            return cls._in_folder(data, folder)
        except InputError as error:
            raise with_place(error, source) from None
