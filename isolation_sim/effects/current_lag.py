"""The field follows the coil current late: inductance of the coil, eddy currents in the core.

Forms:

    first_order      field' = (I - field) / lag
    second_order     two such lags of lag / 2 one after the other, so that the field starts gently
    rise_and_fall    first order, with a lag of its own while the field falls
    two_stages       a part of the field lags by lag, the slow part by lag + slower_by
    diffusion        the flux enters a massive core from its surface: three modes of a cylinder
    saturating       field' = (I - field) (1 + (s field)^2) / lag: the inductance falls as the steel
                     saturates
    overshooting     two lags in a loop: field'' = (I - field - 2 damping T field') / T^2, with
                     T = lag / (2 damping); a supply that regulates its current overshoots
    slew             the supply changes the current by 1 / per_ampere in a second at most

Time constants below 0.3 ms approach 0.1 ms instead of 0.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from ..laws.law import Quantity
from .effect import Effect, EffectParameter, Signals
from .followers import RISE, time_constant

SHORTEST = 1e-4
"""s: a shorter lag makes no difference to a structure, and would only make the steps small."""
_QUICK = 1e-3
"""s/A: a supply that is quicker follows the wanted current more closely than within ``RISE``."""
# step response of the mean flux in a cylinder: parts 4 / j^2 and times 1 / j^2, with the zeros j of
# Bessel's function J0; the third part stands for all later ones, of the same sum and mean time
_PARTS = (0.6917, 0.1313, 0.1770)
_TIMES = (1.0, 0.1898, 0.0358)
"""Time constants over that of the slowest mode."""


def current(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """The current whose field is there."""
    return states[-1]


def rates(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """First-order lag."""
    (lag,) = parameters
    return ((signals.current - states[0]) / time_constant(lag, SHORTEST),)


def start(signals: Signals, parameters: tuple) -> tuple:
    """The current has been on for long."""
    return (signals.current,)


def rates_second(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Two equal lags."""
    core, field = states
    each = time_constant(parameters[0] / 2, SHORTEST)
    return (signals.current - core) / each, (core - field) / each


def start_second(signals: Signals, parameters: tuple) -> tuple:
    """The current has been on for long."""
    return signals.current, signals.current


def rates_rise_and_fall(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """First-order lag that depends on the sign of the change."""
    (field,), (lag, ratio) = states, parameters
    falls = np.fabs(field) > np.fabs(signals.current)
    each = time_constant(lag * (1 + (ratio - 1) * falls), SHORTEST)
    return ((signals.current - field) / each,)


def current_two(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Sum of the quick and the slow part."""
    part = parameters[1]
    return (1 - part) * states[0] + part * states[1]


def rates_two(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Two lags side by side."""
    lag, _, slow = parameters
    quick_rate = (signals.current - states[0]) / time_constant(lag, SHORTEST)
    return quick_rate, (signals.current - states[1]) / time_constant(lag + slow, SHORTEST)


def current_diffusion(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Mean flux of the modes."""
    return sum(part * state for part, state in zip(_PARTS, states, strict=True))


def rates_diffusion(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """A lag for each mode."""
    (lag,) = parameters
    return tuple(
        (signals.current - state) / time_constant(lag * of_first, SHORTEST)
        for state, of_first in zip(states, _TIMES, strict=True)
    )


def start_diffusion(signals: Signals, parameters: tuple) -> tuple:
    """The current has been on for long."""
    return (signals.current,) * len(_PARTS)


def rates_saturating(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """First-order lag that shortens with the field."""
    (field,), (lag, saturation) = states, parameters
    quicker = 1 + (saturation * field) ** 2
    return ((signals.current - field) / time_constant(lag / quicker, SHORTEST),)


def rates_overshooting(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Lag of second order; one state is the rate of the field times the period over 2 pi."""
    (swing, field), (lag, damping) = states, parameters
    period = time_constant(lag / (2 * damping), SHORTEST)
    return (signals.current - field - 2 * damping * swing) / period, swing / period


def start_overshooting(signals: Signals, parameters: tuple) -> tuple:
    """The current has been on for long."""
    return 0.0, signals.current


def rates_slew(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """A short lag whose rate is limited."""
    (per_ampere,) = parameters
    lag = SHORTEST + RISE * per_ampere / (per_ampere + _QUICK)
    rate = (signals.current - states[0]) / lag
    return (rate / np.sqrt(1 + (rate * per_ampere) ** 2),)


LAG = EffectParameter(
    "lag", "s", "time constant of the field, of both stages together", lower=0.0, upper=5.0,
    magnitude=True, starts=(0.02, 0.1, 0.5),
)  # fmt: skip
FIELD = Quantity("field", "A", "current whose field is there")

FORMS = (
    Effect(
        cause="current_lag",
        form="first_order",
        title="Current lag",
        parameters=(LAG,),
        states=(FIELD,),
        start=start,
        current=current,
        rates=rates,
        source="first-order lag of an R-L coil",
    ),
    Effect(
        cause="current_lag",
        form="second_order",
        title="Current lag, second order",
        parameters=(LAG,),
        states=(Quantity("core", "A", "current seen by the core"), FIELD),
        start=start_second,
        current=current,
        rates=rates_second,
        source="R-L coil and eddy currents in series",
    ),
    Effect(
        cause="current_lag",
        form="rise_and_fall",
        title="Current lag that differs between rise and fall",
        parameters=(
            LAG,
            EffectParameter(
                "fall_ratio", "1", "time constant while the field falls over that while it rises",
                lower=0.05, upper=20.0, divides=True, starts=(0.4, 2.5),
            ),
        ),
        states=(FIELD,),
        start=start,
        current=current,
        rates=rates_rise_and_fall,
        source="response times of magnetorheological dampers: Koo, Goncalves and Ahmadian (2006)",
    ),
    Effect(
        cause="current_lag",
        form="two_stages",
        title="Current lag, quick and slow part",
        parameters=(
            # at zero the rest of the field follows at once
            replace(LAG, plain=(0.0,)),
            EffectParameter(
                "slow_part", "1", "part of the field that follows slowly", lower=0.0, upper=1.0,
                starts=(0.3,), plain=(0.0, 1.0),
            ),
            EffectParameter(
                # what follows later than any field does is remanence
                "slower_by", "s", "time constant of the slow part above that of the quick one",
                lower=0.0, upper=5.0, starts=(0.2, 1.0), plain=(0.0,),
            ),
        ),
        states=(
            Quantity("quick", "A", "current whose field follows quickly"),
            Quantity("slow", "A", "current whose field follows slowly"),
        ),
        start=start_second,
        current=current_two,
        rates=rates_two,
        source="R-L coil beside eddy currents in the core",
    ),
    Effect(
        cause="current_lag",
        form="diffusion",
        title="Current lag by eddy currents in a massive core",
        parameters=(replace(LAG, meaning="time constant of the slowest mode of the flux"),),
        states=tuple(
            Quantity(f"mode_{n}", "A", f"current whose field mode {n} follows") for n in (1, 2, 3)
        ),
        start=start_diffusion,
        current=current_diffusion,
        rates=rates_diffusion,
        source="Lammeraner & Stafl (1966), Eddy Currents: step of the field along a cylinder",
    ),
    Effect(
        cause="current_lag",
        form="saturating",
        title="Current lag of a coil whose inductance falls",
        parameters=(
            LAG,
            EffectParameter(
                "saturation", "1/A", "inverse of the current that halves the time constant",
                lower=0.0, upper=100.0, starts=(1.5,), plain=(0.0,),
            ),
        ),
        states=(FIELD,),
        start=start,
        current=current,
        rates=rates_saturating,
        source="R-L coil with the differential inductance of saturating steel",
    ),
    Effect(
        cause="current_lag",
        form="overshooting",
        title="Current lag of a supply that overshoots",
        parameters=(
            LAG,
            EffectParameter(
                # at 2 one lag is far longer than the other
                "damping", "1", "damping ratio of the supply's control", lower=0.2, upper=2.0,
                divides=True, starts=(0.5,), plain=(2.0,),
            ),
        ),
        states=(Quantity("swing", "A", "rate of the field, per radian of its period"), FIELD),
        start=start_overshooting,
        current=current,
        rates=rates_overshooting,
        source="current control of MR dampers: Yang, Spencer, Carlson and Sain (2002)",
    ),
    Effect(
        cause="current_lag",
        form="slew",
        title="Current lag of a supply of limited slew rate",
        parameters=(
            EffectParameter(
                "per_ampere", "s/A", "time in which the supply changes the current by 1 A",
                lower=0.0, magnitude=True, starts=(0.3, 1.0, 3.0),
            ),
        ),
        states=(FIELD,),
        start=start,
        current=current,
        rates=rates_slew,
        source="slew rate of a current source",
    ),
)  # fmt: skip
