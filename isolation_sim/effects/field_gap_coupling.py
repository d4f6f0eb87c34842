"""The field weakens as the device deforms: the magnetic circuit opens (Li & Li, Section 4.2).

Forms:

    field          I' = I max(1 - e |x|, 0)
    reluctance     I' = I / (1 + (e x)^2)          a longer path in series with the rest
    off_centre     I' = I / (1 + (e (x - x_c))^2)  the same around another position
    hill           I' = I max(1 - d r^m / (1 + r^m), 0),   r = |x| / A
                   poles that lie over each other up to some deformation, or a field of which a part
                   finds another way
    whole_force    factor max(1 - e |x|, 0)        Li & Li, Eq 15: every parameter shrinks alike
"""

from typing import Any

import numpy as np

from .effect import Effect, EffectParameter, Signals
from .followers import hill as hill_curve
from .followers import positive


def field(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """The current that gives the same field without deformation."""
    return signals.current * positive(1 - parameters[0] * np.fabs(signals.x))


def reluctance(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """The current that gives the same field without deformation."""
    return signals.current / (1 + (parameters[0] * signals.x) ** 2)


def off_centre(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """The current that gives the same field with the poles in line."""
    loss, centre = parameters
    return signals.current / (1 + (loss * (signals.x - centre)) ** 2)


def hill(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """The current that gives the same field without deformation."""
    loss, half, m = parameters
    return signals.current * positive(1 - loss * hill_curve(np.fabs(signals.x), half, m))


def whole_force(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Share of the force that is left."""
    return positive(1 - parameters[0] * np.fabs(signals.x))


LOSS = EffectParameter(
    "loss", "1/m", "loss of field with deformation", lower=0.0, upper=1e4, magnitude=True,
    starts=(0.1, 0.4),
)  # fmt: skip

FORMS = (
    Effect(
        cause="field_gap_coupling",
        form="field",
        title="Field-gap coupling",
        parameters=(LOSS,),
        current=field,
        source="Li & Li, Section 4.2",
    ),
    Effect(
        cause="field_gap_coupling",
        form="reluctance",
        title="Field-gap coupling by reluctance",
        parameters=(LOSS,),
        current=reluctance,
        source="magnetic circuit with a gap that grows as x^2",
    ),
    Effect(
        cause="field_gap_coupling",
        form="off_centre",
        title="Field-gap coupling by reluctance, off centre",
        parameters=(
            LOSS,
            EffectParameter(
                # further out the field grows from one side to the other: an asymmetry
                "centre", "m", "deformation at which the poles are in line", lower=-100.0,
                upper=100.0, starts=(0.15, -0.15), most=0.3,
            ),
        ),
        current=off_centre,
        source="magnetic circuit whose poles are not in line at rest",
    ),
    Effect(
        cause="field_gap_coupling",
        form="hill",
        title="Field-gap coupling by Hill's curve",
        parameters=(
            EffectParameter(
                # above 1 the field vanishes at some deformation
                "loss", "1", "largest fraction of the field lost", lower=0.0, upper=2.0,
                magnitude=True, starts=(0.3, 0.8),
            ),
            EffectParameter(
                "half", "m", "deformation at which half of this is lost", lower=1e-7, upper=100.0,
                divides=True, starts=(0.4, 1.0),
            ),
            EffectParameter(
                "exponent", "1", "sharpness of the loss", lower=0.5, upper=6.0, starts=(2.0,)
            ),
        ),
        current=hill,
        source="magnetic circuit of poles that slide past each other, with leakage beside it",
    ),
    Effect(
        cause="field_gap_coupling",
        form="whole_force",
        title="Field-gap coupling of the whole force",
        parameters=(LOSS,),
        factor=whole_force,
        source="Li & Li, Eq 15",
    ),
)  # fmt: skip
