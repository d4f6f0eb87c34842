"""Stiffness and loss grow slowly with the rate: over decades, not around one relaxation time.

Forms:

    spring_pot     adds a fractional spring-pot, k (i f / 1 Hz)^a, from 0.02 to 50 Hz
    frequency      factor (f / 1 Hz)^n,   f from the moving mean squares of velocity and deformation
    power          factor (1 + (v / v0)^2)^(n / 2)
    mean_speed     the same with the moving mean square of v
    logarithmic    factor 1 + a ln(1 + (v / v0)^2) / 2
    thinning       adds a viscosity that thins with the rate, c v (1 + (v / v0)^2)^((n - 1) / 2)
    thinning_by_current    the same with c (1 + m |I|)
"""

from typing import Any

import numpy as np

from ..laws.law import Quantity
from ..laws.spring_pot import LAW as SPRING_POT
from .effect import Effect, EffectParameter, Signals
from .followers import positive

REST = 1e-6
"""m/s: well below this RMS velocity the frequency is taken to be the reference one."""


def force_spring_pot(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Force of the spring-pot."""
    return SPRING_POT.force(signals.x, signals.v, states, parameters)


def rates_spring_pot(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Its branches'."""
    return SPRING_POT.rates(signals.x, signals.v, states, parameters)


def frequency(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Force over that at 1 Hz."""
    x_square, v_square = positive(states[0]), positive(states[1])
    squared = (v_square + REST**2) / ((2 * np.pi) ** 2 * x_square + REST**2)
    return squared ** (parameters[0] / 2)


def rates_frequency(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Moving means of the squares."""
    window = parameters[1]
    return (signals.x**2 - states[0]) / window, (signals.v**2 - states[1]) / window


def power(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Force over that of slow motion."""
    n, velocity = parameters
    return (1 + (signals.v / velocity) ** 2) ** (n / 2)


def mean_speed(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Force over that of slow motion."""
    n, velocity, _ = parameters
    return (1 + positive(states[0]) / velocity**2) ** (n / 2)


def rates_mean_speed(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Moving mean of the square."""
    return ((signals.v**2 - states[0]) / parameters[-1],)


def logarithmic(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Force over that of slow motion."""
    rise, velocity = parameters
    return positive(1 + rise * np.log1p((signals.v / velocity) ** 2) / 2)


def thinning(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Viscous force that grows with a small power of the velocity."""
    viscosity, velocity, n, *_ = parameters
    return viscosity * signals.v * (1 + (signals.v / velocity) ** 2) ** ((n - 1) / 2)


def thinning_by_current(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Viscous force that is larger in the field."""
    by_current = parameters[3]
    return thinning(signals, states, parameters) * (1 + by_current * np.fabs(signals.current))


VELOCITY = EffectParameter(
    "velocity", "m/s", "velocity of the onset of rate dependence", lower=1e-7, divides=True,
    starts=(0.02, 0.1, 0.5),
)  # fmt: skip
# a mean over longer than a test grows from rest throughout it: so do path and time
_WHOLE_TEST = 10.0
WINDOW = EffectParameter(
    "window", "s", "averaging time", lower=0.02, upper=_WHOLE_TEST, divides=True,
    starts=(0.3, 1.0), other=(_WHOLE_TEST,),
)  # fmt: skip
V_SQUARE = Quantity("v_square", "m^2/s^2", "moving mean square of the velocity")
THINNING = (
    EffectParameter(
        "viscosity", "N s/m", "viscosity at low velocity", lower=0.0, magnitude=True, starts=(0.2,)
    ),
    # far above the fastest test nothing thins, and the effect is a dashpot
    EffectParameter(
        "velocity", "m/s", "velocity of the onset of thinning", lower=1e-6, divides=True,
        starts=(0.01, 0.1), most=10.0, other=(np.inf,),
    ),
    # friction's own power is 0, and below 0.25 its smooth forms follow as well
    EffectParameter(
        "exponent", "1", "power of the velocity", lower=0.25, upper=0.8, starts=(0.3, 0.5)
    ),
)  # fmt: skip
_K, _A = SPRING_POT.parameters

FORMS = (
    Effect(
        cause="weak_rate_dependence",
        form="spring_pot",
        title="Weak rate dependence",
        parameters=(
            EffectParameter(
                "stiffness", _K.unit, _K.meaning, lower=0.0, magnitude=True, starts=(0.3,)
            ),
            EffectParameter(
                "exponent", _A.unit, _A.meaning, _A.lower, _A.upper, divides=True,
                starts=(0.1, 0.3),
            ),
        ),
        states=SPRING_POT.states,
        force=force_spring_pot,
        rates=rates_spring_pot,
        stored_energy=SPRING_POT.stored_energy,
        source="Scott Blair (1947); laws.spring_pot",
    ),
    Effect(
        cause="weak_rate_dependence",
        form="frequency",
        title="Weak dependence on frequency",
        parameters=(
            EffectParameter(
                "exponent", "1", "power of the frequency", lower=-0.5, upper=1.0, magnitude=True,
                starts=(0.05,),
            ),
            WINDOW,
        ),
        states=(
            Quantity("x_square", "m^2", "moving mean square of the deformation"),
            V_SQUARE,
        ),
        rates=rates_frequency,
        factor=frequency,
        source="power law of the dynamic modulus",
    ),
    Effect(
        cause="weak_rate_dependence",
        form="power",
        title="Weak rate dependence, power of the velocity",
        parameters=(
            EffectParameter(
                "exponent", "1", "power of the velocity", lower=-0.9, upper=1.0, magnitude=True,
                starts=(0.05,),
            ),
            VELOCITY,
        ),
        factor=power,
        source="Carreau (1972)",
    ),
    Effect(
        cause="weak_rate_dependence",
        form="mean_speed",
        title="Weak rate dependence, power of the mean speed",
        parameters=(
            # with a negative one it would be a softening by amplitude
            EffectParameter(
                "exponent", "1", "power of the RMS velocity", lower=0.0, upper=1.0, magnitude=True,
                starts=(0.05,),
            ),
            VELOCITY,
            WINDOW,
        ),
        states=(V_SQUARE,),
        rates=rates_mean_speed,
        factor=mean_speed,
        source="power law of the rate, Carreau (1972), remembered over a time",
    ),
    Effect(
        cause="weak_rate_dependence",
        form="logarithmic",
        title="Weak rate dependence, logarithm of the velocity",
        parameters=(
            EffectParameter(
                "rise", "1", "growth of the force for an e-fold velocity", lower=-0.2, upper=1.0,
                magnitude=True, starts=(0.05,),
            ),
            VELOCITY,
        ),
        factor=logarithmic,
        source="Eyring (1936), Johnson & Cook (1983)",
    ),
    Effect(
        cause="weak_rate_dependence",
        form="thinning",
        title="Weak rate dependence, thinning viscosity",
        parameters=THINNING,
        force=thinning,
        source="Carreau (1972)",
    ),
    Effect(
        cause="weak_rate_dependence",
        form="thinning_by_current",
        title="Weak rate dependence, thinning viscosity that grows with the current",
        parameters=(
            *THINNING,
            EffectParameter(
                "by_current", "1/A", "growth of the viscosity with the current", lower=0.0,
                starts=(1.0,), plain=(0.0,),
            ),
        ),
        force=thinning_by_current,
        needs=frozenset({"current"}),
        source="Carreau (1972), of a magnetorheological elastomer",
    ),
)  # fmt: skip
