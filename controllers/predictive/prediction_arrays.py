"""Arguments of ``prediction_kernel``, from the flat arrays of a decision."""

from __future__ import annotations

from numpy.typing import NDArray

from .flat_arrays import array1, array2, array3


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
