"""Tasks of further processes that compile effects before they are needed."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

from ...effects import EFFECTS
from .effect_evaluation import compile_effect, is_compiled


@dataclass(frozen=True)
class EffectCompilation:
    """Task: compile a form of an effect, or its derivatives."""

    cause: str  # Name of the effect
    form: int  # Its number
    differentiated: bool  # Whether the derivatives are compiled

    def run(self) -> None:
        """Compile to the cache folder."""
        with suppress(Exception):  # the search says what is wrong
            compile_effect(EFFECTS[self.cause][self.form], self.differentiated)


def effects_to_compile() -> list[EffectCompilation]:
    """Tasks for the effects that are not compiled yet, from the one that is needed last."""
    # of the derivatives some are never needed: they come after the effects
    return [
        EffectCompilation(cause, k, differentiated)
        for differentiated in (False, True)
        for cause, forms in reversed([*EFFECTS.items()])
        for k, form in enumerate(forms)
        if not is_compiled(form, differentiated)
    ]
