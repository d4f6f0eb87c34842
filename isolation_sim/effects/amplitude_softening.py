"""Payne effect: filled rubber softens with the present amplitude and recovers when it falls.

Forms:

    kraus            1 - d r^m / (1 + r^m),   r = A / A_c
    power            (1 + A / A_c)^-n
    power_by_current (1 + A / A_c)^-n(1 + m I): the field's part softens more, or less
    mean_square      Kraus' factor with the amplitude from a moving mean square
    instantaneous    Kraus' factor with |x| in place of the amplitude
    network          1 - d (1 - s), s' = (1 - s) / memory - |v| s / length: the filler's network
                     breaks with the motion and is built again, as in thixotropy
    storage          F - d x r^m / (1 + r^m): the storage modulus alone falls, a spring d is lost

A is sensed from the motion: a peak of |x| is followed at once (2 ms) and forgotten over the time
`memory`, or A = sqrt(2 <x^2>) with the mean over `memory`.
"""

from typing import Any

import numpy as np

from ..laws.law import Quantity
from .effect import Effect, EffectInPlan, EffectParameter, Signals
from .followers import amplitude, hill, positive, rise_and_fade


def kraus(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Share of the force that is left."""
    loss, half, m, _ = parameters
    return 1 - loss * hill(positive(states[0]), half, m)


def power(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Share of the force that is left."""
    n, half, _ = parameters
    return (1 + positive(states[0]) / half) ** (-n)


def power_by_current(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Share of the force that is left."""
    n, by_current, half, _ = parameters
    return (1 + np.fabs(states[0]) / half) ** (-n * (1 + by_current * signals.current))


def mean_square(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Share of the force that is left."""
    loss, half, m, _ = parameters
    return 1 - loss * hill(amplitude(states[0]), half, m)


def instantaneous(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Share of the force that is left."""
    loss, half, m = parameters
    return 1 - loss * hill(np.fabs(signals.x), half, m)


def network(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Share of the force that is left."""
    return 1 - parameters[0] * (1 - positive(states[0]))


def storage(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Force that the spring has lost."""
    stiffness, half, m, _ = parameters
    return -stiffness * signals.x * hill(positive(states[0]), half, m)


def rates_network(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Recovery, less what the motion breaks."""
    _, length, memory = parameters
    return ((1 - states[0]) / memory - np.fabs(signals.v) / length * states[0],)


def start_network(signals: Signals, parameters: tuple) -> tuple:
    """Whole after a rest."""
    return (1.0,)


def rates_peak(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Amplitude up at once, down over the memory."""
    return (rise_and_fade(np.fabs(signals.x), states[0], parameters[-1]),)


def start_peak(signals: Signals, parameters: tuple) -> tuple:
    """The first deformation is all that is known."""
    return (np.fabs(signals.x),)


def rates_mean(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Moving mean of the square."""
    return ((signals.x**2 - states[0]) / parameters[-1],)


def plan_rates_mean(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Moving mean of the squared length of the deformation."""
    x, y = signals.x
    return ((x**2 + y**2 - states[0]) / parameters[-1],)


def start_mean(signals: Signals, parameters: tuple) -> tuple:
    """The first deformation is all that is known."""
    return (signals.x**2,)


LOSS = EffectParameter(
    "loss", "1", "largest fraction of the force lost", lower=0.0, upper=0.95, magnitude=True,
    starts=(0.3, 0.6),
)  # fmt: skip
HALF = EffectParameter(
    "half", "m", "amplitude at which half of this is lost", lower=1e-7, upper=100.0, divides=True,
    starts=(0.1, 0.4, 1.0),
)  # fmt: skip
EXPONENT = EffectParameter(
    "exponent", "1", "exponent of the amplitude (Kraus' 2 m)", lower=0.5, upper=4.0, starts=(1.2,)
)
POWER = EffectParameter(
    "exponent", "1", "exponent of the amplitude", lower=0.0, upper=2.0, magnitude=True,
    starts=(0.2, 0.5),
)  # fmt: skip
KNEE = EffectParameter(
    "half", "m", "amplitude above which the power law holds", lower=1e-7, upper=100.0, divides=True,
    starts=(0.05, 0.3),
)  # fmt: skip
# what is remembered for longer is the largest deformation: stress softening; what is forgotten at
# once is no amplitude, but the deformation itself, as of a spring with a bend
MEMORY = EffectParameter(
    "memory", "s", "time constant of forgetting", lower=0.02, upper=10.0, divides=True,
    starts=(0.5, 3.0), other=(0.02,),
)  # fmt: skip
PEAK = Quantity("amplitude", "m", "present amplitude")

FORMS = (
    Effect(
        cause="amplitude_softening",
        form="kraus",
        title="Amplitude softening (Payne)",
        parameters=(LOSS, HALF, EXPONENT, MEMORY),
        states=(PEAK,),
        start=start_peak,
        rates=rates_peak,
        factor=kraus,
        source="Payne (1962); Kraus (1984)",
    ),
    Effect(
        cause="amplitude_softening",
        form="power",
        title="Amplitude softening (Payne), power law",
        parameters=(POWER, KNEE, MEMORY),
        states=(PEAK,),
        start=start_peak,
        rates=rates_peak,
        factor=power,
        source="power law of the amplitude, flat below its knee",
    ),
    Effect(
        cause="amplitude_softening",
        form="power_by_current",
        title="Amplitude softening (Payne), power law that follows the current",
        parameters=(
            POWER,
            EffectParameter(
                "by_current", "1/A", "growth of the exponent with the current", lower=0.0,
                upper=1.0, starts=(0.2,), plain=(0.0,),
            ),
            KNEE,
            MEMORY,
        ),
        states=(PEAK,),
        start=start_peak,
        rates=rates_peak,
        factor=power_by_current,
        needs=frozenset({"current"}),
        source="Li & Li, Table 1: the loss with amplitude grows with the current",
    ),
    Effect(
        cause="amplitude_softening",
        form="mean_square",
        title="Amplitude softening (Payne) by mean square",
        parameters=(LOSS, HALF, EXPONENT, MEMORY),
        states=(Quantity("mean_square", "m^2", "moving mean square of the deformation"),),
        start=start_mean,
        rates=rates_mean,
        factor=mean_square,
        source="Kraus (1984), amplitude from the mean square",
        plan=EffectInPlan(rates=plan_rates_mean, factor=mean_square),
    ),
    Effect(
        cause="amplitude_softening",
        form="instantaneous",
        title="Amplitude softening by the deformation itself",
        parameters=(LOSS, HALF, EXPONENT),
        factor=instantaneous,
        source="Kraus (1984), deformation in place of amplitude",
    ),
    Effect(
        cause="amplitude_softening",
        form="network",
        title="Amplitude softening (Payne), a network that breaks and recovers",
        parameters=(
            LOSS,
            EffectParameter(
                "length", "m", "path over which the network breaks", lower=1e-6, upper=100.0,
                divides=True, starts=(0.3, 2.0),
            ),
            MEMORY,
        ),
        states=(Quantity("whole", "1", "share of the network that is whole"),),
        start=start_network,
        rates=rates_network,
        factor=network,
        source="Moore (1959), structure kinetics; Payne (1965), filler network",
    ),
    Effect(
        cause="amplitude_softening",
        form="storage",
        title="Amplitude softening (Payne) of the storage modulus alone",
        parameters=(
            EffectParameter(
                "stiffness", "N/m", "stiffness lost at large amplitude", lower=0.0, magnitude=True,
                starts=(0.2,),
            ),
            HALF,
            EXPONENT,
            MEMORY,
        ),
        states=(PEAK,),
        start=start_peak,
        rates=rates_peak,
        force=storage,
        source="Kraus (1984), storage modulus",
    ),
)  # fmt: skip
