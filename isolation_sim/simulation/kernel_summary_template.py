"""Peaks and mean squares of a finished run.

Part of the compiled kernel; see ``kernel_march_template.py``.
"""


@njit(cache=True, nogil=True, **OPTIONS)
def summarise(info, windows, spans, samples, motion_rows, quantity_rows, n_directions, ground, z,
              states, command, coil_history, driver, law_table, law_breaks, law_shape, channel,
              points, inputs, forces, w, applied, moving, going, peak, total):
    """Peaks and trapezoidal means of squared quantities over the samples, lane by lane.

    motion_rows holds the devices' deformations and velocities as blocks of eight rows over the
    modes' real and imaginary parts; quantity_rows the quantities, over device forces and ground
    accelerations too. A quantity is the norm of n_directions consecutive rows. Devices are taken
    as just after any change of current.
    """
    n_modes, n_pad, n_windows = info[1], info[2], info[4]
    per_block = 8 // n_directions
    n_wanted = peak.shape[0] // LANES
    size = 8 * (2 * n_modes + N_ELEMENTS + N_GROUND)
    row = 2 * n_pad
    n_samples = samples.shape[0]
    for e in range(N_ELEMENTS):
        for lane in range(LANES):
            applied[e, lane] = np.nan
    window = 0
    for start in range(0, n_samples, POINTS):
        for p in range(POINTS):
            points[p] = samples[min(start + p, n_samples - 1)]
        for block in range(-(-2 * N_ELEMENTS // 8)):
            motion_at(inputs, block * 8 * POINTS, motion_rows, block * 16 * n_modes, z, points,
                      row, n_modes, n_pad, forces, 0, 0, ground, 0)
        for p in range(POINTS):
            entered = start + p == 0
            while window + 1 < n_windows and windows[window + 1, 0] <= points[p]:
                window += 1
                entered = True
            first, n_intervals = windows[window, 0], windows[window, 2]
            t = spans[windows[window, 1]] * (points[p] - first) / n_intervals
            for e in range(N_ELEMENTS):
                c, base = channel[e], e * STRIDE
                if entered:
                    moving[e, 0] = 0
                    for lane in range(LANES):
                        if coil_history[window, c, lane] != command[first, c, lane]:
                            moving[e, 0] = 1
                if entered or moving[e, 0]:
                    changed = 0
                    for lane in range(LANES):
                        current = coil_history[window, c, lane]
                        if moving[e, 0]:
                            current = coil_current(current, command[first, c, lane],
                                                   driver[c, 0, lane], driver[c, 1, lane], t)
                        going[lane] = 0
                        if current != applied[e, lane]:
                            applied[e, lane] = current
                            going[lane] = 1
                            changed = 1
                            set_parameters(e, lane, 0, current, law_table, law_breaks,
                                           law_shape[e, 0], law_shape[e, 1], w)
                    if changed:
                        prepare_held(e, w, base * LANES, going)
                moved = (2 * e // 8 * POINTS + p) * 8 + 2 * e % 8
                for k in range(LANES):
                    w[(base + SLOT_D_END) * LANES + k] = inputs[moved * LANES + k]
                    w[(base + SLOT_V_END) * LANES + k] = inputs[(moved + 1) * LANES + k]
                at = (points[p] * N_ELEMENTS + e) * N_STATES * LANES
                held = (base + SLOT_START[KIND[e]]) * LANES
                for k in range(N_STATES * LANES):
                    w[held + k] = states[at + k]
                for lane in range(LANES):
                    going[lane] = 1
                probe(e, w, base * LANES, going)
                for lane in range(LANES):
                    forces[(p * N_ELEMENTS + e) * LANES + lane] = (
                        w[(base + SLOT_FORCE_END) * LANES + lane]
                    )
        for block in range(-(-n_wanted // per_block)):
            quantities_at(inputs, 0, quantity_rows, block * size, z, points, row, n_modes, n_pad,
                          forces, N_ELEMENTS, N_ELEMENTS, ground, N_GROUND)
            number = block * per_block
            n_here = min(per_block, n_wanted - number)
            for p in range(min(POINTS, n_samples - start)):
                at = 8 * p * LANES
                if n_directions > 1:
                    for r in range(n_here):
                        for lane in range(LANES):
                            own = at + r * n_directions * LANES + lane
                            square = 0.0
                            for direction in range(n_directions):
                                square += inputs[own + direction * LANES] ** 2
                            inputs[at + r * LANES + lane] = np.sqrt(square)
                weight = 1.0 / (n_samples - 1)
                if start + p == 0 or start + p == n_samples - 1:
                    weight *= 0.5
                for k in range(n_here * LANES):
                    square = inputs[at + k] * inputs[at + k]
                    peak[number * LANES + k] = max(peak[number * LANES + k], square)
                    total[number * LANES + k] += weight * square
