"""Groups of arguments of ``device_kernel.py``."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Coefficients(NamedTuple):
    """Coefficients of a law's parameters over the current, (n_coefficients,) each."""

    theta: NDArray  # The coefficients
    owner: NDArray  # int: Each one's parameter, by number
    power: NDArray  # int: Power of the current that it multiplies


class Workspace(NamedTuple):
    """A law's states and parameters while it follows a motion, and their derivatives."""

    s: NDArray  # (n_states,)
    parameters: NDArray  # (n_parameters,)
    slope: NDArray  # (n_states, n_coefficients): Derivatives of the states by the coefficients
    new_slope: NDArray  # The same, at the end of a step
    by: NDArray  # (n_states, n_states + n_parameters): Derivatives of a step or of the force
    factor: NDArray  # (n_coefficients,): Powers of the current


def workspace(n_states: int, n_parameters: int, n_coefficients: int) -> Workspace:
    """Return room for a law; a law without states has the derivatives of its force in one row."""
    rows = max(n_states, 1)
    return Workspace(
        np.zeros(rows),
        np.zeros(n_parameters),
        np.zeros((rows, n_coefficients)),
        np.zeros((rows, n_coefficients)),
        np.zeros((rows, n_states + n_parameters)),
        np.zeros(n_coefficients),
    )
