"""From a prediction and its derivatives to a quadratic programme, for Numba."""

from __future__ import annotations

import math

from numpy.typing import NDArray

# places in the array of weights
ON_DISPLACEMENT, ON_ACCELERATION, ON_END = range(3)
ON_CHANGE, ON_ROUGHNESS, ON_CURRENT, ON_PEAKS = range(3, 7)
SMALL = 1e-6
"""Curvature of the excess peaks, so that the programme is strictly convex."""


def largest_gap(lag: float, slew: float, step: float) -> float:
    """Largest distance of a command from the current, A, before the slew rate bounds a decision."""
    # By the lag alone the current then changes by slew * step within the decision. A coil that
    # cannot be faster than its slew rate falls short of that by less than a tenth.
    return slew * step / -math.expm1(-step / lag) if lag > 0.0 else slew * step


def condense(
    prediction: tuple, commands: NDArray, before: NDArray, block: NDArray, coils: NDArray,
    step: float, sizes: tuple, units: NDArray, levels: NDArray, margins: tuple, weights: NDArray,
    resting: NDArray, programme: tuple, by: NDArray,
) -> int:  # fmt: skip
    """Fill in the quadratic programme of one decision; its number of rows."""
    # Unknown are the change of each block of commands, in ranges of its coil, and three excesses in
    # their units: of displacement and of acceleration over their levels, and of acceleration over
    # the peak without current (the regret). ``by``: one output's derivatives, in its unit, by them.
    y, dy, past, y_before, dy_before = prediction
    hessian, gradient, _, _, _ = programme
    n_displacements, n_accelerations = sizes
    n_steps, n_channels = commands.shape[0], commands.shape[1]
    width = dy.shape[2]
    hessian[:] = 0.0
    gradient[:] = 0.0
    bound_commands(commands, block, coils, width, programme)
    weigh_commands(commands, before, block, coils, weights, width, programme)
    for excess in range(3):
        gradient[width + excess] = weights[ON_PEAKS + excess]
        hessian[width + excess, width + excess] = SMALL

    row = 0
    for k in range(n_steps + 1):
        # later blocks have no effect yet
        now = min(k, n_steps - 1)
        active = (int(block[now]) + 1) * n_channels
        for o in range(y.shape[1]):
            kind = 0 if o < n_displacements else 1 if o < n_displacements + n_accelerations else 2
            value = y[k, o] / units[kind]
            in_its_unit(dy, k, o, active, coils, units[kind], by)
            weigh_output(
                k, o, kind, value, active, n_steps, sizes, units, weights, resting, programme, by
            )
            if kind == 2:
                continue
            clearance, more = 0.0, 0.0
            if kind == 1:
                clearance, more = tightening_at(
                    k, o - n_displacements, past, now, width, coils, units[kind], margins
                )
            # a jump of the current changes the accelerations only
            for moment in range(2 if kind == 1 and y_before.shape[0] > 0 else 1):
                if moment == 1:
                    value = y_before[k, o] / units[kind]
                    in_its_unit(dy_before, k, o, active, coils, units[kind], by)
                row = limit_output(
                    row, k, kind, value, active, past, now, (clearance, more), n_channels, units,
                    levels, margins, weights, programme, by,
                )  # fmt: skip
    for a in range(width):
        for b in range(a):
            hessian[b, a] = hessian[a, b]
    return limit_slew(row, past, commands, before, block, coils, step, width, programme)


def bound_commands(
    commands: NDArray, block: NDArray, coils: NDArray, width: int, programme: tuple
) -> None:
    """Bounds: every command of a block stays within the coil's range, and no excess is negative."""
    _, _, _, upper, lower = programme
    n_steps, n_channels = commands.shape[0], commands.shape[1]
    for j in range(width + 3):
        lower[j], upper[j] = (-1e30, 1e30) if j < width else (0.0, 1e30)
    for k in range(n_steps):
        for c in range(n_channels):
            j = int(block[k]) * n_channels + c
            span = coils[c, 3] - coils[c, 2]
            lower[j] = max(lower[j], (coils[c, 2] - commands[k, c]) / span)
            upper[j] = min(upper[j], (coils[c, 3] - commands[k, c]) / span)


def weigh_commands(
    commands: NDArray, before: NDArray, block: NDArray, coils: NDArray, weights: NDArray,
    width: int, programme: tuple,
) -> None:  # fmt: skip
    """Cost of the change of a plan, of currents, and of their changes between decisions."""
    hessian, gradient, _, _, _ = programme
    n_steps, n_channels = commands.shape[0], commands.shape[1]
    for j in range(width):
        hessian[j, j] = 2.0 * weights[ON_CHANGE]
    for k in range(n_steps):
        for c in range(n_channels):
            span = coils[c, 3] - coils[c, 2]
            earlier = commands[k - 1, c] if k > 0 else before[c]
            rise = 2.0 * weights[ON_ROUGHNESS] * (commands[k, c] - earlier) / span
            j = int(block[k]) * n_channels + c
            i = int(block[max(k - 1, 0)]) * n_channels + c
            on_current = 2.0 * weights[ON_CURRENT] / n_steps
            gradient[j] += on_current * (commands[k, c] - coils[c, 2]) / span
            hessian[j, j] += on_current
            if k == 0:
                gradient[j] += rise
                hessian[j, j] += 2.0 * weights[ON_ROUGHNESS]
            elif i != j:
                gradient[j] += rise
                gradient[i] -= rise
                hessian[j, j] += 2.0 * weights[ON_ROUGHNESS]
                hessian[i, i] += 2.0 * weights[ON_ROUGHNESS]
                hessian[j, i] -= 2.0 * weights[ON_ROUGHNESS]


def in_its_unit(
    dy: NDArray, k: int, o: int, active: int, coils: NDArray, unit: float, by: NDArray
) -> None:
    """Derivatives of output o at step k, in its unit, by changes in ranges of the coils."""
    n_channels = coils.shape[0]
    for j in range(active):
        span = coils[j % n_channels, 3] - coils[j % n_channels, 2]
        by[j] = dy[k, o, j] * (span / unit)


def weigh_output(
    k: int, o: int, kind: int, value: float, active: int, n_steps: int, sizes: tuple,
    units: NDArray, weights: NDArray, resting: NDArray, programme: tuple, by: NDArray,
) -> None:  # fmt: skip
    """Cost of an output at step k; at the last one also of the vibration that is left."""
    hessian, gradient, _, _, _ = programme
    n_displacements, n_accelerations = sizes
    weight = 0.0
    if kind == 0:
        weight = weights[ON_DISPLACEMENT] / n_steps
    elif kind == 1:
        # mean of the levels, so that a second direction at rest changes nothing
        weight = weights[ON_ACCELERATION] * n_displacements / (n_steps * n_accelerations)
    pull = weight * value
    if k == n_steps and kind != 1:
        weight += weights[ON_END]
        pull += weights[ON_END] * (value + resting[o] / units[kind])
    if weight > 0.0 and k > 0:
        for a in range(active):
            slope = 2.0 * by[a]
            gradient[a] += slope * pull
            for b in range(a + 1):
                hessian[a, b] += slope * weight * by[b]


def tightening_at(
    k: int, level: int, past: NDArray, now: int, width: int, coils: NDArray, unit: float,
    margins: tuple,
) -> tuple[float, float]:  # fmt: skip
    """Margin of an acceleration at step k for the forecast's error, and its rise with current."""
    known, tightening, clear, _ = margins
    late = min(max(k + 1 - known, 0), clear.shape[0] - 1)
    margin = clear[late, level]
    more = tightening * (margin[1] - margin[0]) / (unit * coils.shape[0])
    clearance = tightening * margin[0] / unit
    for c in range(coils.shape[0]):
        span = coils[c, 3] - coils[c, 2]
        clearance += more * (past[now, c, width] - coils[c, 2]) / span
    return clearance, more


def limit_output(
    row: int, k: int, kind: int, value: float, active: int, past: NDArray, now: int,
    tightened: tuple, n_channels: int, units: NDArray, levels: NDArray, margins: tuple,
    weights: NDArray, programme: tuple, by: NDArray,
) -> int:  # fmt: skip
    """Rows that keep an output below its levels, or make its excess cost; the next row."""
    _, _, rows, upper, lower = programme
    clearance, more = tightened
    without_current = margins[3]
    n = rows.shape[1]
    width = n - 3
    # only outputs that an admissible change can bring above the level
    for sign in (1.0, -1.0):
        extreme = sign * value
        first = row
        for c in range(n_channels):
            # relative to their ranges, a coil current changes as much as its command
            for q in range(active // n_channels):
                j = q * n_channels + c
                slope = sign * by[j] + more * past[now, c, j]
                rows[first, j] = slope
                extreme += max(slope * upper[j], slope * lower[j])
        # the regret is a second excess of the same acceleration
        for excess in range(kind, 3 if kind == 1 else 1):
            if weights[ON_PEAKS + excess] == 0.0:
                continue
            level = without_current[k] if excess == 2 else levels[kind]
            level = level / units[kind] - clearance
            if extreme > level:
                for j in range(n):
                    rows[row, j] = rows[first, j] if j < active else 0.0
                rows[row, width + excess] = -1.0
                upper[n + row], lower[n + row] = level - sign * value, -1e30
                row += 1
    return row


def limit_slew(
    row: int, past: NDArray, commands: NDArray, before: NDArray, block: NDArray, coils: NDArray,
    step: float, width: int, programme: tuple,
) -> int:  # fmt: skip
    """Rows by which no current changes faster than its driver's slew rate; the next row."""
    _, _, rows, upper, lower = programme
    n_steps, n_channels = commands.shape[0], commands.shape[1]
    n = width + 3
    for c in range(n_channels):
        lag, slew = coils[c, 0], coils[c, 1]
        if slew < 1e30:
            span = coils[c, 3] - coils[c, 2]
            for k in range(n_steps):
                for j in range(n):
                    rows[row, j] = 0.0
                rows[row, int(block[k]) * n_channels + c] = span
                most = largest_gap(lag, slew, step)
                if lag > 0.0:
                    gap = commands[k, c] - past[k, c, width]
                    for j in range(width):
                        other = coils[j % n_channels, 3] - coils[j % n_channels, 2]
                        rows[row, j] -= past[k, c, j] * other
                else:
                    gap = commands[k, c] - (commands[k - 1, c] if k > 0 else before[c])
                    if k > 0:
                        rows[row, int(block[k - 1]) * n_channels + c] -= span
                upper[n + row], lower[n + row] = most - gap, -most - gap
                row += 1
    return row
