"""Undamped modes."""

from __future__ import annotations

import numpy as np

from ..errors import InputError


def undamped_modes(mass: np.ndarray, stiffness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Undamped frequencies and mass-normalised mode shapes."""
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    squares, vectors = np.linalg.eigh(inverse @ stiffness @ inverse.T)
    if squares.size and squares[0] <= 1e-12 * squares[-1]:
        raise InputError(
            "a mode has no stiffness; expected: a positive definite stiffness matrix, and "
            "isolators with a stiffness at rest"
        )
    return np.sqrt(squares), inverse.T @ vectors
