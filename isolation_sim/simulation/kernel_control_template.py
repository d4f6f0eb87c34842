"""Coil currents, device parameters, sensors and decisions.

Part of the compiled kernel; see ``kernel_integration_template.py``.
"""


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
    """Piece of a device's dependence on the current that holds at a current (A)."""
    piece = 0
    while piece < n_pieces - 1 and current >= law_breaks[e, piece + 1, lane]:
        piece += 1
    return piece


@inline
def set_parameters(e, lane, node, current, law_table, law_breaks, n_pieces, n_powers, w):
    """Write a device's parameters at a current (A)."""
    piece = piece_at(e, lane, current, law_breaks, n_pieces)
    n = N_PARAMETERS[KIND[e]]
    for k in range(n):
        value = 0.0
        for power in range(n_powers - 1, -1, -1):
            value = value * current + law_table[e, piece, k, power, lane]
        at = e * STRIDE + SLOT_PARAMETER[KIND[e]] + node * n + k
        w[at * LANES + lane] = value


@inner
def set_moving_parameters(
    e, lane, t, h, coil, command, lag, slew, law_table, law_breaks, n_pieces, n_powers, w
):
    """Parameters at the three nodes and the end of a step, while the coil current moves.

    The current's path bends where a slew limit ends, that of the parameters from one piece of
    their dependence on the current to the next.
    """
    current = coil_current(coil, command, lag, slew, t)
    first = piece_at(e, lane, current, law_breaks, n_pieces)
    ramp = (abs(command - coil) - slew * lag) / slew if slew < np.inf else 0.0
    bent = 1.0 if t < ramp < t + h else 0.0
    for node in range(4):
        current = coil_current(coil, command, lag, slew, t + NODES_AND_END[node] * h)
        set_parameters(e, lane, node, current, law_table, law_breaks, n_pieces, n_powers, w)
        if piece_at(e, lane, current, law_breaks, n_pieces) != first:
            bent = 1.0
    w[(e * STRIDE + SLOT_BENT) * LANES + lane] = bent


@inner
def change_current(e, c, command, g, coil, applied, law_table, law_breaks, law_shape, w, going):
    """Give an element the coil current that it has from a grid point on; its force may jump."""
    base = e * STRIDE
    for lane in range(LANES):
        going[lane] = 0
        if coil[c, lane] == command[g, c, lane] and coil[c, lane] != applied[e, lane]:
            going[lane] = 1
            applied[e, lane] = coil[c, lane]
            set_parameters(
                e,
                lane,
                0,
                coil[c, lane],
                law_table,
                law_breaks,
                law_shape[e, 0],
                law_shape[e, 1],
                w,
            )
    prepare_held(e, w, base * LANES, going)
    probe(e, w, base * LANES, going)
    for direction in range(DIRECTIONS[e]):
        for lane in range(LANES):
            if going[lane]:
                at = (base + direction * STRIDE) * LANES + lane
                begin = w[at + SLOT_FORCE_END * LANES]
                begin -= w[at + SLOT_K_REF * LANES] * w[at + SLOT_D_END * LANES]
                begin -= w[at + SLOT_C_REF * LANES] * w[at + SLOT_V_END * LANES]
                jump = begin - w[at + SLOT_F_START * LANES]
                for k in range(3):
                    w[at + (SLOT_F0 + k) * LANES] += jump
                w[at + SLOT_F_START * LANES] = begin


@inline
def keep_force(forces, kind, point, e, w, slot, mask):
    """Keep an element's force beyond its reference, N, at a grid point."""
    for lane in range(LANES):
        if mask[lane]:
            at = (point * N_ELEMENTS + e) * FORCES + kind
            forces[at * LANES + lane] = w[(e * STRIDE + slot) * LANES + lane]


@inline
def keep_force_inside(forces, point, e, w, tau, mask):
    """The same at a fraction tau of the step, from its polynomial."""
    to = (point * N_ELEMENTS + e) * FORCES
    for lane in range(LANES):
        if mask[lane]:
            force = 0.0
            for k in range(3):
                weight = LAGRANGE[k][0] + tau * (LAGRANGE[k][1] + tau * LAGRANGE[k][2])
                force += weight * w[(e * STRIDE + SLOT_F0 + k) * LANES + lane]
            forces[(to + BEFORE) * LANES + lane] = force
            forces[(to + AFTER) * LANES + lane] = force


@inner
def read_sensors(
    k, g, n_measured, n_channels, n_modes, n_pad, measure, noise, ground, z, z_at, coil, w, measured
):
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


@inner
def set_commands(g, target, first, n_channels, clamp, driver, command, coil, alive, counts):
    """The commands from grid point g on, as the drivers take them; counts what was clamped."""
    for c in range(n_channels):
        for lane in range(LANES):
            value = target[first, lane, c]
            low, high = driver[c, 2, lane], driver[c, 3, lane]
            if not low <= value <= high:
                counts[0, lane] += 1
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
def call_controllers(k, function, decided, measured_for, addresses):
    """Decision k of every lane, by a compiled controller; rows of doubles at given addresses."""
    (
        measured,
        measured_step,
        settings,
        settings_step,
        memory,
        memory_step,
        chosen,
        chosen_step,
        sizes,
    ) = addresses
    for lane in range(LANES):
        call(
            function,
            decided[k],
            measured + (measured_for[k] * LANES + lane) * measured_step,
            settings + lane * settings_step,
            memory + lane * memory_step,
            chosen + (k * LANES + lane) * chosen_step,
            sizes,
        )
