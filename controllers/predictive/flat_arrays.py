"""Arrays of several axes in one flat array, which begins with their places and shapes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

PER_ARRAY = 4
"""Numbers at the beginning for each array: its place, then its lengths; -1 for no axis."""


def array(flat: NDArray, k: int) -> NDArray:
    """Array k in its own shape; compiled decisions use the other three functions."""
    begin, *shape = (int(number) for number in flat[PER_ARRAY * k : PER_ARRAY * (k + 1)])
    shape = [n for n in shape if n >= 0]
    return flat[begin : begin + int(np.prod(shape))].reshape(shape)


def array1(flat: NDArray, k: int) -> NDArray:
    """Array k, of one axis."""
    begin, n = int(flat[PER_ARRAY * k]), int(flat[PER_ARRAY * k + 1])
    return flat[begin : begin + n]


def array2(flat: NDArray, k: int) -> NDArray:
    """Array k, of two axes."""
    begin, n, m = (
        int(flat[PER_ARRAY * k]),
        int(flat[PER_ARRAY * k + 1]),
        int(flat[PER_ARRAY * k + 2]),
    )
    return flat[begin : begin + n * m].reshape((n, m))


def array3(flat: NDArray, k: int) -> NDArray:
    """Array k, of three axes."""
    begin, n, m = (
        int(flat[PER_ARRAY * k]),
        int(flat[PER_ARRAY * k + 1]),
        int(flat[PER_ARRAY * k + 2]),
    )
    depth = int(flat[PER_ARRAY * k + 3])
    return flat[begin : begin + n * m * depth].reshape((n, m, depth))


def flat_arrays(arrays: Mapping[int, ArrayLike]) -> NDArray:
    """Write arrays of one to three axes, numbered from 0, into one."""
    rows = [np.asarray(arrays[k], dtype=float) for k in range(len(arrays))]
    begins = PER_ARRAY * len(rows) + np.cumsum([0, *(one.size for one in rows)])
    heads = [
        [begin, *one.shape, *[-1.0] * (PER_ARRAY - 1 - one.ndim)]
        for begin, one in zip(begins, rows, strict=False)
    ]
    return np.concatenate([np.ravel(heads), *(one.ravel() for one in rows)])
