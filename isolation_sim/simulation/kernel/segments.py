"""Segments, step size control and records; see ``integration.py``."""

import numpy as np

from ...compilation.options import inline, inner
from .arguments import Step
from .collocation import LAGRANGE, NODES_AND_END
from .operations import call, make_move_modes
from .shape import LANES, N_ELEMENTS, N_GROUND, STRIDE, TABLE_LANES
from .slots import (
    AFTER,
    ALIVE,
    AT_NODES,
    BEFORE,
    BEGIN,
    BENT,
    C_REF,
    CLAMPED,
    COMMAND,
    CURRENT_REFUSED,
    D_END,
    ENDED,
    F0,
    F_START,
    FORCE_END,
    FORCE_SCALE,
    FORCES,
    K_REF,
    LENGTH,
    MEASURE,
    MISSED,
    NEXT,
    NO_CONVERGENCE,
    NOT_FINITE,
    SEGMENT,
    SEGMENT_NOW,
    STAGE,
    STEPS,
    TO_STRUCTURE,
    TOO_LARGE,
    V_END,
    WEIGHT,
)  # fmt: skip
from .tables import build_table, layout

move_modes = make_move_modes(LANES, TABLE_LANES, STRIDE, F0, N_ELEMENTS, N_GROUND)

HOLD = 8  # segments to wait after a rejected step before a coarser one is tried
MOST_STEPS = 4096  # tried in one segment; after these, steps that miss the tolerance are counted
MOVING_FACTOR = 8.0  # weight of the error while a coil current changes: errors then accumulate


@inline
def begin_segment(position, sizes, time_grid, measurements, coils, channel, lanes, z, w):
    """Sensors, decision and commands at a segment's start; return whether it has been decided."""
    segment = position[SEGMENT_NOW]
    segments, _, events, ground = time_grid
    command, driver, coil, _, moving, coil_history = coils
    n_pad, n_channels = sizes.n_pad, sizes.n_channels
    g = segments[segment, 0]
    if position[STAGE] == MEASURE:
        # sensors read before the current changes; then the controller decides
        if events[segment, 0] >= 0:
            read_sensors(
                events[segment, 0], g, sizes.n_outputs, n_channels, sizes.n_modes, n_pad,
                sizes.n_elements, sizes.n_ground, measurements.rows, measurements.noise, ground, z,
                g * 2 * n_pad, coil, w, measurements.measured,
            )  # fmt: skip
        if events[segment, 1] >= 0:
            position[STAGE] = COMMAND
            if sizes.controller == 0:
                return False
            call_controllers(
                events[segment, 1], sizes.controller, measurements.decision_times,
                measurements.measured_for, measurements.addresses,
            )  # fmt: skip
    if events[segment, 2] >= 0:
        set_commands(
            g, measurements.chosen, events[segment, 2], n_channels, sizes.clamp, driver, command,
            coil, lanes.alive, lanes.counts,
        )  # fmt: skip
    for e in range(sizes.n_elements):
        c = channel[e]
        for lane in range(LANES):
            moving[e, lane] = 0
            w[(e * STRIDE + BENT) * LANES + lane] = 0.0
            w[(e * STRIDE + WEIGHT) * LANES + lane] = 1.0
            if coil[c, lane] != command[g, c, lane]:
                moving[e, lane] = 1
                w[(e * STRIDE + WEIGHT) * LANES + lane] = MOVING_FACTOR
    for c in range(n_channels):
        for lane in range(LANES):
            coil_history[segment, c, lane] = coil[c, lane]
    for lane in range(LANES):
        lanes.todo[lane] = 1 if lanes.alive[lane] == ALIVE else 0
        lanes.place[lane] = 0
        lanes.tried[lane] = 0
        lanes.base[lane] = lanes.level[lane]
        lanes.worst[lane] = -1.0
    return True


@inline
def take_current(e, g, coils, law_numbers, going, w):
    """Mark the lanes with a new constant current of an element; set its parameters."""
    c = law_numbers.channel[e]
    changed = False
    for lane in range(LANES):
        going[lane] = 0
        current = coils.current[c, lane]
        if current == coils.command[g, c, lane] and current != coils.applied[e, lane]:
            going[lane] = 1
            coils.applied[e, lane] = current
            set_parameters(e, lane, 0, current, law_numbers, w)
            changed = True
    return changed


@inline
def shift_force(e, n_directions, w, going):
    """Change the force at a step's start to that of a new current."""
    for direction in range(n_directions):
        for lane in range(LANES):
            if going[lane]:
                at = (e + direction) * STRIDE * LANES + lane
                begin = w[at + FORCE_END * LANES]
                begin -= w[at + K_REF * LANES] * w[at + D_END * LANES]
                begin -= w[at + C_REF * LANES] * w[at + V_END * LANES]
                jump = begin - w[at + F_START * LANES]
                for k in range(3):
                    w[at + (F0 + k) * LANES] += jump
                w[at + F_START * LANES] = begin


@inline
def any_lane(mask):
    """Whether a mask has any lane."""
    count = 0
    for lane in range(LANES):
        count += mask[lane]
    return count > 0


@inline
def choose_step(segment, sizes, limits, time_grid, propagation, lanes, u):
    """The next step of the lanes with the least time; its coefficients and ground motion."""
    segments, spans, _, ground = time_grid
    offsets, modes, table, built, phi, integral = propagation
    n_levels = sizes.n_levels
    whole = 1 << (n_levels - 1)  # a segment in the shortest steps
    g = segments[segment, 0]
    kind = segments[segment, 1]
    n_intervals = segments[segment, 2]
    # of these lanes, those with the longest step
    at, depth = whole, n_levels
    for lane in range(LANES):
        if lanes.todo[lane]:
            if lanes.place[lane] < at:
                at, depth = lanes.place[lane], lanes.level[lane]
            elif lanes.place[lane] == at:
                depth = min(depth, lanes.level[lane])
    while at % (whole >> depth) != 0:
        depth += 1
    n_steps = 1 << depth
    number = at // (whole >> depth)
    n_sub = max(n_intervals >> depth, 1)
    per_interval = max(n_steps // n_intervals, 1)
    # a step counts by its share of the sample, with some reserve where steps had to be cut
    share = 4.0 / per_interval if per_interval > 1 else 1.0
    # what the iteration leaves adds up over the steps; rounding ends it
    left = max(limits.iteration / per_interval, min(limits.iteration, 1e-14))
    h = spans[kind] / n_steps
    offset = offsets[kind, depth]
    if built[kind, depth] == 0:
        for lane in range(TABLE_LANES):
            build_table(h, n_sub, lane, sizes[:4], modes, table, offset, phi, integral)
        built[kind, depth] = 1
    fresh = 0
    for lane in range(LANES):
        lanes.active[lane] = 0
        if lanes.todo[lane] and lanes.place[lane] == at and lanes.level[lane] <= depth:
            lanes.active[lane] = 1
            lanes.tried[lane] += 1
        lanes.going[lane] = 1 if lanes.active[lane] and lanes.last[lane] != h else 0
        fresh += lanes.going[lane]
        if lanes.going[lane]:
            lanes.contraction[lane] = 1.0
        if lanes.active[lane]:
            lanes.last[lane] = h
    first = number * n_sub if per_interval == 1 else number // per_interval
    point = g + first
    if per_interval == 1:
        for k in range((n_sub + 1) * sizes.n_ground * LANES):
            u[k] = ground[point * sizes.n_ground * LANES + k]
    else:
        a = (number - first * per_interval) / per_interval
        for k in range(sizes.n_ground * LANES):
            low = ground[point * sizes.n_ground * LANES + k]
            high = ground[(point + 1) * sizes.n_ground * LANES + k]
            u[k] = low + (high - low) * a
            u[sizes.n_ground * LANES + k] = low + (high - low) * (a + 1.0 / per_interval)
    # within a grid interval the modes go through a scratch row behind the last point
    spare = segments[sizes.n_segments, 0] + 1
    start = point if per_interval == 1 or number % per_interval == 0 else spare
    end = g + (number + 1) * n_intervals // n_steps
    if (number + 1) % per_interval != 0:
        end = spare
    return Step(
        at, depth, number, n_steps, n_intervals, n_sub, per_interval, point, start, end, fresh,
        offset, whole, h, share, left,
    )  # fmt: skip


@inline
def judge_step(step, sizes, limits, lanes):
    """Accept or reject a step in each lane; return whether any lane accepts it."""
    n_levels = sizes.n_levels
    lanes.counts[STEPS, 0] += 1
    running = 0
    for lane in range(LANES):
        if lanes.active[lane] == 0:
            continue
        # samples inside a step are read off the polynomial: its defect is their error
        error, defect = lanes.errors[lane], lanes.defects[lane]
        accepted = error <= limits.error and (
            (step.n_sub == 1 and defect < np.inf) or defect <= limits.defect
        )
        if (
            not accepted
            and defect < np.inf
            and (step.depth + 1 == n_levels or lanes.tried[lane] > MOST_STEPS)
        ):
            lanes.counts[MISSED, lane] += 1
            lanes.missed[lane] = max(lanes.missed[lane], error)
            accepted = True
        running += 1
        if not accepted:
            lanes.active[lane] = 0
            running -= 1
            lanes.last[lane] = 0.0
            if lanes.kinks[lane] == 0.0:
                lanes.hold[lane] = HOLD
                lanes.worst[lane] = np.inf
            if step.depth + 1 < n_levels and lanes.tried[lane] < 2 * MOST_STEPS:
                lanes.level[lane] = step.depth + 1
            else:
                lanes.alive[lane] = NO_CONVERGENCE
                lanes.todo[lane] = 0
    return running > 0


@inline
def keep_step(step, segment, width, sizes, propagation, lanes, history, u, w):
    """Record an accepted step; modes and forces at its grid points.

    width: numbers of an element in a step's record.
    """
    n_pad = sizes.n_pad
    row = 2 * n_pad
    z, _, forces, steps, step_count, cuts, first_step, last_step = history
    active, table, offset = lanes.active, propagation.table, step.offset
    point, n_sub, per_interval = step.point, step.n_sub, step.per_interval
    own = row + sizes.n_elements * width  # behind them a step's own numbers
    for lane in range(LANES):
        if active[lane] == 0:
            continue
        if per_interval == 1:
            for i in range(n_sub):
                cuts[point + i, lane] = -n_sub
        elif step.number % per_interval == 0:
            cuts[point, lane] = 1
            first_step[point, lane] = step_count[0]
        else:
            cuts[point, lane] += 1
            steps[last_step[lane], (own + NEXT) * LANES + lane] = step_count[0]
        last_step[lane] = step_count[0]
    # the peaks inside a sample are looked for in the steps that cut it
    if sizes.record_steps or per_interval > 1:
        k = step_count[0]
        for r in range(row * LANES):
            steps[k, r] = z[step.start * row * LANES + r]
        for e in range(sizes.n_elements):
            to = (row + e * width) * LANES
            first_slot = (e * STRIDE + F_START) * LANES
            for r in range(width * LANES):
                steps[k, to + r] = w[first_slot + r]
        for lane in range(LANES):
            steps[k, (own + SEGMENT) * LANES + lane] = segment
            steps[k, (own + BEGIN) * LANES + lane] = step.number / step.n_steps
            steps[k, (own + LENGTH) * LANES + lane] = 1.0 / step.n_steps
        step_count[0] = k + 1
    if per_interval == 1:
        for e in range(sizes.n_elements):
            for k in range(3):
                keep_force(sizes, forces, AT_NODES + k, point, e, w, F0 + k, active)
    _, _, decay, ground_columns, force_columns = layout(sizes[:4], n_sub)
    for i in range(n_sub):
        start = step.start if i == 0 else point + i
        to = point + i + 1
        if per_interval > 1 and (step.number + 1) % per_interval != 0:
            to = step.end
        move_modes(
            n_pad, table, offset + decay, offset + ground_columns,
            offset + force_columns + i * sizes.n_elements * 6 * n_pad, z, start * row, to * row, u,
            i * sizes.n_ground, w, active, sizes.n_elements, sizes.n_ground,
        )  # fmt: skip
        if i + 1 < n_sub:
            for e in range(sizes.n_elements):
                keep_force_inside(sizes, forces, point + i + 1, e, w, (i + 1.0) / n_sub, active)


@inline
def close_step(step, sizes, limits, lanes, forces, w):
    """Forces at an accepted step's end, progress of the lanes, and length of their next step."""
    active, place, level, base = lanes.active, lanes.place, lanes.level, lanes.base
    tried, hold, worst = lanes.tried, lanes.hold, lanes.worst
    if (step.number + 1) % step.per_interval == 0:
        for e in range(sizes.n_elements):
            keep_force(sizes, forces, BEFORE, step.end, e, w, F_START, active)
            keep_force(sizes, forces, AFTER, step.end, e, w, F_START, active)
    if sizes.n_elements > 1:
        share_scale(sizes, w, active)
    for lane in range(LANES):
        if active[lane] == 0:
            continue
        place[lane] = step.at + (step.whole >> step.depth)
        attained = lanes.errors[lane] * (1.0 / limits.error)
        if step.n_steps <= step.n_intervals:
            attained = max(attained, lanes.defects[lane] * (1.0 / limits.defect))
        if step.depth <= base[lane] and lanes.kinks[lane] == 0.0:
            worst[lane] = max(worst[lane], attained)
        # after a rejection coarser steps wait, unless the cause is clearly past
        if tried[lane] > MOST_STEPS:
            level[lane] = base[lane]
        elif hold[lane] == 0 or attained <= 1e-6:
            while level[lane] > base[lane] and attained < 0.02:
                level[lane] -= 1
                attained *= 64.0
        if place[lane] == step.whole:
            lanes.todo[lane] = 0
            if hold[lane] > 0 and worst[lane] > 1e-6:
                hold[lane] -= 1
            elif worst[lane] >= 0.0:
                while level[lane] > 0 and worst[lane] < 0.02:
                    level[lane] -= 1
                    worst[lane] *= 64.0


@inline
def close_segment(position, sizes, time_grid, limits, coils, channel, lanes, w):
    """Status of each lane and coil currents at a segment's end; return whether any is alive."""
    segment = position[SEGMENT_NOW]
    command, driver, coil, applied, _, _ = coils
    g, kind, n_intervals = (
        time_grid.segments[segment, 0],
        time_grid.segments[segment, 1],
        time_grid.segments[segment, 2],
    )
    alive, counts = lanes.alive, lanes.counts
    dead = 0
    for lane in range(LANES):
        if alive[lane] == ALIVE:
            size = 0.0
            for e in range(sizes.n_elements):
                size += abs(w[(e * STRIDE + D_END) * LANES + lane])
            if not size < np.inf:
                alive[lane] = NOT_FINITE
            elif size > limits.deformation[lane]:
                alive[lane] = TOO_LARGE
        if alive[lane] != ALIVE:
            dead += 1
            if counts[ENDED, lane] == 0:
                counts[ENDED, lane] = segment + 1
    stop = g + n_intervals
    for c in range(coil.shape[0]):
        for lane in range(LANES):
            if coil[c, lane] != command[g, c, lane]:
                coil[c, lane] = coil_current(
                    coil[c, lane], command[g, c, lane], driver[c, 0, lane], driver[c, 1, lane],
                    time_grid.spans[kind],
                )  # fmt: skip
                for e in range(sizes.n_elements):
                    if channel[e] == c:
                        applied[e, lane] = np.nan
            command[stop, c, lane] = command[g, c, lane]
    position[SEGMENT_NOW] = segment + 1
    return dead < LANES


@inline
def share_scale(sizes, w, active):
    """Scale of a small element's force: at least 1/20 of the largest force on the structure."""
    for lane in range(LANES):
        if active[lane] == 0:
            continue
        least = np.inf
        for e in range(sizes.n_elements):
            at = e * STRIDE * LANES + lane
            least = min(least, w[at + FORCE_SCALE * LANES] / w[at + TO_STRUCTURE * LANES])
        for e in range(sizes.n_elements):
            at = e * STRIDE * LANES + lane
            most = 20.0 * least * w[at + TO_STRUCTURE * LANES]
            w[at + FORCE_SCALE * LANES] = min(w[at + FORCE_SCALE * LANES], most)


@inline
def coil_current(start, command, lag, slew, t):
    """Coil current a time t after the command was set: rate = clip((command - i)/lag, +-slew)."""
    gap = command - start
    sign = 1.0 if gap > 0.0 else -1.0
    ramp = max(abs(gap) - slew * lag, 0.0) / slew if slew < np.inf else 0.0
    if t < ramp:
        return start + sign * slew * t
    if lag == 0.0:
        return command
    left = gap - sign * slew * ramp if ramp > 0.0 else gap
    return command - left * np.exp((ramp - t) / lag)


@inline
def piece_at(e, lane, current, law_breaks, n_pieces):
    """Piece of a device's current dependence at a current (A)."""
    piece = 0
    while piece < n_pieces - 1 and current >= law_breaks[e, piece + 1, lane]:
        piece += 1
    return piece


@inline
def set_parameters(e, lane, node, current, law_numbers, w):
    """Write a device's parameters at a current (A)."""
    law_table, law_shape, numbers = law_numbers.table, law_numbers.shape, law_numbers.numbers
    n_pieces, n_powers = law_shape[e, 0], law_shape[e, 1]
    n, slot = numbers[e, 0], numbers[e, 1]
    piece = piece_at(e, lane, current, law_numbers.breaks, n_pieces)
    for k in range(n):
        value = 0.0
        for power in range(n_powers - 1, -1, -1):
            value = value * current + law_table[e, piece, k, power, lane]
        at = e * STRIDE + slot + node * n + k
        w[at * LANES + lane] = value


@inline
def move_currents(step, segment, e, time_grid, coils, law_numbers, lanes, w):
    """Parameters at the nodes and the end of a step with a changing current; whether it changes.

    The current has a kink at the end of a slew limit. The parameters have one between two pieces of
    their dependence on the current.
    """
    command, driver, coil, _, moving, _ = coils
    g = time_grid.segments[segment, 0]
    c = law_numbers.channel[e]
    t = step.number * step.length
    h = step.length
    changed = 0
    for lane in range(LANES):
        lanes.going[lane] = 0
        if moving[e, lane] and lanes.active[lane]:
            set_moving_parameters(
                e, lane, t, h, coil[c, lane], command[g, c, lane], driver[c, 0, lane],
                driver[c, 1, lane], law_numbers, w,
            )  # fmt: skip
            lanes.going[lane] = 1
            changed = 1
    return changed > 0


@inner
def set_moving_parameters(e, lane, t, h, coil, command, lag, slew, law_numbers, w):
    """The same of one lane."""
    law_breaks, law_shape = law_numbers.breaks, law_numbers.shape
    n_pieces = law_shape[e, 0]
    current = coil_current(coil, command, lag, slew, t)
    first = piece_at(e, lane, current, law_breaks, n_pieces)
    ramp = (abs(command - coil) - slew * lag) / slew if slew < np.inf else 0.0
    bent = 1.0 if t < ramp < t + h else 0.0
    for node in range(4):
        current = coil_current(coil, command, lag, slew, t + NODES_AND_END[node] * h)
        set_parameters(e, lane, node, current, law_numbers, w)
        if piece_at(e, lane, current, law_breaks, n_pieces) != first:
            bent = 1.0
    w[(e * STRIDE + BENT) * LANES + lane] = bent


@inline
def keep_force(sizes, forces, kind, point, e, w, slot, mask):
    """Record an element's residual force, N, at a grid point."""
    for lane in range(LANES):
        if mask[lane]:
            at = (point * sizes.n_elements + e) * FORCES + kind
            forces[at * LANES + lane] = w[(e * STRIDE + slot) * LANES + lane]


@inline
def keep_force_inside(sizes, forces, point, e, w, tau, mask):
    """The same at a fraction tau of the step, from its polynomial."""
    to = (point * sizes.n_elements + e) * FORCES
    for lane in range(LANES):
        if mask[lane]:
            force = 0.0
            for k in range(3):
                weight = LAGRANGE[k][0] + tau * (LAGRANGE[k][1] + tau * LAGRANGE[k][2])
                force += weight * w[(e * STRIDE + F0 + k) * LANES + lane]
            forces[(to + BEFORE) * LANES + lane] = force
            forces[(to + AFTER) * LANES + lane] = force


@inner
def read_sensors(
    k, g, n_measured, n_channels, n_modes, n_pad, n_elements, n_ground, measure, noise, ground, z,
    z_at, coil, w, measured,
):  # fmt: skip
    """Measurement k: modes, element forces and ground to outputs; noise; then coil currents."""
    for r in range(n_measured):
        for lane in range(LANES):
            total = noise[k, r, lane] if noise.shape[0] > 0 else 0.0
            for m in range(n_modes):
                total += measure[r, m, lane] * z[(z_at + m) * LANES + lane]
                total += measure[r, n_modes + m, lane] * z[(z_at + n_pad + m) * LANES + lane]
            for e in range(n_elements):
                force = w[(e * STRIDE + FORCE_END) * LANES + lane]
                total += measure[r, 2 * n_modes + e, lane] * force
            for i in range(n_ground):
                at = (g * n_ground + i) * LANES + lane
                total += measure[r, 2 * n_modes + n_elements + i, lane] * ground[at]
            measured[k, lane, r] = total
    for c in range(n_channels):
        for lane in range(LANES):
            measured[k, lane, n_measured + c] = coil[c, lane]


@inner
def set_commands(g, target, first, n_channels, clamp, driver, command, coil, alive, counts):
    """The drivers' commands from grid point g on; counts clamped commands."""
    for c in range(n_channels):
        for lane in range(LANES):
            value = target[first, lane, c]
            low, high = driver[c, 2, lane], driver[c, 3, lane]
            if not low <= value <= high:
                counts[CLAMPED, lane] += 1
                if alive[lane] == ALIVE and (clamp == 0 or value != value):
                    alive[lane] = CURRENT_REFUSED
                value = low if value < low else high
            step = driver[c, 4, lane]
            if step > 0.0:
                value = step * np.floor(value / step + 0.5)
                # a limit between two steps; rounding must not move one that is a step
                if value > high + 1e-9 * step:
                    value -= step
                elif value < low - 1e-9 * step:
                    value += step
                value = min(max(value, low), high)
            command[g, c, lane] = value
            if driver[c, 0, lane] == 0.0 and driver[c, 1, lane] == np.inf:
                coil[c, lane] = value


@inline
def call_controllers(k, function, decision_times, measured_for, addresses):
    """Decision k of every lane, by a compiled controller."""
    (
        measured, measured_step, settings, settings_step, memory, memory_step, chosen, chosen_step,
        sizes,
    ) = addresses  # fmt: skip
    for lane in range(LANES):
        call(
            function, decision_times[k],
            measured + (measured_for[k] * LANES + lane) * measured_step,
            settings + lane * settings_step, memory + lane * memory_step,
            chosen + (k * LANES + lane) * chosen_step, sizes,
        )  # fmt: skip
