"""Docstrings of the three packages against signatures: numpydoc that cannot go stale."""

from __future__ import annotations

import importlib
import re
import runpy
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import griffe

from isolation_sim.scenario import Scenario
from isolation_sim.scenario.writer import _section_types

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("isolation_sim", "controllers", "ground_motions")
API = runpy.run_path(str(ROOT / "docs" / "_ext" / "api_pages.py"))
"""The modules that offer names to users are those of the API reference."""
# text that the kernel's generator completes, and the generator of an element's text
GENERATED = (
    *(
        f"isolation_sim.simulation.kernel.{part}"
        for part in ("tables", "segments", "step", "integration", "peaks")
    ),
    "isolation_sim.simulation.kernel.element_code",
)

PHYSICAL = re.compile(
    r"(^|_)(mass|stiffness|damping|dt|period|duration|time|delay|lag|slew|current|force|velocity|"
    r"displacement|acceleration|deformation|height|pga|sa|frequency|amplitude|rms|peak)(es|s)?$"
)
UNITS = re.compile(
    r"(?<![\w/])(s|m|mm|in|kg|N|A|Hz|J|rad|g|m/s|m/s2|m/s\^2|N/m|N s/m|A/s|rad/s)(?![\w/^])"
    r"|dimensionless|ratio|share|factor|scale|unit",
    re.IGNORECASE,
)


@cache
def _package(name: str) -> griffe.Module:
    loaded = griffe.load(name, docstring_parser="numpy", resolve_aliases=False)
    assert isinstance(loaded, griffe.Module)
    return loaded


def _functions(owner: griffe.Module | griffe.Class) -> Iterator[griffe.Function]:
    for name, member in owner.members.items():
        if member.is_alias or (name.startswith("_") and name != "__init__"):
            continue
        if isinstance(member, griffe.Function):
            yield member
        elif isinstance(member, griffe.Module | griffe.Class):
            yield from _functions(member)


def _classes(owner: griffe.Module | griffe.Class) -> Iterator[griffe.Class]:
    for name, member in owner.members.items():
        if member.is_alias or name.startswith("_"):
            continue
        if isinstance(member, griffe.Class):
            yield member
        if isinstance(member, griffe.Module):
            yield from _classes(member)


@cache
def offered() -> dict[tuple[str, str], object]:
    """What the modules offer by name."""
    return {
        (module, name): getattr(importlib.import_module(module), name)
        for module in API["PACKAGES"]
        for name in API["offered"](importlib.import_module(module))
    }


@cache
def functions() -> dict[str, griffe.Function]:
    return {
        function.path: function
        for package in PACKAGES
        for function in _functions(_package(package))
        if not function.path.startswith(GENERATED)
    }


@cache
def classes() -> dict[str, griffe.Class]:
    return {c.path: c for package in PACKAGES for c in _classes(_package(package))}


def _sections(thing: griffe.Object, kind: str) -> list:
    if thing.docstring is None:
        return []
    return [section for section in thing.docstring.parsed if section.kind.value == kind]


def _documented(thing: griffe.Object, kind: str) -> dict[str, str]:
    """Names in a section, with their type and description as text."""
    results = {}
    for section in _sections(thing, kind):
        for item in section.value:
            text = f"{item.annotation} {item.description}"
            results.update({name.strip().lstrip("*"): text for name in item.name.split(",")})
    return results


def _noted(kind: griffe.Class) -> dict[str, str]:
    """Fields of a class that is not exported, with the comment beside or above them."""
    results, above = {}, ""
    for line in kind.source.splitlines():
        if comment := re.fullmatch(r"    # (.*)", line):
            above += comment[1] + " "
        elif field := re.match(r"    (\w+): (.*?)(?:  # (.*))?$", line):
            # a comment above may name several fields that follow each other
            names = re.match(r"(\w+(?:, \w+)*): ", above)
            for name in {field[1], *(names[1].split(", ") if names else ())}:
                if text := field[3] or above:
                    results.setdefault(name, f"{field[2]} {text}")
            above = ""
    return results


def _taken(function: griffe.Function) -> dict[str, str]:
    """Parameters of a signature, with their annotation as text."""
    return {
        parameter.name: str(parameter.annotation)
        for parameter in function.parameters
        if parameter.name not in ("self", "cls")
    }


@cache
def detailed() -> dict[str, griffe.Function]:
    """Functions whose docstrings have sections."""
    return {
        path: function
        for path, function in functions().items()
        if any(_sections(function, kind) for kind in ("parameters", "returns", "yields", "raises"))
    }


def _exported() -> Iterator[str]:
    """Paths of what the packages offer by name, and of the public methods of its classes."""
    for (_, name), value in offered().items():
        path = f"{getattr(value, '__module__', '')}.{getattr(value, '__qualname__', name)}"
        if path in functions():
            yield path
        elif path in classes():
            bases = classes()[path].mro()
            for method in _functions(classes()[path]):
                if not any(f"{base.path}.{method.name}" in detailed() for base in bases):
                    yield method.path


@cache
def exported() -> list[str]:
    return sorted({path for path in _exported() if not path.endswith("__init__")})


def test_parameters_are_those_of_the_signature():
    assert len(detailed()) > 200
    for path, function in detailed().items():
        assert list(_documented(function, "parameters")) == list(_taken(function)), path


def test_what_is_returned_is_documented():
    for path, function in detailed().items():
        if function.returns is None:  # compiled functions have no annotations
            continue
        returned = str(function.returns)
        generator = returned.startswith(("Iterator", "Generator"))
        documented = _sections(function, "yields" if generator else "returns")
        assert bool(documented) == (returned != "None"), path


def test_what_is_raised_is_documented():
    for path, function in detailed().items():
        # a private helper's errors are its caller's; what a function itself raises is seen here
        errors = r"(InputError|Diverged)\b"
        raised = set(re.findall(rf"^\s+raise {errors}", function.source, re.MULTILINE))
        assert function.docstring is not None
        text = function.docstring.value
        assert raised <= set(re.findall(errors, text)) or "or raise" in text, path


def test_what_is_exported_is_documented_in_full():
    assert len(exported()) > 200
    for path in exported():
        function = functions()[path]
        assert function.docstring is not None, path
        # what only hands keywords on may say where to
        variadic = {p.name for p in function.parameters if p.kind and "variadic" in p.kind.value}
        if set(_taken(function)) - variadic:
            assert path in detailed(), f"{path} has parameters but no section Parameters"


def test_fields_of_dataclasses_are_documented():
    for path, kind in classes().items():
        if "dataclass" not in kind.labels:
            continue
        made = kind.all_members["__init__"]
        assert isinstance(made, griffe.Function)
        # a class tells of its own fields; what it inherits is told where it is declared
        lines = [name for one in (kind, *kind.mro()) for what in ("parameters", "attributes")
                for name in _documented(one, what)]  # fmt: skip
        if path not in _offered_classes():
            lines += [name for one in (kind, *kind.mro()) for name in _noted(one)]
        assert set(_taken(made)) <= set(lines), path


def test_parameters_of_classes_are_those_of_their_constructor():
    documented = {path: kind for path, kind in classes().items() if _sections(kind, "parameters")}
    assert documented
    for path, kind in documented.items():
        made = kind.all_members["__init__"]
        assert isinstance(made, griffe.Function)
        assert list(_documented(kind, "parameters")) == list(_taken(made)), path


def test_physical_numbers_have_units():
    for path in sorted({*detailed(), *classes()}):
        thing = detailed().get(path) or classes()[path]
        lines = [_documented(thing, kind) for kind in ("parameters", "attributes")]
        if isinstance(thing, griffe.Class):
            lines.append(_noted(thing))
        for texts in lines:
            for name, text in texts.items():
                if PHYSICAL.search(name) and re.search(r"float|array|NDArray", text):
                    assert UNITS.search(text), f"{path}: {name}: {text}"


def test_every_key_of_a_scenario_is_explained():
    for field in Scenario.model_fields.values():
        for section in _section_types(field):
            for key, value in section.model_fields.items():
                assert value.description or key in ("kind", "settings"), f"{section}: {key}"


@cache
def _offered_classes() -> set[str]:
    """Paths of the classes that are offered, and of their bases."""
    kinds = offered().values()
    return {f"{base.__module__}.{base.__qualname__}" for kind in kinds if isinstance(kind, type)
            for base in kind.__mro__}  # fmt: skip


IMPORTED_BY_PAGES = {
    f"{module}.{name}"
    for page in [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    for module, names in re.findall(r"(?m)^from ([\w.]+) import (.*)$", page.read_text())
    for name in re.findall(r"\w+", names)
}


def test_what_is_not_exported_has_no_sections():
    """Its docstring is a line, and its types say the rest."""
    kinds, documented = _offered_classes(), set(exported())
    assert [
        path
        for path, function in detailed().items()
        if path not in documented | IMPORTED_BY_PAGES
        and function.parent is not None
        and function.parent.path not in kinds
    ] == []
