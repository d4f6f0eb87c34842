"""Tasks of further processes that compile effects before they are needed."""

from __future__ import annotations

from contextlib import suppress
from functools import partial

from ...effects import EFFECTS
from ...workers import Task
from .effect_evaluation import compile_effect
from .effect_kernel_text import is_compiled


def effects_to_compile() -> list[Task[None]]:
    """Tasks for the effects that are not compiled yet, from the one that is needed last."""
    # of the derivatives some are never needed: they come after the effects
    return [
        partial(_compile, cause, k, differentiated)
        for differentiated in (False, True)
        for cause, forms in reversed([*EFFECTS.items()])
        for k, form in enumerate(forms)
        if not is_compiled(form, differentiated)
    ]


def _compile(cause: str, form: int, differentiated: bool) -> None:
    """Compile a form of an effect, by its number, or its derivatives."""
    with suppress(Exception):  # the search says what is wrong
        compile_effect(EFFECTS[cause][form], differentiated)
