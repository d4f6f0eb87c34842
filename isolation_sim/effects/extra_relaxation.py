"""A relaxation that the law lacks: springs in series with dashpots beside it.

Forms:

    one_arm     k q,                               q' = v - q / time
    two_arms    k ((1 - share) q1 + share q2),     with a time each
    by_current  k (1 + m |I|) q,                   q' = v - q / time
    eyring      k q,                               q' = v - (length / time) sinh(q / length)
    power       k q,                               q' = v - w |q / length|^(1 / exponent) sgn q,
                                                   w = 0.1 m/s
"""

from typing import Any

import numpy as np

from ..laws.law import Quantity
from .effect import Effect, EffectParameter, Signals
from .followers import beyond

_MOST = 30.0
"""Extension over the length beyond which the dashpot flows no more easily."""
_FLOW = 0.1
"""m/s: of the dashpot under the force that extends the spring by the length."""
_LINEAR = 0.02
"""Extension over the length below which the dashpot is linear."""


def force(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Force of the arm's spring."""
    return parameters[0] * states[0]


def rates(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """The spring's extension relaxes."""
    return (signals.v - states[0] / parameters[1],)


def force_by_current(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Force of a spring that is stiffer in the field."""
    k, _, by_current = parameters
    return k * (1 + by_current * np.fabs(signals.current)) * states[0]


def stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:
    """Energy of the spring."""
    return parameters[0] * states[0] ** 2 / 2


def force_two(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Force of both springs."""
    k, share, _, _ = parameters
    return k * ((1 - share) * states[0] + share * states[1])


def rates_two(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Both springs' extensions relax."""
    _, _, time, second_time = parameters
    return signals.v - states[0] / time, signals.v - states[1] / second_time


def stored_energy_two(x: Any, states: tuple, parameters: tuple) -> Any:
    """Energy of both springs."""
    k, share, _, _ = parameters
    return k * ((1 - share) * states[0] ** 2 + share * states[1] ** 2) / 2


def rates_eyring(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """The dashpot flows the more easily the larger its force is."""
    _, time, length = parameters
    stretched = states[0] / length
    # beyond _MOST the spring is let go within less than a step
    return (signals.v - length / time * np.sinh(stretched - beyond(stretched, _MOST)),)


def rates_power(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """The dashpot's force is a power of its velocity."""
    _, length, exponent = parameters
    stretched = states[0] / length
    stretched = stretched - beyond(stretched, _MOST)
    size = np.sqrt(stretched**2 + _LINEAR**2)
    return (signals.v - _FLOW * stretched * size ** (1 / exponent - 1),)


STIFFNESS = EffectParameter(
    "stiffness", "N/m", "total stiffness of the springs", lower=0.0, magnitude=True, starts=(0.2,)
)


_NEVER = 1e4
"""s: an arm that relaxes so slowly is a spring."""


def _time(name: str, meaning: str, *starts: float) -> EffectParameter:
    return EffectParameter(
        name, "s", meaning, lower=1e-3, upper=_NEVER, divides=True, starts=starts, other=(_NEVER,)
    )


FORMS = (
    Effect(
        cause="extra_relaxation",
        form="one_arm",
        title="Extra relaxation",
        parameters=(STIFFNESS, _time("time", "relaxation time", 0.05, 0.3, 2.0, 10.0)),
        states=(Quantity("extension", "m", "of the arm's spring"),),
        force=force,
        rates=rates,
        stored_energy=stored_energy,
        source="Maxwell (1867)",
    ),
    Effect(
        cause="extra_relaxation",
        form="two_arms",
        title="Extra relaxation, two arms",
        parameters=(
            STIFFNESS,
            EffectParameter(
                "share", "1", "fraction of the second arm", lower=0.0, upper=1.0, starts=(0.5,),
                plain=(0.0, 1.0),
            ),
            _time("time", "relaxation time of the first arm", 0.05, 0.3),
            _time("second_time", "relaxation time of the second arm", 1.0, 10.0),
        ),
        states=(
            Quantity("extension", "m", "of the first arm's spring"),
            Quantity("second_extension", "m", "of the second arm's spring"),
        ),
        force=force_two,
        rates=rates_two,
        stored_energy=stored_energy_two,
        source="Wiechert (1893)",
    ),
    Effect(
        cause="extra_relaxation",
        form="by_current",
        title="Extra relaxation that grows with the current",
        parameters=(
            STIFFNESS,
            _time("time", "relaxation time", 0.05, 0.3, 2.0, 10.0),
            EffectParameter(
                "by_current", "1/A", "growth of the stiffness with the current", lower=0.0,
                starts=(1.0,), plain=(0.0,),
            ),
        ),
        states=(Quantity("extension", "m", "of the arm's spring"),),
        force=force_by_current,
        rates=rates,
        needs=frozenset({"current"}),
        source="Maxwell (1867), with the modulus of a magnetorheological elastomer",
    ),
    Effect(
        cause="extra_relaxation",
        form="eyring",
        title="Extra relaxation, activated by the force",
        parameters=(
            STIFFNESS,
            _time("time", "relaxation time at a small force", 0.05, 0.3, 2.0, 10.0),
            EffectParameter(
                "length", "m", "extension of the spring beyond which the dashpot yields",
                lower=1e-6, upper=1.0, divides=True, starts=(0.1, 0.3), plain=(1.0,),
            ),
        ),
        states=(Quantity("extension", "m", "of the arm's spring"),),
        force=force,
        rates=rates_eyring,
        stored_energy=stored_energy,
        source="Eyring (1936), flow activated by the stress",
    ),
    Effect(
        cause="extra_relaxation",
        form="power",
        title="Extra relaxation, power of the velocity",
        parameters=(
            STIFFNESS,
            EffectParameter(
                "length", "m", "extension of the spring at 0.1 m/s", lower=1e-6, upper=1.0,
                divides=True, starts=(0.1, 0.3),
            ),
            EffectParameter(
                "exponent", "1", "power of the velocity in the dashpot's force", lower=0.25,
                upper=2.0, divides=True, starts=(0.5, 1.8), plain=(2.0,),
            ),
        ),
        states=(Quantity("extension", "m", "of the arm's spring"),),
        force=force,
        rates=rates_power,
        stored_energy=stored_energy,
        source="Makris and Constantinou (1991), fluid damper with a flexible brace",
    ),
)  # fmt: skip
