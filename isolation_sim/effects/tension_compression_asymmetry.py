"""The device is stiffer one way than the other: preload, a tilted stack, one-sided plates.

Forms:

    step            factor 1 + a tanh(x / w)
    proportional    factor 1 + a x / sqrt(1 + (a x)^2)      1 + a x where that is small
    one_sided       factor 1 / (1 + (-a x)+): softer with the deformation on one side, by the sign
                    of a, as where bonded rubber tears inside in tension
    direction       the factor 1 + a tanh(v / w) for F - k x: dampers whose valves or pistons resist
                    more one way; the spring k beside them does not
    spring          adds k (sqrt(x^2 + w^2) - w): the stiffness alone differs, by 2 k between
                    both directions where |x| is well above w; in x^2 below it
    spring_by_current   the same with k (1 + m |I|): the field's part differs, too
    gas             adds k l u^2 / (1 - u), u = x / l times the sign of k: a gas of the length l
                    that deformation one way compresses, beyond its linear stiffness k: the
                    accumulator of a fluid damper
    dashpot_by_current  adds c |v| (1 + m |I|): a dashpot that resists more one way, as valves do
"""

from typing import Any

import numpy as np

from .effect import Effect, EffectParameter, Signals
from .followers import of_core, positive


def step(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Force over the symmetric one."""
    asymmetry, width = parameters
    return 1 + asymmetry * np.tanh(signals.x / width)


def proportional(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Force over the symmetric one."""
    ratio = parameters[0] * signals.x
    return 1 + ratio / np.sqrt(1 + ratio**2)


def one_sided(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Force over that on the other side."""
    return 1 / (1 + positive(-parameters[0] * signals.x))


def direction(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Force beyond the mean of both directions of motion."""
    asymmetry, velocity, stiffness = parameters
    return asymmetry * np.tanh(signals.v / velocity) * of_core(signals, stiffness)


def spring(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Even part of the elastic force."""
    stiffness, width = parameters
    return stiffness * (np.sqrt(signals.x**2 + width**2) - width)


def stored_energy_spring(x: Any, states: tuple, parameters: tuple) -> Any:
    """Its potential."""
    stiffness, width = parameters
    root = np.sqrt(x**2 + width**2)
    return stiffness * (x * root / 2 + width**2 / 2 * np.arcsinh(x / width) - width * x)


def spring_by_current(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Even part of an elastic force that follows the field."""
    stiffness, by_current, width = parameters
    even = spring(signals, states, (stiffness, width))
    return even * (1 + by_current * np.fabs(signals.current))


def _compression(x: Any, stiffness: Any, length: Any) -> tuple:
    """Part of a gas column that is compressed, up to ``FULL``, and what is beyond it."""
    u = x * np.sign(stiffness) / length
    beyond = positive(u - FULL)
    return u - beyond, beyond


def gas(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Force of a gas at constant temperature beyond its mean and its stiffness at rest."""
    stiffness, length = parameters
    u, beyond = _compression(signals.x, stiffness, length)
    return stiffness * length * (u**2 / (1 - u) + AT_FULL[1] * beyond)


def stored_energy_gas(x: Any, states: tuple, parameters: tuple) -> Any:
    """Its potential."""
    stiffness, length = parameters
    u, beyond = _compression(x, stiffness, length)
    inside = -np.log(1 - u) - u - u**2 / 2
    linear = AT_FULL[0] * beyond + AT_FULL[1] * beyond**2 / 2
    return np.fabs(stiffness) * length**2 * (inside + linear)


def dashpot_by_current(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Even part of a dashpot's force, which follows the field."""
    damping, by_current = parameters
    return damping * np.fabs(signals.v) * (1 + by_current * np.fabs(signals.current))


FULL = 0.95
"""Compression of a gas from which its force grows linearly."""
AT_FULL = (FULL**2 / (1 - FULL), FULL * (2 - FULL) / (1 - FULL) ** 2)
"""Force and slope there, over the stiffness."""

DIFFERENCE = EffectParameter(
    "stiffness", "N/m", "half of the difference between both directions", magnitude=True,
    starts=(0.1,),
)  # fmt: skip
BY_CURRENT = EffectParameter(
    "by_current", "1/A", "growth of the difference with the current", starts=(0.5,),
)  # fmt: skip
WIDTH = EffectParameter(
    "width", "m", "deformation over which it develops", lower=1e-7, upper=10.0, divides=True,
    starts=(0.05, 0.5, 3.0),
)  # fmt: skip

FORMS = (
    Effect(
        cause="tension_compression_asymmetry",
        form="step",
        title="Asymmetry",
        parameters=(
            EffectParameter(
                "asymmetry", "1", "half of the difference between both directions", lower=-0.95,
                upper=0.95, magnitude=True, starts=(0.1,),
            ),
            EffectParameter(
                "width", "m", "deformation over which it develops", lower=1e-7, upper=10.0,
                divides=True, starts=(0.05, 0.5),
            ),
        ),
        factor=step,
        source="smoothed step between two stiffnesses",
    ),
    Effect(
        cause="tension_compression_asymmetry",
        form="proportional",
        title="Asymmetry that grows with deformation",
        parameters=(
            EffectParameter(
                "asymmetry", "1/m", "relative change of force with deformation", lower=-1e5,
                upper=1e5, magnitude=True, starts=(0.1,),
            ),
        ),
        factor=proportional,
        source="first even term of the force's series, limited to positive values",
    ),
    Effect(
        cause="tension_compression_asymmetry",
        form="one_sided",
        title="Asymmetry, softer with deformation on one side",
        parameters=(
            EffectParameter(
                "asymmetry", "1/m", "relative loss of stiffness with deformation", lower=-1e5,
                upper=1e5, magnitude=True, starts=(0.2,),
            ),
        ),
        factor=one_sided,
        source="Gent & Lindley (1959), internal rupture of bonded rubber in tension",
    ),
    Effect(
        cause="tension_compression_asymmetry",
        form="direction",
        title="Asymmetry by the direction of motion",
        parameters=(
            EffectParameter(
                "asymmetry", "1", "half of the difference between both directions", lower=-0.95,
                upper=0.95, magnitude=True, starts=(0.1,),
            ),
            EffectParameter(
                "velocity", "m/s", "velocity over which it develops", lower=1e-6, divides=True,
                starts=(0.02, 0.2),
            ),
            EffectParameter(
                "stiffness", "N/m", "stiffness of a spring beside it, alike both ways", lower=0.0,
                starts=(0.5, 0.2), plain=(0.0,),
            ),
        ),
        force=direction,
        needs=frozenset({"force"}),
        source="Dixon (2007), valves of different damping in extension and compression",
    ),
    Effect(
        cause="tension_compression_asymmetry",
        form="spring",
        title="Asymmetry of the stiffness",
        parameters=(DIFFERENCE, WIDTH),
        force=spring,
        stored_energy=stored_energy_spring,
        source="smoothed bilinear spring",
    ),
    Effect(
        cause="tension_compression_asymmetry",
        form="spring_by_current",
        title="Asymmetry of the stiffness that grows with the current",
        parameters=(
            DIFFERENCE,
            BY_CURRENT,
            WIDTH,
        ),
        force=spring_by_current,
        needs=frozenset({"current"}),
        source="smoothed bilinear spring of a magnetorheological elastomer",
    ),
    Effect(
        cause="tension_compression_asymmetry",
        form="gas",
        title="Asymmetry of a gas spring",
        parameters=(
            EffectParameter(
                "stiffness", "N/m", "stiffness of the gas at rest; its sign is the direction in "
                "which it is compressed", magnitude=True, starts=(0.1, -0.1),
            ),
            EffectParameter(
                "length", "m", "deformation that would compress it to nothing", lower=1e-7,
                upper=100.0, divides=True, starts=(1.5,), least=1.0,
            ),
        ),
        force=gas,
        stored_energy=stored_energy_gas,
        source="Boyle's law; the accumulator of a monotube damper",
    ),
    Effect(
        cause="tension_compression_asymmetry",
        form="dashpot_by_current",
        title="Asymmetry of a dashpot that grows with the current",
        parameters=(
            EffectParameter(
                "damping", "N s/m", "half of the difference between both directions",
                magnitude=True, starts=(0.1,),
            ),
            BY_CURRENT,
        ),
        force=dashpot_by_current,
        needs=frozenset({"current"}),
        source="bilinear dashpot of a magnetorheological damper",
    ),
)  # fmt: skip
