"""The device warms by its dissipation, and warm rubber and warm fluid are weaker.

One thermal body, h' = gain F v - h / cooling, where h is temperature rise times sensitivity.

Forms:

    exponential    factor exp(-h)
    hyperbolic     factor 1 / (1 + h)

F is the force after the factor, so that a device that weakens heats less. Elastic work swings h
within a cycle and cancels over it; only h > 0 weakens.
"""

from typing import Any

import numpy as np

from ..laws.law import Quantity
from .effect import Effect, EffectParameter, Signals
from .followers import positive


def exponential(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Share of the force that is left."""
    return np.exp(-positive(states[0]))


def hyperbolic(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Share of the force that is left."""
    return 1 / (1 + positive(states[0]))


def rates_exponential(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Heat in, heat out."""
    return (_rate(signals, states[0], exponential(signals, states, parameters), parameters),)


def rates_hyperbolic(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Heat in, heat out."""
    return (_rate(signals, states[0], hyperbolic(signals, states, parameters), parameters),)


def _rate(signals: Signals, h: Any, factor: Any, parameters: tuple) -> Any:
    gain, cooling = parameters
    return gain * factor * signals.force * signals.v - h / cooling


PARAMETERS = (
    EffectParameter(
        "gain", "1/J", "loss of force for work done", lower=0.0, strength=True,
        starts=(0.02, 0.1),
    ),
    EffectParameter(
        "cooling", "s", "time constant of cooling", lower=1.0, upper=1e5, divides=True,
        starts=(5.0, 20.0, 100.0),
    ),
)  # fmt: skip
WARMTH = Quantity("warmth", "1", "temperature rise times sensitivity")

FORMS = (
    Effect(
        cause="self_heating",
        form="exponential",
        title="Self-heating",
        parameters=PARAMETERS,
        states=(WARMTH,),
        rates=rates_exponential,
        factor=exponential,
        needs=frozenset({"force"}),
        source="lumped heat balance; Kalpakidis & Constantinou (2009) for lead-rubber bearings",
    ),
    Effect(
        cause="self_heating",
        form="hyperbolic",
        title="Self-heating, hyperbolic",
        parameters=PARAMETERS,
        states=(WARMTH,),
        rates=rates_hyperbolic,
        factor=hyperbolic,
        needs=frozenset({"force"}),
        source="lumped heat balance, viscosity falling as 1 / (1 + h)",
    ),
)
