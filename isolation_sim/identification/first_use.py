"""Tasks of further processes that compile laws before they are needed."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from functools import partial

from ..laws.registry import LAWS
from ..workers import Task
from .device_kernel_text import is_compiled
from .sensitivities import compile_law


def laws_to_compile(laws: Iterable[str] = LAWS) -> list[Task[None]]:
    """Tasks for the laws that are not compiled yet, from the one that is needed last."""
    return [partial(_compile, name) for name in reversed([*laws]) if not is_compiled(LAWS[name])]


def _compile(law: str) -> None:
    with suppress(Exception):  # the fit says what is wrong
        compile_law(LAWS[law])
