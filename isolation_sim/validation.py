"""Validation of settings: tables of strict types without unknown keys, and errors of one line."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Self, get_args

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
from pydantic_core import ErrorDetails

from ground_motions.registry import absolute_place

from .errors import InputError, check_name, did_you_mean


class Section(BaseModel):
    """A table of settings with strict types and no unknown keys."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    def __init__(self, **data: Any) -> None:
        try:
            super().__init__(**data)
        except ValidationError as error:
            raise InputError(one_line(error, data)) from None

    # for pydantic: sections within sections report to the outermost one
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    @classmethod
    def _in_folder(cls, data: dict[str, Any], folder: str | Path) -> Self:
        """Validate a table whose paths are relative to a folder."""
        try:
            return cls.model_validate(data, context={"folder": folder})
        except ValidationError as error:
            raise InputError(one_line(error, data)) from None

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

_ACCEPTED = {
    "greater_than": "a number above {gt:g}",
    "greater_than_equal": "{ge:g} or more",
    "less_than": "a number below {lt:g}",
    "less_than_equal": "{le:g} or less",
    "finite_number": "a finite number",
    "float_type": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "string_type": "text",
    "string_too_short": "text that is not empty",
    "bool_type": "true or false",
    "list_type": "a list",
    "dict_type": "a table",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "literal_error": "{expected}",
    "union_tag_invalid": "{expected_tags}",
    "union_tag_not_found": "a table",
    "is_instance_of": "a path, as text",
    "too_short": "a list of {min_length} or more",
    "too_long": "a list of {max_length} at most",
}


def one_line(error: ValidationError, data: Any) -> str:
    """Describe the problems of settings in one line."""
    # a union reports once per kind of value; they are one problem per place
    problems: dict[str, list[ErrorDetails]] = {}
    for details in error.errors():
        problems.setdefault(_place(details, data), []).append(details)
    # the deepest place is the wrong item of a valid list or table
    inner = [place for place in problems if not any(_is_within(other, place) for other in problems)]
    text = _message(inner[0], problems[inner[0]])
    more = len(inner) - 1
    return text + (f" (and {more} more problem{'s' * (more > 1)})" if more else "")


def _is_within(inner: str, outer: str) -> bool:
    return inner != outer and inner.startswith((f"{outer}.", f"{outer}["))


def _place(details: ErrorDetails, data: Any) -> str:
    """Path of keys in the file, without pydantic's names of a union's members."""
    place = ""
    for step in details["loc"]:
        if isinstance(step, int):
            # a single ground motion needs no list
            if isinstance(data, list):
                place += f"[{step}]"
                data = data[step]
        # the names of a union's members are no keys of the file: no kind has the name of a key
        elif isinstance(data, Mapping) and step in data:
            place += f".{step}"
            data = data[step]
        elif details["type"] == "missing" and step is details["loc"][-1]:
            place += f".{step}"
    return place.lstrip(".")


def _message(place: str, details: list[ErrorDetails]) -> str:
    first = details[0]
    context = first.get("ctx", {})
    if first["type"] == "value_error":
        return f"{place}: {context['error']}" if place else str(context["error"])
    if first["type"] == "missing":
        return f"{place} is missing; it has no default"
    if first["type"] == "list_type" and isinstance(first["input"], Mapping):
        accepted = f"a list (of tables: [[{place}]], double brackets)"
        return str(InputError(place, "a table", accepted))
    value = _shown(first["input"])
    if first["type"] == "union_tag_invalid":
        place, value = f"{place}.kind", repr(context["tag"])
    accepted = " or ".join(dict.fromkeys(_accepted(d) for d in details))
    hint = did_you_mean(value.strip("'"), re.findall(r"'([^']*)'", accepted))
    return str(InputError(place, value, accepted, hint))


def _accepted(details: ErrorDetails) -> str:
    template = _ACCEPTED.get(details["type"])
    return template.format(**details.get("ctx", {})) if template else details["msg"]


def _shown(value: Any) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else text[:57] + "..."
