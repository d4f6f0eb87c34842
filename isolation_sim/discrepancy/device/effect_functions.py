"""Functions of an effect that ``effect_kernel.py`` calls: here those of a current lag."""

import numpy as np

from ...compilation.options import exact
from ...effects.current_lag import SHORTEST

N_STATES = 1
GAMMA = 1 - 1 / 2**0.5
"""Coefficient of the Rosenbrock step, of every effect."""


@exact
def respond(x, v, a, current, force, temperature, s, parameters, out, k):
    """Write the effect at sample k: changed motion and current, factor, added force in its rows."""
    out[0, k] = s[0]


@exact
def step(
    x_0, v_0, a_0, current_0, force_0, temperature_0,
    x_1, v_1, a_1, current_1, force_1, temperature_1, h, s, parameters,
):  # fmt: skip
    """Move the states by one Rosenbrock step of h, s, along which signals are straight lines."""
    lag = parameters[0] + SHORTEST * np.exp(-((parameters[0] / SHORTEST) ** 2))
    drift = GAMMA * (current_1 - current_0) / lag
    first = ((current_0 - s[0]) / lag + drift) / (1 + GAMMA * h / lag)
    second = ((current_1 - s[0] - h * first) / lag - drift - 2 * first) / (1 + GAMMA * h / lag)
    s[0] += h * (1.5 * first + 0.5 * second)
