"""Text of a compiled kernel: a copy of ordinary modules, written for one case.

A kernel imports its sizes, or the functions of a law, from a module that has those of one example.
The kernel itself therefore runs as it is. In a copy, the text for another case takes the place of
this import.

Numba's own analysis, not LLVM, takes most of the compile time, and it processes every constant and
every product. Known constants are therefore inserted first: offsets are summed, a loop with one
pass is replaced by its body, and a branch that cannot be taken is removed.
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Mapping, Sequence
from importlib import import_module
from importlib.util import resolve_name
from pathlib import Path
from types import ModuleType

from ground_motions.python_source import parse


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


_ARITHMETIC = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul,
    ast.FloorDiv: operator.floordiv,
}  # fmt: skip
_COMPARISONS = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.Gt: operator.gt,
}


def fold_constants(text: str, fields: Mapping[str, int] | None = None) -> str:
    """A module's text with inserted integer constants and unsigned array indices.

    ``fields`` are known fields of groups of arguments, such as ``sizes.n_elements``.
    """
    tree = parse(text)
    constants: dict[str, object] = dict(fields or {})
    for node in tree.body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            node.value = _Fold(constants).visit(node.value)
            if node.targets[0].id.isupper() and isinstance(node.value, ast.Constant | ast.Tuple):
                constants[node.targets[0].id] = ast.literal_eval(node.value)
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            node.body = _statements(_Fold(constants), node.body) or [ast.Pass()]
    tree = _UnsignedIndices().visit(tree)
    return ast.unparse(ast.fix_missing_locations(tree)) + "\n"


def _statements(visitor: ast.NodeTransformer, body: list[ast.stmt]) -> list[ast.stmt]:
    """Statements after a visit, which may replace one by several or none."""
    result: list[ast.stmt] = []
    for statement in body:
        new = visitor.visit(statement)
        result += new if isinstance(new, list) else [new] if new is not None else []
    return result


class _Fold(ast.NodeTransformer):
    """Insert known names; evaluate integer arithmetic, branches and loops from them."""

    def __init__(self, known: dict[str, object]):
        self.known = known

    def visit_Name(self, node: ast.Name) -> ast.expr:
        if isinstance(node.ctx, ast.Load) and isinstance(self.known.get(node.id), int):
            return ast.Constant(self.known[node.id])  # type: ignore[arg-type]
        return node

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        value = self.known.get(ast.unparse(node))
        return node if value is None else ast.Constant(value)  # type: ignore[arg-type]

    def visit_Subscript(self, node: ast.Subscript) -> ast.expr:
        self.generic_visit(node)
        place = _integer(node.slice)
        if isinstance(node.value, ast.Name) and place is not None:
            table = self.known.get(node.value.id)
            if isinstance(table, tuple) and isinstance(table[place], int):
                return ast.Constant(table[place])
        return node

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        self.generic_visit(node)
        left, right, kind = _integer(node.left), _integer(node.right), type(node.op)
        if left is not None and right is not None and kind in _ARITHMETIC:
            return ast.Constant(_ARITHMETIC[kind](left, right))
        if kind is ast.Mult and 0 in (left, right):
            return ast.Constant(0)
        if (kind is ast.Mult and left == 1) or (kind is ast.Add and left == 0):
            return node.right
        if (kind is ast.Mult and right == 1) or (kind in (ast.Add, ast.Sub) and right == 0):
            return node.left
        return node

    def visit_Compare(self, node: ast.Compare) -> ast.expr:
        self.generic_visit(node)
        left, right = _integer(node.left), _integer(node.comparators[0])
        kind = type(node.ops[0])
        if len(node.ops) == 1 and left is not None and right is not None and kind in _COMPARISONS:
            return ast.Constant(_COMPARISONS[kind](left, right))
        return node

    def visit_If(self, node: ast.If) -> ast.stmt | list[ast.stmt]:
        node.test = self.visit(node.test)
        condition = node.test.value if isinstance(node.test, ast.Constant) else None
        node.body = _statements(self, node.body) if condition is not False else []
        node.orelse = _statements(self, node.orelse) if condition is not True else []
        if condition is None:
            node.body = node.body or [ast.Pass()]
            return node
        return node.body + node.orelse

    def visit_For(self, node: ast.For) -> ast.stmt | list[ast.stmt]:
        node.iter = self.visit(node.iter)
        once = isinstance(node.iter, ast.Call) and [_integer(a) for a in node.iter.args] == [1]
        if not once or not isinstance(node.target, ast.Name) or any(map(_leaves, node.body)):
            node.body = _statements(self, node.body) or [ast.Pass()]
            return node
        return _statements(_Fold({**self.known, node.target.id: 0}), node.body)


def _integer(node: ast.expr) -> int | None:
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        value = _integer(node.operand)
        return None if value is None else -value
    return node.value if isinstance(node, ast.Constant) and type(node.value) is int else None


def _is_array(node: ast.expr) -> bool:
    """Whether a name or a group's field is an array rather than a tuple of constants."""
    name = node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")
    return name.islower()


def _leaves(node: ast.AST) -> bool:
    """Whether a statement leaves its loop or continues with the next pass."""
    if isinstance(node, ast.Break | ast.Continue | ast.For | ast.While):
        return isinstance(node, ast.Break | ast.Continue)
    return any(map(_leaves, ast.iter_child_nodes(node)))


class _UnsignedIndices(ast.NodeTransformer):
    """Make array indices unsigned, so that Numba omits the test for negative ones."""

    # For an index unknown at compile time this test takes much of the kernel's time.

    def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
        self.generic_visit(node)
        if _is_array(node.value):
            parts = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
            if any((_integer(part) or 0) < 0 for part in parts):
                raise ValueError(
                    f"internal error: negative index in {ast.unparse(node)}; expected in the "
                    "text of a kernel: indices from 0"
                )
            parts = [
                part
                if isinstance(part, ast.Constant | ast.Slice)
                else ast.Call(ast.Name("unsigned", ast.Load()), [part], [])
                for part in parts
            ]
            node.slice = ast.Tuple(parts, ast.Load()) if len(parts) > 1 else parts[0]
        return node
