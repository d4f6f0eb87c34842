"""What effects remember of a motion: the largest, the present amplitude. Shared by several."""

from __future__ import annotations

from typing import Any

import numpy as np

RISE = 2e-3
"""s: lag with which a peak is followed upwards; short beside any cycle of a structure."""


def positive(value: Any) -> Any:
    """Positive part.

    Parameters
    ----------
    value : float, numpy.ndarray or casadi.SX
        Any number.

    Returns
    -------
    float, numpy.ndarray or casadi.SX
        The value, 0 where it is negative.
    """
    return value * (value > 0)


def rise(value: Any, peak: Any) -> Any:
    """Rate of a state that follows a value upwards and never falls.

    Parameters
    ----------
    value : float, numpy.ndarray or casadi.SX
        What is followed.
    peak : float, numpy.ndarray or casadi.SX
        The state, in the same unit.

    Returns
    -------
    float, numpy.ndarray or casadi.SX
        The unit / s.
    """
    return positive(value - peak) / RISE


def rise_and_fade(value: Any, peak: Any, time: Any) -> Any:
    """Rate of a state that follows a value upwards at once and downwards slowly.

    Parameters
    ----------
    value : float, numpy.ndarray or casadi.SX
        What is followed.
    peak : float, numpy.ndarray or casadi.SX
        The state, in the same unit.
    time : float, numpy.ndarray or casadi.SX, s
        Time constant of the way down.

    Returns
    -------
    float, numpy.ndarray or casadi.SX
        The unit / s.
    """
    return rise(value, peak) - positive(peak - value) / time


def amplitude(mean_square: Any) -> Any:
    """Amplitude of the sine that has a mean square.

    Parameters
    ----------
    mean_square : float, numpy.ndarray or casadi.SX, m^2
        Negative values, which an integrator may meet by rounding, count as zero.

    Returns
    -------
    float, numpy.ndarray or casadi.SX, m
    """
    return np.sqrt(2 * positive(mean_square) + 1e-24)
