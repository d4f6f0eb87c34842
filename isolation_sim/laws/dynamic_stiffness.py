"""Dynamic stiffness of an MR elastomer, linear in amplitude, field and frequency, in time.

``F = K'(A, B, f) x + K''(A, B, f) v / (2 pi f)`` with the storage stiffness
``K' = k_0 + k_A A + k_B B + k_f f`` and the loss stiffness ``K'' = l_0 + l_A A + l_B B + l_f f``,
which the paper fits to its Table 1. A and f are the amplitude and frequency of a sinusoid with the
mean squares of deformation and velocity of the last ``tau`` seconds. In K' and K'' they are limited
to the range of the tests, 0.1-0.2 mm and 6-20 Hz, because the regression is not valid beyond it. In
the first periods of a motion, f is near the reference frequency of 10 Hz.

The paper gives the field, but no current. The field against the current is the parameter ``B``:
``B = [0, 0.3]`` is 0.3 T/A. The published sets take 0.588 T/A, the field that Li & Li (Section 4.2)
compute for the first layer of their own isolator at 1 A. Give the field of your magnet, and a
``current_range`` up to 0.4 T, the largest field of the tests.

No linear device has such a stiffness. By causality, a loss stiffness of 1 N/mm from 6 to 20 Hz
raises the storage stiffness by 0.8 N/mm, four times the printed 0.2 N/mm. This device adapts to the
motion and is not linear. It has no stored energy, and a stiffness that changes with the amplitude
can do work.

For a fit, fix ``B`` and ``tau``. The slopes need motions of several amplitudes and frequencies
within the range of the tests.
"""

from typing import Any

import numpy as np

from . import linearised_bouc_wen
from .current_dependence import CurrentDependence
from .device import Device
from .law import Law, Quantity
from .published import (
    LINEARISED_AMPLITUDES_MM,
    LINEARISED_FIELDS_T,
    LINEARISED_FREQUENCIES_HZ,
    LINEARISED_REGRESSION_PRINTED,
)

AMPLITUDES = (1e-3 * LINEARISED_AMPLITUDES_MM[0], 1e-3 * LINEARISED_AMPLITUDES_MM[-1])
"""Smallest and largest tested amplitude, m."""

FREQUENCIES = (LINEARISED_FREQUENCIES_HZ[0], LINEARISED_FREQUENCIES_HZ[-1])
"""Lowest and highest tested frequency, Hz."""

REFERENCE_FREQUENCY = 10.0
"""Estimate of the frequency at rest, Hz."""

TESLA_PER_AMPERE = 0.588
"""Li & Li, Section 4.2: field at 1 A in the first layer of another isolator."""

AVERAGING_TIME = 1.0
"""Default tau in s, six periods of the slowest test."""

# mean square added to both, over the square of the largest amplitude: sets the estimate at rest
_REST = 1e-4


def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
    """Storage stiffness times deformation and loss stiffness times velocity over frequency."""
    k_0, k_A, k_B, k_f, l_0, l_A, l_B, l_f, B, _ = parameters
    amplitude, frequency = _motion(*states)
    A, f = _hold(amplitude, *AMPLITUDES), _hold(frequency, *FREQUENCIES)
    storage = k_0 + k_A * A + k_B * B + k_f * f
    loss = l_0 + l_A * A + l_B * B + l_f * f
    return storage * x + loss * v / (2 * np.pi * frequency)


def rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
    """Rates of both running means."""
    e, g = states
    tau = parameters[-1]
    largest, omega = AMPLITUDES[1], 2 * np.pi * REFERENCE_FREQUENCY
    return (x**2 / largest - e) / tau, ((v / omega) ** 2 / largest - g) / tau


def _motion(e: Any, g: Any) -> tuple:
    """Amplitude and frequency of the sinusoid that has these mean squares."""
    rest = _REST * AMPLITUDES[1]
    e, g = e * (e > 0) + rest, g * (g > 0) + rest
    return np.sqrt(2 * AMPLITUDES[1] * e), REFERENCE_FREQUENCY * np.sqrt(g / e)


def _hold(value: Any, low: float, high: float) -> Any:
    """Hold a value between two ends, with corners rounded over a thousandth of the range."""
    corner = 1e-3 * (high - low)
    return (low + high + np.hypot(value - low, corner) - np.hypot(value - high, corner)) / 2


# from N/mm over mm, T and Hz to SI
_SI = {"constant": ("0", 1e3), "A": ("A", 1e6), "B": ("B", 1e3), "f": ("f", 1e3)}


def _device(coefficients: dict[str, dict[str, float]], source: str) -> Device:
    values: dict[str, float | tuple[float, ...]] = {
        f"{letter}_{_SI[name][0]}": _SI[name][1] * value
        for letter, part in (("k", "storage"), ("l", "loss"))
        for name, value in coefficients[part].items()
    }
    values |= {"B": (0.0, TESLA_PER_AMPERE), "tau": AVERAGING_TIME}
    return Device(
        law=LAW,
        current=CurrentDependence.polynomial(values),
        current_range=(0.0, LINEARISED_FIELDS_T[-1] / TESLA_PER_AMPERE),
        tested_deformation=AMPLITUDES[1],
        tested_current=LINEARISED_FIELDS_T[-1] / TESLA_PER_AMPERE,
        source=f"dynamic stiffness of MR elastomers, {source}; field by Li & Li, 0.588 T/A",
    )


def sound() -> Device:
    """Build the regression of Table 1 without its corrupt column."""
    result = linearised_bouc_wen.regression(drop=[linearised_bouc_wen.CORRUPT])
    return _device(
        {part: slopes for part, (slopes, _) in result.items()},
        "Table 1 without 0.2 T, 0.1 mm, 20 Hz",
    )


def printed() -> Device:
    """Build the regression that the paper prints."""
    return _device(LINEARISED_REGRESSION_PRINTED, "second Eqs 10-11 as printed")


LAW = Law(
    name="dynamic_stiffness",
    title="Dynamic stiffness by regression",
    states=(
        Quantity("e", "m", "running mean square of the deformation, over 0.2 mm"),
        Quantity("g", "m", "the same of the velocity over 2 pi 10 Hz"),
    ),
    parameters=(
        Quantity("k_0", "N/m", "storage stiffness without field, motion"),
        Quantity("k_A", "N/m^2", "its slope over the amplitude"),
        Quantity("k_B", "N/(m T)", "its slope over the field"),
        Quantity("k_f", "N s/m", "its slope over the frequency"),
        Quantity("l_0", "N/m", "loss stiffness without field, motion"),
        Quantity("l_A", "N/m^2", "its slope over the amplitude"),
        Quantity("l_B", "N/(m T)", "its slope over the field"),
        Quantity("l_f", "N s/m", "its slope over the frequency"),
        Quantity("B", "T", "field, against the current", lower=0.0),
        Quantity("tau", "s", "averaging time of the motion", lower=0.0, divides=True),
    ),
    force=force,
    rates=rates,
    source="A study of the dynamic stiffness of MR elastomers, second Eqs 10-11; Li & Li, Section "
    "4.2, for the field at 1 A",
    sets={"regression_sound": sound, "regression_printed": printed},
)
