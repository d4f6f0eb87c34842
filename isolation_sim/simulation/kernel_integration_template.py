"""The compiled time integration; ``kernel.py`` puts the elements' code in front of this text.

Exponential collocation. The linear structure is kept in complex modes and propagated exactly; each
element's force, less that of its reference spring and dashpot (which are part of the linear
structure), is a quadratic through the three Gauss points of a step; device states are collocated
on the same points; both are iterated to a fixed point from the extrapolated last step.

The grid holds the record's samples and the controller's instants. A window is a number of equal
grid intervals during which no command changes. A step is a window's 2**level-th part, at a multiple
of its own length: so it spans several samples where the response is smooth and a fraction of one
where it is not, and halving closes in on a kink within the window. How far the force polynomial
misses the force at the step's ends decides on the level.

Arrays are flat or end in the lane: LANES runs go through side by side and the compiler turns the
innermost loops into vector instructions. A lane's result does not depend on its neighbours. Names
that are not defined here (LANES, N_ELEMENTS, KIND, STRIDE, SLOT_..., sweep, ...) come from
``kernel.py``.
"""

FINISHED, DECIDE, BUFFER_FULL = range(3)
WINDOW_NOW, STAGE = range(2)
MEASURE, COMMAND, UNDER_WAY = range(3)
ALIVE, NO_CONVERGENCE, NOT_FINITE, TOO_LARGE, CURRENT_REFUSED = range(5)
MAX_SWEEPS = 40
HOLD = 8  # windows to wait after a rejected step before a coarser one is tried
MOST_STEPS = 4096  # tried in one window; what still misses the tolerance then is counted


@njit(cache=True, nogil=True, **OPTIONS)
def integrate(
    position,
    sizes,
    limits,
    course,
    propagation,
    measurements,
    coils,
    law_numbers,
    lanes,
    history,
    scratch,
):
    """Integrate until a controller must decide, the step record is full, or the grid ends.

    position: the window and the stage within it, where the next call goes on. What the other groups
    hold is said in ``arguments.py``. Returns FINISHED, DECIDE or BUFFER_FULL; what became of each
    lane is in ``lanes.alive``.
    """
    (
        n_modes,
        n_pad,
        _,
        _,
        n_channels,
        n_windows,
        n_levels,
        n_measured,
        controller,
        record_steps,
        clamp,
    ) = sizes
    sweep_tolerance, error_limit, defect_limit, deformation_limit = limits
    windows, spans, events, ground = course
    offsets, modes, table, built, phi, integral = propagation
    measure, noise, measured, chosen, decided, measured_for, addresses = measurements
    command, driver, coil, applied, moving, coil_history = coils
    law_table, law_breaks, law_shape, channel = law_numbers
    (
        level,
        base,
        place,
        tried,
        hold,
        alive,
        active,
        going,
        todo,
        last,
        previous,
        contraction,
        defects,
        errors,
        kinks,
        worst,
        missed,
        counts,
    ) = lanes
    z, states, forces, steps, step_count, cuts, first_step, last_step = history
    w, u = scratch
    per_error, per_defect = 1.0 / error_limit, 1.0 / defect_limit
    shape = sizes[:4]
    row = 2 * n_pad
    whole = 1 << (n_levels - 1)  # a window in the shortest steps
    width = 4 + 4 * N_STATES if record_steps else 4  # numbers of an element in a step's record
    own = row + N_ELEMENTS * width  # behind them a step's own numbers

    while position[WINDOW_NOW] < n_windows:
        window = position[WINDOW_NOW]
        g = windows[window, 0]
        kind = windows[window, 1]
        n_intervals = windows[window, 2]
        if window == 0 and position[STAGE] == MEASURE:
            for e in range(N_ELEMENTS):  # forces at rest, under the initial currents
                change_current(
                    e,
                    channel[e],
                    command,
                    g,
                    coil,
                    applied,
                    law_table,
                    law_breaks,
                    law_shape,
                    w,
                    going,
                )
                keep_force(forces, BEFORE, g, e, w, SLOT_F_START, going)
                keep_force(forces, AFTER, g, e, w, SLOT_F_START, going)
        if position[STAGE] == MEASURE:
            # sensors read before the current changes; then the controller decides
            if events[window, 0] >= 0:
                read_sensors(
                    events[window, 0],
                    g,
                    n_measured,
                    n_channels,
                    n_modes,
                    n_pad,
                    measure,
                    noise,
                    ground,
                    z,
                    g * row,
                    coil,
                    w,
                    measured,
                )
            if events[window, 1] >= 0:
                position[STAGE] = COMMAND
                if controller == 0:
                    return DECIDE
                call_controllers(events[window, 1], controller, decided, measured_for, addresses)
        if position[STAGE] != UNDER_WAY:
            if events[window, 2] >= 0:
                set_commands(
                    g,
                    chosen,
                    events[window, 2],
                    n_channels,
                    clamp,
                    driver,
                    command,
                    coil,
                    alive,
                    counts,
                )
            for e in range(N_ELEMENTS):
                c = channel[e]
                changed = 0
                for lane in range(LANES):
                    moving[e, lane] = 0
                    w[(e * STRIDE + SLOT_BENT) * LANES + lane] = 0.0
                    w[(e * STRIDE + SLOT_WEIGHT) * LANES + lane] = 1.0
                    if coil[c, lane] != command[g, c, lane]:
                        moving[e, lane] = 1
                        w[(e * STRIDE + SLOT_WEIGHT) * LANES + lane] = MOVING_FACTOR
                    elif coil[c, lane] != applied[e, lane]:
                        changed = 1
                if changed:
                    change_current(
                        e,
                        c,
                        command,
                        g,
                        coil,
                        applied,
                        law_table,
                        law_breaks,
                        law_shape,
                        w,
                        going,
                    )
                    keep_force(forces, AFTER, g, e, w, SLOT_F_START, going)
            for c in range(n_channels):
                for lane in range(LANES):
                    coil_history[window, c, lane] = coil[c, lane]
            for lane in range(LANES):
                todo[lane] = 1 if alive[lane] == ALIVE else 0
                place[lane] = 0
                tried[lane] = 0
                base[lane] = level[lane]
                worst[lane] = -1.0
        position[STAGE] = MEASURE
        span = spans[kind]
        waiting = 0
        for lane in range(LANES):
            waiting += todo[lane]
        while waiting > 0:
            if step_count[0] == steps.shape[0]:
                position[STAGE] = UNDER_WAY  # the window is under way; the caller makes room
                return BUFFER_FULL
            # the lanes that are furthest behind, and of these those with the longest step
            at, depth = whole, n_levels
            for lane in range(LANES):
                if todo[lane]:
                    if place[lane] < at:
                        at, depth = place[lane], level[lane]
                    elif place[lane] == at:
                        depth = min(depth, level[lane])
            while at % (whole >> depth) != 0:
                depth += 1
            n_steps = 1 << depth
            step = at // (whole >> depth)
            n_sub = max(n_intervals >> depth, 1)
            per_interval = max(n_steps // n_intervals, 1)
            # a step counts by its share of the sample, with some reserve where steps had to be cut
            share = 4.0 / per_interval if per_interval > 1 else 1.0
            # what the iteration leaves adds up over the steps; rounding ends it
            left = max(sweep_tolerance / per_interval, min(sweep_tolerance, 1e-14))
            h = span / n_steps
            offset = offsets[kind, depth]
            _, _, decay, ground_columns, force_columns = layout(shape, n_sub)
            if built[kind, depth] == 0:
                for lane in range(TABLE_LANES):
                    build_table(h, n_sub, lane, shape, modes, table, offset, phi, integral)
                built[kind, depth] = 1
            running = 0
            fresh = 0
            for lane in range(LANES):
                active[lane] = 0
                if todo[lane] and place[lane] == at and level[lane] <= depth:
                    active[lane] = 1
                    tried[lane] += 1
                running += active[lane]
                going[lane] = 1 if active[lane] and last[lane] != h else 0
                fresh += going[lane]
                if going[lane]:
                    contraction[lane] = 1.0
                if active[lane]:
                    last[lane] = h
            if fresh:
                for e in range(N_ELEMENTS):
                    restart(e, w, e * STRIDE * LANES, going)
            if fresh or step == 0:
                if step == 0:
                    for lane in range(LANES):
                        going[lane] = active[lane]
                for e in range(N_ELEMENTS):
                    relax(e, w, e * STRIDE * LANES, h, going)
            first = step * n_sub if per_interval == 1 else step // per_interval
            point = g + first
            if per_interval == 1:
                for k in range((n_sub + 1) * N_GROUND * LANES):
                    u[k] = ground[point * N_GROUND * LANES + k]
            else:
                a = (step - first * per_interval) / per_interval
                for k in range(N_GROUND * LANES):
                    low = ground[point * N_GROUND * LANES + k]
                    high = ground[(point + 1) * N_GROUND * LANES + k]
                    u[k] = low + (high - low) * a
                    u[N_GROUND * LANES + k] = low + (high - low) * (a + 1.0 / per_interval)
            for e in range(N_ELEMENTS):
                c = channel[e]
                changed = 0
                for lane in range(LANES):
                    going[lane] = 0
                    if moving[e, lane] and active[lane]:
                        set_moving_parameters(
                            e,
                            lane,
                            step * h,
                            h,
                            coil[c, lane],
                            command[g, c, lane],
                            driver[c, 0, lane],
                            driver[c, 1, lane],
                            law_table,
                            law_breaks,
                            law_shape[e, 0],
                            law_shape[e, 1],
                            w,
                        )
                        going[lane] = 1
                        changed = 1
                if changed:
                    prepare_moving(e, w, e * STRIDE * LANES, going)
            # within a grid interval the modes go through a scratch row behind the last point
            spare = (windows[n_windows, 0] + 1) * row
            z_at = point * row if per_interval == 1 or step % per_interval == 0 else spare
            solve_step(
                h,
                n_sub,
                share,
                left,
                shape,
                table,
                offset,
                z,
                z_at,
                u,
                w,
                active,
                going,
                previous,
                contraction,
                defects,
                errors,
                kinks,
            )
            counts[1, 0] += 1
            for lane in range(LANES):
                if active[lane] == 0:
                    continue
                # samples inside a step are read off the polynomial: its defect is their error
                error, defect = errors[lane], defects[lane]
                accepted = error <= error_limit and (
                    (n_sub == 1 and defect < np.inf) or defect <= defect_limit
                )
                if (
                    not accepted
                    and defect < np.inf
                    and (depth + 1 == n_levels or tried[lane] > MOST_STEPS)
                ):
                    counts[4, lane] += 1
                    missed[lane] = max(missed[lane], error)
                    accepted = True
                if not accepted:
                    active[lane] = 0
                    running -= 1
                    counts[2, lane] += 1
                    last[lane] = 0.0
                    if kinks[lane] == 0.0:
                        hold[lane] = HOLD
                        worst[lane] = np.inf
                    if depth + 1 < n_levels and tried[lane] < 2 * MOST_STEPS:
                        level[lane] = depth + 1
                    else:
                        alive[lane] = NO_CONVERGENCE
                        todo[lane] = 0
                        waiting -= 1
            if running == 0:
                continue
            for lane in range(LANES):
                if active[lane] == 0:
                    continue
                if per_interval == 1:
                    for i in range(n_sub):
                        cuts[point + i, lane] = -n_sub
                elif step % per_interval == 0:
                    cuts[point, lane] = 1
                    first_step[point, lane] = step_count[0]
                else:
                    cuts[point, lane] += 1
                    steps[last_step[lane], (own + NEXT) * LANES + lane] = step_count[0]
                last_step[lane] = step_count[0]
            # the peaks inside a sample are looked for in the steps that cut it
            if record_steps or per_interval > 1:
                k = step_count[0]
                for r in range(row * LANES):
                    steps[k, r] = z[z_at * LANES + r]
                for e in range(N_ELEMENTS):
                    to = (row + e * width) * LANES
                    first_slot = (e * STRIDE + SLOT_F_START) * LANES
                    for r in range(width * LANES):
                        steps[k, to + r] = w[first_slot + r]
                for lane in range(LANES):
                    steps[k, (own + WINDOW) * LANES + lane] = window
                    steps[k, (own + BEGIN) * LANES + lane] = step / n_steps
                    steps[k, (own + LENGTH) * LANES + lane] = 1.0 / n_steps
                step_count[0] = k + 1
            if per_interval == 1:
                for e in range(N_ELEMENTS):
                    for k in range(3):
                        keep_force(forces, AT_NODES + k, point, e, w, SLOT_F0 + k, active)
            for i in range(n_sub):
                start = z_at if i == 0 else (point + i) * row
                to = (point + i + 1) * row
                if per_interval > 1 and (step + 1) % per_interval != 0:
                    to = spare
                move_modes(
                    n_pad,
                    table,
                    offset + decay,
                    offset + ground_columns,
                    offset + force_columns + i * N_ELEMENTS * 6 * n_pad,
                    z,
                    start,
                    to,
                    u,
                    i * N_GROUND,
                    w,
                    active,
                )
                if i + 1 < n_sub:
                    for e in range(N_ELEMENTS):
                        inside(
                            e,
                            w,
                            e * STRIDE * LANES,
                            (i + 1.0) / n_sub,
                            states,
                            ((point + i + 1) * N_ELEMENTS + e) * N_STATES * LANES,
                            active,
                        )
                        keep_force_inside(forces, point + i + 1, e, w, (i + 1.0) / n_sub, active)
            point = g + (step + 1) * n_intervals // n_steps
            if (step + 1) % per_interval != 0:
                point = windows[n_windows, 0] + 1
            for e in range(N_ELEMENTS):
                accept(
                    e,
                    w,
                    e * STRIDE * LANES,
                    states,
                    (point * N_ELEMENTS + e) * N_STATES * LANES,
                    active,
                )
            if (step + 1) % per_interval == 0:
                for e in range(N_ELEMENTS):
                    keep_force(forces, BEFORE, point, e, w, SLOT_F_START, active)
                    keep_force(forces, AFTER, point, e, w, SLOT_F_START, active)
            if N_ELEMENTS > 1:
                share_scale(w, active)
            for lane in range(LANES):
                if active[lane] == 0:
                    continue
                place[lane] = at + (whole >> depth)
                attained = errors[lane] * per_error
                if n_steps <= n_intervals:
                    attained = max(attained, defects[lane] * per_defect)
                if depth <= base[lane] and kinks[lane] == 0.0:
                    worst[lane] = max(worst[lane], attained)
                # after a rejection coarser steps wait, unless the cause is clearly past
                if tried[lane] > MOST_STEPS:
                    level[lane] = base[lane]
                elif hold[lane] == 0 or attained <= 1e-6:
                    while level[lane] > base[lane] and attained < 0.02:
                        level[lane] -= 1
                        attained *= 64.0
                if place[lane] == whole:
                    todo[lane] = 0
                    waiting -= 1
                    if hold[lane] > 0 and worst[lane] > 1e-6:
                        hold[lane] -= 1
                    elif worst[lane] >= 0.0:
                        while level[lane] > 0 and worst[lane] < 0.02:
                            level[lane] -= 1
                            worst[lane] *= 64.0

        dead = 0
        for lane in range(LANES):
            if alive[lane] == ALIVE:
                size = 0.0
                for e in range(N_ELEMENTS):
                    size += abs(w[(e * STRIDE + SLOT_D_END) * LANES + lane])
                if not size < np.inf:
                    alive[lane] = NOT_FINITE
                elif size > deformation_limit[lane]:
                    alive[lane] = TOO_LARGE
            if alive[lane] != ALIVE:
                dead += 1
                if counts[3, lane] == 0:
                    counts[3, lane] = window + 1
        stop = g + n_intervals
        for c in range(n_channels):
            for lane in range(LANES):
                if coil[c, lane] != command[g, c, lane]:
                    coil[c, lane] = coil_current(
                        coil[c, lane],
                        command[g, c, lane],
                        driver[c, 0, lane],
                        driver[c, 1, lane],
                        span,
                    )
                    for e in range(N_ELEMENTS):
                        if channel[e] == c:
                            applied[e, lane] = np.nan
                command[stop, c, lane] = command[g, c, lane]
        position[WINDOW_NOW] = window + 1
        if dead == LANES:
            break
    return FINISHED
