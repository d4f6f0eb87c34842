"""Force and displacement are not recorded at the same time: filters, channels read in turn.

Forms:

    second_order    the force belongs to the motion `delay` earlier:
                    x' = x - t v + t^2 a / 2,   v' = v - t a
    filter          the force passes a low-pass filter of first order, time constant `delay`
    two_filters     the same twice, with half the time constant

A negative delay: the displacement is the late one. A fault of the test, not of the device.
"""

from typing import Any

from ..laws.law import Quantity
from .effect import Effect, EffectParameter, Signals

SHORTEST = 5e-4
"""s: shorter time constants make no difference at any sampling rate in use."""


def motion(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """The motion that the recorded force belongs to."""
    (t,) = parameters
    return signals.x - t * signals.v + t**2 / 2 * signals.a, signals.v - t * signals.a


def rates_filter(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Low-pass filter of first order."""
    return ((signals.force - states[0]) / (parameters[0] + SHORTEST),)


def rates_two_filters(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Two of these in a row."""
    each = parameters[0] / 2 + SHORTEST
    return (signals.force - states[0]) / each, (states[0] - states[1]) / each


def recorded(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """What the last filter lets through instead of the force."""
    lag = parameters[0]
    # without a filter the force is recorded as it is
    return (states[-1] - signals.force) * lag / (lag + SHORTEST)


LATENESS = EffectParameter(
    "delay", "s", "of the force behind the displacement", lower=0.0, upper=0.2, strength=True,
    starts=(0.003,),
)  # fmt: skip
_FILTERED = Quantity("filtered", "N", "force behind the filter")

FORMS = (
    Effect(
        cause="sensor_delay",
        form="second_order",
        title="Sensor delay",
        parameters=(
            EffectParameter(
                "delay", "s", "of the force behind the displacement", lower=-0.1, upper=0.1,
                strength=True, starts=(0.003,),
            ),
        ),
        motion=motion,
        needs=frozenset({"acceleration"}),
        of_device=False,
        source="Taylor series of the motion",
    ),
    Effect(
        cause="sensor_delay",
        form="filter",
        title="Sensor delay, filtered force",
        parameters=(LATENESS,),
        states=(_FILTERED,),
        rates=rates_filter,
        force=recorded,
        of_device=False,
        source="low-pass filter of first order",
    ),
    Effect(
        cause="sensor_delay",
        form="two_filters",
        title="Sensor delay, force filtered twice",
        parameters=(LATENESS,),
        states=(_FILTERED, Quantity("filtered_twice", "N", "force behind the second filter")),
        rates=rates_two_filters,
        force=recorded,
        of_device=False,
        source="low-pass filter of second order",
    ),
)  # fmt: skip
