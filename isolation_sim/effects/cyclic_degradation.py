"""Cycles wear the device: its force falls with the way travelled or the work done, for good.

In the form ``hardening`` it rises, as that of steel does.

Forms:

    exponential    1 - d (1 - exp(-S / S0)),     S' = |v|
    hardening      1 + g (1 - exp(-S / S0))
    logarithmic    1 / (1 + c ln(1 + S / S0))
    work           1 - d (1 - exp(-W / W0)),     W' = max(F v, 0)
    dissipation    1 - d (1 - exp(-W / W0)),     W' = F v
    unlimited      exp(-c W),                    W' = F v
    inelastic, inelastic_unlimited    the last two with W less the elastic energy k x^2 / 2, k the
                                      secant stiffness as in self-heating by dissipation
    core           1 / (1 + c W) of F - k x alone,    W' = (F - k x) v, of the force that is left:
                   the yield force falls, and the rubber of stiffness k beside it does not
    core_limited   the same with 1 - d (1 - exp(-W / W0))
    cycles         1 - d (1 - exp(-N / N0)),     N' = |v| / (4 w cosh(x / w)^2)
    cycles_logarithmic    1 / (1 + c ln(1 + N / N0))

N counts cycles: half of one at each passage through the middle, whatever the amplitude, if this is
larger than the width w. Cycles smaller than w count in proportion to their amplitude.
Elastic work swings the W of dissipation and unlimited within a cycle and cancels over it, as it
does the warmth of self-heating. The unlimited ones are self-heating that never cools: the data
decide between both causes by the cooling, and not by what drives them.
"""

from typing import Any

import numpy as np

from ..laws.law import Quantity
from .effect import Effect, EffectInPlan, EffectParameter, Past, Signals
from .followers import (
    RUBBER,
    SECANT,
    TINY,
    of_core,
    plan_core,
    plan_power,
    positive,
    rates_secant,
    stored_energy,
)


def exponential(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Share of the force that is left."""
    loss, scale, *_ = parameters
    return 1 + loss * np.expm1(-positive(states[0]) / scale)


def hardening(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Force over that of the first cycle."""
    gain, scale = parameters
    return exponential(signals, states, (-gain, scale))


def logarithmic(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Share of the force that is left."""
    loss, scale, *_ = parameters
    return 1 / (1 + loss * np.log1p(positive(states[0]) / scale))


def rates_travel(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Way travelled."""
    return (np.fabs(signals.v),)


def rates_cycles(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Cycles, half of one at each passage through the middle."""
    width = parameters[-1]
    # 1 / cosh^2 without overflow
    fading = np.exp(-2 * np.fabs(signals.x) / width)
    return (np.fabs(signals.v) * fading / (width * (1 + fading) ** 2),)


def rates_work(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Work done on the device, by the force that is left."""
    return (positive(signals.force * signals.v) * exponential(signals, states, parameters),)


def rates_dissipation(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Work that is not given back, of the force that is left."""
    return (signals.force * signals.v * exponential(signals, states, parameters),)


def carried_travel(past: Past, parameters: tuple) -> tuple:
    """Way travelled in earlier tests."""
    return (past.travel,)


def carried_cycles(past: Past, parameters: tuple) -> tuple:
    """Cycles of earlier tests, as if all had their mean amplitude."""
    amplitude = past.travel / (4 * past.cycles + TINY)
    return (past.cycles * np.tanh(amplitude / parameters[-1]),)


def carried_work(past: Past, parameters: tuple) -> tuple:
    """Work of earlier tests."""
    return (past.work,)


def carried_dissipation(past: Past, parameters: tuple) -> tuple:
    """Work of earlier tests that was not given back."""
    return (past.dissipated,)


def unlimited(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Share of the force that is left."""
    return np.exp(-parameters[0] * positive(states[0]))


def rates_unlimited(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Work that is not given back, of the force that is left."""
    return (signals.force * signals.v * unlimited(signals, states, parameters),)


def inelastic(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Share of the force that is left."""
    # a device that has weakened stores less
    work, stored = states[0], stored_energy(signals, tuple(states[1:]))
    left = exponential(signals, (work - stored,), parameters)
    return exponential(signals, (work - stored * left,), parameters)


def rates_inelastic(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """All work, of the force that is left; moving means."""
    return _rates_of_work(signals, states, inelastic(signals, states, parameters))


def inelastic_unlimited(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Share of the force that is left."""
    work, stored = states[0], stored_energy(signals, tuple(states[1:]))
    left = unlimited(signals, (work - stored,), parameters)
    return unlimited(signals, (work - stored * left,), parameters)


def rates_inelastic_unlimited(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """All work, of the force that is left; moving means."""
    return _rates_of_work(signals, states, inelastic_unlimited(signals, states, parameters))


def _rates_of_work(signals: Signals, states: tuple, left: Any) -> tuple:
    return (signals.force * signals.v * left, *rates_secant(signals, tuple(states[1:])))


def carried_inelastic(past: Past, parameters: tuple) -> tuple:
    """Work of earlier tests that was not given back; no motion remembered."""
    return (past.dissipated, 0.0 * past.dissipated, 0.0 * past.dissipated)


def core(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Loss of force of the yielding part."""
    return (_remaining_fraction(states, parameters) - 1) * of_core(signals, parameters[1])


def rates_core(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Work of the yielding part, by the force that is left."""
    return (_remaining_fraction(states, parameters) * of_core(signals, parameters[1]) * signals.v,)


def core_limited(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Loss of force of the yielding part."""
    left = exponential(signals, states, parameters[:2])
    return (left - 1) * of_core(signals, parameters[2])


def rates_core_limited(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Work of the yielding part, by the force that is left."""
    left = exponential(signals, states, parameters[:2])
    return (left * of_core(signals, parameters[2]) * signals.v,)


def plan_rates_dissipation(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Work in both directions that is not given back, of the force that is left."""
    return (plan_power(signals.force, signals.v) * exponential(signals, states, parameters),)


def plan_force_core(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Loss of force of the yielding part along x and y."""
    return plan_core(signals, parameters[1], _remaining_fraction(states, parameters) - 1)


def plan_rates_core(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Work of the yielding part in both directions, by the force that is left."""
    force = plan_core(signals, parameters[1], _remaining_fraction(states, parameters))
    return (plan_power(force, signals.v),)


def _remaining_fraction(states: tuple, parameters: tuple) -> Any:
    """Share of the yield force that is left."""
    return 1 / (1 + parameters[0] * positive(states[0]))


TRAVEL = Quantity("travel", "m", "way travelled")
CYCLES = Quantity("cycles", "1", "cycles so far")
DISSIPATED = Quantity("dissipated", "J", "work done on the device and not given back")
PER_ENERGY = EffectParameter(
    "loss", "1/J", "loss of force for energy dissipated", lower=0.0, magnitude=True, starts=(0.02,)
)
LOSS = EffectParameter(
    "loss", "1", "final fraction of the force lost", lower=0.0, upper=0.95, magnitude=True,
    starts=(0.2, 0.5),
)  # fmt: skip


GAIN = EffectParameter(
    "gain", "1", "final fraction of the force gained", lower=0.0, upper=3.0, magnitude=True,
    starts=(0.2,),
)  # fmt: skip
PER_E_FOLD = EffectParameter(
    "loss", "1", "loss for an e-fold path length or number of cycles", lower=0.0, upper=10.0,
    magnitude=True, starts=(0.1,),
)  # fmt: skip
WIDTH = EffectParameter(
    "width", "m", "amplitude from which all cycles wear alike", lower=1e-6, divides=True,
    starts=(0.1, 0.5),
)  # fmt: skip


def _scale(
    unit: str, meaning: str, starts: tuple[float, ...] = (5.0, 30.0, 200.0)
) -> EffectParameter:
    return EffectParameter("scale", unit, meaning, lower=1e-6, divides=True, starts=starts)


NUMBER = _scale("1", "number of cycles over which force is lost", (1.0, 5.0, 30.0))


FORMS = (
    *(
        Effect(
            cause="cyclic_degradation",
            form=form,
            title=title,
            parameters=(change, _scale("m", meaning)),
            states=(TRAVEL,),
            factor=factor,
            carried=carried_travel,
            rates=rates_travel,
            source=source,
            gradual=True,
        )
        for form, title, factor, change, meaning, source in (
            (
                "exponential", "Cyclic degradation", exponential, LOSS,
                "path length over which force is lost",
                "exponential decay towards a stable cycle",
            ),
            (
                "hardening", "Cyclic hardening", hardening, GAIN,
                "path length over which force is gained",
                "Chaboche (1986), isotropic hardening towards a stable cycle",
            ),
            (
                "logarithmic", "Cyclic degradation, logarithmic", logarithmic, PER_E_FOLD,
                "path length after which it begins",
                "loss with the logarithm of the number of cycles",
            ),
        )
    ),
    Effect(
        cause="cyclic_degradation",
        form="work",
        title="Cyclic degradation by work",
        parameters=(LOSS, _scale("J", "work after which force is lost")),
        states=(Quantity("work", "J", "work done on the device"),),
        factor=exponential,
        carried=carried_work,
        rates=rates_work,
        needs=frozenset({"force"}),
        source="damage by absorbed energy",
        gradual=True,
    ),
    Effect(
        cause="cyclic_degradation",
        form="dissipation",
        title="Cyclic degradation by dissipation",
        parameters=(LOSS, _scale("J", "dissipated energy after which force is lost")),
        states=(DISSIPATED,),
        factor=exponential,
        carried=carried_dissipation,
        rates=rates_dissipation,
        needs=frozenset({"force"}),
        source="damage by dissipated energy",
        gradual=True,
        plan=EffectInPlan(rates=plan_rates_dissipation, factor=exponential),
    ),
    Effect(
        cause="cyclic_degradation",
        form="unlimited",
        title="Cyclic degradation by dissipation, without an end",
        parameters=(PER_ENERGY,),
        states=(DISSIPATED,),
        factor=unlimited,
        carried=carried_dissipation,
        rates=rates_unlimited,
        needs=frozenset({"force"}),
        source="damage in proportion to the dissipated energy and to what is left",
        gradual=True,
    ),
    Effect(
        cause="cyclic_degradation",
        form="inelastic",
        title="Cyclic degradation by the dissipated work",
        parameters=(LOSS, _scale("J", "dissipated energy after which force is lost")),
        states=(DISSIPATED, *SECANT),
        factor=inelastic,
        carried=carried_inelastic,
        rates=rates_inelastic,
        needs=frozenset({"force"}),
        source="damage by dissipated energy; elastic energy by the secant stiffness",
        gradual=True,
    ),
    Effect(
        cause="cyclic_degradation",
        form="inelastic_unlimited",
        title="Cyclic degradation by the dissipated work, without an end",
        parameters=(PER_ENERGY,),
        states=(DISSIPATED, *SECANT),
        factor=inelastic_unlimited,
        carried=carried_inelastic,
        rates=rates_inelastic_unlimited,
        needs=frozenset({"force"}),
        source="damage in proportion to the dissipated energy and to what is left",
        gradual=True,
    ),
    Effect(
        cause="cyclic_degradation",
        form="core",
        title="Cyclic degradation of the yield force",
        parameters=(PER_ENERGY, RUBBER),
        states=(DISSIPATED,),
        force=core,
        carried=carried_dissipation,
        rates=rates_core,
        needs=frozenset({"force"}),
        source="Baber & Noori (1985): strength over 1 + c W, W the energy of the hysteretic part",
        gradual=True,
        plan=EffectInPlan(rates=plan_rates_core, force=plan_force_core),
    ),
    Effect(
        cause="cyclic_degradation",
        form="core_limited",
        title="Cyclic degradation of the yield force, to a limit",
        parameters=(LOSS, _scale("J", "dissipated energy after which it is lost"), RUBBER),
        states=(DISSIPATED,),
        force=core_limited,
        carried=carried_dissipation,
        rates=rates_core_limited,
        needs=frozenset({"force"}),
        source="Baber & Noori (1985), with a strength that remains",
        gradual=True,
    ),
    Effect(
        cause="cyclic_degradation",
        form="cycles",
        title="Cyclic degradation by the number of cycles",
        parameters=(LOSS, NUMBER, WIDTH),
        states=(CYCLES,),
        factor=exponential,
        carried=carried_cycles,
        rates=rates_cycles,
        source="exponential decay towards a stable cycle",
        gradual=True,
    ),
    Effect(
        cause="cyclic_degradation",
        form="cycles_logarithmic",
        title="Cyclic degradation by the logarithm of the number of cycles",
        parameters=(PER_E_FOLD, NUMBER, WIDTH),
        states=(CYCLES,),
        factor=logarithmic,
        carried=carried_cycles,
        rates=rates_cycles,
        source="loss with the logarithm of the number of cycles",
        gradual=True,
    ),
)  # fmt: skip
