"""Play in the bolts: the device does not feel the first part of a deformation."""

from typing import Any

import numpy as np

from isolation_sim.effects import Effect, EffectParameter, Signals


def motion(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Deformation and velocity that reach the device."""
    (gap,) = parameters
    beyond: Any = np.fabs(signals.x) - gap
    touches = beyond > 0
    return beyond * touches * np.sign(signals.x), signals.v * touches


GAP = EffectParameter("gap", "m", "play to either side", lower=0.0, magnitude=True, starts=(0.1,))
FORMS = (
    Effect(
        cause="slack",
        form="symmetric",
        title="Play in the bolts",
        parameters=(GAP,),
        motion=motion,
        source="geometry",
    ),
)
