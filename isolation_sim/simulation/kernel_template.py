"""The compiled time integration; ``kernel.py`` puts the elements' code in front of this text.

Exponential collocation. The linear structure is kept in complex modes and propagated exactly; each
element's force, less that of its reference spring and dashpot (which are part of the linear
structure), is a quadratic through the three Gauss points of a step; device states are collocated
on the same points; both are iterated to a fixed point from the extrapolated last step.

The grid holds the record's samples and the controller's instants. A window is a number of equal
grid intervals during which no command changes; it takes 2**level equal steps, so a step spans
several samples where the response is smooth and a fraction of one where it is not. How far the
force polynomial misses the force at the step's ends decides on the level.

Arrays are flat or end in the lane: LANES runs go through side by side and the compiler turns the
innermost loops into vector instructions. A lane's result does not depend on its neighbours. Names
that are not defined here (LANES, N_ELEMENTS, KIND, STRIDE, SLOT_..., sweep, ...) come from
``kernel.py``.
"""

FINISHED, DECIDE, BUFFER_FULL = range(3)
ALIVE, NO_CONVERGENCE, NOT_FINITE, TOO_LARGE, CURRENT_REFUSED = range(5)
MAX_SWEEPS = 40
HOLD = 8  # windows to wait after a rejected step before a coarser one is tried


@njit(**OPTIONS)
def phi_functions(z, phi):
    """phi[k] = sum_n z**n / (n + k)!, the integrals of exp against powers, for k = 0..3."""
    if abs(z) < 1.0:
        term = 1.0 / 6.0 + 0.0j
        total = term
        for n in range(1, 21):
            term = term * z / (n + 3)
            total += term
        phi[3] = total
        phi[2] = 0.5 + z * phi[3]
        phi[1] = 1.0 + z * phi[2]
        phi[0] = 1.0 + z * phi[1]
    else:
        phi[0] = np.exp(z)
        phi[1] = (phi[0] - 1.0) / z
        phi[2] = (phi[1] - 1.0) / z
        phi[3] = (phi[2] - 0.5) / z


@njit(**OPTIONS)
def powers(eigenvalue, span, h, integral, phi):
    """integral[p] = int_0^span exp(eigenvalue (span - t)) (t / h)**p dt."""
    phi_functions(eigenvalue * span, phi)
    ratio = span / h
    integral[0] = span * phi[1]
    integral[1] = span * ratio * phi[2]
    integral[2] = 2.0 * span * ratio * ratio * phi[3]


@njit(**OPTIONS)
def build_table(h, n_sub, lane, n_modes, n_pad, modes, table, offset, phi, integral):
    """Fill the coefficients of one step length that spans n_sub grid intervals, for one lane.

    modes: [eigenvalues | rows d, v an element | columns a ground direction | columns an element].
    table, from offset, see ``layout``: free rows, ground rows, force rows, decay, ground columns,
    force columns.
    """
    ground_rows, force_rows, decay, ground_columns, force_columns = layout(n_modes, n_pad, n_sub)
    first_ground = n_modes * (1 + 2 * N_ELEMENTS)
    first_force = first_ground + n_modes * N_GROUND
    delta = h / n_sub
    for k in range(ground_rows, decay):
        table[(offset + k) * LANES + lane] = 0.0
    for m in range(n_modes):
        value = modes[m, lane]
        for node in range(4):
            end = h * NODES_AND_END[node]
            powers(value, end, h, integral, phi)
            for rate in range(2):
                r = 3 * rate + node if node < 3 else 6 + rate
                for e in range(N_ELEMENTS):
                    row = modes[n_modes * (1 + 2 * e + rate) + m, lane]
                    at = offset + (e * 2 * n_modes + m) * 8 + r
                    table[at * LANES + lane] = (row * phi[0]).real
                    table[(at + 8 * n_modes) * LANES + lane] = -(row * phi[0]).imag
                    for other in range(N_ELEMENTS):
                        column = row * modes[first_force + n_modes * other + m, lane]
                        for k in range(3):
                            at = offset + force_rows + ((e * N_ELEMENTS + other) * 3 + k) * 8 + r
                            table[at * LANES + lane] += (
                                column * (LAGRANGE[k][0] * integral[0]
                                          + LAGRANGE[k][1] * integral[1]
                                          + LAGRANGE[k][2] * integral[2])
                            ).real
            # the ground is linear in each grid interval that begins before this time
            for i in range(n_sub):
                start = i * delta
                if start >= end:
                    break
                stop = min(start + delta, end)
                powers(value, stop - start, delta, integral, phi)
                decayed = np.exp(value * (end - stop))
                for rate in range(2):
                    r = 3 * rate + node if node < 3 else 6 + rate
                    for e in range(N_ELEMENTS):
                        row = modes[n_modes * (1 + 2 * e + rate) + m, lane] * decayed
                        for g in range(N_GROUND):
                            column = row * modes[first_ground + n_modes * g + m, lane]
                            at = offset + ground_rows + (
                                (e * N_GROUND + g) * (n_sub + 1) + i
                            ) * 8 + r
                            table[at * LANES + lane] += (column * (integral[0] - integral[1])).real
                            table[(at + 8) * LANES + lane] += (column * integral[1]).real
        powers(value, delta, delta, integral, phi)
        table[(offset + decay + m) * LANES + lane] = phi[0].real
        table[(offset + decay + n_pad + m) * LANES + lane] = phi[0].imag
        for g in range(N_GROUND):
            column = modes[first_ground + n_modes * g + m, lane]
            at = offset + ground_columns + 2 * g * 2 * n_pad + m
            for k in range(2):
                weight = column * (integral[1] if k == 1 else integral[0] - integral[1])
                table[(at + k * 2 * n_pad) * LANES + lane] = weight.real
                table[(at + (2 * k + 1) * n_pad) * LANES + lane] = weight.imag
        for i in range(n_sub):
            # the force polynomial's powers of t/h, on the interval from i delta to (i + 1) delta
            a, b = i * delta / h, delta / h
            for e in range(N_ELEMENTS):
                column = modes[first_force + n_modes * e + m, lane]
                for k in range(3):
                    c0, c1, c2 = LAGRANGE[k][0], LAGRANGE[k][1], LAGRANGE[k][2]
                    weight = column * (
                        (c0 + c1 * a + c2 * a * a) * integral[0]
                        + (c1 + 2.0 * c2 * a) * b * integral[1]
                        + c2 * b * b * integral[2]
                    )
                    at = offset + force_columns + ((i * N_ELEMENTS + e) * 3 + k) * 2 * n_pad + m
                    table[at * LANES + lane] = weight.real
                    table[(at + n_pad) * LANES + lane] = weight.imag


@inline
def layout(n_modes, n_pad, n_sub):
    """Offsets of a table's parts: ground rows, force rows, decay, ground columns, force columns."""
    ground_rows = N_ELEMENTS * 2 * n_modes * 8
    force_rows = ground_rows + N_ELEMENTS * N_GROUND * (n_sub + 1) * 8
    decay = force_rows + N_ELEMENTS * N_ELEMENTS * 3 * 8
    ground_columns = decay + 2 * n_pad
    return (ground_rows, force_rows, decay, ground_columns,
            ground_columns + 2 * N_GROUND * 2 * n_pad)


@inline
def solve_step(h, n_sub, tolerance, n_modes, n_pad, table, offset, z, z_at, u, w, active, going,
               previous, contraction, defects, errors):
    """Forces and states at the nodes and the end of one step; z and u are only read.

    z, from z_at, holds the modes at the start (real parts, then imaginary); u the ground at the
    grid points. defects: how far a lane's force polynomial misses the force at the step's ends,
    relative to the peak force; infinite where the iteration did not contract. errors: the guess of
    what that does to the response.
    """
    ground_rows, force_rows, _, _, _ = layout(n_modes, n_pad, n_sub)
    for e in range(N_ELEMENTS):
        free_rows(w, e * STRIDE + SLOT_FREE0, table, offset + e * 16 * n_modes,
                  offset + ground_rows + e * N_GROUND * (n_sub + 1) * 8, z, z_at, n_modes, n_pad,
                  u, n_sub + 1)
    for lane in range(LANES):
        going[lane] = active[lane]
        previous[lane] = 0.0
        defects[lane] = 0.0
        errors[lane] = 0.0
    waiting = 1
    for count in range(MAX_SWEEPS):
        for e in range(N_ELEMENTS):
            base = e * STRIDE
            for lane in range(LANES):
                w[(base + SLOT_CHANGE) * LANES + lane] = 0.0
            if N_ELEMENTS > 1:
                for k in range(8 * LANES):
                    w[(base + SLOT_DN0) * LANES + k] = w[(base + SLOT_FREE0) * LANES + k]
                for other in range(N_ELEMENTS):
                    if other != e:
                        at = offset + force_rows + (e * N_ELEMENTS + other) * 24
                        add_rows(w, base + SLOT_DN0, table, at, w, other * STRIDE + SLOT_F0, 1, 3)
            at = offset + force_rows + (e * N_ELEMENTS + e) * 24
            sweep(e, w, base * LANES, h, table, at * LANES, going)
        waiting = 0
        for lane in range(LANES):
            if going[lane]:
                change = 0.0
                for e in range(N_ELEMENTS):
                    change += w[(e * STRIDE + SLOT_CHANGE) * LANES + lane]
                before = previous[lane]
                previous[lane] = change
                # What a linear convergence leaves: change r / (1 - r) with r = change / before; at
                # the first sweep r is twice the last step's.
                if count == 0:
                    ratio = 2.0 * contraction[lane]
                    done = change * ratio <= tolerance * (1.0 - ratio)
                else:
                    done = change * change <= tolerance * (before - change)
                if done:
                    going[lane] = 0
                    if count > 0:
                        contraction[lane] = change / (before + TINY)
                elif not change < HOPELESS:
                    going[lane] = 0
                    defects[lane] = np.inf
                else:
                    waiting += 1
        if waiting == 0:
            break
    if waiting > 0:
        for lane in range(LANES):
            if going[lane]:
                defects[lane] = np.inf
    for e in range(N_ELEMENTS):
        base = e * STRIDE
        if N_ELEMENTS > 1:
            for k in range(2 * LANES):
                w[(base + SLOT_D_END) * LANES + k] = w[(base + SLOT_FREE6) * LANES + k]
            for other in range(N_ELEMENTS):
                if other == e:
                    continue
                at = offset + force_rows + (e * N_ELEMENTS + other) * 24 + 6
                for k in range(3):
                    for lane in range(LANES):
                        force = w[(other * STRIDE + SLOT_F0 + k) * LANES + lane]
                        for r in range(2):
                            w[(base + SLOT_D_END + r) * LANES + lane] += (
                                table[(at + 8 * k + r) * LANES + lane] * force
                            )
        at = offset + force_rows + (e * N_ELEMENTS + e) * 24
        finish(e, w, base * LANES, h, table, at * LANES, active)
        for lane in range(LANES):
            defects[lane] += w[(base + SLOT_DEFECT) * LANES + lane]
            errors[lane] += w[(base + SLOT_ERROR) * LANES + lane]


@inline
def share_scale(w):
    """Measure a small element's force by a twentieth of the largest on the structure."""
    for lane in range(LANES):
        least = np.inf
        for e in range(N_ELEMENTS):
            at = e * STRIDE * LANES + lane
            least = min(least, w[at + SLOT_FORCE_SCALE * LANES] / w[at + SLOT_TO_STRUCTURE * LANES])
        for e in range(N_ELEMENTS):
            at = e * STRIDE * LANES + lane
            most = 20.0 * least * w[at + SLOT_TO_STRUCTURE * LANES]
            w[at + SLOT_FORCE_SCALE * LANES] = min(w[at + SLOT_FORCE_SCALE * LANES], most)


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
def set_parameters(e, lane, node, current, law_table, law_breaks, n_pieces, n_powers, w):
    """Write a device's parameters at a current (A)."""
    piece = 0
    while piece < n_pieces - 1 and current >= law_breaks[e, piece + 1, lane]:
        piece += 1
    n = N_PARAMETERS[KIND[e]]
    for k in range(n):
        value = 0.0
        for power in range(n_powers - 1, -1, -1):
            value = value * current + law_table[e, piece, k, power, lane]
        at = e * STRIDE + SLOT_PARAMETER[KIND[e]] + node * n + k
        w[at * LANES + lane] = value


@njit(**OPTIONS)
def set_moving_parameters(e, lane, t, h, coil, command, lag, slew, law_table, law_breaks,
                          n_pieces, n_powers, w):
    """Parameters at the three nodes and the end of a step, while the coil current moves."""
    for node in range(4):
        current = coil_current(coil, command, lag, slew, t + NODES_AND_END[node] * h)
        set_parameters(e, lane, node, current, law_table, law_breaks, n_pieces, n_powers, w)


@njit(**OPTIONS)
def change_current(e, c, command, g, coil, applied, law_table, law_breaks, law_shape, w, going,
                   previous):
    """Give an element the coil current that it has from a grid point on; its force may jump."""
    base = e * STRIDE
    for lane in range(LANES):
        going[lane] = 0
        if coil[c, lane] == command[g, c, lane] and coil[c, lane] != applied[e, lane]:
            going[lane] = 1
            previous[lane] = w[(base + SLOT_FORCE_END) * LANES + lane]
            applied[e, lane] = coil[c, lane]
            set_parameters(e, lane, 0, coil[c, lane], law_table, law_breaks,
                           law_shape[e, 0], law_shape[e, 1], w)
    prepare_held(e, w, base * LANES, going)
    probe(e, w, base * LANES, going)
    for lane in range(LANES):
        if going[lane]:
            jump = w[(base + SLOT_FORCE_END) * LANES + lane] - previous[lane]
            for k in range(3):
                w[(base + SLOT_F0 + k) * LANES + lane] += jump
            w[(base + SLOT_F_START) * LANES + lane] += jump


@njit(**OPTIONS)
def read_sensors(k, g, n_measured, n_channels, n_modes, n_pad, measure, noise, ground, z, z_at,
                 coil, w, measured):
    """Measurement k: modes, element forces and ground to outputs; noise; then coil currents."""
    for r in range(n_measured):
        for lane in range(LANES):
            total = noise[k, r, lane] if noise.shape[0] > 0 else 0.0
            for m in range(n_modes):
                total += measure[r, m, lane] * z[(z_at + m) * LANES + lane]
                total += measure[r, n_modes + m, lane] * z[(z_at + n_pad + m) * LANES + lane]
            for e in range(N_ELEMENTS):
                force = w[(e * STRIDE + SLOT_FORCE_END) * LANES + lane]
                total += measure[r, 2 * n_modes + e, lane] * force
            for i in range(N_GROUND):
                at = (g * N_GROUND + i) * LANES + lane
                total += measure[r, 2 * n_modes + N_ELEMENTS + i, lane] * ground[at]
            measured[k, lane, r] = total
    for c in range(n_channels):
        for lane in range(LANES):
            measured[k, lane, n_measured + c] = coil[c, lane]


@njit(**OPTIONS)
def set_commands(g, wanted, first, n_channels, clamp, driver, command, coil, alive, counts):
    """The commands from grid point g on, within the drivers' limits; counts what was clamped."""
    for c in range(n_channels):
        for lane in range(LANES):
            value = wanted[first, lane, c]
            low, high = driver[c, 2, lane], driver[c, 3, lane]
            if not low <= value <= high:
                counts[0, lane] += 1
                if alive[lane] == ALIVE and (clamp == 0 or value != value):
                    alive[lane] = CURRENT_REFUSED
                value = low if value < low else high
            command[g, c, lane] = value
            if driver[c, 0, lane] == 0.0 and driver[c, 1, lane] == np.inf:
                coil[c, lane] = value


@inline
def call_controllers(k, function, decided, measured_for, addresses):
    """Decision k of every lane, by a compiled controller; rows of doubles at given addresses."""
    (measured, measured_step, settings, settings_step, memory, memory_step, chosen, chosen_step,
     sizes) = addresses
    for lane in range(LANES):
        call(
            function, decided[k], measured + (measured_for[k] * LANES + lane) * measured_step,
            settings + lane * settings_step, memory + lane * memory_step,
            chosen + (k * LANES + lane) * chosen_step, sizes,
        )


@njit(cache=True, nogil=True, **OPTIONS)
def march(info, settings, deformation_limit, windows, spans, offsets, ground, events, modes, table,
          built, phi, integral, measure, noise, measured, chosen, decided, measured_for,
          addresses, command, driver, law_table, law_breaks, law_shape, channel, z,
          states, levels, w, w_saved, coil, applied, level, hold, alive, moving, active,
          going, todo, last, previous, contraction, defects, errors, worst, steps,
          step_count, counts, coil_history, u):
    """Integrate until a controller must decide, the step record is full, or the grid ends.

    What each array holds is said in ``workspace.py``. Returns FINISHED, DECIDE or BUFFER_FULL;
    what became of each lane is in ``alive``.
    """
    n_modes, n_pad = info[1], info[2]
    n_channels, n_windows = info[3], info[4]
    n_levels, n_measured = info[6], info[7]
    record_steps, clamp = info[8], info[10]
    sweep_tolerance, error_limit = settings[0], settings[1]
    defect_limit = settings[2]
    row = 2 * n_pad

    while info[0] < n_windows:
        window = info[0]
        g = windows[window, 0]
        kind = windows[window, 1]
        n_intervals = windows[window, 2]
        if window == 0 and info[9] == 0:
            for e in range(N_ELEMENTS):  # forces at rest, under the initial currents
                change_current(e, channel[e], command, g, coil, applied, law_table, law_breaks,
                               law_shape, w, going, previous)
        if info[9] == 0:
            # sensors read before the current changes; then the controller decides
            if events[window, 0] >= 0:
                read_sensors(events[window, 0], g, n_measured, n_channels, n_modes, n_pad,
                             measure, noise, ground, z, g * row, coil, w, measured)
            if events[window, 1] >= 0:
                info[9] = 1
                if info[5] == 0:
                    return DECIDE
                call_controllers(events[window, 1], info[5], decided, measured_for, addresses)
        if info[9] != 2:
            if events[window, 2] >= 0:
                set_commands(g, chosen, events[window, 2], n_channels, clamp, driver, command,
                             coil, alive, counts)
            for e in range(N_ELEMENTS):
                c = channel[e]
                changed = 0
                for lane in range(LANES):
                    moving[e, lane] = 0
                    if coil[c, lane] != command[g, c, lane]:
                        moving[e, lane] = 1
                    elif coil[c, lane] != applied[e, lane]:
                        changed = 1
                if changed:
                    change_current(e, c, command, g, coil, applied, law_table, law_breaks,
                                   law_shape, w, going, previous)
        info[9] = 0
        for c in range(n_channels):
            for lane in range(LANES):
                coil_history[window, c, lane] = coil[c, lane]
        span = spans[kind]
        waiting = 0
        for lane in range(LANES):
            todo[lane] = 1 if alive[lane] == ALIVE else 0
            waiting += todo[lane]
        while waiting > 0:
            depth = n_levels
            for lane in range(LANES):
                if todo[lane]:
                    depth = min(depth, level[lane])
            n_steps = 1 << depth
            if record_steps and step_count[0] + n_steps > steps.shape[0]:
                info[9] = 2  # this window's events are done; the caller makes room
                return BUFFER_FULL
            n_sub = max(n_intervals >> depth, 1)
            per_interval = max(n_steps // n_intervals, 1)
            h = span / n_steps
            offset = offsets[kind, depth]
            _, _, decay, ground_columns, force_columns = layout(n_modes, n_pad, n_sub)
            if built[kind, depth] == 0:
                for lane in range(LANES):
                    build_table(h, n_sub, lane, n_modes, n_pad, modes, table, offset, phi,
                                integral)
                built[kind, depth] = 1
            running = 0
            fresh = 0
            for lane in range(LANES):
                active[lane] = 1 if todo[lane] and level[lane] == depth else 0
                running += active[lane]
                worst[lane] = 0.0
                going[lane] = 1 if active[lane] and last[lane] != h else 0
                fresh += going[lane]
                if going[lane]:
                    contraction[lane] = 1.0
                if active[lane]:
                    last[lane] = h
                    if depth > 0:
                        for r in range(N_ELEMENTS * STRIDE):
                            w_saved[r * LANES + lane] = w[r * LANES + lane]
            if fresh:
                for e in range(N_ELEMENTS):
                    restart(e, w, e * STRIDE * LANES, going)
            mark = step_count[0]
            for step in range(n_steps):
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
                                e, lane, step * h, h, coil[c, lane], command[g, c, lane],
                                driver[c, 0, lane], driver[c, 1, lane], law_table, law_breaks,
                                law_shape[e, 0], law_shape[e, 1], w)
                            going[lane] = 1
                            changed = 1
                    if changed:
                        prepare_moving(e, w, e * STRIDE * LANES, going)
                # within a grid interval the modes go through a scratch row behind the last point
                spare = (windows[n_windows, 0] + 1) * row
                z_at = point * row if per_interval == 1 or step % per_interval == 0 else spare
                solve_step(h, n_sub, sweep_tolerance, n_modes, n_pad, table, offset, z, z_at, u, w,
                           active, going, previous, contraction, defects, errors)
                counts[1, 0] += 1
                for lane in range(LANES):
                    if active[lane] == 0:
                        continue
                    # a step counts by its share of the sample, with some reserve where steps had to
                    # be cut; samples inside a step are read off the polynomial, so that its defect
                    # is their error
                    if per_interval > 1:
                        errors[lane] *= 4.0 / per_interval
                    accepted = errors[lane] <= error_limit and (
                        (n_sub == 1 and defects[lane] < np.inf) or defects[lane] <= defect_limit
                    )
                    if not accepted and depth + 1 == n_levels and defects[lane] < np.inf:
                        counts[4, lane] += 1
                        accepted = True
                    if accepted:
                        worst[lane] = max(worst[lane], max(
                            errors[lane] / error_limit,
                            defects[lane] / defect_limit if n_steps <= n_intervals else 0.0))
                        continue
                    active[lane] = 0
                    running -= 1
                    counts[2, lane] += 1
                    last[lane] = 0.0
                    hold[lane] = HOLD
                    if depth + 1 < n_levels:
                        level[lane] = depth + 1
                    else:
                        alive[lane] = NO_CONVERGENCE
                        todo[lane] = 0
                        waiting -= 1
                    if step > 0:
                        for r in range(N_ELEMENTS * STRIDE):
                            w[r * LANES + lane] = w_saved[r * LANES + lane]
                if running == 0:
                    step_count[0] = mark
                    break
                if record_steps:
                    at = step_count[0]
                    for r in range(row):
                        steps[at, r] = z[z_at + r]
                    for e in range(N_ELEMENTS):
                        for k in range(3 + 4 * N_STATES):
                            steps[at, row + e * (3 + 4 * N_STATES) + k] = (
                                w[e * STRIDE + SLOT_F0 + k]
                            )
                    step_count[0] = at + 1
                for i in range(n_sub):
                    start = z_at if i == 0 else (point + i) * row
                    to = (point + i + 1) * row
                    if per_interval > 1 and (step + 1) % per_interval != 0:
                        to = spare
                    move_modes(n_pad, table, offset + decay, offset + ground_columns,
                               offset + force_columns + i * N_ELEMENTS * 6 * n_pad, z, start, to,
                               u, i * N_GROUND, w, active)
                    if i + 1 < n_sub:
                        for e in range(N_ELEMENTS):
                            inside(e, w, e * STRIDE * LANES, (i + 1.0) / n_sub, states,
                                   ((point + i + 1) * N_ELEMENTS + e) * N_STATES * LANES, active)
                point = g + (step + 1) * n_intervals // n_steps
                if (step + 1) % per_interval != 0:
                    point = windows[n_windows, 0] + 1
                for e in range(N_ELEMENTS):
                    accept(e, w, e * STRIDE * LANES, states,
                           (point * N_ELEMENTS + e) * N_STATES * LANES, active)
                if N_ELEMENTS > 1:
                    share_scale(w)
            for lane in range(LANES):
                if active[lane]:
                    todo[lane] = 0
                    waiting -= 1
                    levels[window, lane] = depth
                    # after a rejection coarser steps wait, unless the cause is clearly past
                    if hold[lane] > 0 and worst[lane] > 1e-6:
                        hold[lane] -= 1
                    else:
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
                    coil[c, lane] = coil_current(coil[c, lane], command[g, c, lane],
                                                 driver[c, 0, lane], driver[c, 1, lane], span)
                    for e in range(N_ELEMENTS):
                        if channel[e] == c:
                            applied[e, lane] = np.nan
                command[stop, c, lane] = command[g, c, lane]
        info[0] = window + 1
        if dead == LANES:
            break
    return FINISHED


@njit(cache=True, nogil=True, **OPTIONS)
def summarise(info, windows, spans, weights, motion_rows, quantity_rows, n_directions, ground, z,
              states, command, coil_history, driver, law_table, law_breaks, law_shape, channel,
              inputs, forces, w, applied, going, peak, total):
    """Peaks and weighted sums of squared quantities over the grid points, lane by lane.

    motion_rows holds the devices' deformations and velocities as blocks of eight rows over the
    modes' real and imaginary parts; quantity_rows the quantities, over device forces and ground
    accelerations too. A quantity is the norm of n_directions consecutive rows. Devices are taken
    as just after any change of current.
    """
    n_modes, n_pad, n_windows = info[1], info[2], info[4]
    n_motion, per_block = -(-2 * N_ELEMENTS // 8), 8 // n_directions
    n_wanted = peak.shape[0] // LANES
    size = 8 * (2 * n_modes + N_ELEMENTS + N_GROUND)
    row = 2 * n_pad
    for e in range(N_ELEMENTS):
        for lane in range(LANES):
            applied[e, lane] = np.nan
    for window in range(n_windows):
        first, n_intervals = windows[window, 0], windows[window, 2]
        span = spans[windows[window, 1]]
        last = n_intervals + 1 if window == n_windows - 1 else n_intervals
        for i in range(last):
            point = first + i
            if weights[point] == 0.0:
                continue
            for block in range(n_motion):
                for k in range(8 * LANES):
                    inputs[block * 8 * LANES + k] = 0.0
                at = block * 16 * n_modes
                add_rows(inputs, 8 * block, motion_rows, at, z, point * row, 1, n_modes)
                add_rows(inputs, 8 * block, motion_rows, at + 8 * n_modes, z, point * row + n_pad,
                         1, n_modes)
            for e in range(N_ELEMENTS):
                c, base = channel[e], e * STRIDE
                changed = 0
                for lane in range(LANES):
                    current = coil_history[window, c, lane]
                    if current != command[first, c, lane]:
                        current = coil_current(current, command[first, c, lane], driver[c, 0, lane],
                                               driver[c, 1, lane], span * i / n_intervals)
                    going[lane] = 0
                    if current != applied[e, lane]:
                        applied[e, lane] = current
                        going[lane] = 1
                        changed = 1
                        set_parameters(e, lane, 0, current, law_table, law_breaks,
                                       law_shape[e, 0], law_shape[e, 1], w)
                if changed:
                    prepare_held(e, w, base * LANES, going)
                for k in range(LANES):
                    w[(base + SLOT_D_END) * LANES + k] = inputs[2 * e * LANES + k]
                    w[(base + SLOT_V_END) * LANES + k] = inputs[(2 * e + 1) * LANES + k]
                at = (point * N_ELEMENTS + e) * N_STATES * LANES
                start = (base + SLOT_START[KIND[e]]) * LANES
                for k in range(N_STATES * LANES):
                    w[start + k] = states[at + k]
                for lane in range(LANES):
                    going[lane] = 1
                probe(e, w, e * STRIDE * LANES, going)
                for lane in range(LANES):
                    forces[e * LANES + lane] = w[(e * STRIDE + SLOT_FORCE_END) * LANES + lane]
            for block in range(-(-n_wanted // per_block)):
                for k in range(8 * LANES):
                    inputs[k] = 0.0
                at = block * size
                add_rows(inputs, 0, quantity_rows, at, z, point * row, 1, n_modes)
                at += 8 * n_modes
                add_rows(inputs, 0, quantity_rows, at, z, point * row + n_pad, 1, n_modes)
                at += 8 * n_modes
                add_rows(inputs, 0, quantity_rows, at, forces, 0, 1, N_ELEMENTS)
                at += 8 * N_ELEMENTS
                add_rows(inputs, 0, quantity_rows, at, ground, point * N_GROUND, 1, N_GROUND)
                number = block * per_block
                n_here = min(per_block, n_wanted - number)
                for direction in range(1, n_directions):
                    for r in range(n_here):
                        for lane in range(LANES):
                            a = inputs[r * n_directions * LANES + lane]
                            b = inputs[(r * n_directions + direction) * LANES + lane]
                            inputs[r * n_directions * LANES + lane] = np.sqrt(a * a + b * b)
                if n_directions > 1:
                    for r in range(n_here):
                        for lane in range(LANES):
                            inputs[r * LANES + lane] = inputs[r * n_directions * LANES + lane]
                weight = weights[point]
                for k in range(n_here * LANES):
                    square = inputs[k] * inputs[k]
                    peak[number * LANES + k] = max(peak[number * LANES + k], square)
                    total[number * LANES + k] += weight * square
