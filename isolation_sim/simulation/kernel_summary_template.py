"""Peaks and mean squares of a finished run.

Part of the compiled kernel; see ``kernel_march_template.py``.
"""


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
