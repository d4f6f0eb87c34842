"""Tasks of further processes that compile laws before they are needed."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass

from ..laws.registry import LAWS
from .sensitivities import compile_law, is_compiled


@dataclass(frozen=True)
class LawCompilation:
    """Task: compile the simulation of a law."""

    law: str  # Its name

    def run(self) -> None:
        """Compile to the cache folder."""
        with suppress(Exception):  # the fit says what is wrong
            compile_law(LAWS[self.law])


def laws_to_compile(laws: Iterable[str] = LAWS) -> list[LawCompilation]:
    """Tasks for the laws that are not compiled yet, from the one that is needed last."""
    return [LawCompilation(name) for name in reversed([*laws]) if not is_compiled(LAWS[name])]
