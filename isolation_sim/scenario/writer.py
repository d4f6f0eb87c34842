"""A scenario as TOML text, with the descriptions of the fields as comments."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, get_args

import tomlkit
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from ground_motions.registry import code_files

from ..validation import Section, names_in
from .control import ControllerEntry
from .devices import AppliedEffect

_COMMENT_COLUMN = 40
_HEADER = """\
# A scenario of isolation-sim: one building, one ground motion, controllers compared.
# SI units; a key ends in its unit. Relative paths are relative to this file's folder.
# A key after # is not set. A section that is left out is that of the main job.
"""


def toml_text(scenario: Section, comments: bool) -> str:
    """Write a scenario."""
    blocks = [[_HEADER]] if comments else []
    for key, field in type(scenario).model_fields.items():
        value = getattr(scenario, key)
        if not isinstance(value, Section | list) and value is not None:
            blocks.append([_line(key, value, field.description, comments), ""])
            continue
        sections = value if isinstance(value, list) else [value]
        # one ground motion is one table; controllers and elements are tables of a list even alone
        is_one = not isinstance(value, list) or (key, len(value)) == ("ground", 1)
        title = f"[{key}]" if is_one else f"[[{key}]]"
        if comments:
            blocks.append([f"# {field.description}"])
        for section in sections:
            if section is not None:
                blocks.append([title, *_body(section, comments), ""])
                blocks += _tables_within(key, section)
        if comments:
            blocks.append(_absent(title, field, sections))
    own = code_files(names_in(scenario.model_dump(mode="json")))
    if own:
        lines = [_line(path, digest) for path, digest in own.items()]
        blocks.append(["# SHA-256 of code files; a change is warned of", "[code]", *lines])
    return "\n".join(line for block in blocks for line in block).rstrip("\n") + "\n"


def _body(section: Section, comments: bool) -> list[str]:
    if isinstance(section, ControllerEntry):
        entries = {"name": section.name, "label": section.label} | section.settings
        return [_line(key, value) for key, value in entries.items() if value is not None]
    if isinstance(section, AppliedEffect):
        entries = {"name": section.name, "form": section.form} | section.parameters
        return [_line(key, value) for key, value in entries.items() if value is not None]
    return [
        _line(key, getattr(section, key), field.description, comments)
        for key, field in _own_first(type(section))
        if (comments or not _is_unset(getattr(section, key)))
        and not _is_tables(getattr(section, key))
    ]


def _tables_within(title: str, section: Section) -> list[list[str]]:
    """Lists of tables in a section, after its other keys."""
    return [
        [f"[[{title}.{key}]]", *_body(one, False), ""]
        for key in type(section).model_fields
        if _is_tables(getattr(section, key))
        for one in getattr(section, key)
    ]


def _is_tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and isinstance(value[0], Section)


def _absent(title: str, field: FieldInfo, present: list) -> list[str]:
    """Comments on the other kinds of a section."""
    kinds = list(dict.fromkeys(_section_types(field)))
    used = {type(section) for section in present if section is not None}
    if len(kinds) == 1:
        return [] if used else [f"# {title}", *_template(kinds[0]), ""]
    lines = [f"# other kinds of {title}, with required and (optional) keys:"]
    for kind in kinds:
        if kind not in used:
            literal = kind.model_fields["kind"].annotation
            names = " or ".join(f'"{name}"' for name in get_args(literal))
            keys = [
                key if field.is_required() else f"({key})"
                for key, field in _own_first(kind)
                if key != "kind" and key not in _shared(kind, used)
            ]
            lines.append(f"#   kind = {names}: {', '.join(keys)}".rstrip(": "))
    return [*lines, ""]


def _template(kind: type[Section]) -> list[str]:
    return [
        _line(key, field.get_default(call_default_factory=True), field.description, True, "# ")
        for key, field in _own_first(kind)
    ]


def _line(
    key: str,
    value: Any,
    description: str | None = None,
    comments: bool = False,
    before: str = "",
) -> str:
    name = tomlkit.key(key).as_string()
    text = f"# {name} =" if _is_unset(value) else f"{before}{name} = {_toml(value)}"
    if comments and description:
        return f"{text:<{_COMMENT_COLUMN}}  # {description}"
    return text


def _is_unset(value: Any) -> bool:
    return value is None or value is PydanticUndefined or value in ({}, "")


def _toml(value: Any) -> str:
    if isinstance(value, Section):
        # a section within a section; with its kind, which its keys alone may not tell
        value = {key: v for key, v in value.model_dump(mode="json").items() if v is not None}
    if isinstance(value, dict):
        pairs = ", ".join(f"{tomlkit.key(k).as_string()} = {_toml(v)}" for k, v in value.items())
        return f"{{ {pairs} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_toml, value))}]"
    plain = value if isinstance(value, bool | int | float | str) else str(value)
    return tomlkit.item(plain).as_string()


def _own_first(kind: type[Section]) -> Iterator[tuple[str, FieldInfo]]:
    """Fields of a section: specific fields first, then those in common with other kinds."""
    for cls in kind.__mro__:
        if issubclass(cls, Section) and cls is not Section:
            inherited = getattr(cls.__mro__[1], "model_fields", {})
            yield from ((k, f) for k, f in cls.model_fields.items() if k not in inherited)


def _shared(kind: type[Section], used: set[type[Section]]) -> set[str]:
    """Keys of a kind that another section has from the same base class."""
    bases = {cls for each in used for cls in each.__mro__[1:]}
    common = [cls for cls in kind.__mro__[1:] if cls in bases and issubclass(cls, Section)]
    return {key for cls in common for key in cls.model_fields}


def _section_types(field: Any) -> Iterator[type[Section]]:
    annotation = getattr(field, "annotation", field)
    if isinstance(annotation, type) and issubclass(annotation, Section):
        yield annotation
    for inner in get_args(annotation):
        yield from _section_types(inner)
