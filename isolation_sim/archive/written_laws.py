"""Laws that the program wrote as text: an equation or a learned term around a law."""

from __future__ import annotations

import ast
from pathlib import Path

from ..errors import InputError
from ..generated import cache_folder, load_text
from ..laws.law import Law
from ..laws.registry import LAWS

NAME = "LAW"
_MODULES = {"typing", "numpy", "isolation_sim.laws", "isolation_sim.laws.law"}
_CALLED = {"Law", "Quantity", "len", "zip", "enumerate", "tuple", "limited", "learned"}
_NUMPY = {"abs", "cosh", "exp", "fabs", "log", "log1p", "max", "min", "sign", "sinh", "sqrt",
          "tanh", "where"}  # fmt: skip


def law_of(text: str) -> Law:
    """Load a law from the text of its file, which is kept in the cache folder."""
    module = load_text("law", text)
    return LAWS[f"{module.__file__}:{NAME}"]


def text_of(law: Law) -> str:
    """Return the text of a law that ``law_of`` has loaded; empty for any other law."""
    file, _, name = LAWS.called(law, "").rpartition(":")
    path = Path(file)
    return path.read_text() if name == NAME and path.parent == cache_folder().resolve() else ""


def law_of_saved(text: str) -> Law:
    """Load a law from the text in a saved result, if the text does nothing but describe a law."""
    for node in ast.walk(ast.parse(text)):
        if not _describes(node):
            raise InputError(
                f"the text of a saved law, line {getattr(node, 'lineno', 1)}, is not as the "
                "program writes it; expected: the law as a file of its own"
            )
    return law_of(text)


def _describes(node: ast.AST) -> bool:
    """Whether a part of a text is arithmetic, or names what a law is made of."""
    if isinstance(node, ast.Import):
        return all(one.name in _MODULES for one in node.names)
    if isinstance(node, ast.ImportFrom):
        return node.level == 0 and node.module in _MODULES
    if isinstance(node, ast.Attribute):
        of_numpy = isinstance(node.value, ast.Name) and node.value.id == "np"
        return node.attr in _NUMPY if of_numpy else not node.attr.startswith("_")
    if isinstance(node, ast.Call):
        called = node.func
        return isinstance(called, ast.Attribute) or (
            isinstance(called, ast.Name) and called.id in _CALLED
        )
    return not isinstance(node, ast.With | ast.Try | ast.Raise | ast.ClassDef | ast.Lambda)
