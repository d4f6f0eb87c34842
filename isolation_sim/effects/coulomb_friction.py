"""Dry friction in guides or bearings of the test rig or between the layers.

Forms:

    smooth      level tanh(v / velocity)
    arctangent  level 2/pi arctan(v / velocity)                          slower to its full value
    magnetic    level (1 + growth I^2) tanh(v / velocity)                the magnet presses as B^2
    stroke      level (1 + growth |x|) tanh(v / velocity)                a bent guide presses more
    stribeck    level (1 + rise exp(-(v / v_s)^2)) tanh(10 v / v_s)      more at low velocity
    dahl        level z,   z' = (v - |v| z) / length                     elastic before it slides
    lugre       level z,   z' = (v - |v| z / g) / length,   g = 1 + rise exp(-(v / v_s)^2)   both
"""

from dataclasses import replace
from typing import Any

import numpy as np

from ..laws.in_plan import length
from ..laws.law import Quantity
from .effect import Effect, EffectInPlan, EffectParameter, Signals


def smooth(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Friction that sets in over a small velocity."""
    level, velocity = parameters
    return level * np.tanh(signals.v / velocity)


def arctangent(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Friction that nears its full value slowly."""
    level, velocity = parameters
    return level * np.arctan(signals.v / velocity) * (2 / np.pi)


def magnetic(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Friction under a normal force that grows with the field."""
    level, growth, velocity = parameters
    return level * (1 + growth * signals.current**2) * np.tanh(signals.v / velocity)


def stroke(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Friction under a normal force that grows with the deformation."""
    level, growth, velocity = parameters
    return level * (1 + growth * np.fabs(signals.x)) * np.tanh(signals.v / velocity)


def plan_smooth(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Friction against the velocity, within a circle."""
    level, velocity = parameters
    speed = length(*signals.v)
    over_speed = level * np.tanh(speed / velocity) / speed
    return over_speed * signals.v[0], over_speed * signals.v[1]


def stribeck(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Friction that falls from its static to its sliding value."""
    level, rise, velocity = parameters
    ratio = signals.v / velocity
    return level * (1 + rise * np.exp(-(ratio**2))) * np.tanh(10 * ratio)


def dahl(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Friction of bristles."""
    return parameters[0] * states[0]


def rates_dahl(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Bristles bend, up to their sliding value."""
    return ((signals.v - np.fabs(signals.v) * states[0]) / parameters[1],)


def rates_lugre(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Bristles bend, up to a value that falls from static to sliding friction."""
    _, length, rise, velocity = parameters
    most = 1 + rise * np.exp(-((signals.v / velocity) ** 2))
    return ((signals.v - np.fabs(signals.v) * states[0] / most) / length,)


def stored_energy_dahl(x: Any, states: tuple, parameters: tuple) -> Any:
    """Energy of the bent bristles."""
    return parameters[0] * parameters[1] * states[0] ** 2 / 2


LEVEL = EffectParameter("level", "N", "sliding friction", lower=0.0, magnitude=True, starts=(0.1,))
VELOCITY = EffectParameter(
    "velocity", "m/s", "range over which friction develops", lower=1e-6, divides=True,
    starts=(0.002, 0.02, 0.2), most=1.0, other=(np.inf,),
)  # fmt: skip
"""What has not developed at the largest velocity is a dashpot."""
RISE = EffectParameter(
    "rise", "1", "static over sliding friction, minus one", lower=0.0, upper=2.0, starts=(0.3,),
    plain=(0.0,),
)  # fmt: skip
STRIBECK = EffectParameter(
    "velocity", "m/s", "velocity range of the rise", lower=1e-5, divides=True,
    starts=(0.01, 0.1, 0.5),
)  # fmt: skip
LENGTH = EffectParameter(
    "length", "m", "range over which friction develops", lower=1e-6, divides=True,
    starts=(0.002, 0.02, 0.1), most=1.0, other=(np.inf,),
)  # fmt: skip
"""What has not developed at the largest deformation is a spring."""
BENT = Quantity("bent", "1", "friction over its sliding value")

FORMS = (
    Effect(
        cause="coulomb_friction",
        form="smooth",
        title="Coulomb friction",
        parameters=(LEVEL, VELOCITY),
        force=smooth,
        source="Coulomb (1785)",
        plan=EffectInPlan(force=plan_smooth),
    ),
    Effect(
        cause="coulomb_friction",
        form="arctangent",
        title="Coulomb friction that sets in slowly",
        parameters=(LEVEL, VELOCITY),
        force=arctangent,
        source="Coulomb (1785), smoothed by an arctangent",
    ),
    Effect(
        cause="coulomb_friction",
        form="stribeck",
        title="Coulomb friction with Stribeck's rise",
        parameters=(LEVEL, RISE, replace(STRIBECK, most=10.0, other=(np.inf,))),  # as VELOCITY
        force=stribeck,
        source="Stribeck (1902)",
    ),
    Effect(
        cause="coulomb_friction",
        form="dahl",
        title="Coulomb friction with presliding",
        parameters=(LEVEL, LENGTH),
        states=(BENT,),
        force=dahl,
        rates=rates_dahl,
        stored_energy=stored_energy_dahl,
        source="Dahl (1968)",
    ),
    Effect(
        cause="coulomb_friction",
        form="lugre",
        title="Coulomb friction with presliding and Stribeck's rise",
        parameters=(LEVEL, LENGTH, RISE, STRIBECK),
        states=(BENT,),
        force=dahl,
        rates=rates_lugre,
        stored_energy=stored_energy_dahl,
        source="Canudas de Wit, Olsson, Astrom and Lischinsky (1995), without damping of bristles",
    ),
    Effect(
        cause="coulomb_friction",
        form="magnetic",
        title="Coulomb friction pressed by the magnet",
        parameters=(
            LEVEL,
            EffectParameter(
                "growth", "1/A^2", "growth of the friction with the squared current", lower=0.0,
                starts=(1.0,),
            ),
            VELOCITY,
        ),
        force=magnetic,
        needs=frozenset({"current"}),
        source="Maxwell's stress in the gap, as the square of the field",
    ),
    Effect(
        cause="coulomb_friction",
        form="stroke",
        title="Coulomb friction that grows with the stroke",
        parameters=(
            LEVEL,
            EffectParameter(
                "growth", "1/m", "growth of the friction with the deformation", lower=0.0,
                starts=(1.0,),
            ),
            VELOCITY,
        ),
        force=stroke,
        source="normal force of a guide that the load bends, in proportion to the stroke",
    ),
)  # fmt: skip
