"""Text of a compiled kernel: a copy of ordinary modules, written for one case.

A kernel imports its sizes, or the functions of a law, from a module that has those of one example.
The kernel itself therefore runs as it is. In a copy, the text for another case takes the place of
this import. All constants are inserted, which shortens Numba's analysis.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from importlib import import_module
from importlib.util import resolve_name
from pathlib import Path
from types import ModuleType

from ground_motions.python_source import parse

from .constant_folding import fold_constants


def kernel_text(
    modules: Sequence[ModuleType],
    case: Mapping[ModuleType, str],
    fields: Mapping[str, int] | None = None,
) -> str:
    """Source of modules as one; ``case``: text in place of an imported module."""
    blocks, own = [*case.values()], {module.__name__ for module in (*modules, *case)}
    for module in modules:
        for node in parse(Path(str(module.__file__)).read_text()).body:
            if not isinstance(node, ast.ImportFrom) or not node.level:
                blocks.append(ast.unparse(node))
                continue
            name = resolve_name("." * node.level + str(node.module), module.__package__)
            if name not in own:
                blocks += _import_statements(name, [alias.name for alias in node.names])
    return module_text(blocks, fields)


def _import_statements(module: str, names: list[str]) -> list[str]:
    """Statements in a copy that give it names of another module."""
    # numbers become the copy's own, so that they are known where it is written
    values = {name: getattr(import_module(module), name) for name in names}
    numbers = {name: v for name, v in values.items() if isinstance(v, int | float | tuple)}
    others = ", ".join(name for name in names if name not in numbers)
    return [*([f"from {module} import {others}"] if others else []), assigned(numbers)]


def assigned(constants: Mapping[str, object]) -> str:
    """Statements that define constants."""
    return "\n".join(f"{name} = {value!r}" for name, value in constants.items())


def module_text(blocks: Sequence[str], fields: Mapping[str, int] | None = None) -> str:
    """Source of a module; ``fields``: see ``fold_constants``."""
    first = f'"""Written by {__name__}; do not edit."""'
    text = "\n\n".join([first, "import numpy as np", "unsigned = np.uint64", *blocks])
    return fold_constants(text, fields)
