"""Decision of a trained recurrent policy, on flat arrays of fixed size, for Numba and for C.

The inputs are the measured motion, the ground motion and the responses of the nominal model to it
at three constant currents. All are relative to running peaks without current.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from numpy.typing import NDArray

from ..device_states import follow_states
from .flat_arrays import array1, array2, array3, plant_at, results_at, work_at
from .prediction_kernel import predict
from .running_peaks import follow_peaks

# arrays of the settings: single numbers, then those of ``prediction_kernel``, then the others
(
    NUMBERS, DECAY, HELD, SLOPED, MOVED, DEFORMATIONS, REFERENCE, CHANNELS, DEVICE_NUMBERS,
    COIL_DECAY, ON_MODES, ON_FORCES, FORCE_SCALES, NO_BLOCK, RANGES, REFERENCE_CURRENTS, GATES,
    RECURRENT, GATE_OFFSETS, FIRST, FIRST_OFFSETS, SECOND, SECOND_OFFSETS, LAST, LAST_OFFSETS,
) = range(25)  # fmt: skip
# the single numbers
STEP, FREQUENCY, N_DISPLACEMENTS, N_ACCELERATIONS, ELEMENT, LENGTH = range(6)
# arrays of the memory
(
    STATE, LEVELS, STATES_THEN, FOLLOWING, PAST, PEAKS, OUTPUTS, REFERENCE_Z, REFERENCE_STATES,
    REFERENCE_PAST, REFERENCE_PEAKS, REFERENCE_OUTPUTS, GROUND, SAMPLES, INPUTS, HIDDEN, GATE_SUMS,
    FIRST_LAYER, SECOND_LAYER,
) = range(19)  # fmt: skip
VALUES, DERIVATIVES, SIDE, RESULTS = 19, 29, 39, 40
# the single numbers of the memory; ground accelerations in m/s^2, velocities in m/s
(
    BEGUN, THEN, ACCELERATION, VELOCITY, DISPLACEMENT, FAST_VELOCITY, PEAK_ACCELERATION,
    PEAK_VELOCITY, RATE, MOVING, CURRENT_THEN,
) = range(11)  # fmt: skip

N_GROUND, N_MOTION = 20, 13
"""Inputs from the ground motion alone, and from the controlled motion. Those of preview follow."""
AHEAD = 4
"""Decisions from one acceleration ahead, which is an input, to the next."""
N_REFERENCES = 3
"""Constant currents at which the nominal model is simulated: lowest, a third, highest."""
N_SAMPLES = 5
"""Ground accelerations over which the rate is measured."""
SLOW_MEMORY, DISPLACEMENT_MEMORY, FAST_MEMORY = 10.0, 2.0, 1.0
"""Memories of the integrals of the ground acceleration, s."""
RATE_FADING = 0.9995
"""Factor of the largest rate from one decision to the next."""
LEAST_PEAK = 0.13
"""Lower limit of the peaks without current, as a multiple of the largest ground acceleration."""
FELT = 0.05
"""Ground acceleration from which on the motion has begun, m/s^2."""
LIMIT = 4.0
"""Largest absolute value of an input."""


def decide(
    t: float, measured: NDArray, settings: NDArray, memory: NDArray, command: NDArray,
    device_side: Callable, state_rates: Callable,
) -> None:  # fmt: skip
    """Update the memory by one measurement, and evaluate the network."""
    # Measured: accelerations of all levels (m/s^2), deformation (m) and velocity (m/s) of the first
    # driven element, displacement of the roof (m), ground acceleration (m/s^2), coil currents (A),
    # ground accelerations at the next decisions (m/s^2) with preview
    state, levels = array1(memory, STATE), array1(memory, LEVELS)
    n = len(levels)
    for k in range(n):
        levels[k] = measured[k]
    ground, n_now = measured[n + 3], n + 4 + len(command)
    current, ahead = measured[n + 4 : n_now], measured[n_now:]
    plant = plant_at(settings, DECAY, array1(settings, FORCE_SCALES))
    work = work_at(memory, VALUES)
    follow_controlled(t, (measured[n], measured[n + 1]), current, settings, memory, state_rates)
    # the nominal model and the ground motion are known up to the end of the preview
    begun = state[BEGUN] == 1.0
    first = len(ahead) if begun else 0
    for k in range(first, len(ahead) + 1):
        new = ground if k == 0 else ahead[k - 1]
        follow_references(begun or k > 0, new, settings, memory, plant, work, device_side)
        follow_ground(new, settings, memory)
    fill_inputs(ground, ahead, current, measured[n + 2], settings, memory)
    share = evaluate_network(settings, memory)
    ranges = array2(settings, RANGES)
    for c in range(len(command)):
        command[c] = ranges[c, 0] + share * (ranges[c, 1] - ranges[c, 0])
    state[BEGUN], state[THEN] = 1.0, t


def follow_controlled(
    t: float, motion: tuple, current: NDArray, settings: NDArray, memory: NDArray,
    state_rates: Callable,
) -> None:  # fmt: skip
    """States of the first driven element along its measured motion, and peaks so far."""
    state, numbers = array1(memory, STATE), array2(settings, DEVICE_NUMBERS)
    levels, y = array1(memory, LEVELS), array1(memory, OUTPUTS)
    e = int(array1(settings, NUMBERS)[ELEMENT])
    c, n, rate = int(array1(settings, CHANNELS)[e]), len(levels), len(levels) + 1
    if state[BEGUN] == 1.0:
        follow_states(
            e, (y[0], y[rate]), motion, t - state[THEN], array1(memory, STATES_THEN),
            0.5 * (state[CURRENT_THEN] + current[c]), numbers[e], array1(memory, FOLLOWING),
            state_rates,
        )  # fmt: skip
    state[CURRENT_THEN] = current[c]
    y[0], y[rate] = motion
    for k in range(n):
        y[1 + k] = levels[k]
    follow_peaks(y, 1, n, array2(memory, PAST), array1(memory, PEAKS))


def follow_references(
    begun: bool, ground: float, settings: NDArray, memory: NDArray, plant: tuple, work: tuple,
    device_side: Callable,
) -> None:  # fmt: skip
    """Advance the nominal model at each constant current by one decision."""
    single, path = array1(settings, NUMBERS), array2(memory, GROUND)
    currents = array3(settings, REFERENCE_CURRENTS)
    z, states = array2(memory, REFERENCE_Z), array3(memory, REFERENCE_STATES)
    past, peaks = array3(memory, REFERENCE_PAST), array2(memory, REFERENCE_PEAKS)
    y, values = array2(memory, REFERENCE_OUTPUTS), work[0]
    results = results_at(memory, RESULTS)
    last = path.shape[1] - 1
    rise = ground - path[0, 0]
    for sub in range(1, last + 1):
        path[0, sub] = path[0, 0] + rise * (sub / last)
    if begun:
        for r in range(N_REFERENCES):
            held = currents[r]
            predict(
                1, z[r], states[r], held[0], held, array1(settings, NO_BLOCK), path, 0, plant, work,
                results, device_side,
            )  # fmt: skip
            for m in range(z.shape[1]):
                z[r, m] = values[0][m]
            for e in range(states.shape[1]):
                for q in range(states.shape[2]):
                    states[r, e, q] = values[2][e, q]
            for o in range(y.shape[1]):
                y[r, o] = results[0][1, o]
            follow_peaks(
                y[r], int(single[N_DISPLACEMENTS]), int(single[N_ACCELERATIONS]), past[r], peaks[r]
            )
    path[0, 0] = ground


def follow_ground(new: float, settings: NDArray, memory: NDArray) -> None:
    """Integrals, peaks and rate of the ground acceleration."""
    state, samples = array1(memory, STATE), array1(memory, SAMPLES)
    h = array1(settings, NUMBERS)[STEP]
    mean = 0.5 * (state[ACCELERATION] + new)
    state[VELOCITY] = state[VELOCITY] * math.exp(-h / SLOW_MEMORY) + h * mean
    faded = state[DISPLACEMENT] * math.exp(-h / DISPLACEMENT_MEMORY)
    state[DISPLACEMENT] = faded + h * state[VELOCITY]
    state[FAST_VELOCITY] = state[FAST_VELOCITY] * math.exp(-h / FAST_MEMORY) + h * mean
    state[PEAK_ACCELERATION] = max(state[PEAK_ACCELERATION], abs(new))
    state[PEAK_VELOCITY] = max(state[PEAK_VELOCITY], abs(state[VELOCITY]))
    state[RATE] = max(RATE_FADING * state[RATE], abs(new - samples[0]) / (N_SAMPLES * h))
    if state[PEAK_ACCELERATION] > FELT:
        state[MOVING] += h
    for k in range(N_SAMPLES - 1):
        samples[k] = samples[k + 1]
    samples[N_SAMPLES - 1] = new
    state[ACCELERATION] = new


def logarithm(value: float) -> float:
    """Logarithm of a number that may be 0."""
    return math.log(max(value, 1e-6))


def fill_inputs(
    ground: float, ahead: NDArray, current: NDArray, roof: float, settings: NDArray,
    memory: NDArray,
) -> None:  # fmt: skip
    """Write the network's inputs."""
    state, single, x = array1(memory, STATE), array1(settings, NUMBERS), array1(memory, INPUTS)
    y, r = array1(memory, OUTPUTS), array2(memory, REFERENCE_OUTPUTS)
    peaks, r_peaks = array1(memory, PEAKS), array2(memory, REFERENCE_PEAKS)
    states, ranges, n = array1(memory, STATES_THEN), array2(settings, RANGES), len(y) - 2
    rate = int(single[N_DISPLACEMENTS]) + int(single[N_ACCELERATIONS])
    w, pga = single[FREQUENCY], max(state[PEAK_ACCELERATION], 1e-3)
    x0 = max(r_peaks[0, 0], LEAST_PEAK * pga / (w * w))
    a0 = max(r_peaks[0, 1], LEAST_PEAK * pga)
    v0 = x0 * w
    x[0] = ground / pga
    x[1] = state[VELOCITY] / v0
    x[2] = state[DISPLACEMENT] / x0
    x[3] = state[FAST_VELOCITY] / v0
    x[4] = r[0, 0] / x0
    x[5] = r[0, rate] / v0
    x[6] = r[0, rate - 1] / a0
    x[7] = 0.5 * logarithm(x0 / 0.1)
    x[8] = 0.5 * logarithm(a0)
    x[9] = 0.5 * logarithm(0.5 * pga)
    x[10] = logarithm(2.0 * math.pi * pga / max(state[RATE], 1e-3))
    x[11] = logarithm(2.0 * math.pi * max(state[PEAK_VELOCITY], 1e-4) / pga)
    x[12] = math.tanh(state[MOVING] / 2.0)
    x[13] = math.tanh(state[MOVING] / 8.0)
    x[14] = logarithm(r_peaks[2, 0] / x0 + 0.01)
    x[15] = logarithm(r_peaks[2, 1] / a0 + 0.01)
    x[16] = logarithm(r_peaks[1, 0] / x0 + 0.01)
    x[17] = logarithm(r_peaks[1, 1] / a0 + 0.01)
    x[18] = r[1, 0] / x0
    x[19] = r[2, 0] / x0
    k = N_GROUND
    x[k] = y[0] / x0
    x[k + 1] = y[n + 1] / v0
    x[k + 2] = y[1] / a0
    x[k + 3] = y[1 + n // 2] / a0
    x[k + 4] = y[n] / a0
    for q in range(2):
        x[k + 5 + q] = states[q] * single[LENGTH] / x0 if q < len(states) else 0.0
    x[k + 7] = 2.0 * (current[0] - ranges[0, 0]) / (ranges[0, 1] - ranges[0, 0]) - 1.0
    x[k + 8] = peaks[0] / x0
    x[k + 9] = peaks[1] / a0
    x[k + 10] = (abs(y[0]) - peaks[0]) / x0
    x[k + 11] = (abs(y[n]) - peaks[1]) / a0
    x[k + 12] = 5.0 * roof / x0
    for j in range(k + N_MOTION, len(x)):
        x[j] = ahead[AHEAD * (j - k - N_MOTION + 1) - 1] / pga
    for j in range(len(x)):
        x[j] = min(max(x[j], -LIMIT), LIMIT)


def evaluate_network(settings: NDArray, memory: NDArray) -> float:
    """One step of the gated recurrent unit, then two layers: the share of the current's range."""
    x, hidden, sums = array1(memory, INPUTS), array1(memory, HIDDEN), array1(memory, GATE_SUMS)
    first, second = array1(memory, FIRST_LAYER), array1(memory, SECOND_LAYER)
    gates, recurrent = array2(settings, GATES), array2(settings, RECURRENT)
    offsets, n = array1(settings, GATE_OFFSETS), len(hidden)
    # sums: reset gate, update gate and candidate from the inputs; the same from the hidden units
    for j in range(3 * n):
        sums[j], sums[3 * n + j] = offsets[j], 0.0
        for k in range(len(x)):
            sums[j] += gates[k, j] * x[k]
        for k in range(n):
            sums[3 * n + j] += recurrent[k, j] * hidden[k]
    for j in range(n):
        reset = 1.0 / (1.0 + math.exp(-sums[j] - sums[3 * n + j]))
        update = 1.0 / (1.0 + math.exp(-sums[n + j] - sums[4 * n + j]))
        candidate = math.tanh(sums[2 * n + j] + reset * sums[5 * n + j])
        hidden[j] = update * hidden[j] + (1.0 - update) * candidate
    weights, offsets = array2(settings, FIRST), array1(settings, FIRST_OFFSETS)
    for j in range(len(first)):
        total = offsets[j]
        for k in range(len(x)):
            total += weights[k, j] * x[k]
        for k in range(n):
            total += weights[len(x) + k, j] * hidden[k]
        first[j] = math.tanh(total)
    weights, offsets = array2(settings, SECOND), array1(settings, SECOND_OFFSETS)
    for j in range(len(second)):
        total = offsets[j]
        for k in range(len(first)):
            total += weights[k, j] * first[k]
        second[j] = math.tanh(total)
    total = array1(settings, LAST_OFFSETS)[0]
    for k in range(len(second)):
        total += array2(settings, LAST)[k, 0] * second[k]
    return 1.0 / (1.0 + math.exp(-total))
