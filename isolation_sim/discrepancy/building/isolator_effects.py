"""Effects that the law of an isolation layer may lack.

Those that are tried first stand around the law at once, the absent ones with magnitude zero: one
law to compile, whatever combination is tried. Each that is tried last makes another law with those
beside it.
"""

from collections.abc import Collection
from typing import Any

import numpy as np

from ...effects import Effect, EffectInPlan, EffectParameter, Signals, effect
from ...effects.followers import positive, raised

_SPEED = 0.1
"""m/s: velocity at which a damper's force is reported."""
_TINY = 1e-8
"""Square of the velocity, over that one, below which the force is linear: a low power of less is a
jump, whose simulation takes 50 times as long and shows by less than 0.1 % in a floor."""
_TOUCH = 2e-3
"""Overrun, over the gap, at which half of a wall's dashpot acts: its force does not jump."""


def _power_force(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Damper whose force grows with a power of the velocity."""
    level, exponent = parameters
    ratio = signals.v / _SPEED
    return level * ratio * (ratio * ratio + _TINY) ** ((exponent - 1) / 2)


def _plan_power_force(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """The same along the velocity in plan."""
    level, exponent = parameters
    x, y = signals.v[0] / _SPEED, signals.v[1] / _SPEED
    over_ratio = level * (x * x + y * y + _TINY) ** ((exponent - 1) / 2)
    return over_ratio * x, over_ratio * y


DAMPER = Effect(
    cause="extra_isolator_damping",
    form="power_of_velocity",
    title="Nonlinear damper",
    parameters=(
        EffectParameter("level", "N", "force at 0.1 m/s", lower=0.0, magnitude=True, starts=(0.1,)),
        EffectParameter(
            "exponent", "1", "exponent of the velocity", lower=0.2, upper=2.0, starts=(0.6,)
        ),
    ),
    force=_power_force,
    source="nonlinear fluid dampers, such as Symans and others (2008)",
    plan=EffectInPlan(force=_plan_power_force),
)


def _impact_force(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Wall that dissipates: elastic contact, more on closing than on opening, never pulling."""
    k, gap, n, damping, dashpot, only = parameters
    side, w = np.sign(signals.x), gap / 10
    # 0 on the side without a wall
    met = positive(1 - only * only + only * side)
    u, closing = positive(np.fabs(signals.x) - gap), signals.v * side
    elastic = k * w * raised(u / w, n) * positive(1 + damping * closing)
    return met * positive(elastic + dashpot * closing * u / (u + _TOUCH * gap)) * side


def _plan_impact_force(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Walls on all four sides."""
    x, y = (signals._replace(x=x, v=v) for x, v in zip(signals.x, signals.v, strict=True))
    return _impact_force(x, states, parameters), _impact_force(y, states, parameters)


IMPACT = Effect(
    cause="end_stop",
    form="dissipating",
    title="Impact on a wall",
    parameters=(
        *effect("end_stop", "power").parameters,
        EffectParameter(
            "damping",
            "s/m",
            "increase of the force, over itself, per closing velocity",
            lower=0.0,
            upper=1e3,
            starts=(1.0,),
            plain=(0.0,),  # an elastic wall
        ),
        EffectParameter(
            "dashpot",
            "N s/m",
            "dashpot beside the spring",
            lower=0.0,
            starts=(1.0,),
            plain=(0.0,),
        ),
        EffectParameter(
            "only",
            "1",
            "side of the wall, 1 or -1; 0 for both",
            lower=-1.0,
            upper=1.0,
            starts=(0.0,),
        ),
    ),
    force=_impact_force,
    source="Hunt and Crossley (1975); with the dashpot, Anagnostopoulos (1988)",
    plan=EffectInPlan(force=_plan_impact_force),
)


RUBBER = effect("stress_softening", "rubber")
"""Devices that were saved before it was a form of the catalogue find it here."""

ISOLATOR_EFFECTS: dict[str, Effect] = {
    # by the mean square: smooth, so that a run costs little more than without
    "isolator_amplitude_softening": effect("amplitude_softening", "mean_square"),
    "stress_softening": effect("stress_softening", "hyperbolic"),
    "coulomb_friction": effect("coulomb_friction"),
    # found by its place, so that a saved device finds it again
    "extra_isolator_damping": effect(f"{__name__}:DAMPER"),
    "moat_impact": effect(f"{__name__}:IMPACT"),
}
"""By the name of the cause in a building, in the order in which they act."""
LAYER_CAUSES = (
    "amplitude_softening", "coulomb_friction", "cyclic_degradation", "extra_relaxation",
    "field_gap_coupling", "field_saturation", "magnetic_remanence", "self_heating",
    "stress_softening", "weak_rate_dependence",
)  # fmt: skip
"""Causes of device tests that are tried last, in the form that is nearest to the layer's force:
those that are not of a sensor, and that a building has no cause of its own for."""
HISTORIES = "stress_softening", "cyclic_degradation", "self_heating"
"""Causes by which isolators soften as a motion goes on."""


def around_the_law(present: Collection[Effect]) -> tuple[Effect, ...]:
    """The effects of the law that has some of them, in order.

    If they are all tried first, the absent ones of these as well.
    """
    # a law has one form of each
    every = {one.cause: one for one in (*ISOLATOR_EFFECTS.values(), *present)}.values()
    if present and all(one in ISOLATOR_EFFECTS.values() for one in present):
        return tuple(every)
    # most that are tried last are dropped: their law is compiled in a quarter of the time without
    return tuple(one for one in every if one in present)


def absent(one: Effect, size: float) -> dict[str, float]:
    """Numbers that leave a law as it is."""
    numbers = {}
    for q in one.parameters:
        value = 0.0 if q.magnitude else q.starts[0] * (size if q.unit == "m" else 1.0)
        numbers[q.name] = float(np.clip(value, q.lower, q.upper))
    return numbers
