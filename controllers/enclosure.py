"""Bounds on a law's force, and on its slope, over an interval of the current.

Interval arithmetic (Moore 1966) along the law's own operations: no current in the interval has a
force or a slope outside the bounds, up to rounding. A range is a tuple of four numbers: lowest and
highest value, lowest and highest slope by the current. Numba compiles everything here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from isolation_sim.laws.law import Law

Range = tuple[float, float, float, float]

STEEP = 1e100
"""Bound on values and slopes where there is none, as at a jump."""
TWO_PI = 6.283185307179586


def product_bounds(a: float, b: float, c: float, d: float) -> tuple[float, float]:
    """Lowest and highest product of a number from a to b and one from c to d."""
    first, second, third, fourth = a * c, a * d, b * c, b * d
    return min(min(first, second), min(third, fourth)), max(max(first, second), max(third, fourth))


def square_bounds(a: float, b: float) -> tuple[float, float]:
    """Lowest and highest square of a number from a to b."""
    lowest = 0.0 if a <= 0.0 <= b else min(a * a, b * b)
    return lowest, max(a * a, b * b)


def sine_bounds(a: float, b: float) -> tuple[float, float]:
    """Lowest and highest sine of an angle from a to b."""
    highest = 1.0 if np.floor(b / TWO_PI - 0.25) > np.floor(a / TWO_PI - 0.25) else -1.0
    lowest = -1.0 if np.floor(b / TWO_PI + 0.25) > np.floor(a / TWO_PI + 0.25) else 1.0
    return min(lowest, min(np.sin(a), np.sin(b))), max(highest, max(np.sin(a), np.sin(b)))


def power_bounds(a: float, b: float, c: float, d: float) -> tuple[float, float]:
    """Lowest and highest of a number from a to b to a power from c to d."""
    if c < d or c != np.floor(c):
        # only whole powers are defined for a negative number
        a, b = max(a, 0.0), max(b, 0.0)
    if a <= 0.0 <= b and c < 0.0:
        return -STEEP, STEEP
    # monotone in each of the two: the corners
    first, second, third, fourth = a**c, a**d, b**c, b**d
    lowest = min(min(first, second), min(third, fourth))
    highest = max(max(first, second), max(third, fourth))
    if a < 0.0 < b and c > 0.0:
        return min(lowest, 0.0), max(highest, 0.0)
    return lowest, highest


def chained(a: Range, low: float, high: float, slope_low: float, slope_high: float) -> Range:
    """Range of a function, from bounds on its values and on its derivative by its argument."""
    by_current = product_bounds(a[2], a[3], slope_low, slope_high)
    return low, high, by_current[0], by_current[1]


def fixed_range(value: float) -> Range:
    """Range of a number on which the current has no effect."""
    return value, value, 0.0, 0.0


def negative_range(a: Range) -> Range:
    """Range of -a."""
    return -a[1], -a[0], -a[3], -a[2]


def scaled_range(a: Range, factor: float) -> Range:
    """Range of a times a number."""
    if factor < 0.0:
        return factor * a[1], factor * a[0], factor * a[3], factor * a[2]
    return factor * a[0], factor * a[1], factor * a[2], factor * a[3]


def sum_range(a: Range, b: Range) -> Range:
    """Range of a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]


def difference_range(a: Range, b: Range) -> Range:
    """Range of a - b."""
    return a[0] - b[1], a[1] - b[0], a[2] - b[3], a[3] - b[2]


def product_range(a: Range, b: Range) -> Range:
    """Range of a b."""
    value = product_bounds(a[0], a[1], b[0], b[1])
    first = product_bounds(a[2], a[3], b[0], b[1])
    second = product_bounds(a[0], a[1], b[2], b[3])
    return value[0], value[1], first[0] + second[0], first[1] + second[1]


def square_range(a: Range) -> Range:
    """Range of a^2."""
    value = square_bounds(a[0], a[1])
    return chained(a, value[0], value[1], 2.0 * a[0], 2.0 * a[1])


def inverse_range(a: Range) -> Range:
    """Range of 1 / a."""
    if a[0] <= 0.0 <= a[1]:
        return -STEEP, STEEP, -STEEP, STEEP
    low, high = 1.0 / a[1], 1.0 / a[0]
    squared = square_bounds(low, high)
    return chained(a, low, high, -squared[1], -squared[0])


def quotient_range(a: Range, b: Range) -> Range:
    """Range of a / b."""
    return product_range(a, inverse_range(b))


def power_range(a: Range, b: Range) -> Range:
    """Range of a^b."""
    value = power_bounds(a[0], a[1], b[0], b[1])
    lower = power_bounds(a[0], a[1], b[0] - 1.0, b[1] - 1.0)
    factor = product_bounds(b[0], b[1], lower[0], lower[1])
    by_base = product_bounds(a[2], a[3], factor[0], factor[1])
    if b[2] == 0.0 == b[3]:
        return value[0], value[1], by_base[0], by_base[1]
    logarithm = log_range(a)
    factor = product_bounds(logarithm[0], logarithm[1], value[0], value[1])
    by_power = product_bounds(b[2], b[3], factor[0], factor[1])
    return value[0], value[1], by_base[0] + by_power[0], by_base[1] + by_power[1]


def exp_range(a: Range) -> Range:
    """Range of e^a."""
    low, high = np.exp(a[0]), np.exp(a[1])
    return chained(a, low, high, low, high)


def expm1_range(a: Range) -> Range:
    """Range of e^a - 1."""
    return chained(a, np.expm1(a[0]), np.expm1(a[1]), np.exp(a[0]), np.exp(a[1]))


def log_range(a: Range) -> Range:
    """Range of the natural logarithm of a."""
    if a[0] <= 0.0:
        return -STEEP, np.log(a[1]) if a[1] > 0.0 else STEEP, -STEEP, STEEP
    return chained(a, np.log(a[0]), np.log(a[1]), 1.0 / a[1], 1.0 / a[0])


def log1p_range(a: Range) -> Range:
    """Range of log(1 + a)."""
    if a[0] <= -1.0:
        return -STEEP, np.log1p(a[1]) if a[1] > -1.0 else STEEP, -STEEP, STEEP
    return chained(a, np.log1p(a[0]), np.log1p(a[1]), 1.0 / (1.0 + a[1]), 1.0 / (1.0 + a[0]))


def sqrt_range(a: Range) -> Range:
    """Range of a's square root; that of a negative number, which rounding makes, is taken as 0."""
    low, high = np.sqrt(max(a[0], 0.0)), np.sqrt(max(a[1], 0.0))
    return chained(
        a, low, high, 0.5 / high if high > 0.0 else 0.0, 0.5 / low if low > 0.0 else STEEP
    )


def sin_range(a: Range) -> Range:
    """Range of a's sine."""
    value, slope = sine_bounds(a[0], a[1]), sine_bounds(a[0] + 0.25 * TWO_PI, a[1] + 0.25 * TWO_PI)
    return chained(a, value[0], value[1], slope[0], slope[1])


def cos_range(a: Range) -> Range:
    """Range of a's cosine."""
    value, slope = sine_bounds(a[0] + 0.25 * TWO_PI, a[1] + 0.25 * TWO_PI), sine_bounds(a[0], a[1])
    return chained(a, value[0], value[1], -slope[1], -slope[0])


def sinh_range(a: Range) -> Range:
    """Range of a's hyperbolic sine."""
    lowest = 1.0 if a[0] <= 0.0 <= a[1] else min(np.cosh(a[0]), np.cosh(a[1]))
    highest = max(np.cosh(a[0]), np.cosh(a[1]))
    return chained(a, np.sinh(a[0]), np.sinh(a[1]), lowest, highest)


def cosh_range(a: Range) -> Range:
    """Range of a's hyperbolic cosine."""
    lowest = 1.0 if a[0] <= 0.0 <= a[1] else min(np.cosh(a[0]), np.cosh(a[1]))
    highest = max(np.cosh(a[0]), np.cosh(a[1]))
    return chained(a, lowest, highest, np.sinh(a[0]), np.sinh(a[1]))


def tanh_range(a: Range) -> Range:
    """Range of a's hyperbolic tangent."""
    low, high = np.tanh(a[0]), np.tanh(a[1])
    squared = square_bounds(low, high)
    return chained(a, low, high, 1.0 - squared[1], 1.0 - squared[0])


def atan_range(a: Range) -> Range:
    """Range of a's arc tangent."""
    squared = square_bounds(a[0], a[1])
    slope = 1.0 / (1.0 + squared[1]), 1.0 / (1.0 + squared[0])
    return chained(a, np.arctan(a[0]), np.arctan(a[1]), slope[0], slope[1])


def asinh_range(a: Range) -> Range:
    """Range of a's inverse hyperbolic sine."""
    squared = square_bounds(a[0], a[1])
    slope = 1.0 / np.sqrt(1.0 + squared[1]), 1.0 / np.sqrt(1.0 + squared[0])
    return chained(a, np.arcsinh(a[0]), np.arcsinh(a[1]), slope[0], slope[1])


def hypot_range(a: Range, b: Range) -> Range:
    """Range of (a^2 + b^2)^(1/2)."""
    return sqrt_range(sum_range(square_range(a), square_range(b)))


def fabs_range(a: Range) -> Range:
    """Range of a's absolute value."""
    if a[0] >= 0.0:
        return a
    if a[1] <= 0.0:
        return negative_range(a)
    return chained(a, 0.0, max(-a[0], a[1]), -1.0, 1.0)


def fmax_range(a: Range, b: Range) -> Range:
    """Range of the larger of a and b."""
    if a[0] >= b[1]:
        return a
    if b[0] >= a[1]:
        return b
    return max(a[0], b[0]), max(a[1], b[1]), min(a[2], b[2]), max(a[3], b[3])


def fmin_range(a: Range, b: Range) -> Range:
    """Range of the smaller of a and b."""
    return negative_range(fmax_range(negative_range(a), negative_range(b)))


def step_range(low: float, high: float, below: float, at: float, above: float) -> Range:
    """Range of a function with three values, by the sign of a number from low to high."""
    if low > 0.0:
        return fixed_range(above)
    if high < 0.0:
        return fixed_range(below)
    if low == 0.0 == high:
        return fixed_range(at)
    if low == 0.0 and at == above:
        return fixed_range(at)
    if high == 0.0 and at == below:
        return fixed_range(at)
    return min(below, min(at, above)), max(below, max(at, above)), -STEEP, STEEP


def sign_range(a: Range) -> Range:
    """Range of a's sign."""
    return step_range(a[0], a[1], -1.0, 0.0, 1.0)


def less_range(a: Range, b: Range) -> Range:
    """Range of a < b, which is 1 or 0."""
    return step_range(a[0] - b[1], a[1] - b[0], 1.0, 0.0, 0.0)


def at_most_range(a: Range, b: Range) -> Range:
    """Range of a <= b, which is 1 or 0."""
    return step_range(a[0] - b[1], a[1] - b[0], 1.0, 1.0, 0.0)


def equal_range(a: Range, b: Range) -> Range:
    """Range of a == b, which is 1 or 0."""
    return step_range(a[0] - b[1], a[1] - b[0], 0.0, 1.0, 0.0)


def unequal_range(a: Range, b: Range) -> Range:
    """Range of a != b, which is 1 or 0."""
    return step_range(a[0] - b[1], a[1] - b[0], 1.0, 0.0, 1.0)


def not_range(a: Range) -> Range:
    """Range of a == 0, which is 1 or 0."""
    return step_range(a[0], a[1], 0.0, 1.0, 0.0)


def floor_range(a: Range) -> Range:
    """Range of the largest whole number up to a."""
    low, high = np.floor(a[0]), np.floor(a[1])
    return fixed_range(low) if low == high else (low, high, -STEEP, STEEP)


def copysign_range(a: Range, b: Range) -> Range:
    """Range of |a|, or -|a| where b is negative."""
    return product_range(fabs_range(a), step_range(b[0], b[1], -1.0, 1.0, 1.0))


def polynomial_range(row: NDArray, at: int, n_powers: int, low: float, high: float) -> Range:
    """Range of a parameter whose ascending coefficients begin at a place in a device's numbers."""
    value = fixed_range(row[at + n_powers - 1])
    for power in range(n_powers - 2, -1, -1):
        c = row[at + power]
        product = product_bounds(value[0], value[1], low, high)
        slope = product_bounds(value[2], value[3], low, high)
        value = product[0] + c, product[1] + c, slope[0] + value[0], slope[1] + value[1]
    return value


OPERATIONS: dict[str, Callable[..., Range]] = {
    "OP_ADD": sum_range,
    "OP_SUB": difference_range,
    "OP_MUL": product_range,
    "OP_DIV": quotient_range,
    "OP_POW": power_range,
    "OP_CONSTPOW": power_range,
    "OP_LT": less_range,
    "OP_LE": at_most_range,
    "OP_EQ": equal_range,
    "OP_NE": unequal_range,
    "OP_FMAX": fmax_range,
    "OP_FMIN": fmin_range,
    "OP_COPYSIGN": copysign_range,
    "OP_HYPOT": hypot_range,
    "OP_NEG": negative_range,
    "OP_SQ": square_range,
    "OP_INV": inverse_range,
    "OP_NOT": not_range,
    "OP_FABS": fabs_range,
    "OP_SIGN": sign_range,
    "OP_FLOOR": floor_range,
    "OP_SQRT": sqrt_range,
    "OP_SIN": sin_range,
    "OP_COS": cos_range,
    "OP_ATAN": atan_range,
    "OP_SINH": sinh_range,
    "OP_COSH": cosh_range,
    "OP_TANH": tanh_range,
    "OP_ASINH": asinh_range,
    "OP_EXP": exp_range,
    "OP_LOG": log_range,
    "OP_EXPM1": expm1_range,
    "OP_LOG1P": log1p_range,
}
"""Range of a CasADi operation, for all that a law may use."""


def force_range_statements(law: Law) -> tuple[list[str], str]:
    """Statements and result that bound a law's force."""
    from isolation_sim.laws.emit import NotTraceable, straight_line, symbols

    def ranged(operation: str, operands: Sequence[str], is_fixed: Sequence[bool]) -> str:
        if operation == "OP_MUL" and any(is_fixed):
            factor, a = operands if is_fixed[0] else operands[::-1]
            return f"scaled_range({a}, {factor})"
        if operation == "OP_TWICE":
            return f"scaled_range({operands[0]}, 2.0)"
        if operation not in OPERATIONS:
            raise NotTraceable(
                f"operation {operation[3:].lower()} has no range, so that no current can be found "
                f"for a force of {law.name}; expected: an operation that isolation_sim.laws.law "
                "lists"
            )
        arguments = [
            f"fixed_range({o})" if fixed else o for o, fixed in zip(operands, is_fixed, strict=True)
        ]
        return f"{OPERATIONS[operation].__name__}({', '.join(arguments)})"

    fixed = ["x", "v", *(f"s{k}" for k in range(len(law.states)))]
    ranges = [f"p{k}" for k in range(len(law.parameters))]
    arguments = symbols([*fixed, *ranges])
    x, v, *rest = arguments
    states, parameters = tuple(rest[: len(law.states)]), tuple(rest[len(law.states) :])
    hoisted, _, statements, (result,) = straight_line(
        dict(zip([*fixed, *ranges], arguments, strict=True)),
        [law.force(x, v, states, parameters)], fixed, ranged,
    )  # fmt: skip
    known = {*ranges, *(statement.split(" = ")[0] for statement in statements)}
    return [*hoisted, *statements], result if result in known else f"fixed_range({result})"
