"""Effects of a device that keeps its history from run to run, as one specimen in a test series.

An effect of the catalogue begins each run on a fresh device. Here its state begins where the
earlier runs have left it, held-out runs included, in the order in which the campaign lists them.
Only states that follow from the measured motion, current and force can begin so.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ...effects import Effect
from ...identification.measured_runs import MeasuredRuns

@dataclass(frozen=True, eq=False)
class CarriedHistory(Effect):
    """A form of an effect of the catalogue whose state goes on from run to run."""

    fresh: Effect | None = None  # The form that begins on a fresh device


@lru_cache(maxsize=64)
def carry_history(effect: Effect) -> CarriedHistory:
    """An effect whose state goes on from run to run."""
    same = {one.name: getattr(effect, one.name) for one in fields(Effect)}
    form, title = f"{effect.form}, kept", f"{effect.title}, kept from run to run"
    return CarriedHistory(**{**same, "form": form, "title": title}, fresh=effect)


def can_carry_history(effect: Effect) -> bool:
    """Whether an effect's states follow from the measured history of a device."""
    return effect.carried is not None


def of_device(effect: Effect) -> Effect:
    """The effect of the catalogue, for a device that is fresh when a simulation begins."""
    return effect.fresh if isinstance(effect, CarriedHistory) and effect.fresh else effect


def first_states(effect: Effect, data: MeasuredRuns, first: NDArray, p: NDArray) -> NDArray:
    """States at the start of each run, (n_runs, n_states), from those of a fresh device."""
    if not isinstance(effect, CarriedHistory) or effect.carried is None or data.past is None:
        return first
    return np.maximum(first, np.column_stack(effect.carried(data.past, tuple(p))))
