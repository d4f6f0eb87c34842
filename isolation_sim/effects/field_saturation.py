"""The steel of the magnetic circuit saturates: the field grows less than the current.

Forms:

    knee    I' = I / (1 + (s |I|)^n)^(1/n)      n = 1 the Froelich-Kennelly curve
    tanh    I' = tanh(s I) / s

s is one over the current at which the field would saturate.
"""

from typing import Any

import numpy as np

from .effect import Effect, EffectParameter, Signals

TINY = 1e-9
"""Keeps the forms' derivatives finite at zero current and zero strength."""


def knee(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """The current that gives the same field in unsaturated steel."""
    saturation, n = parameters
    return signals.current / (1 + (saturation * np.fabs(signals.current) + TINY) ** n) ** (1 / n)


def tanh(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """The current that gives the same field in unsaturated steel."""
    (saturation,) = parameters
    ratio = saturation * np.fabs(signals.current) + TINY
    return signals.current * np.tanh(ratio) / ratio


STRENGTH = EffectParameter(
    "saturation", "1/A", "inverse of the saturation current", lower=0.0, upper=100.0,
    strength=True, starts=(0.5, 1.5),
)  # fmt: skip

FORMS = (
    Effect(
        cause="field_saturation",
        form="knee",
        title="Field saturation",
        parameters=(
            STRENGTH,
            EffectParameter(
                "exponent", "1", "sharpness of the knee", lower=1.0, upper=6.0, starts=(1.5, 4.0)
            ),
        ),
        current=knee,
        source="Froelich (1881), Kennelly (1891), with a free knee",
    ),
    Effect(
        cause="field_saturation",
        form="tanh",
        title="Field saturation, hyperbolic tangent",
        parameters=(STRENGTH,),
        current=tanh,
        source="Jiles (1991), Introduction to Magnetism and Magnetic Materials",
    ),
)
