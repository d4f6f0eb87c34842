"""The steel of the magnetic circuit saturates: the field grows less than the current.

Forms:

    knee    I' = I / (1 + (s |I|)^n)^(1/n)      n = 1 the Froelich-Kennelly curve
    tanh    I' = tanh(s I) / s
    slope   I' = (1 - d) I + d I / (1 + |I / I_k|^n)^(1/n)

s is one over the current at which the field would saturate. The field of the coil itself does
not saturate: the slope falls by d beyond the knee at I_k.
"""

from typing import Any

import numpy as np

from .effect import Effect, EffectParameter, Signals

TINY = 1e-9
"""Keeps the forms' derivatives finite at zero current and zero magnitude."""


def knee(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """The current that gives the same field in unsaturated steel."""
    saturation, n = parameters
    return signals.current / (1 + (saturation * np.fabs(signals.current) + TINY) ** n) ** (1 / n)


def tanh(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """The current that gives the same field in unsaturated steel."""
    (saturation,) = parameters
    ratio = saturation * np.fabs(signals.current) + TINY
    return signals.current * np.tanh(ratio) / ratio


def slope(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """The current that gives the same field in unsaturated steel."""
    decrease, current, n = parameters
    saturated = knee(signals, states, (1 / current, n))
    return signals.current + decrease * (saturated - signals.current)


SATURATION = EffectParameter(
    "saturation", "1/A", "inverse of the saturation current", lower=0.0, upper=100.0,
    magnitude=True, starts=(0.5, 1.5),
)  # fmt: skip

EXPONENT = EffectParameter(
    "exponent", "1", "sharpness of the knee", lower=0.7, upper=12.0, starts=(1.5, 4.0),
    plain=(12.0,),
)  # fmt: skip
"""At the upper bound both branches are straight lines."""

FORMS = (
    Effect(
        cause="field_saturation",
        form="knee",
        title="Field saturation",
        parameters=(SATURATION, EXPONENT),
        current=knee,
        source="Froelich (1881), Kennelly (1891), with a free knee",
    ),
    Effect(
        cause="field_saturation",
        form="tanh",
        title="Field saturation, hyperbolic tangent",
        parameters=(SATURATION,),
        current=tanh,
        source="Jiles (1991), Introduction to Magnetism and Magnetic Materials",
    ),
    Effect(
        cause="field_saturation",
        form="slope",
        title="Field saturation with a slope that remains",
        parameters=(
            EffectParameter(
                "decrease", "1", "decrease of the slope beyond the knee", lower=0.0, upper=1.0,
                magnitude=True, starts=(0.5,), plain=(1.0,),
            ),
            EffectParameter(
                "current", "A", "current at the knee", lower=1e-3, upper=1e3, divides=True,
                starts=(0.3, 0.5, 0.75),
            ),
            EXPONENT,
        ),
        current=slope,
        source="Jiles (1991), Introduction to Magnetism and Magnetic Materials: B = mu_0 (H + M)",
    ),
)  # fmt: skip
