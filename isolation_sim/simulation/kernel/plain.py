"""The functions of ``intrinsics.py`` in Python, for ``NUMBA_DISABLE_JIT=1``."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .intrinsics import EIGHT, points_at_once

_elements: list[Callable[..., None]] = []


def read(array: NDArray, at: int, offset: int) -> float:
    """array[at + offset]."""
    return array[at + offset]


def write(array: NDArray, at: int, offset: int, value: float, on: bool) -> None:
    """array[at + offset] = value if on."""
    if on:
        array[at + offset] = value


def fused(a: float, b: float, c: float) -> float:
    """A b + c."""
    return a * b + c


def make_respond_to_others(
    lanes: int, table_lanes: int, stride: int, to: int, free: int, force: int
) -> Callable[..., None]:
    """Make ``respond_to_others(e, n_elements, w, table, force_rows)``."""

    def respond_to_others(
        e: int, n_elements: int, w: NDArray, table: NDArray, force_rows: int
    ) -> None:
        total = _part(w, e * stride + free, EIGHT, lanes).copy()
        for k in range(1, n_elements):
            other = (e + k) % n_elements
            at = force_rows + (e * n_elements + other) * 3 * EIGHT
            force_at = other * stride + force
            total += _product(table, at, table_lanes, _part(w, force_at, 3, lanes))
        _part(w, e * stride + to, EIGHT, lanes)[:] = total

    return respond_to_others


def make_rows_at(lanes: int, table_lanes: int, n_rows: int = EIGHT) -> Callable[..., None]:
    """Make ``rows_at(w, to, table, at, z, points, row, n_modes, n_pad, f, f_row, n_f, u, n_u)``."""

    def rows_at(
        w: NDArray, to: int, table: NDArray, at: int, z: NDArray, points: NDArray, row: int,
        n_modes: int, n_pad: int, f: NDArray, f_row: int, n_f: int, u: NDArray, n_u: int,
    ) -> None:  # fmt: skip
        for p in range(points_at_once(lanes)):
            start = points[p] * row
            inputs = [
                _part(z, start, n_modes, lanes),
                _part(z, start + n_pad, n_modes, lanes),
                _part(f, p * f_row, n_f, lanes),
                _part(u, points[p] * n_u, n_u, lanes),
            ]
            values = _product(table, at, table_lanes, np.concatenate(inputs))
            _part(w, to + EIGHT * p, n_rows, lanes)[:] = values[:n_rows]

    return rows_at


def make_free_rows(lanes: int, table_lanes: int) -> Callable[..., None]:
    """Make ``free_rows(w, to, table, at, ground_at, z, z_at, n_modes, n_pad, u, n_points, n)``."""

    def free_rows(
        w: NDArray, to: int, table: NDArray, at: int, ground_at: int, z: NDArray, z_at: int,
        n_modes: int, n_pad: int, u: NDArray, n_points: int, n: int,
    ) -> None:  # fmt: skip
        modes = [_part(z, z_at + part, n_modes, lanes) for part in (0, n_pad)]
        total = _product(table, at, table_lanes, np.concatenate(modes))
        ground = _part(u, 0, n_points * n, lanes).reshape(n_points, n, lanes)
        for g in range(n):
            total += _product(table, ground_at + g * n_points * EIGHT, table_lanes, ground[:, g])
        _part(w, to, EIGHT, lanes)[:] = total

    return free_rows


def make_move_modes(
    lanes: int, table_lanes: int, stride: int, first: int, n_elements: int, n_ground: int
) -> Callable[..., None]:
    """Make ``move_modes``, see ``intrinsics.make_move_modes``."""

    def move_modes(
        n_pad: int, table: NDArray, decay: int, ground: int, force: int, z: NDArray, start: int,
        to: int, u: NDArray, u_at: int, w: NDArray, mask: NDArray, n_e: int, n_g: int,
    ) -> None:  # fmt: skip
        def complex_part(numbers: NDArray, at: int, width: int) -> NDArray:
            real, imaginary = (_part(numbers, at + part, n_pad, width) for part in (0, n_pad))
            return real + 1j * imaginary

        inputs = [
            (ground + 2 * n_pad * (2 * g + k), _part(u, u_at + k * n_g + g, 1, lanes))
            for g in range(n_g)
            for k in range(2)
        ]
        inputs += [
            (force + 2 * n_pad * (3 * e + k), _part(w, e * stride + first + k, 1, lanes))
            for e in range(n_e)
            for k in range(3)
        ]
        with np.errstate(all="ignore"):  # the padding's numbers mean nothing
            new = complex_part(table, decay, table_lanes) * complex_part(z, start, lanes)
            for column, value in inputs:
                new = new + complex_part(table, column, table_lanes) * value
        on = mask != 0 if lanes > 1 else slice(None)
        _part(z, to, n_pad, lanes)[:, on] = new.real[:, on]
        _part(z, to + n_pad, n_pad, lanes)[:, on] = new.imag[:, on]

    return move_modes


def make_element(stride: int, lanes: int) -> Callable[..., None]:
    """Make ``element(functions, operation, e, w, a, b, numbers, at, mask)``."""

    def element(
        functions: NDArray, operation: int, e: int, w: NDArray, a: float, b: float,
        numbers: NDArray, at: int, mask: NDArray,
    ) -> None:  # fmt: skip
        if functions[e]:
            own = _elements[functions[e] - 1]
            own(operation, w, e * stride * lanes, a, b, numbers, at, mask)

    return element


def address_of_element(function: Callable[..., None]) -> int:
    """Number of a law's ``element``, in place of its address."""
    if function not in _elements:
        _elements.append(function)
    return 1 + _elements.index(function)


def _part(numbers: NDArray, at: int, n: int, width: int) -> NDArray:
    """Rows ``at`` to ``at + n`` of a flat array of rows of ``width`` numbers, (n, width)."""
    return numbers[at * width : (at + n) * width].reshape(n, width)


def _product(table: NDArray, at: int, width: int, factors: NDArray) -> NDArray:
    """Eight rows of the sum over k of the table's numbers [at + 8 k + r] times factors[k]."""
    coefficients = _part(table, at, EIGHT * len(factors), width)
    return (coefficients.reshape(len(factors), EIGHT, width) * factors[:, np.newaxis]).sum(axis=0)
