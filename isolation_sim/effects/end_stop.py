"""Beyond a gap the device meets a stop, or its rubber locks.

Forms, with u = max(|x| - gap, 0):

    linear         k u
    power          k u (u / w)^(n - 1),   w = gap / 10: k is the secant stiffness at u = w
    exponential    k w (exp(u / w) - 1),  linear from u = 20 w on, so that it stays finite
    two_gaps       power, with a gap of its own on either side
    dissipating    power times max(1 + c u', 0): less on the way back than on the way in
"""

from typing import Any

import numpy as np

from .effect import Effect, EffectInPlan, EffectParameter, Signals
from .followers import positive, raised

STEEPEST = 20.0
"""u / w beyond which the exponential goes on linearly."""


def linear(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Contact force."""
    k, gap = parameters
    return k * positive(np.fabs(signals.x) - gap) * np.sign(signals.x)


def stored_energy_linear(x: Any, states: tuple, parameters: tuple) -> Any:
    """Its potential."""
    k, gap = parameters
    return k * positive(np.fabs(x) - gap) ** 2 / 2


def power(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Contact force."""
    k, gap, n = parameters
    u, w = positive(np.fabs(signals.x) - gap), gap / 10
    return k * w * raised(u / w, n) * np.sign(signals.x)


def plan_power(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Contact forces of walls on all four sides."""
    x, y = (signals._replace(x=along) for along in signals.x)
    return power(x, states, parameters), power(y, states, parameters)


def stored_energy_power(x: Any, states: tuple, parameters: tuple) -> Any:
    """Its potential."""
    k, gap, n = parameters
    u, w = positive(np.fabs(x) - gap), gap / 10
    return k * w**2 * raised(u / w, n + 1) / (n + 1)


def stored_energy_dissipating(x: Any, states: tuple, parameters: tuple) -> Any:
    """Its potential; what the damping keeps is lost."""
    return stored_energy_power(x, states, parameters[:3])


def two_gaps(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Contact force."""
    k, ahead, behind, n = parameters
    w = ahead / 10
    forwards, backwards = positive(signals.x - ahead) / w, positive(-signals.x - behind) / w
    return k * w * (raised(forwards, n) - raised(backwards, n))


def stored_energy_two_gaps(x: Any, states: tuple, parameters: tuple) -> Any:
    """Its potential."""
    k, ahead, behind, n = parameters
    w = ahead / 10
    forwards, backwards = positive(x - ahead) / w, positive(-x - behind) / w
    return k * w**2 * (raised(forwards, n + 1) + raised(backwards, n + 1)) / (n + 1)


def dissipating(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Contact force."""
    approach = signals.v * np.sign(signals.x)
    return power(signals, states, parameters[:3]) * positive(1 + parameters[3] * approach)


def exponential(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Contact force."""
    k, gap, w = parameters
    ratio = positive(np.fabs(signals.x) - gap) / w
    beyond = positive(ratio - STEEPEST)
    steep = np.expm1(ratio - beyond) + np.exp(STEEPEST) * beyond
    return k * w * steep * np.sign(signals.x)


def stored_energy_exponential(x: Any, states: tuple, parameters: tuple) -> Any:
    """Its potential."""
    k, gap, w = parameters
    ratio = positive(np.fabs(x) - gap) / w
    beyond = positive(ratio - STEEPEST)
    within = ratio - beyond
    steep = np.expm1(within) - within
    more = beyond * np.expm1(STEEPEST) + np.exp(STEEPEST) * beyond**2 / 2
    return k * w**2 * (steep + more)


def _stiffness(meaning: str) -> EffectParameter:
    return EffectParameter("stiffness", "N/m", meaning, lower=0.0, magnitude=True, starts=(1.0,))


def _gap(name: str, meaning: str, *starts: float) -> EffectParameter:
    # what begins nearer to the middle is a spring that stiffens, not a stop
    return EffectParameter(
        name, "m", meaning, lower=1e-6, upper=100.0, divides=True, starts=starts, least=0.3
    )


def _exponent(*starts: float) -> EffectParameter:
    return EffectParameter(
        "exponent", "1", "exponent of the overrun", lower=1.0, upper=6.0, starts=starts,
        plain=(1.0,),
    )  # fmt: skip


GAP = _gap("gap", "deformation at which it begins", 0.5, 0.7, 0.9)

FORMS = (
    Effect(
        cause="end_stop",
        form="power",
        title="End stop",
        parameters=(
            _stiffness("secant stiffness at a tenth of the gap beyond the gap"),
            GAP,
            _exponent(1.0, 2.0),
        ),
        force=power,
        stored_energy=stored_energy_power,
        source="Hertz (1882) for an exponent of 1.5",
        plan=EffectInPlan(force=plan_power),
    ),
    Effect(
        cause="end_stop",
        form="linear",
        title="End stop, linear",
        parameters=(_stiffness("stiffness beyond the gap"), GAP),
        force=linear,
        stored_energy=stored_energy_linear,
        source="linear contact",
    ),
    Effect(
        cause="end_stop",
        form="exponential",
        title="End stop, exponential",
        parameters=(
            _stiffness("tangent stiffness where it begins"),
            GAP,
            EffectParameter(
                "depth", "m", "overrun for e-fold growth", lower=1e-4, upper=100.0,
                divides=True, starts=(0.1, 0.3),
            ),
        ),
        force=exponential,
        stored_energy=stored_energy_exponential,
        source="Fung (1967)",
    ),
    Effect(
        cause="end_stop",
        form="two_gaps",
        title="End stop that begins elsewhere on each side",
        parameters=(
            _stiffness("secant stiffness at a tenth of the first gap beyond the gaps"),
            _gap("ahead", "positive deformation at which it begins", 0.5, 0.8, 1.2),
            _gap("behind", "negative deformation at which it begins", 0.5, 0.8, 1.2),
            _exponent(1.5),
        ),
        force=two_gaps,
        stored_energy=stored_energy_two_gaps,
        source="Hertz (1882) for an exponent of 1.5",
    ),
    Effect(
        cause="end_stop",
        form="dissipating",
        title="End stop that dissipates",
        parameters=(
            _stiffness("secant stiffness at a tenth of the gap beyond the gap, at rest"),
            GAP,
            _exponent(1.5),
            EffectParameter(
                "damping", "s/m", "growth of the force with the velocity of approach", lower=0.0,
                starts=(0.5,), plain=(0.0,),
            ),
        ),
        force=dissipating,
        stored_energy=stored_energy_dissipating,
        source="Hunt & Crossley (1975)",
    ),
)  # fmt: skip
