"""Checks of users' numbers and matrices."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..errors import InputError


def read_only(array: np.ndarray) -> np.ndarray:
    """Return the array after making it read-only."""
    array.flags.writeable = False
    return array


def numbers(what: str, values: Any) -> np.ndarray:
    """Turn user input into a read-only array of numbers."""
    try:
        return read_only(np.array(values, dtype=float))
    except (TypeError, ValueError):
        raise InputError(f"{what} must be numbers in rows of one length") from None


def matrix(what: str, values: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Turn user input into a read-only array of finite numbers."""
    array = numbers(what, values)
    if array.shape != shape:
        raise InputError(f"{what} has shape {array.shape}; expected: {shape}")
    if not np.isfinite(array).all():
        bad = np.argwhere(~np.isfinite(array))[0]
        place = ", ".join(str(i) for i in bad)
        raise InputError(f"{what}[{place}]", f"{array[tuple(bad)]}", "finite numbers")
    return array


def check_matrices(mass: np.ndarray, stiffness: np.ndarray, names: Sequence[str]) -> None:
    """Refuse a mass that is not symmetric positive definite, or an asymmetric stiffness."""
    for i, name in enumerate(names):
        if not mass[i, i] > 0:
            raise InputError(f"mass of {name!r}", f"{mass[i, i]:g} kg", "above zero")
    for what, array in (("mass", mass), ("stiffness", stiffness)):
        skew = np.abs(array - array.T)
        if skew.size and np.max(skew) > 1e-8 * np.max(np.abs(array)):
            i, j = np.argwhere(skew == np.max(skew))[0].tolist()
            raise InputError(f"{what} is not symmetric between {names[i]!r} and {names[j]!r}")
    if names and np.linalg.eigvalsh(mass)[0] <= 0:
        raise InputError("mass is not positive definite; expected: inertia in every motion")


def positive_numbers(what: str, values: Any, unit: str) -> np.ndarray:
    """Turn user input into a read-only row of positive numbers."""
    row = np.atleast_1d(numbers(what, values))
    if row.ndim != 1 or row.size == 0:
        raise InputError(f"{what} has shape {row.shape}; expected: one number per storey")
    for i, value in enumerate(row):
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{what}[{i}]", f"{value:g} {unit}", "above zero")
    return read_only(row)
