"""Functions of an effect that ``effect_kernel.py`` calls: here those of a current lag."""

import numpy as np

from ...compilation.options import exact_inline
from ...effects.current_lag import SHORTEST

N_STATES = 1
N_PARAMETERS = 1
N_OUTPUTS = 1
GAMMA = 1 - 1 / 2**0.5
"""Coefficient of the Rosenbrock step, of every effect."""


@exact_inline
def respond(signals, k, s, parameters, out):
    """Write the effect at sample k: changed motion and current, factor, added force in its rows."""
    out[0, k] = s[0]


@exact_inline
def step(signals, k, n, h, s, parameters):
    """Move the states from sample k to n by one Rosenbrock step of h, s, along straight lines."""
    current_0, current_1 = signals.current[k], signals.current[n]
    lag = parameters[0] + SHORTEST * np.exp(-((parameters[0] / SHORTEST) ** 2))
    drift = GAMMA * (current_1 - current_0) / lag
    first = ((current_0 - s[0]) / lag + drift) / (1 + GAMMA * h / lag)
    second = ((current_1 - s[0] - h * first) / lag - drift - 2 * first) / (1 + GAMMA * h / lag)
    s[0] += h * (1.5 * first + 0.5 * second)


@exact_inline
def respond_with_slopes(signals, k, s, parameters, out, by):
    """The same, and its derivatives by states, parameters and force, a row of by for each."""
    out[0, k] = s[0]
    by[0, 0] = 1.0
    by[0, 1] = 0.0
    by[0, 2] = 0.0


@exact_inline
def step_with_slopes(signals, k, n, h, s, parameters, by):
    """The same, and derivatives of the new states by states, parameters, and force at both ends."""
    current_0, current_1 = signals.current[k], signals.current[n]
    short = SHORTEST * np.exp(-((parameters[0] / SHORTEST) ** 2))
    lag = parameters[0] + short
    by_lag = 1 - 2 * parameters[0] / SHORTEST**2 * short
    drift = GAMMA * (current_1 - current_0) / lag
    below = 1 + GAMMA * h / lag
    first = ((current_0 - s[0]) / lag + drift) / below
    second = ((current_1 - s[0] - h * first) / lag - drift - 2 * first) / below
    # of the lag: 1 / lag and what is over it
    first_by = ((s[0] - current_0) / lag**2 - drift / lag + first * GAMMA * h / lag**2) / below
    second_by = (
        (s[0] + h * first - current_1) / lag**2
        - h * first_by / lag
        + drift / lag
        - 2 * first_by
        + second * GAMMA * h / lag**2
    ) / below
    by_first = -1 / lag / below
    by_second = ((-1 - h * by_first) / lag - 2 * by_first) / below
    by[0, 0] = 1 + h * (1.5 * by_first + 0.5 * by_second)
    by[0, 1] = h * (1.5 * first_by + 0.5 * second_by) * by_lag
    by[0, 2] = 0.0
    by[0, 3] = 0.0
    s[0] += h * (1.5 * first + 0.5 * second)
