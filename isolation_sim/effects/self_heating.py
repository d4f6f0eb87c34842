"""The device warms by its dissipation and its coil, and warm rubber and warm fluid are weaker.

One thermal body, h' = gain F v - h / cooling, where h is temperature rise times sensitivity.

Forms:

    exponential    factor exp(-h)
    hyperbolic     factor 1 / (1 + h)
    core           the same as exponential, for F - k x alone: rubber of stiffness k around a lead
                   core or beside a slider keeps its force
    fluid          the same as exponential, for a part c v of F alone: the fluid thins, and a yield
                   force, a friction or a spring keeps its value
    dissipation    the same as exponential, with h less the elastic energy k x^2 / 2 times the gain,
                   and the secant stiffness k = <F x> / <x^2>, means over the last second
    absolute_power the same as exponential, with h' = gain |F v| - h / cooling: work that the device
                   gives back warms it as much as work done on it

F is the force after the factor, so that a device that weakens heats less. Elastic work swings h
within a cycle and cancels over it, where it is not taken out; only h > 0 weakens.
"""

from typing import Any

import numpy as np

from ..laws.law import Quantity
from .effect import Effect, EffectInPlan, EffectParameter, Past, Signals
from .followers import (
    FLUID,
    RUBBER,
    SECANT,
    of_core,
    plan_core,
    plan_power,
    positive,
    rates_secant,
    stored_energy,
)


def exponential(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Share of the force that is left."""
    return _left(states[0])


def hyperbolic(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Share of the force that is left."""
    return 1 / (1 + positive(states[0]))


def rates_exponential(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Heat in, heat out."""
    return (_rate(signals, states[0], exponential(signals, states, parameters), parameters),)


def carried(past: Past, parameters: tuple) -> tuple:
    """Heat of earlier tests, without cooling."""
    return (parameters[0] * past.dissipated,)


def recovery(parameters: tuple) -> Any:
    """Time constant of cooling."""
    return parameters[1]


def rates_hyperbolic(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Heat in, heat out."""
    return (_rate(signals, states[0], hyperbolic(signals, states, parameters), parameters),)


def _rate(signals: Signals, h: Any, factor: Any, parameters: tuple) -> Any:
    gain, cooling = parameters
    return gain * factor * signals.force * signals.v - h / cooling


def core(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Loss of force of the core."""
    return (exponential(signals, states, parameters) - 1) * of_core(signals, parameters[2])


def rubber(signals: Signals, parameters: tuple) -> Any:
    """Force of the rubber beside the core."""
    return parameters[2] * signals.x


def rates_core(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Heat from the core, heat out."""
    gain, cooling, _ = parameters
    force = exponential(signals, states, parameters) * of_core(signals, parameters[2])
    return (gain * force * signals.v - states[0] / cooling,)


def plan_rates_exponential(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Heat in from both directions, heat out."""
    gain, cooling = parameters
    power = exponential(signals, states, parameters) * plan_power(signals.force, signals.v)
    return (gain * power - states[0] / cooling,)


def plan_force_core(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Loss of force of the core along x and y."""
    return plan_core(signals, parameters[2], exponential(signals, states, parameters) - 1)


def plan_rates_core(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Heat from the core, heat out."""
    gain, cooling, stiffness = parameters
    force = plan_core(signals, stiffness, exponential(signals, states, parameters))
    return (gain * plan_power(force, signals.v) - states[0] / cooling,)


def fluid(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Loss of force of the fluid."""
    return (exponential(signals, states, parameters) - 1) * parameters[2] * signals.v


def rates_fluid(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Heat from all that is left of the force, heat out."""
    gain, cooling, _ = parameters
    force = signals.force + fluid(signals, states, parameters)
    return (gain * force * signals.v - states[0] / cooling,)


def rates_absolute_power(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Heat by work done on the device and given back, heat out."""
    gain, cooling = parameters
    left = exponential(signals, states, parameters)
    return (gain * left * np.fabs(signals.force * signals.v) - states[0] / cooling,)


def rates_coil(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Heat by the work and by the current, heat out."""
    gain, cooling, resistance = parameters
    by_work = _rate(signals, states[0], exponential(signals, states, parameters), (gain, cooling))
    return (by_work + gain * resistance * signals.current**2,)


def dissipation(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Share of the force that is left."""
    return _left(_dissipated_heat(signals, states, parameters))


def rates_dissipation(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Heat by all work, heat out of the part that is not elastic; moving means."""
    gain, cooling = parameters
    heat = _dissipated_heat(signals, states, parameters)
    power = _left(heat) * signals.force * signals.v
    return (gain * power - heat / cooling, *rates_secant(signals, tuple(states[1:])))


def _dissipated_heat(signals: Signals, states: tuple, parameters: tuple) -> Any:
    # a device that has weakened stores less
    stored = parameters[0] * stored_energy(signals, tuple(states[1:]))
    return states[0] - stored * _left(states[0] - stored)


def _left(heat: Any) -> Any:
    return np.exp(-positive(heat))


PARAMETERS = (
    EffectParameter(
        "gain", "1/J", "loss of force for work done", lower=0.0, magnitude=True, starts=(0.02, 0.1),
    ),
    EffectParameter(
        "cooling", "s", "time constant of cooling", lower=1.0, upper=1e5, divides=True, starts=(5.0,
        20.0, 100.0),
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
        carried=carried,
        recovery=recovery,
        rates=rates_exponential,
        factor=exponential,
        needs=frozenset({"force"}),
        source="lumped heat balance; Kalpakidis & Constantinou (2009) for lead-rubber bearings",
        gradual=True,
        plan=EffectInPlan(rates=plan_rates_exponential, factor=exponential),
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
        gradual=True,
    ),
    Effect(
        cause="self_heating",
        form="core",
        title="Self-heating of the core",
        parameters=(*PARAMETERS, RUBBER),
        states=(WARMTH,),
        carried=carried,
        recovery=recovery,
        spared=rubber,
        rates=rates_core,
        force=core,
        needs=frozenset({"force"}),
        source="Kalpakidis & Constantinou (2009): the yield force of the lead alone falls",
        gradual=True,
        plan=EffectInPlan(rates=plan_rates_core, force=plan_force_core),
    ),
    Effect(
        cause="self_heating",
        form="fluid",
        title="Self-heating of the fluid",
        parameters=(*PARAMETERS, FLUID),
        states=(WARMTH,),
        rates=rates_fluid,
        force=fluid,
        needs=frozenset({"force"}),
        source="Gordaninejad & Breese (1999): the viscosity falls, the yield stress hardly does",
        gradual=True,
    ),
    Effect(
        cause="self_heating",
        form="dissipation",
        title="Self-heating by the dissipated work",
        parameters=PARAMETERS,
        states=(WARMTH, *SECANT),
        rates=rates_dissipation,
        factor=dissipation,
        needs=frozenset({"force"}),
        source="lumped heat balance; elastic energy by the secant stiffness of the storage modulus",
        gradual=True,
    ),
    Effect(
        cause="self_heating",
        form="absolute_power",
        title="Self-heating by work done and given back",
        parameters=PARAMETERS,
        states=(WARMTH,),
        rates=rates_absolute_power,
        factor=exponential,
        needs=frozenset({"force"}),
        source="lumped heat balance by the magnitude of the power, a common simplification",
        gradual=True,
    ),
    Effect(
        cause="self_heating",
        form="coil",
        title="Self-heating by the coil too",
        parameters=(
            *PARAMETERS,
            EffectParameter(
                "resistance", "N m/(s A^2)", "resistance of the coil", lower=0.0,
                starts=(1.0, 10.0), plain=(0.0,),
            ),
        ),
        states=(WARMTH,),
        rates=rates_coil,
        factor=exponential,
        needs=frozenset({"force", "current"}),
        source="lumped heat balance of the dissipation and of the coil's resistance",
        gradual=True,
    ),
)  # fmt: skip
