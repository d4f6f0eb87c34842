"""Internal states of the nominal devices, integrated along the measured motion.

No sensor measures the internal states of a device. A controller therefore integrates its nominal
law along the measured deformation.
"""

from __future__ import annotations

from collections.abc import Callable

from numpy.typing import NDArray

from .device_model import N_STATES

SCRATCH = 5
"""Scratch numbers per state that ``follow_states`` needs."""
STEPS_PER_RATE = 2.0
"""Steps in the time constant of the fastest state; explicit Runge-Kutta needs 0.36 to be stable."""
LONGEST_STEP = 0.01
"""s; so that a state does not run away from where its rate was measured."""
MOST_STEPS = 4096
"""In one interval; a law with a jump has no fastest rate."""
NUDGE = 1e-7
"""Fraction of a device's deformation: the displacement that measures a state's rate."""


def fastest_rate(
    e: int, x: float, v: float, states: NDArray, current: float, row: NDArray, work: NDArray,
    state_rates: Callable,
) -> float:  # fmt: skip
    """Bound on the fastest decay of a device's states: a norm of their Jacobian."""
    n = int(row[N_STATES])
    before, after = work[:n], work[n : 2 * n]
    state_rates(e, x, v, states, current, row, before)
    size = abs(x)
    for i in range(n):
        size = max(size, abs(states[i]))
    fastest = 0.0
    step = NUDGE * size + 1e-12
    for j in range(n):
        original = states[j]
        states[j] = original + step
        state_rates(e, x, v, states, current, row, after)
        states[j] = original
        column = 0.0
        for i in range(n):
            column += abs(after[i] - before[i]) / step
        fastest = max(fastest, column)
    return fastest


def follow_states(
    e: int, start: tuple, end: tuple, h: float, states: NDArray, current: float, row: NDArray,
    work: NDArray, state_rates: Callable,
) -> None:  # fmt: skip
    """Integrate a device's states over an interval, in place."""
    # Between its ends the deformation is the cubic that has the measured deformations and
    # velocities there: its velocity adds up to the change in deformation, so that noise in the
    # velocity does not make a state drift. The steps of the classical Runge-Kutta method are as
    # short as the fastest state asks for.
    n = int(row[N_STATES])
    if n == 0 or h <= 0.0:
        return
    trial = work[4 * n : 5 * n]
    x, v = start
    done = 0.0
    while done < 1.0:
        fastest = fastest_rate(e, x, v, states, current, row, work, state_rates)
        step = min(1.0 / (STEPS_PER_RATE * h * fastest + 1.0), LONGEST_STEP / h)
        step = max(step, 1.0 / MOST_STEPS)
        # the last two steps are equal, so that no tiny step remains
        left = 1.0 - done
        step = left if step >= left else min(step, 0.5 * left)
        for stage in range(4):
            offset = 0.5 * ((stage + 1) // 2)
            tau = done + offset * step
            # cubic Hermite polynomial and its slope
            x = (
                (1.0 + 2.0 * tau) * (1.0 - tau) ** 2 * start[0]
                + tau * (1.0 - tau) ** 2 * h * start[1]
                + tau**2 * (3.0 - 2.0 * tau) * end[0]
                + tau**2 * (tau - 1.0) * h * end[1]
            )
            v = (
                6.0 * tau * (1.0 - tau) * (end[0] - start[0]) / h
                + (1.0 - tau) * (1.0 - 3.0 * tau) * start[1]
                + tau * (3.0 * tau - 2.0) * end[1]
            )
            for i in range(n):
                trial[i] = states[i]
                if stage > 0:
                    trial[i] += offset * step * h * work[(stage - 1) * n + i]
            state_rates(e, x, v, trial, current, row, work[stage * n : (stage + 1) * n])
        for i in range(n):
            inner = work[n + i] + work[2 * n + i]
            states[i] += step * h / 6.0 * (work[i] + 2.0 * inner + work[3 * n + i])
        done = 1.0 if step == left else done + step
