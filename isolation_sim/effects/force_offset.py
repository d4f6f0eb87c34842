"""A constant force: preload of the device, or a sensor that was not set to zero.

Forms:

    constant        `level` is added: preload, or the zero of the load cell
    displacement    the law acts on x' = x - `offset`: the zero of the displacement sensor; its
                    force follows the stiffness, with the current and with the deformation
"""

from typing import Any

from .effect import Effect, EffectParameter, Signals


def force(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """The offset."""
    return parameters[0]


def stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:
    """Potential of a constant force."""
    return parameters[0] * x


def motion(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """The motion about the device's own zero."""
    return signals.x - parameters[0], signals.v


FORMS = (
    Effect(
        cause="force_offset",
        form="constant",
        title="Force offset",
        parameters=(
            EffectParameter("level", "N", "offset of the force", magnitude=True, starts=(0.1,)),
        ),
        force=force,
        stored_energy=stored_energy,
        source="preload F0 of the Bouc-Wen dampers' models: Spencer et al. (1997)",
    ),
    Effect(
        cause="force_offset",
        form="displacement",
        title="Force offset, by the zero of the displacement",
        parameters=(
            EffectParameter(
                "offset", "m", "displacement recorded where the device is not deformed",
                magnitude=True, starts=(0.05,),
            ),
        ),
        motion=motion,
        of_device=False,
        source="zero of the displacement sensor",
    ),
)  # fmt: skip
