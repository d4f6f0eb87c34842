"""A cold device is stiff, a warm one soft. Reference: 20 deg C.

Forms:

    exponential    factor exp(-b (T - 20))
    linear         factor max(1 - b (T - 20), 0)
    arrhenius      factor exp(E (1 / T_K - 1 / 293.15)),   E activation energy over gas constant
"""

from typing import Any

import numpy as np

from .effect import REFERENCE_TEMPERATURE, Effect, EffectParameter, Signals
from .followers import positive

ABSOLUTE_ZERO = -273.15
"""deg C."""


def exponential(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Force over that at the reference temperature."""
    return np.exp(-parameters[0] * (signals.temperature - REFERENCE_TEMPERATURE))


def linear(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Force over that at the reference temperature."""
    return positive(1 - parameters[0] * (signals.temperature - REFERENCE_TEMPERATURE))


def arrhenius(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Force over that at the reference temperature."""
    here, reference = signals.temperature, REFERENCE_TEMPERATURE
    return np.exp(parameters[0] * (1 / (here - ABSOLUTE_ZERO) - 1 / (reference - ABSOLUTE_ZERO)))


SOFTENING = EffectParameter(
    "softening", "1/degC", "relative loss of force with temperature", lower=-0.1, upper=0.1,
    strength=True, starts=(0.005,),
)  # fmt: skip
ACTIVATION = EffectParameter(
    "activation", "K", "activation energy over gas constant", lower=-1e4, upper=1e4,
    strength=True, starts=(500.0,),
)  # fmt: skip

FORMS = tuple(
    Effect(
        cause="ambient_temperature",
        form=factor.__name__,
        title=title,
        parameters=(strength,),
        factor=factor,
        needs=frozenset({"temperature"}),
        source=source,
    )
    for factor, title, strength, source in (
        (exponential, "Ambient temperature", SOFTENING, "exponential softening of elastomers"),
        (linear, "Ambient temperature, linear", SOFTENING, "first order in the temperature"),
        (arrhenius, "Ambient temperature, Arrhenius", ACTIVATION, "Arrhenius (1889)"),
    )
)
