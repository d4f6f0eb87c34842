"""Effects of a device that keeps its history from run to run, as one specimen in a test series.

An effect of the catalogue begins each run on a fresh device. Here its state begins where the
earlier runs have left it, held-out runs included, in the order in which the campaign lists them.
Only states that follow from the measured motion, current and force can begin so. A state that
recovers in rests of unknown length begins between zero and the end of the run before, where the
run's own forces are best met.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ...effects import Effect, Past
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


def keeps_history(effect: Effect) -> bool:
    """Whether an effect's state goes on from run to run."""
    return isinstance(effect, CarriedHistory)


def has_unknown_starts(effect: Effect) -> bool:
    """Whether an effect's state at the start of each run is fitted to the run."""
    return keeps_history(effect) and effect.recovery is not None


def can_carry_history(effect: Effect) -> bool:
    """Whether an effect's states follow from the measured history of a device."""
    return effect.carried is not None


def of_device(effect: Effect) -> Effect:
    """The effect of the catalogue, for a device that is fresh when a simulation begins."""
    return effect.fresh if isinstance(effect, CarriedHistory) and effect.fresh else effect


def first_states(effect: Effect, data: MeasuredRuns, first: NDArray, p: NDArray) -> NDArray:
    """States at the start of each run, (n_runs, n_states), from those of a fresh device."""
    if not keeps_history(effect) or effect.carried is None or data.past is None:
        return first
    return np.maximum(first, np.column_stack(effect.carried(data.past, tuple(p))))


def after_rests(
    effect: Effect, data: MeasuredRuns, force: NDArray, factor: NDArray, first: NDArray, p: NDArray
) -> NDArray:
    """Move the states at the start of each run, (n_runs, 1), by a step to the forces of the run."""
    # ``force``: of the law, N; ``factor``: of the effect that begins with ``first``, (n_samples,)
    assert effect.carried is not None and effect.recovery is not None and data.past is not None
    time = effect.recovery(tuple(p))
    before = effect.carried(data.past, tuple(p))[0]  # each run, without recovery
    result, most, so_far = np.zeros_like(first), 0.0, 0.0
    for k, run in enumerate(data.runs):
        # runs that are left out here were made all the same
        most += max(float(before[k]) - so_far, 0.0)
        simulated = force[run] * factor[run]
        slope = simulated * np.exp(-np.arange(len(simulated)) * data.dt[k] / time)
        step = (simulated - data.force[run]) @ slope / max(slope @ slope, 1e-300)
        result[k] = np.clip(first[k] + step, 0.0, most)
        most = max(-float(np.log(max(factor[run][-1], 1e-300))), 0.0)
        own = Past(0.0, 0.0, 0.0, 0.0, data.force[run] @ data.v[run] * data.dt[k])
        so_far = float(before[k] + effect.carried(own, tuple(p))[0])
    return result
