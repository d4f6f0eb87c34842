"""A decision of predictive control, on flat arrays of fixed size, for Numba and for C."""

from __future__ import annotations

from collections.abc import Callable

from numpy.typing import NDArray

from ..device_model import FORCE_SCALE
from ..device_states import follow_states
from .active_set import excess, solve
from .condense_kernel import condense, largest_gap
from .flat_arrays import array1, array2, array3, plant_at, results_at, work_at
from .force_scale import learn_scale
from .ground_kernel import look_ahead
from .prediction_kernel import device_now, motion_of, outputs_now, predict
from .running_peaks import change_peaks, follow_peaks
from .slow_ground import follow_slow
from .uncontrolled import follow_uncontrolled

STOPPING = 0.35
"""Time constant with which the ground velocity vanishes after the horizon, s."""
INFEASIBLE = 1e-6
"""Largest violation of a constraint by a usable solution, in the programme's units."""

# arrays of the settings: single numbers, then those of ``prediction_kernel``, then the others
(
    NUMBERS, DECAY, HELD, SLOPED, MOVED, DEFORMATIONS, REFERENCE, CHANNELS, DEVICE_NUMBERS,
    COIL_DECAY, ON_MODES, ON_FORCES, BLOCK, NO_BLOCK, COIL_TABLE, TO_MODES, ALONG, PULSES,
    BY_INERTIA, BY_FORCE, WEIGHTS, LENGTHS, LOWEST_CURRENTS, OBSERVER_SCALES,
) = range(24)  # fmt: skip
# the single numbers
(
    STEP, N_SUB, N_LATE, HOLDS, STOP, MARGIN, LEAST_PEAK, FREQUENCY, DISPLACEMENT_LEVEL,
    ACCELERATION_LEVEL, LINEARISATIONS, LEARNS, LEARNING_DECAY, LEARNT_BEFORE, PULL,
    VELOCITY_DECAY, FORECAST_DECAY, SLOW_LIMIT, N_DISPLACEMENTS, N_ACCELERATIONS, JUMPS, PRESENT,
) = range(22)  # fmt: skip
# arrays of the memory: single numbers, data from one decision to the next, and scratch
(
    STATE, FORCE_SCALES, OBSERVER_SETTINGS, OBSERVER_MEMORY, PLAN, PENDING, Z_THEN, STATES_THEN,
    CURRENT_THEN, Z_NOW, STATES_NOW, CURRENT_NOW, GROUND_MOTION, GROUND_PAST, COEFFICIENTS,
    COVARIANCE, NOISE, PEAKS_PAST, PEAKS, FREE_Z, FREE_STATES, FREE_PAST, FREE_PEAKS,
    PEAK_HISTORY, FREE_GROUND, SLOW_SAMPLES, SLOW_RATES, SLOW_STATE, SCALE_SUMS, UNITS,
) = range(30)  # fmt: skip
(
    OBSERVED, MOTION_SEEN, Z_SEEN, SAMPLE, BEFORE, TRIAL, FORCES, ACCELERATION_AHEAD, PATH,
    DEVIATIONS, GROUND_END, GAIN, INNOVATIONS, SHAPE, OUTPUTS, LEVELS, REGRET_LEVELS, RESTING,
    SLOPES, FOLLOWING,
) = range(30, 50)  # fmt: skip
VALUES, DERIVATIVES, SIDE = 50, 60, 70
RESULTS, FREE_RESULTS, PROGRAMME, SOLUTION, SOLVER = 71, 76, 81, 86, 87
# the single numbers of the memory
BEGUN, THEN, STRONGEST, SLOW, FAILED, ITERATED, FACTOR, CONSTRAINTS = range(8)


def programme_of(memory: NDArray) -> tuple:
    """Hessian, gradient, rows, upper and lower bounds of the quadratic programme."""
    k = PROGRAMME
    return (
        array2(memory, k), array1(memory, k + 1), array2(memory, k + 2), array1(memory, k + 3),
        array1(memory, k + 4),
    )  # fmt: skip


def decide_by_motion(
    t: float, accelerations: NDArray, rest: NDArray, settings: NDArray, memory: NDArray,
    command: NDArray, device_side: Callable, state_rates: Callable,
) -> None:  # fmt: skip
    """Predict, linearise, solve, and return the first command of the plan."""
    numbers, state = array1(settings, NUMBERS), array1(memory, STATE)
    coils, lowest = array2(settings, COIL_TABLE), array2(settings, LOWEST_CURRENTS)
    plan, trial, before = array2(memory, PLAN), array2(memory, TRIAL), array1(memory, BEFORE)
    z, s, i = array1(memory, Z_NOW), array2(memory, STATES_NOW), array1(memory, CURRENT_NOW)
    path, y = array2(memory, PATH), array1(memory, OUTPUTS)
    past, peaks = array2(memory, PEAKS_PAST), array1(memory, PEAKS)
    plant = plant_at(settings, DECAY, array1(memory, FORCE_SCALES))
    work = work_at(memory, VALUES)
    n_steps, n_channels, n_ground = plan.shape[0], coils.shape[0], path.shape[0]
    n_d, n_a = int(numbers[N_DISPLACEMENTS]), int(numbers[N_ACCELERATIONS])
    n_late, n_sub, begun = int(numbers[N_LATE]), int(numbers[N_SUB]), state[BEGUN] == 1.0
    current, ahead = rest[n_ground : n_ground + n_channels], rest[n_ground + n_channels :]

    # the command of the last decision, and the plan behind it
    if begun and numbers[JUMPS] == 1.0:
        outputs_now(z, s, plan[0], plant, work, y, device_side)
        change_peaks(y, n_d, n_a, past, peaks)
    for c in range(n_channels):
        before[c] = plan[0, c]
    if begun:
        move_on(n_late, plan, array2(memory, PENDING))
    follow_motion(t, current, settings, memory, plant, state_rates)
    if numbers[LEARNS] == 1.0:
        learn_force_scale(accelerations, current, settings, memory, plant, device_side)
    was_slow = state[SLOW] == 1.0
    forecast(begun, rest, ahead, settings, memory, plant, work, device_side)
    if was_slow and state[SLOW] == 0.0:
        for k in range(n_steps):
            for c in range(n_channels):
                plan[k, c] = coils[c, 2]

    state_at_decision(current, settings, memory, plant, work, device_side)
    outputs_now(z, s, i, plant, work, y, device_side)
    follow_peaks(y, n_d, n_a, past, peaks)
    slow = state[SLOW] == 1.0
    for k in range(n_steps):
        for c in range(n_channels):
            trial[k, c] = coils[c, 3] if slow else plan[k, c]
    state[FAILED] = state[ITERATED] = 0.0
    n_linearisations = 0 if slow and numbers[HOLDS] == 1.0 else int(numbers[LINEARISATIONS])
    n_known = len(ahead) // (n_ground * n_sub) + 1
    for _ in range(n_linearisations):
        predict(
            n_steps, z, s, i, trial, array1(settings, BLOCK), path, n_late * n_sub, plant, work,
            results_at(memory, RESULTS), device_side,
        )  # fmt: skip
        if not improve(n_known, settings, memory):
            state[FAILED] = 1.0
            for k in range(n_steps):
                for c in range(n_channels):
                    trial[k, c] = plan[k, c]
            break
    keep_within_coils(numbers[STEP], coils, lowest, i, before, trial, plan)
    for c in range(n_channels):
        command[c] = plan[0, c]
    state[BEGUN] = 1.0


def move_on(n_late: int, plan: NDArray, pending: NDArray) -> None:
    """Move the plan by one decision; its first command is the last of those on their way."""
    for c in range(plan.shape[1]):
        for k in range(n_late):
            pending[k, c] = pending[k + 1, c] if k < n_late - 1 else plan[0, c]
        for k in range(plan.shape[0] - 1):
            plan[k, c] = plan[k + 1, c]


def state_at_decision(
    current: NDArray, settings: NDArray, memory: NDArray, plant: tuple, work: tuple,
    device_side: Callable,
) -> None:  # fmt: skip
    """Predict the state at the decision from the measured one, which is delayed."""
    numbers = array1(settings, NUMBERS)
    n_late = int(numbers[N_LATE])
    z, s, i = array1(memory, Z_NOW), array2(memory, STATES_NOW), array1(memory, CURRENT_NOW)
    z_then, s_then = array1(memory, Z_THEN), array2(memory, STATES_THEN)
    values = work[0]
    if n_late > 0:
        predict(
            n_late, z_then, s_then, current, array2(memory, PENDING), array1(settings, NO_BLOCK),
            array2(memory, PATH), int(numbers[PRESENT]), plant, work,
            results_at(memory, FREE_RESULTS), device_side,
        )  # fmt: skip
    for m in range(len(z)):
        z[m] = values[0][m] if n_late > 0 else z_then[m]
    for e in range(s.shape[0]):
        for q in range(s.shape[1]):
            s[e, q] = values[2][e, q] if n_late > 0 else s_then[e, q]
    for c in range(len(i)):
        i[c] = values[4][c] if n_late > 0 else current[c]


def keep_within_coils(
    step: float, coils: NDArray, lowest: NDArray, i: NDArray, before: NDArray, trial: NDArray,
    plan: NDArray,
) -> None:  # fmt: skip
    """Plan without the violations of a bound by the solver, 1e-6 at most: none reaches a coil."""
    for c in range(plan.shape[1]):
        lag = coils[c, 0]
        start = i[c] if lag > 0.0 else before[c]
        reach = largest_gap(lag, coils[c, 1], step)
        trial[0, c] = min(max(trial[0, c], start - reach), start + reach)
        for k in range(plan.shape[0]):
            plan[k, c] = min(max(trial[k, c], lowest[0, c]), coils[c, 3])


def follow_motion(
    t: float, current: NDArray, settings: NDArray, memory: NDArray, plant: tuple,
    state_rates: Callable,
) -> None:  # fmt: skip
    """Modes from the measured motion, and device states integrated along it."""
    state, rows, numbers = array1(memory, STATE), plant[4], plant[7]
    z, seen = array1(memory, Z_THEN), array1(memory, Z_SEEN)
    motion, to_modes = array1(memory, MOTION_SEEN), array2(settings, TO_MODES)
    channels, lengths = array1(settings, CHANNELS), array1(settings, LENGTHS)
    then, states = array1(memory, CURRENT_THEN), array2(memory, STATES_THEN)
    n_modes = len(z) // 2
    for m in range(len(z)):
        seen[m] = 0.0
        for k in range(len(motion)):
            seen[m] += to_modes[m, k] * motion[k]
    if state[BEGUN] == 1.0:
        for e in range(len(lengths)):
            c, size = int(channels[e]), lengths[e]
            amperes = 0.5 * (then[c] + current[c]) if c >= 0 else 0.0
            x, v = motion_of(rows[e, 0], z, n_modes), motion_of(rows[e, 1], z, n_modes)
            x_end = motion_of(rows[e, 0], seen, n_modes)
            v_end = motion_of(rows[e, 1], seen, n_modes)
            follow_states(
                e, (x * size, v * size), (x_end * size, v_end * size), t - state[THEN], states[e],
                amperes, numbers[e], array1(memory, FOLLOWING), state_rates,
            )  # fmt: skip
    for m in range(len(z)):
        z[m] = seen[m]
    for c in range(len(then)):
        then[c] = current[c]
    state[THEN] = t


def learn_force_scale(
    accelerations: NDArray, current: NDArray, settings: NDArray, memory: NDArray, plant: tuple,
    device_side: Callable,
) -> None:  # fmt: skip
    """Estimate the devices' forces over those of the nominal model."""
    numbers, state = array1(settings, NUMBERS), array1(memory, STATE)
    force_scales, force = array1(memory, FORCE_SCALES), array1(memory, FORCES)
    devices, side = array2(settings, DEVICE_NUMBERS), array1(memory, SIDE)
    for e in range(len(force)):
        device_now(
            e, array1(memory, Z_THEN), array2(memory, STATES_THEN), current, plant, side,
            device_side,
        )  # fmt: skip
        force[e] = side[0] * devices[e, FORCE_SCALE]
    state[FACTOR] = learn_scale(
        accelerations, force, array2(settings, BY_INERTIA), array2(settings, BY_FORCE),
        numbers[LEARNING_DECAY], numbers[LEARNT_BEFORE], array1(memory, SCALE_SUMS),
    )  # fmt: skip
    for e in range(len(force_scales)):
        force_scales[e] = state[FACTOR]


def forecast(
    begun: bool, measured: NDArray, ahead: NDArray, settings: NDArray, memory: NDArray,
    plant: tuple, work: tuple, device_side: Callable,
) -> None:  # fmt: skip
    """Ground motion ahead, the response to it without current, and whether it is slow."""
    numbers, state = array1(settings, NUMBERS), array1(memory, STATE)
    acceleration, path = array2(memory, ACCELERATION_AHEAD), array2(memory, PATH)
    sample, peaks = array1(memory, SAMPLE), array1(memory, PEAKS)
    n_sub = int(numbers[N_SUB])
    n_known = len(ahead) // (path.shape[0] * n_sub)
    model = (
        array2(memory, GROUND_MOTION), array2(memory, GROUND_END), array2(memory, GROUND_PAST),
        array2(memory, COEFFICIENTS), array3(memory, COVARIANCE), array2(memory, NOISE),
        array1(memory, GAIN), array1(memory, INNOVATIONS), array1(memory, SHAPE),
    )  # fmt: skip
    returning = (numbers[PULL], numbers[STEP], numbers[VELOCITY_DECAY], numbers[FORECAST_DECAY])
    look_ahead(
        measured, ahead, n_sub, returning, model, array3(settings, PULSES), acceleration, path,
        array3(memory, DEVIATIONS),
    )  # fmt: skip
    free = (
        array1(memory, FREE_Z), array2(memory, FREE_STATES), array2(memory, FREE_PAST),
        array1(memory, FREE_PEAKS), array2(memory, PEAK_HISTORY), array2(memory, FREE_GROUND),
    )  # fmt: skip
    follow_uncontrolled(
        begun, n_known, (int(numbers[N_DISPLACEMENTS]), int(numbers[N_ACCELERATIONS])),
        array2(settings, LOWEST_CURRENTS), path, n_sub, plant, work,
        results_at(memory, FREE_RESULTS), free, array1(settings, NO_BLOCK), device_side,
    )  # fmt: skip
    for k in range(n_known if begun else 0, n_known + 1):
        for d in range(len(sample)):
            sample[d] = acceleration[d, k]
        slow = follow_slow(
            sample, peaks[1], numbers[STEP], numbers[SLOW_LIMIT], array2(memory, SLOW_SAMPLES),
            array1(memory, SLOW_RATES), array1(memory, SLOW_STATE),
        )  # fmt: skip
        state[SLOW] = 1.0 if slow else 0.0


def improve(n_known: int, settings: NDArray, memory: NDArray) -> bool:
    """Change the plan by the solution of the programme around it; whether there is one."""
    numbers, state = array1(settings, NUMBERS), array1(memory, STATE)
    coils, block = array2(settings, COIL_TABLE), array1(settings, BLOCK)
    along, trial = array2(settings, ALONG), array2(memory, TRIAL)
    acceleration, end = array2(memory, ACCELERATION_AHEAD), array2(memory, GROUND_END)
    peak_history = array2(memory, PEAK_HISTORY)
    peaks, free = array1(memory, PEAKS), array1(memory, FREE_PEAKS)
    levels, regret_levels = array1(memory, LEVELS), array1(memory, REGRET_LEVELS)
    units, resting, x = array1(memory, UNITS), array1(memory, RESTING), array1(memory, SOLUTION)
    n_d, n_a = int(numbers[N_DISPLACEMENTS]), int(numbers[N_ACCELERATIONS])
    first, last = int(numbers[N_LATE]), peak_history.shape[0] - 1
    for d in range(acceleration.shape[0]):
        for k in range(n_known):
            state[STRONGEST] = max(state[STRONGEST], abs(acceleration[d, k]), 1e-3)
    # a unit that grows too late would let the plan accept any acceleration to avoid displacement
    for kind in range(2):
        least = numbers[LEAST_PEAK] * state[STRONGEST]
        if kind == 0:
            least /= numbers[FREQUENCY] * numbers[FREQUENCY]
        units[kind] = max(peak_history[last, kind], least)
        unavoidable = max(free[kind], least) * numbers[DISPLACEMENT_LEVEL + kind]
        levels[kind] = max(peaks[kind], unavoidable)
        if kind == 1:
            for k in range(len(regret_levels)):
                regret_levels[k] = max(peak_history[first + k, 1], max(peaks[1], least))
    units[2] = units[0] * numbers[FREQUENCY]
    # relative to ground that stops, a free base has the ground velocity in addition to its own
    for o in range(n_d):
        lost = 0.0
        for d in range(along.shape[1]):
            lost += numbers[STOP] * along[o, d] * end[d, 1]
        resting[o], resting[n_d + n_a + o] = -STOPPING * lost, lost
    margins = (max(n_known - first, 1), numbers[MARGIN], array3(memory, DEVIATIONS), regret_levels)
    programme = programme_of(memory)
    n_rows = condense(
        results_at(memory, RESULTS), trial, array1(memory, BEFORE), block, coils, numbers[STEP],
        (n_d, n_a), units, levels, margins, array1(settings, WEIGHTS), resting, programme,
        array1(memory, SLOPES),
    )  # fmt: skip
    hessian, gradient, rows, upper, lower = programme
    w = SOLVER
    solver = array2(memory, w), array2(memory, w + 1), array2(memory, w + 2), array1(memory, w + 3)
    iterations = solve(hessian, gradient, rows, n_rows, upper, lower, x, solver)
    state[ITERATED] += abs(iterations)
    state[CONSTRAINTS] = n_rows
    if iterations < 0 or not usable(n_rows, rows, upper, lower, x):
        return False
    for k in range(trial.shape[0]):
        for c in range(trial.shape[1]):
            change = x[int(block[k]) * trial.shape[1] + c]
            trial[k, c] += change * (coils[c, 3] - coils[c, 2])
    return True


def usable(n_rows: int, rows: NDArray, upper: NDArray, lower: NDArray, x: NDArray) -> bool:
    """Whether a solution is a number, and within the constraints."""
    for k in range(len(x) + n_rows):
        outside = max(excess(k + 1, rows, upper, lower, x), excess(-k - 1, rows, upper, lower, x))
        if not outside <= INFEASIBLE:
            return False
    return True
