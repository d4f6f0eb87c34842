"""Force and displacement are not recorded at the same time: filters, channels read in turn.

Forms:

    shift           the force belongs to the motion `delay` earlier. In a simulation, which
                    knows an instant alone:  x' = x - t v + t^2 a / 2,   v' = v - t a
    filter          the force passes a low-pass filter of first order, time constant `delay`
    butterworth     the same of second order, Butterworth's: cut-off frequency
                    sqrt(2) / (2 pi `delay`)
    dead_time       the force is recorded `delay` late, by Pade's approximation of second order:
                    right within 1 % up to an angular frequency of 1.7 / delay
    displacement_filter  the displacement passed a low-pass filter of first order, time constant
                    `delay`:  x' = x + t v,   v' = v + t a

A negative delay: the displacement is the late one. A fault of the test, not of the device.
Time constants below 1.5 ms approach 0.5 ms instead of 0, with less of the filtered force.
"""

from typing import Any

import numpy as np

from ..laws.law import Quantity
from .effect import Effect, EffectParameter, Signals
from .followers import time_constant

SERIES_SPRING = "a spring in series with a viscous device, as of its mounting or its fluid"
SHORTEST = 5e-4
"""s: shorter time constants make no difference at any sampling rate in use."""


def motion(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """The motion that the recorded force belongs to."""
    (t,) = parameters
    return signals.x - t * signals.v + t**2 / 2 * signals.a, signals.v - t * signals.a


def unfiltered_motion(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """The motion whose displacement, behind the filter, was recorded."""
    (t,) = parameters
    return signals.x + t * signals.v, signals.v + t * signals.a


def delay(parameters: tuple) -> Any:
    """The time by which that motion is earlier."""
    return parameters[0]


def rates_filter(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Low-pass filter of first order."""
    return ((signals.force - states[0]) / time_constant(parameters[0], SHORTEST),)


def start_filtered(signals: Signals, parameters: tuple) -> tuple:
    """The filter has settled at the first force."""
    return (signals.force,)


def rates_butterworth(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Butterworth's filter of second order: its output, and that one's slope times a time."""
    filtered, slope = states
    t = time_constant(parameters[0], SHORTEST) / np.sqrt(2)
    return slope / t, (signals.force - filtered - np.sqrt(2) * slope) / t


def start_with_slope(signals: Signals, parameters: tuple) -> tuple:
    """The filter has settled at the first force."""
    return signals.force, 0.0


def rates_dead_time(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """The approximation's denominator: its output, and that one's slope times the delay."""
    slow, slope = states
    t = time_constant(parameters[0], SHORTEST)
    return slope / t, 12 / t * (signals.force - slow - slope / 2)


def recorded(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Filtered force in place of the force."""
    return (states[0] - signals.force) * _late(parameters)


def recorded_late(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Delayed force in place of the force."""
    return -states[1] * _late(parameters)


def _late(parameters: tuple) -> Any:
    # without a delay the force is recorded as it is
    return parameters[0] / time_constant(parameters[0], SHORTEST)


LATENESS = EffectParameter(
    "delay", "s", "delay of the force to the displacement", lower=0.0, upper=0.2, magnitude=True,
    starts=(0.003,),
)  # fmt: skip

FORMS = (
    Effect(
        cause="sensor_delay",
        form="shift",
        title="Sensor delay",
        parameters=(
            EffectParameter(
                "delay", "s", "delay of the force to the displacement", lower=-0.1, upper=0.1,
                magnitude=True, starts=(0.003,),
            ),
        ),
        motion=motion,
        delay=delay,
        needs=frozenset({"acceleration"}),
        of_device=False,
        alike=SERIES_SPRING,
        source="interpolated motion; its Taylor series in a simulation",
    ),
    Effect(
        cause="sensor_delay",
        form="filter",
        title="Sensor delay, filtered force",
        parameters=(LATENESS,),
        states=(Quantity("filtered", "N", "force behind the filter"),),
        start=start_filtered,
        rates=rates_filter,
        force=recorded,
        of_device=False,
        alike=SERIES_SPRING,
        needs=frozenset({"force"}),
        source="low-pass filter of first order",
    ),
    Effect(
        cause="sensor_delay",
        form="butterworth",
        title="Sensor delay, force behind Butterworth's filter",
        parameters=(LATENESS,),
        states=(
            Quantity("filtered", "N", "force behind the filter"),
            Quantity("slope", "N", "its slope times the filter's time"),
        ),
        start=start_with_slope,
        rates=rates_butterworth,
        force=recorded,
        of_device=False,
        alike=SERIES_SPRING,
        needs=frozenset({"force"}),
        source="Butterworth (1930), second order",
    ),
    Effect(
        cause="sensor_delay",
        form="dead_time",
        title="Sensor delay, dead time",
        parameters=(LATENESS,),
        states=(
            Quantity("slow", "N", "force through the denominator"),
            Quantity("slope", "N", "its slope times the delay"),
        ),
        start=start_with_slope,
        rates=rates_dead_time,
        force=recorded_late,
        of_device=False,
        alike=SERIES_SPRING,
        needs=frozenset({"force"}),
        source="Pade approximant of second order",
    ),
    Effect(
        cause="sensor_delay",
        form="displacement_filter",
        title="Sensor delay, filtered displacement",
        parameters=(
            EffectParameter(
                "delay", "s", "time constant of the displacement's filter", lower=0.0, upper=0.1,
                magnitude=True, starts=(0.003,),
            ),
        ),
        motion=unfiltered_motion,
        needs=frozenset({"acceleration"}),
        of_device=False,
        alike=SERIES_SPRING,
        source="low-pass filter of first order, inverted",
    ),
)  # fmt: skip
