"""Effects that the runs of device tests could show: what they depend on varies in them."""

from __future__ import annotations

import numpy as np

from ...effects import EFFECTS, Effect
from ...effects.extend import check_effect
from ...identification.measured_runs import MeasuredRuns
from ..decisions import STEADY_CURRENT
from .carried_history import can_carry_history, carry_history, keeps_history
from .model import EACH_RUN


def observable_effects(data: MeasuredRuns) -> list[Effect]:
    """Effects that the runs could show."""
    current_varies = bool(np.ptp(data.current) > 0)
    warmth_varies = data.has_temperature and bool(np.ptp(data.temperature) > 0.5)
    effects = [
        effect
        for forms in EFFECTS.values()
        for effect in forms
        if ((effect.current is None and "current" not in effect.needs) or current_varies)
        and ("temperature" not in effect.needs or warmth_varies)
    ]
    for effect in effects:
        check_effect(effect)
    several = len(data.dt) > 2
    if several and data.past is not None:
        effects += [carry_history(effect) for effect in effects if can_carry_history(effect)]
    changes, falls = _current_history(data)
    effects = [
        effect
        for effect in effects
        if not _remembers_current(effect) or changes or (keeps_history(effect) and falls)
    ]
    return [EACH_RUN, *effects] if several else effects


def _remembers_current(effect: Effect) -> bool:
    return effect.current is not None and bool(effect.states)


def _current_history(data: MeasuredRuns) -> tuple[bool, bool]:
    """Whether the current changes within a run, and whether it falls from run to run.

    Where it does neither, a memory of the current shows no more than a saturation does.
    """
    least = STEADY_CURRENT * float(np.max(np.abs(data.current)))
    currents = [data.current[run] for run in data.runs]
    changes = any(np.ptp(one) > least for one in currents)
    before = np.zeros(len(currents)) if data.past is None else data.past.current
    return changes, any(before - np.array([np.max(one) for one in currents]) > least)
