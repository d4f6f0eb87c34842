"""Matrices in flat arrays, row by row, for compiled decisions, which cannot allocate arrays."""

from __future__ import annotations

import math

from numpy.typing import NDArray

ORDER = 6
"""Of the Taylor polynomials before doubling."""
REACH = 0.125
"""Size of a matrix for which they are exact within 1e-10."""


def multiply(n: int, a: NDArray, b: NDArray, out: NDArray) -> None:
    """Product of two square matrices."""
    for i in range(n):
        row = out[i * n : (i + 1) * n]
        for j in range(n):
            row[j] = 0.0
        for k in range(n):
            factor = a[i * n + k]
            if factor != 0.0:
                other = b[k * n : (k + 1) * n]
                for j in range(n):
                    row[j] += factor * other[j]


def conjugate(n: int, a: NDArray, s: NDArray, out: NDArray, work: NDArray) -> None:
    """Product a s a' for a symmetric s."""
    multiply(n, a, s, work)
    for i in range(n):
        for j in range(i + 1):
            total = 0.0
            for k in range(n):
                total += work[i * n + k] * a[j * n + k]
            out[i * n + j] = out[j * n + i] = total


def step_matrices(
    n: int, a: NDArray, noise: NDArray, transition: NDArray, covariance: NDArray, work: NDArray
) -> None:
    """Transition exp(a) and covariance added by white noise over a step of unit length.

    Taylor polynomials of a fraction of the step, then doubling: a step of twice the length has the
    squared transition, and adds the propagated noise of its first half to that of its second.

    References
    ----------
    Moler and Van Loan 2003, method 3; Al-Mohy and Higham 2009, for the size from a squared.
    """
    size = n * n
    term, other, spare = work[:size], work[size : 2 * size], work[2 * size : 3 * size]
    multiply(n, a, a, spare)
    largest = 0.0
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += abs(spare[i * n + j])
        largest = max(largest, total)
    doublings = 0
    while math.sqrt(largest) > REACH * 2.0**doublings and doublings < 60:
        doublings += 1
    for i in range(size):
        a[i] /= 2.0**doublings
        term[i] = a[i]
        transition[i] = a[i]
        other[i] = noise[i] / 2.0**doublings
        covariance[i] = other[i]
    for i in range(n):
        transition[i * n + i] += 1.0
    for k in range(2, ORDER + 1):
        multiply(n, a, other, spare)
        for i in range(n):
            for j in range(n):
                other[i * n + j] = (spare[i * n + j] + spare[j * n + i]) / k
        multiply(n, a, term, spare)
        for i in range(size):
            covariance[i] += other[i]
            term[i] = spare[i] / k
            transition[i] += term[i]
    for _ in range(doublings):
        conjugate(n, transition, covariance, other, spare)
        multiply(n, transition, transition, spare)
        for i in range(size):
            covariance[i] += other[i]
            transition[i] = spare[i]
