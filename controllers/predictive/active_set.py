"""Strictly convex quadratic programmes by the dual active-set method, for Numba and for C.

Goldfarb and Idnani 1983, A numerically stable dual method for solving strictly convex quadratic
programs. It starts from the minimum without constraints and adds the constraint that is violated
most, one after another; each step increases the cost, so that no active set comes twice.
"""

from __future__ import annotations

import math

from numpy.typing import NDArray

VIOLATED = 1e-9
"""Violation from which a constraint is added to the active set."""
DEPENDENT = 1e-24
"""Relative squared part of a normal outside the active ones, below which it counts as dependent."""
MOST = 40
"""Iterations per unknown before the solver gives up."""


def solve(
    hessian: NDArray, gradient: NDArray, rows: NDArray, n_rows: int, upper: NDArray,
    lower: NDArray, x: NDArray, work: tuple,
) -> int:  # fmt: skip
    """Minimise x'Hx / 2 + g'x within lower <= (x, rows x) <= upper; iterations, below 0: failed."""
    # work: (n, n) J' with J J' the inverse of H, its first rows spanning the active normals; (n, n)
    # triangular factor R of the active normals, J'N; (4, n + 1) multipliers, their changes, the
    # normal in the space of J, the normal; (n + 1,) active constraints, from 1, with their sign
    basis, factor, vectors, active = work
    multiplier, change, d, normal = vectors[0], vectors[1], vectors[2], vectors[3]
    n = len(gradient)
    unconstrained(hessian, gradient, x, basis, factor, d)
    n_active, iterations = 0, 0
    while True:
        place, violation = most_violated(rows, n_rows, upper, lower, x)
        if place == 0:
            return iterations
        put_normal(place, rows, normal, n)
        multiplier[n_active] = 0.0
        while True:
            iterations += 1
            if iterations > MOST * n:
                return -iterations
            whole, free = 0.0, 0.0
            for k in range(n):
                d[k] = dot(basis[k], normal, n)
                whole += d[k] * d[k]
                if k >= n_active:
                    free += d[k] * d[k]
            for k in range(n_active - 1, -1, -1):
                change[k] = d[k]
                for j in range(k + 1, n_active):
                    change[k] -= factor[k, j] * change[j]
                change[k] /= factor[k, k]
            # the longest step that keeps the multipliers positive, and that to the constraint
            step, blocking = math.inf, -1
            for k in range(n_active):
                if change[k] > 0.0 and multiplier[k] < step * change[k]:
                    step, blocking = multiplier[k] / change[k], k
            moves = free > DEPENDENT * whole
            if moves and violation <= step * free:
                step, blocking = violation / free, -1
            if step == math.inf:
                return -iterations  # infeasible
            for k in range(n_active):
                multiplier[k] -= step * change[k]
            multiplier[n_active] += step
            if moves:
                for k in range(n_active, n):
                    for j in range(n):
                        x[j] -= step * d[k] * basis[k, j]
            if blocking < 0:
                add(basis, factor, d, n_active, n)
                active[n_active] = place
                n_active += 1
                if abs(place) <= n:  # exact to the last bit, from any distance
                    x[abs(place) - 1] = (upper if place > 0 else lower)[abs(place) - 1]
                break
            remove(blocking, basis, factor, multiplier, active, n_active, n)
            n_active -= 1
            violation = max(excess(place, rows, upper, lower, x), 0.0)


def unconstrained(
    hessian: NDArray, gradient: NDArray, x: NDArray, basis: NDArray, factor: NDArray, d: NDArray
) -> None:
    """Minimum without constraints; the inverse of the Hessian's Cholesky factor into ``basis``."""
    n = len(gradient)
    for j in range(n):
        for i in range(j, n):
            factor[i, j] = hessian[i, j] - dot(factor[i], factor[j], j)
            if i == j:
                factor[j, j] = math.sqrt(factor[j, j])
            else:
                factor[i, j] /= factor[j, j]
    for i in range(n):
        for j in range(n):
            basis[i, j] = 1.0 if i == j else 0.0
        for k in range(i):
            for j in range(k + 1):
                basis[i, j] -= factor[i, k] * basis[k, j]
        for j in range(i + 1):
            basis[i, j] /= factor[i, i]
        d[i] = dot(basis[i], gradient, n)
        x[i] = 0.0
    for k in range(n):
        for j in range(n):
            x[j] -= d[k] * basis[k, j]


def dot(a: NDArray, b: NDArray, n: int) -> float:
    """Scalar product of the first n entries, in four sums that a processor adds in parallel."""
    s0, s1, s2, s3 = 0.0, 0.0, 0.0, 0.0
    for k in range(n // 4):
        s0 += a[4 * k] * b[4 * k]
        s1 += a[4 * k + 1] * b[4 * k + 1]
        s2 += a[4 * k + 2] * b[4 * k + 2]
        s3 += a[4 * k + 3] * b[4 * k + 3]
    for k in range(4 * (n // 4), n):
        s0 += a[k] * b[k]
    return (s0 + s1) + (s2 + s3)


def excess(place: int, rows: NDArray, upper: NDArray, lower: NDArray, x: NDArray) -> float:
    """Amount by which a constraint is violated."""
    at, n = abs(place) - 1, len(x)
    value = x[at] if at < n else dot(rows[at - n], x, n)
    return value - upper[at] if place > 0 else lower[at] - value


def most_violated(
    rows: NDArray, n_rows: int, upper: NDArray, lower: NDArray, x: NDArray
) -> tuple[int, float]:
    """Most violated constraint and its violation; 0 for none."""
    place, worst, n = 0, VIOLATED, len(x)
    for k in range(n + n_rows):
        value = x[k] if k < n else dot(rows[k - n], x, n)
        if value - upper[k] > worst:
            place, worst = k + 1, value - upper[k]
        if lower[k] - value > worst:
            place, worst = -k - 1, lower[k] - value
    return place, worst


def put_normal(place: int, rows: NDArray, normal: NDArray, n: int) -> None:
    """Outward normal of a constraint."""
    at, sign = abs(place) - 1, 1.0 if place > 0 else -1.0
    for j in range(n):
        normal[j] = sign * rows[at - n, j] if at >= n else 0.0
    if at < n:
        normal[at] = sign


def turn(a: NDArray, b: NDArray, cosine: float, sine: float, begin: int, n: int) -> None:
    """Rotate two rows in their plane."""
    for j in range(begin, n):
        one = a[j]
        a[j] = cosine * one + sine * b[j]
        b[j] = cosine * b[j] - sine * one


def add(basis: NDArray, factor: NDArray, d: NDArray, n_active: int, n: int) -> None:
    """Add a normal, J'n in ``d``, to the factor."""
    for k in range(n - 1, n_active, -1):
        if d[k] != 0.0:
            length = math.hypot(d[k - 1], d[k])
            turn(basis[k - 1], basis[k], d[k - 1] / length, d[k] / length, 0, n)
            d[k - 1] = length
    for k in range(n_active + 1):
        factor[k, n_active] = d[k]


def remove(
    which: int, basis: NDArray, factor: NDArray, multiplier: NDArray, active: NDArray,
    n_active: int, n: int,
) -> None:  # fmt: skip
    """Remove a constraint from the active set."""
    for j in range(which, n_active - 1):
        for k in range(j + 2):
            factor[k, j] = factor[k, j + 1]
        active[j], multiplier[j] = active[j + 1], multiplier[j + 1]
        length = math.hypot(factor[j, j], factor[j + 1, j])
        cosine, sine = factor[j, j] / length, factor[j + 1, j] / length
        turn(basis[j], basis[j + 1], cosine, sine, 0, n)
        # the following columns are still one place to the right
        turn(factor[j], factor[j + 1], cosine, sine, j + 2, n_active)
        factor[j, j], factor[j + 1, j] = length, 0.0
    multiplier[n_active - 1] = multiplier[n_active]
