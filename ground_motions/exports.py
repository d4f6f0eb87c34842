"""Exports of a package that are imported on first use: the list that type checkers read."""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from ground_motions.python_source import parse


def lazy_exports(package: str) -> tuple[Callable[[str], Any], list[str]]:
    """Return ``__getattr__`` and ``__all__`` of a package.

    Its names are those that its ``if TYPE_CHECKING:`` imports as themselves or assigns.
    """
    names = vars(sys.modules[package])
    homes = _homes(Path(names["__file__"]).read_text(encoding="utf-8"))

    def get(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        module, inside = homes[name]
        names[name] = getattr(import_module(module, package), inside)
        return names[name]

    return get, sorted(homes)


def _homes(text: str) -> dict[str, tuple[str, str]]:
    """Module and name there of each exported name."""
    imported, homes = {}, {}
    (block,) = (
        node.body for node in parse(text).body
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
    )  # fmt: skip
    for node in block:
        if isinstance(node, ast.ImportFrom):
            for alias in node.names:
                imported[alias.name] = "." * node.level + (node.module or ""), alias.name
                if alias.asname == alias.name:
                    homes[alias.name] = imported[alias.name]
        elif isinstance(node, ast.Assign):
            homes[ast.unparse(node.targets[0])] = imported[ast.unparse(node.value)]
    return homes
