"""Parsing of Python source in several threads."""

from __future__ import annotations

import ast
from threading import Lock

# in CPython 3.11 two threads may not parse at once (python/cpython#106905)
_PARSING = Lock()


def parse(text: str) -> ast.Module:
    """Syntax tree of a module's text."""
    with _PARSING:
        return ast.parse(text)
