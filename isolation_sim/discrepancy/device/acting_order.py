"""Effects on the current that act before those found earlier.

An effect acts after those already there. Effects on the current do not commute: a gap weakens the
field of a current that lags, while a lag found later would follow the field that the gap weakens.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import lru_cache

from ...effects import Effect


@dataclass(frozen=True, eq=False)
class ActsFirst(Effect):
    """A form of an effect of the catalogue that acts before the others."""

    form_behind: Effect | None = None  # The form that acts after them


@lru_cache(maxsize=64)
def act_first(effect: Effect) -> ActsFirst:
    """An effect that acts before the others."""
    same = {one.name: getattr(effect, one.name) for one in fields(Effect)}
    form, title = f"{effect.form}, first", f"{effect.title}, before the other effects"
    return ActsFirst(**{**same, "form": form, "title": title}, form_behind=effect)


def either_order(effects: Sequence[Effect], beside: Sequence[Effect]) -> list[Effect]:
    """Effects to try beside others: those on the current behind these, and before them."""
    if not any(effect.current is not None for effect in beside):
        return list(effects)
    first = (e for e in effects if e.current is not None and type(e) is Effect)
    return [*effects, *map(act_first, first)]


def acting_order(effects: Sequence[Effect]) -> list[int]:
    """Places of effects in the order in which they act."""
    return sorted(range(len(effects)), key=lambda k: not isinstance(effects[k], ActsFirst))
