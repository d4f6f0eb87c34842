"""Undamped modes."""

from __future__ import annotations

import numpy as np

from ..errors import InputError


def undamped_modes(mass: np.ndarray, stiffness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Undamped frequencies and mass-normalised mode shapes.

    Parameters
    ----------
    mass : numpy.ndarray, shape (n, n), kg
        Symmetric, positive definite.
    stiffness : numpy.ndarray, shape (n, n), N/m
        Symmetric, positive definite.

    Returns
    -------
    frequencies : numpy.ndarray, shape (n,), rad/s
        Increasing.
    shapes : numpy.ndarray, shape (n, n), 1/sqrt(kg)
        One mode a column.

    Raises
    ------
    InputError
        If the stiffness holds some motion not at all.
    """
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    squares, vectors = np.linalg.eigh(inverse @ stiffness @ inverse.T)
    if squares.size and squares[0] <= 1e-12 * squares[-1]:
        raise InputError("the superstructure has a motion that its stiffness does not hold")
    return np.sqrt(squares), inverse.T @ vectors
