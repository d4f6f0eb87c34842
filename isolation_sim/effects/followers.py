"""Memory of a motion, time constants and powers. Shared by several effects."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..laws.law import Quantity
from .effect import EffectParameter, Signals

RISE = 2e-3
"""s: lag with which a peak is followed upwards; short beside any cycle of a structure."""
TINY = 1e-9
"""Keeps the derivatives of a power finite at zero."""


WINDOW = 1.0
"""s: averaging time of the secant stiffness, about a cycle."""
REST = 1e-6
"""m: an RMS deformation well below it has no secant stiffness."""
SECANT = (
    Quantity("product", "J", "moving mean of force times deformation"),
    Quantity("square", "m^2", "moving mean square of the deformation"),
)
"""States of ``stored_energy``."""


def stored_energy(signals: Signals, means: tuple) -> Any:
    """Elastic energy of the secant stiffness, before the device weakens."""
    product, square = means
    return 0.5 * product / (positive(square) + REST**2) * signals.x**2


def rates_secant(signals: Signals, means: tuple) -> tuple:
    """Rates of ``SECANT``."""
    product, square = means
    return (signals.force * signals.x - product) / WINDOW, (signals.x**2 - square) / WINDOW


RUBBER = EffectParameter(
    "stiffness", "N/m", "stiffness of the rubber, which does not weaken", lower=0.0,
    starts=(0.5, 0.2),
)  # fmt: skip
"""Parameter of ``of_core``."""


def of_core(signals: Signals, stiffness: Any) -> Any:
    """Force of a lead core or a slider beside the rubber, before it weakens."""
    return signals.force - stiffness * signals.x


def plan_power(force: tuple, velocity: tuple) -> Any:
    """Power of a force over two directions."""
    return force[0] * velocity[0] + force[1] * velocity[1]


def plan_core(signals: Signals, stiffness: Any, left: Any) -> tuple:
    """Share of the force of a core that is left, along x and y."""
    return tuple(left * (f - stiffness * x) for f, x in zip(signals.force, signals.x, strict=True))


FLUID = EffectParameter(
    "damping", "N s/m", "viscous damping of the fluid, which alone thins", lower=0.0,
    starts=(0.5, 0.2),
)  # fmt: skip
"""Damping c of the part c v of a force that a warm fluid loses."""


def positive(value: Any) -> Any:
    """Positive part."""
    return value * (value > 0)


def raised(value: Any, exponent: Any) -> Any:
    """Power of a value from 0 on, whose derivatives are finite at zero."""
    # changes no value above 1e-148
    return (value > 0) * np.exp(exponent / 2 * np.log(value * value + 1e-300))


def time_constant(time: Any, least: Any) -> Any:
    """A time from 0 on, as a time constant that is never zero."""
    # equal to it within 0.01 % from 3 least, with the same derivative at zero
    return time + least * np.exp(-((time / least) ** 2))


def beyond(value: Any, width: Any) -> Any:
    """Part of a value beyond a width on either side of zero."""
    return positive(value - width) - positive(-value - width)


def hill(value: Any, half: Any, exponent: Any) -> Any:
    """Hill's curve: 0 at zero, 1/2 at half, towards 1 beyond it."""
    ratio = (value / half + TINY) ** exponent
    return ratio / (1 + ratio)


def rise(value: Any, peak: Any) -> Any:
    """Rate of a state that follows a value upwards and never falls."""
    return positive(value - peak) / RISE


def rise_and_fade(value: Any, peak: Any, time: Any) -> Any:
    """Rate of a state that follows a value upwards at once and downwards slowly."""
    return rise(value, peak) - positive(peak - value) / time


def amplitude(mean_square: Any) -> Any:
    """Amplitude of the sine that has a mean square."""
    return np.sqrt(2 * positive(mean_square) + 1e-24)
