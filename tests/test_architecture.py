"""How packages and files import each other, read from their source."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("ground_motions", "isolation_sim", "controllers", "studies")
"""From the lowest to the highest: each imports only those before it."""

EXPORTED = ("isolation_sim", "controllers")
"""The list of exported names tells editors of the class that a user's controller starts from."""

MOST_LAYERS = 15
"""Packages and folders on the longest chain of imports."""


class Import(NamedTuple):
    """One import: of which module, whether within a function, whether for type checkers alone."""

    module: str
    lazy: bool
    typing: bool


@cache
def files() -> dict[str, Path]:
    """Files of the packages by their module's name."""
    results = {}
    for path in (path for package in PACKAGES for path in (ROOT / package).rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        results[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return results


def imports(name: str) -> set[Import]:
    """Imports of one module from the packages."""
    return set(_imports(ast.parse(files()[name].read_text()), name))


def _imports(node: ast.AST, name: str, lazy: bool = False, typing: bool = False) -> Iterator:
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Import | ast.ImportFrom):
            for module in filter(None, map(_module, _imported(child, name))):
                if module != name:
                    yield Import(module, lazy, typing)
        inside = isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
        guard = isinstance(child, ast.If) and ast.unparse(child.test).endswith("TYPE_CHECKING")
        yield from _imports(child, name, lazy or inside, typing or guard)


def _imported(node: ast.Import | ast.ImportFrom, name: str) -> list[str]:
    """Dotted names that a statement imports, relative ones completed."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    package = name.split(".") if files()[name].name == "__init__.py" else name.split(".")[:-1]
    above = package[: len(package) + 1 - node.level] if node.level else []
    base = ".".join([*above, *filter(None, [node.module])])
    # "from controllers import controller" imports a function where the package defines one
    exported = base in files() and files()[base].name == "__init__.py" and _defined(base)
    return [base if exported and a.name in exported else f"{base}.{a.name}" for a in node.names]


@cache
def _defined(package: str) -> set[str]:
    """Functions and classes that a package's own file defines."""
    tree = ast.parse(files()[package].read_text())
    return {n.name for n in tree.body if isinstance(n, ast.FunctionDef | ast.ClassDef)}


def _module(dotted: str) -> str:
    """The module that holds an imported name; empty if it is none of ours."""
    while dotted and dotted not in files():
        dotted = dotted.rpartition(".")[0]
    return dotted


@cache
def graph() -> dict[str, set[str]]:
    """Every module with those it imports, at the top, within functions or for type checkers."""
    return {name: {each.module for each in imports(name)} for name in files()}


def circle(graph: dict[str, set[str]]) -> list[str]:
    """One circle of a graph; empty if there is none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return error.args[1]
    return []


def layers(graph: dict[str, set[str]]) -> int:
    """Files on the longest chain of imports."""
    height: dict[str, int] = {}
    for name in TopologicalSorter(graph).static_order():
        height[name] = 1 + max((height[each] for each in graph.get(name, ())), default=0)
    return max(height.values())


def test_the_reader_of_imports_sees_each_kind(monkeypatch, tmp_path):
    text = (
        "import numpy, isolation_sim.errors\n"
        "from typing import TYPE_CHECKING\n"
        "from . import plan\n"
        "if TYPE_CHECKING:\n    from ..laws import Device\n"
        "def f():\n    from controllers.mpc import Mpc\n"
    )
    path = tmp_path / "example.py"
    path.write_text(text)
    monkeypatch.setitem(files(), "isolation_sim.simulation.example", path)
    assert imports("isolation_sim.simulation.example") == {
        Import("isolation_sim.errors", False, False),
        Import("isolation_sim.simulation.plan", False, False),
        Import("isolation_sim.laws", False, True),
        Import("controllers.mpc", True, False),
    }
    assert set(circle({"a": {"b"}, "b": {"c"}, "c": {"a"}})) == {"a", "b", "c"}
    assert layers({"a": {"b", "c"}, "b": {"c"}}) == 3


def test_packages_import_one_way():
    rank = {package: k for k, package in enumerate(PACKAGES)}
    upward = {
        (name, each)
        for name, imported in graph().items()
        for each in imported
        if rank[each.split(".")[0]] > rank[name.split(".")[0]]
    }
    assert upward == {EXPORTED}, "imports of a higher package"
    assert Import(EXPORTED[1], False, True) in imports(EXPORTED[0]), "for type checkers alone"


def test_no_package_imports_the_tests():
    text = {name: path.read_text() for name, path in files().items()}
    assert [n for n, t in text.items() if re.search(r"^\s*(from|import) tests\b", t, re.M)] == []


def test_no_files_import_each_other_in_a_circle():
    assert circle({name: set(imported) for name, imported in graph().items()}) == []


def component(name: str) -> str:
    """Folder or top-level file of ``isolation_sim`` that holds a module; other packages whole."""
    parts = name.split(".")
    return ".".join(parts[: 2 if parts[0] == "isolation_sim" else 1])


def test_folders_stand_on_each_other_without_a_circle():
    below: dict[str, set[str]] = {component(name): set() for name in files()}
    for name, imported in graph().items():
        for each in imported:
            if component(each) != component(name):
                below[component(name)].add(component(each))
    assert circle(below) == []
    assert layers(below) <= MOST_LAYERS, layers(below)


RENDERED = sorted(
    {
        name
        for path in (ROOT / "isolation_sim").rglob("*.py")
        for name in re.findall(r'\brender\(\s*f?"([\w.]+:[\w{}\[\]]+)"', path.read_text())
    }
)


@pytest.mark.parametrize("name", RENDERED)
def test_results_find_their_reports(name):
    module, _, function = name.partition(":")
    reports = import_module(f"isolation_sim.reports.{module}")
    if "{" in function:
        from isolation_sim.comparison import _FIGURES

        assert all(callable(getattr(reports, each)) for each in _FIGURES.values())
    else:
        assert callable(getattr(reports, function))


def test_what_results_render_is_named_in_their_source():
    assert len(RENDERED) >= 14
