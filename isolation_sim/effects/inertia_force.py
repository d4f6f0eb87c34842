"""Inertia of the masses between the specimen and the load cell: a plate, the device's top.

Forms:

    mass    m a
"""

from typing import Any

from .effect import Effect, EffectParameter, Signals


def force(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Mass times acceleration."""
    return parameters[0] * signals.a


FORMS = (
    Effect(
        cause="inertia_force",
        form="mass",
        title="Inertia force",
        parameters=(EffectParameter("mass", "kg", "moving mass", magnitude=True, starts=(0.05,)),),
        force=force,
        needs=frozenset({"acceleration"}),
        source="Newton (1687)",
    ),
)
