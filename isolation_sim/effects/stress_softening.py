"""Mullins effect: rubber is softer below the largest deformation that it has seen.

Forms:

    ogden_roxburgh    1 - r tanh((X - |x|) / s)        soft below X, stiff again on the virgin path
    exponential       1 - r (1 - exp(-(X / s)^m))      damaged by X wherever it is now; S-shaped
                                                       where m is above 1
    hyperbolic        1 / (1 + c X)
    hill              1 - r u / (1 + u),   u = (X / s)^m
    power             (1 + X / s)^-n
    rubber            F - d x X / (X + s)              of the rubber alone: a friction, a lead core
                                                       or a fluid beside it do not soften
    rubber_below      F - d x tanh((X - |x|) / s)      the same, as ogden_roxburgh

``hill`` and ``power`` are the shapes of amplitude softening. Data decide between the two causes by
the memory alone, and not by the shape.

X is the largest |x| so far, followed within a lag of 2 ms; it never falls.
"""

from typing import Any

import numpy as np

from ..laws.in_plan import length
from ..laws.law import Quantity
from .effect import Effect, EffectInPlan, EffectParameter, Past, Signals
from .followers import hill as hill_curve
from .followers import positive, raised, rise


def ogden_roxburgh(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Share of the force that is left."""
    loss, length = parameters
    return 1 - loss * np.tanh(positive(states[0] - np.fabs(signals.x)) / length)


def exponential(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Share of the force that is left."""
    loss, length, sharpness = parameters
    return 1 + loss * np.expm1(-raised(positive(states[0]) / length, sharpness))


def hyperbolic(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Share of the force that is left."""
    return 1 / (1 + parameters[0] * positive(states[0]))


def hill(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Share of the force that is left."""
    loss, length, sharpness = parameters
    return 1 - loss * hill_curve(positive(states[0]), length, sharpness)


def power(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Share of the force that is left."""
    exponent, length = parameters
    return (1 + positive(states[0]) / length) ** (-exponent)


def rubber(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Force that the rubber has lost: half of it where the largest deformation is a length."""
    stiffness, length = parameters
    largest = positive(states[0])
    return -stiffness * signals.x * largest / (largest + length)


def rubber_below(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Force that the rubber has lost."""
    stiffness, length = parameters
    below = positive(states[0] - np.fabs(signals.x))
    return -stiffness * signals.x * np.tanh(below / length)


def rates(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """The largest deformation grows."""
    return (rise(np.fabs(signals.x), states[0]),)


def plan_rates(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """The largest length of the deformation grows."""
    return (rise(length(*signals.x), states[0]),)


def start(signals: Signals, parameters: tuple) -> tuple:
    """A test begins on rubber that has seen its first deformation alone."""
    return (np.fabs(signals.x),)


def carried(past: Past, parameters: tuple) -> tuple:
    """Earlier tests count."""
    return (past.deformation,)


LARGEST = Quantity("largest", "m", "largest deformation so far")
LOSS = EffectParameter(
    "loss", "1", "largest fraction of the force lost", lower=0.0, upper=0.95, magnitude=True,
    starts=(0.2, 0.5),
)  # fmt: skip
STIFFNESS = EffectParameter(
    "stiffness", "N/m", "largest stiffness lost", lower=0.0, magnitude=True, starts=(0.3,)
)


def _length(meaning: str) -> EffectParameter:
    return EffectParameter(
        "length", "m", meaning, lower=1e-6, upper=100.0, divides=True, starts=(0.1, 0.3, 1.0)
    )


_SHARPNESS = EffectParameter(
    "sharpness", "1", "sharpness of the onset", lower=0.5, upper=6.0, starts=(1.0, 2.0)
)
_COMMON: dict[str, Any] = {
    "cause": "stress_softening",
    "states": (LARGEST,),
    "start": start,
    "carried": carried,
    "rates": rates,
}

FORMS = (
    Effect(
        form="ogden_roxburgh",
        title="Stress softening (Mullins)",
        parameters=(LOSS, _length("deformation below the largest one, over which force is lost")),
        factor=ogden_roxburgh,
        source="Ogden & Roxburgh (1999), with deformation in place of energy",
        **_COMMON,
    ),
    Effect(
        form="exponential",
        title="Stress softening (Mullins), exponential damage",
        parameters=(
            LOSS,
            _length("largest deformation over which force is lost"),
            _SHARPNESS,
        ),
        factor=exponential,
        source="Miehe (1995), discontinuous damage, with Weibull's exponent",
        **_COMMON,
    ),
    Effect(
        form="hyperbolic",
        title="Stress softening (Mullins), hyperbolic damage",
        parameters=(
            EffectParameter(
                "loss", "1/m", "loss per largest deformation", lower=0.0, upper=1e4,
                magnitude=True, starts=(0.2, 1.0),
            ),
        ),
        factor=hyperbolic,
        source="damage 1 / (1 + c X) of the largest deformation",
        plan=EffectInPlan(rates=plan_rates, factor=hyperbolic),
        **_COMMON,
    ),
    Effect(
        form="hill",
        title="Stress softening (Mullins), Hill's curve",
        parameters=(LOSS, _length("largest deformation at which half of this is lost"), _SHARPNESS),
        factor=hill,
        source="shape of Kraus (1984), of the largest deformation",
        **_COMMON,
    ),
    Effect(
        form="power",
        title="Stress softening (Mullins), power law",
        parameters=(
            EffectParameter(
                "exponent", "1", "exponent of the largest deformation", lower=0.0, upper=2.0,
                magnitude=True, starts=(0.2, 0.5),
            ),
            _length("largest deformation above which the power law holds"),
        ),
        factor=power,
        source="power law of the largest deformation, flat below its knee",
        **_COMMON,
    ),
    Effect(
        form="rubber",
        title="Stress softening (Mullins) of rubber beside lead, sliders or friction",
        parameters=(STIFFNESS, _length("largest deformation at which half of it is lost")),
        force=rubber,
        source="damage X / (X + s) of the largest deformation, of the rubber alone",
        **_COMMON,
    ),
    Effect(
        form="rubber_below",
        title="Stress softening (Mullins) of rubber alone, below its largest deformation",
        parameters=(STIFFNESS, _length("deformation below the largest one, over which it is lost")),
        force=rubber_below,
        source="Ogden & Roxburgh (1999), of the rubber alone",
        **_COMMON,
    ),
)  # fmt: skip
