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


def plant_at(settings: NDArray, k: int, force_scales: NDArray) -> tuple:
    """Structure, devices and coils; their arrays, but for the force scales, stand from k on."""
    return (
        array2(settings, k), array2(settings, k + 1), array2(settings, k + 2),
        array3(settings, k + 3), array3(settings, k + 4), array2(settings, k + 5),
        array1(settings, k + 6), array2(settings, k + 7), force_scales, array2(settings, k + 8),
        array2(settings, k + 9), array2(settings, k + 10),
    )  # fmt: skip


def work_at(memory: NDArray, k: int) -> tuple:
    """Scratch: ten arrays of values from k on, ten of derivatives, and the device's side."""
    d = k + 10
    return (
        (
            array1(memory, k), array1(memory, k + 1), array2(memory, k + 2),
            array2(memory, k + 3), array1(memory, k + 4), array1(memory, k + 5),
            array1(memory, k + 6), array1(memory, k + 7), array2(memory, k + 8),
            array2(memory, k + 9),
        ),
        (
            array2(memory, d), array2(memory, d + 1), array3(memory, d + 2),
            array3(memory, d + 3), array2(memory, d + 4), array2(memory, d + 5),
            array2(memory, d + 6), array2(memory, d + 7), array3(memory, d + 8),
            array3(memory, d + 9),
        ),
        array1(memory, d + 10),
    )  # fmt: skip


def results_at(memory: NDArray, k: int) -> tuple:
    """Results, five arrays from k on."""
    return (
        array2(memory, k), array3(memory, k + 1), array3(memory, k + 2), array2(memory, k + 3),
        array3(memory, k + 4),
    )  # fmt: skip
