"""A constant force: preload of the device, or a load cell that was not set to zero."""

from typing import Any

from .effect import Effect, EffectParameter, Signals


def force(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """The offset."""
    return parameters[0]


def stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:
    """Potential of a constant force."""
    return parameters[0] * x


FORMS = (
    Effect(
        cause="force_offset",
        form="constant",
        title="Force offset",
        parameters=(EffectParameter("level", "N", "the force", strength=True, starts=(0.1,)),),
        force=force,
        stored_energy=stored_energy,
        source="preload F0 of the Bouc-Wen dampers' models: Spencer et al. (1997)",
    ),
)
