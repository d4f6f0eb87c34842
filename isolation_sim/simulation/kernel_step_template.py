"""One step: forces and states at its nodes and its end, iterated to a fixed point.

Part of the compiled kernel; see ``kernel_integration_template.py``.
"""


@inline
def solve_step(
    h,
    n_sub,
    share,
    tolerance,
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
):
    """Forces and states at the nodes and the end of one step; z and u are only read.

    z, from z_at, holds the modes at the start (real parts, then imaginary); u the ground at the
    grid points. defects: how far a lane's force polynomial misses the force at the step's ends,
    relative to the peak force; infinite where the iteration did not contract. errors: the guess of
    what that does to the response. kinks: whether an element has a kink within the step. share: by
    how much the error of one such step counts.
    """
    n_modes, n_pad = shape[:2]
    ground_rows, force_rows, _, _, _ = layout(shape, n_sub)
    for e in range(N_ELEMENTS):
        free_rows(
            w,
            e * STRIDE + SLOT_FREE0,
            table,
            offset + e * 16 * n_modes,
            offset + ground_rows + e * N_GROUND * (n_sub + 1) * 8,
            z,
            z_at,
            n_modes,
            n_pad,
            u,
            n_sub + 1,
        )
    for lane in range(LANES):
        going[lane] = active[lane]
        previous[lane] = 0.0
        defects[lane] = 0.0
    waiting = 1
    for count in range(MAX_SWEEPS):
        for e in range(N_ELEMENTS):
            base = e * STRIDE
            for lane in range(LANES):
                w[(base + SLOT_CHANGE) * LANES + lane] = 0.0
            if N_ELEMENTS > 1:  # else the free response is all there is, read where it stands
                for direction in range(DIRECTIONS[e]):
                    respond_to_others(e + direction, w, table, offset + force_rows)
            at = offset + force_rows + (e * N_ELEMENTS + e) * 24
            sweep(e, w, base * LANES, h, table, at * TABLE_LANES, going)
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
            for direction in range(DIRECTIONS[e]):
                respond_to_others(e + direction, w, table, offset + force_rows)
        at = offset + force_rows + (e * N_ELEMENTS + e) * 24
        finish(e, w, base * LANES, h, share, table, at * TABLE_LANES, active)
    for lane in range(LANES):
        defect, error, kink = defects[lane], 0.0, 0.0
        for e in range(N_ELEMENTS):
            defect += w[(e * STRIDE + SLOT_DEFECT) * LANES + lane]
            error += w[(e * STRIDE + SLOT_ERROR) * LANES + lane]
            kink = max(kink, w[(e * STRIDE + SLOT_KINK) * LANES + lane])
        defects[lane], errors[lane], kinks[lane] = defect, error, kink


@inline
def share_scale(w, active):
    """Measure a small element's force by a twentieth of the largest on the structure."""
    for lane in range(LANES):
        if active[lane] == 0:
            continue
        least = np.inf
        for e in range(N_ELEMENTS):
            at = e * STRIDE * LANES + lane
            least = min(least, w[at + SLOT_FORCE_SCALE * LANES] / w[at + SLOT_TO_STRUCTURE * LANES])
        for e in range(N_ELEMENTS):
            at = e * STRIDE * LANES + lane
            most = 20.0 * least * w[at + SLOT_TO_STRUCTURE * LANES]
            w[at + SLOT_FORCE_SCALE * LANES] = min(w[at + SLOT_FORCE_SCALE * LANES], most)
