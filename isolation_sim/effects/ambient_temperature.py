"""A cold device is stiff, a warm one soft. Reference: 20 deg C.

Forms:

    exponential    factor exp(-b (T - 20))
    linear         factor max(1 - b (T - 20), 0)
    arrhenius      factor exp(E (1 / T_K - 1 / 293.15)),   E activation energy over gas constant
    vogel          factor exp(-b (T - 20) D / (D + T - 20)),   D degrees from 20 deg C down to
                   Vogel's temperature: softer the faster, the colder it is
    core           the factor of exponential for F - k x alone: of a lead core or a slider beside
                   rubber of stiffness k, which keeps its force
    fluid          the factor of exponential for a part c v of F alone: the fluid thins, and a yield
                   force, a friction or a spring keeps its value
    superposition  time-temperature superposition: all times of the law have the factor of vogel,
                   so that relaxation is quicker and dashpots are softer, the warmer it is
"""

from typing import Any

import numpy as np

from .effect import REFERENCE_TEMPERATURE, Effect, EffectParameter, Signals
from .followers import FLUID, RUBBER, of_core, positive

ABSOLUTE_ZERO = -273.15
"""deg C."""
LEAST_ABOVE_VOGEL = 5.0
"""deg C. Closer to Vogel's temperature the force grows no further."""


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


def vogel(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Force, or relaxation times, over those at the reference temperature."""
    softening, distance = parameters
    above = signals.temperature - REFERENCE_TEMPERATURE
    # no device of these parameters is tested near or below Vogel's temperature
    left = LEAST_ABOVE_VOGEL + positive(distance + above - LEAST_ABOVE_VOGEL)
    return np.exp(-softening * above * distance / left)


def core(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Force of the core beyond that at the reference temperature."""
    return (exponential(signals, states, parameters) - 1) * of_core(signals, parameters[1])


def fluid(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Force of the fluid beyond that at the reference temperature."""
    return (exponential(signals, states, parameters) - 1) * parameters[1] * signals.v


SOFTENING = EffectParameter(
    "softening", "1/degC", "relative loss of force with temperature", lower=-0.1, upper=0.1,
    magnitude=True, starts=(0.005,),
)  # fmt: skip
ACTIVATION = EffectParameter(
    "activation", "K", "activation energy over gas constant", lower=-1e4, upper=1e4,
    magnitude=True, starts=(500.0,),
)  # fmt: skip
VOGEL = EffectParameter(
    "distance", "degC", "degrees from 20 deg C down to Vogel's temperature",
    lower=40.0, upper=300.0, starts=(110.0,),
)  # fmt: skip

SHIFT = EffectParameter(
    "softening", "1/degC", "relative loss of relaxation times and viscosities with temperature",
    lower=-0.3, upper=0.3, magnitude=True, starts=(0.03,),
)  # fmt: skip

FORMS = (
    *(
        Effect(
            cause="ambient_temperature",
            form=factor.__name__,
            title=title,
            parameters=parameters,
            factor=factor,
            needs=frozenset({"temperature"}),
            source=source,
        )
        for factor, title, parameters, source in (
            (
                exponential, "Ambient temperature", (SOFTENING,),
                "exponential softening of elastomers",
            ),
            (linear, "Ambient temperature, linear", (SOFTENING,), "first order in the temperature"),
            (arrhenius, "Ambient temperature, Arrhenius", (ACTIVATION,), "Arrhenius (1889)"),
            (
                vogel, "Ambient temperature, far above Vogel's temperature", (SOFTENING, VOGEL),
                "Vogel (1921); Williams, Landel and Ferry (1955)",
            ),
        )
    ),
    Effect(
        cause="ambient_temperature",
        form="core",
        title="Ambient temperature, of the core",
        parameters=(SOFTENING, RUBBER),
        force=core,
        needs=frozenset({"temperature", "force"}),
        source="Kalpakidis & Constantinou (2009): the lead's yield force follows the temperature",
    ),
    Effect(
        cause="ambient_temperature",
        form="fluid",
        title="Ambient temperature, of the fluid",
        parameters=(SOFTENING, FLUID),
        force=fluid,
        needs=frozenset({"temperature"}),
        source="Gordaninejad & Breese (1999): the viscosity falls, the yield stress hardly does",
    ),
    Effect(
        cause="ambient_temperature",
        form="superposition",
        title="Ambient temperature, of the relaxation times",
        parameters=(SHIFT, VOGEL),
        time_scale=vogel,
        needs=frozenset({"temperature"}),
        source="Williams, Landel and Ferry (1955)",
    ),
)  # fmt: skip
