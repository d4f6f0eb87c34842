"""A validation error as one line: key, value and expected value."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from ..errors import did_you_mean

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
    """Describe the problems of a scenario in one line."""
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
        return f"{place} is a table; expected: a list (of tables: [[{place}]], double brackets)"
    value = _shown(first["input"])
    if first["type"] == "union_tag_invalid":
        place, value = f"{place}.kind", repr(context["tag"])
    accepted = " or ".join(dict.fromkeys(_accepted(d) for d in details))
    hint = did_you_mean(value.strip("'"), re.findall(r"'([^']*)'", accepted))
    return f"{place} is {value};{hint} expected: {accepted}"


def _accepted(details: ErrorDetails) -> str:
    template = _ACCEPTED.get(details["type"])
    return template.format(**details.get("ctx", {})) if template else details["msg"]


def _shown(value: Any) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else text[:57] + "..."
