"""Checks of matrices that users give."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..errors import InputError


def read_only(array: np.ndarray) -> np.ndarray:
    """Return the array, locked against writing."""
    array.flags.writeable = False
    return array


def numbers(what: str, given: Any) -> np.ndarray:
    """Turn user input into a read-only array of numbers.

    Parameters
    ----------
    what : str
        What it is, for the error.
    given : array_like
        User input.

    Returns
    -------
    numpy.ndarray
        A copy, locked against writing.

    Raises
    ------
    InputError
        If it holds anything but numbers or its rows have different lengths.
    """
    try:
        return read_only(np.array(given, dtype=float))
    except (TypeError, ValueError):
        raise InputError(f"{what} must be numbers in rows of one length") from None


def matrix(what: str, given: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Turn user input into a read-only array of finite numbers.

    Parameters
    ----------
    what : str
        What it is, for the error.
    given : array_like
        User input.
    shape : tuple of int
        The only shape accepted.

    Returns
    -------
    numpy.ndarray, shape ``shape``

    Raises
    ------
    InputError
        If it has another shape or holds anything but finite numbers.
    """
    array = numbers(what, given)
    if array.shape != shape:
        raise InputError(f"{what} has shape {array.shape}; accepted: {shape}")
    bad = np.argwhere(~np.isfinite(array))
    if len(bad):
        place = ", ".join(str(i) for i in bad[0])
        raise InputError(f"{what}[{place}] is {array[tuple(bad[0])]}; accepted: finite numbers")
    return array


def check_matrices(mass: np.ndarray, stiffness: np.ndarray, names: Sequence[str]) -> None:
    """Refuse a mass that is not symmetric positive definite and an asymmetric stiffness.

    Parameters
    ----------
    mass : numpy.ndarray, shape (n, n), kg
        Mass matrix.
    stiffness : numpy.ndarray, shape (n, n), N/m
        Stiffness matrix.
    names : sequence of str
        Dofs, for the error.

    Raises
    ------
    InputError
        Naming the dof.
    """
    for i, name in enumerate(names):
        if not mass[i, i] > 0:
            raise InputError(f"mass of {name!r} is {mass[i, i]:g} kg; accepted: above zero")
    for what, array in (("mass", mass), ("stiffness", stiffness)):
        skew = np.abs(array - array.T)
        if skew.size and np.max(skew) > 1e-8 * np.max(np.abs(array)):
            i, j = np.argwhere(skew == np.max(skew))[0].tolist()
            raise InputError(f"{what} is not symmetric between {names[i]!r} and {names[j]!r}")
    if names and np.linalg.eigvalsh(mass)[0] <= 0:
        raise InputError("mass is not positive definite: some motion has no inertia")


def positive_numbers(what: str, given: Any, unit: str) -> np.ndarray:
    """Turn user input into a read-only row of positive numbers.

    Parameters
    ----------
    what : str
        What they are, for the error.
    given : array_like, shape (n,)
        User input.
    unit : str
        Unit, for the error.

    Returns
    -------
    numpy.ndarray, shape (n,)

    Raises
    ------
    InputError
        Naming the first entry that is not a positive finite number.
    """
    row = np.atleast_1d(numbers(what, given))
    if row.ndim != 1 or row.size == 0:
        raise InputError(f"{what} has shape {row.shape}; accepted: one number a storey")
    for i, value in enumerate(row):
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{what}[{i}] is {value:g} {unit}; accepted: above zero")
    return read_only(row)
