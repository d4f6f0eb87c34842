"""Base of the scenario's sections: strict types, and errors that name unknown keys."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, get_args

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    ValidationError,
    ValidationInfo,
    model_validator,
)

from ground_motions.registry import absolute_place

from ..errors import InputError, check_name
from .problems import one_line


class Section(BaseModel):
    """A table of a scenario file with strict types and no unknown keys."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    def __init__(self, **data: Any) -> None:
        try:
            super().__init__(**data)
        except ValidationError as error:
            raise InputError(one_line(error, data)) from None

    # for pydantic: sections within sections report to the outermost one
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_keys(cls, data: Any) -> Any:
        # checked first, since a misspelt key is the reason for a missing key
        if isinstance(data, dict):
            for key in data:
                check_name("key", str(key), cls.model_fields)
        return data


def kind_by_keys(*sections: type[Section]) -> Callable[[Any], str | None]:
    """Return a function that determines the kind of a section, by ``kind`` or by its keys."""
    kinds = {
        kind: section
        for section in sections
        for kind in get_args(section.model_fields["kind"].annotation)
    }

    def kind(data: Any) -> str | None:
        if isinstance(data, Section):
            return getattr(data, "kind", None)
        if not isinstance(data, Mapping):
            return None
        if "kind" in data:
            return str(data["kind"])
        return max(kinds, key=lambda name: len(kinds[name].model_fields.keys() & data.keys()))

    return kind


def absolute(path: Any, info: ValidationInfo) -> Any:
    """Resolve a path against the scenario's folder."""
    if not isinstance(path, (str, Path)):
        return path
    folder = (info.context or {}).get("folder", Path())
    return (Path(folder) / Path(path).expanduser()).resolve()


def _absolute_place(name: Any, info: ValidationInfo) -> Any:
    """Make the file of a place such as ``my_laws.py:CUBIC`` absolute."""
    folder = (info.context or {}).get("folder", Path())
    return absolute_place(name, folder) if isinstance(name, str) else name


def names_in(data: Any, key: str = "") -> Iterator[str]:
    """Yield the registered names in a scenario's data: of laws and other parts."""
    if isinstance(data, dict):
        for inner, value in data.items():
            yield from names_in(value, inner)
    elif isinstance(data, list | tuple):
        for value in data:
            yield from names_in(value, key)
    elif isinstance(data, str) and key in NAMING:
        yield data


NAMING = ("law", "name", "reader", "criteria")
"""Keys whose value is a registered name."""

Number = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
WholeNumber = Annotated[int, Field(ge=0)]
Registered = Annotated[str, BeforeValidator(_absolute_place)]
"""A registered name, or a place such as ``"my_laws.py:CUBIC"``."""
InputPath = Annotated[Path, BeforeValidator(absolute), PlainSerializer(str)]
Coefficients = Number | Annotated[list[Number], Field(min_length=1)]
