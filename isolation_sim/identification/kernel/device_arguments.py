"""Arrays of ``device_kernel.py``."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Workspace(NamedTuple):
    """A law's states and parameters while it follows a motion, and their derivatives."""

    s: NDArray  # (n_states,)
    parameters: NDArray  # (n_parameters,)
    powers: NDArray  # (n_powers,): Of the current
    slope: NDArray  # (n_states, n_powers, n_parameters): Of the states, by the coefficients
    by: NDArray  # (n_states, n_states + n_parameters): Derivatives of the force, or at rest


def workspace(n_states: int, n_parameters: int, n_powers: int) -> Workspace:
    """Return room for a law; a law without states has the derivatives of its force in one row."""
    rows = max(n_states, 1)
    return Workspace(
        np.zeros(rows),
        np.zeros(n_parameters),
        np.zeros(n_powers),
        np.zeros((rows, n_powers, n_parameters)),
        np.zeros((rows, n_states + n_parameters)),
    )
