"""Peaks and mean squares of the continuous response of a finished run.

A module of its own: it does not depend on the laws. See ``kernel_integration_template.py``.

Every quantity is evaluated at the grid points, on both sides of a change of current. An interval
between two points is a candidate where the quantity could exceed its peak inside it, by its values
at both ends and the change of slope there. The candidates that are left at the end are evaluated
densely: the modes are propagated exactly under the step's own force polynomial.
"""

CANDIDATES = 128  # kept per lane before they are evaluated
BEND = 0.14  # rise above both ends, over change of slope times interval; a parabola has 1/16
BULGE = 1.25  # largest distance of a force from its chord, over that in the middle
PER_RADIAN = 6.0  # points of a dense evaluation, by the fastest mode
FIRST_LOOK = 5  # every so many points are looked at first, to know about how large the peaks are
NEAR = 0.5  # of its peak: a smaller value does not rise above it inside the next interval
FEWEST_DENSE, MOST_DENSE = 4, 64  # in a grid interval; in a step
STRONGLY_CUT = 8  # steps in a grid interval from which every quantity is a candidate


LEFT, TOP, LAST, QUICK, BOUND, PEAK, TOTAL, SLOPES = range(8)
KINDS = SLOPES + 3


@njit(cache=True, nogil=True, **OPTIONS)
def summarise(sizes, intervals, quantities, history, modes, candidates, scratch, track):
    """Peaks and mean squares over the duration, lane by lane.

    The groups are described in ``arguments.py``. track: numbers of each quantity, namely its value
    at the last point, its largest at the ends of the last interval and of the one before, the size
    of its fast modes, a bound inside the interval before the last, its peak, its mean square and
    its last three slopes.
    """
    n_modes, n_pad = sizes.n_modes, sizes.n_pad
    rows, n_quantities, n_directions, fast, _ = quantities
    lengths, ground = intervals.lengths, intervals.ground
    z, forces = history.z, history.forces
    points, inputs, present = scratch.points, scratch.inputs, scratch.present
    per_block = 8 // n_directions
    n_blocks = -(-n_quantities // per_block)
    size = 8 * (2 * n_modes + N_ELEMENTS + N_GROUND)
    row = 2 * n_pad
    n_points = lengths.shape[0] + 1
    duration = 0.0
    for k in range(n_points - 1):
        duration += lengths[k]
    for start in range(0, n_points, POINTS * FIRST_LOOK):
        gather(points, present, forces, start, FIRST_LOOK, n_points)
        for block in range(n_blocks):
            quantities_at(
                inputs,
                0,
                rows,
                block * size,
                z,
                points,
                row,
                n_modes,
                n_pad,
                present,
                N_ELEMENTS,
                N_ELEMENTS,
                ground,
                N_GROUND,
            )
            n_items = min(per_block, n_quantities - block * per_block)
            for p in range(POINTS):
                take_norms(inputs, p * ROWS, n_items, n_directions)
                look(track, block * KINDS * ROWS, inputs, p * ROWS)
    for start in range(0, n_points, POINTS):
        gather(points, present, forces, start, 1, n_points)
        for block in range(n_blocks):
            quantities_at(
                inputs,
                0,
                rows,
                block * size,
                z,
                points,
                row,
                n_modes,
                n_pad,
                present,
                N_ELEMENTS,
                N_ELEMENTS,
                ground,
                N_GROUND,
            )
            n_items = min(per_block, n_quantities - block * per_block)
            at = block * KINDS * ROWS
            for p in range(min(POINTS, n_points - start)):
                point = start + p
                after = p * ROWS
                before = after
                for e in range(N_ELEMENTS):
                    own = (point * N_ELEMENTS + e) * FORCES * LANES
                    for lane in range(LANES):
                        at_end = forces[own + BEFORE * LANES + lane]
                        if forces[own + AFTER * LANES + lane] != at_end:
                            before = POINTS * ROWS
                if before != after:
                    undo_changes(inputs, after, before, rows, block * size, n_modes, forces, point)
                    take_norms(inputs, before, n_items, n_directions)
                take_norms(inputs, after, n_items, n_directions)
                if point > 0:
                    length = lengths[point - 1]
                    near = follow(
                        track,
                        at,
                        inputs,
                        before,
                        after,
                        point % 3,
                        1.0 / length,
                        0.5 * length / duration,
                    )
                    if fast.shape[0] > 0:
                        add_fast_modes(
                            track, at, block * per_block, n_items, quantities, z, point * row, n_pad
                        )
                    exceeded = False
                    if near > 0 and point > 1:
                        find_bulges(scratch.bulges, point - 2, intervals, history, n_pad)
                        exceeded = bound_inside(
                            track,
                            at,
                            (point - 1) % 3,
                            BEND * lengths[point - 2],
                            rows,
                            block * size,
                            n_items,
                            n_directions,
                            n_modes,
                            scratch.bulges,
                        )
                    if exceeded:
                        for r in range(n_items):
                            for lane in range(LANES):
                                own = at + r * LANES + lane
                                bound = track[own + BOUND * ROWS]
                                if bound > track[own + PEAK * ROWS]:
                                    if candidates.number[lane] == CANDIDATES:
                                        look_inside(
                                            lane,
                                            sizes,
                                            intervals,
                                            quantities,
                                            history,
                                            modes,
                                            candidates,
                                            scratch,
                                            track,
                                        )
                                    add_candidate(
                                        candidates, lane, point - 2, block * per_block + r, bound
                                    )
                else:
                    for k in range(ROWS):
                        track[at + LEFT * ROWS + k] = inputs[after + k]
    chosen = candidates.chosen
    for lane in range(LANES):
        look_inside(lane, sizes, intervals, quantities, history, modes, candidates, scratch, track)
        # nothing is known of the slope behind the last interval
        n_chosen = np.int64(0)  # Numba compiles a function again for an argument that began as a 0
        for item in range(n_quantities):
            own = row_of(item, per_block) * LANES + lane
            if track[own + TOP * ROWS] > NEAR * track[own + PEAK * ROWS]:
                chosen[n_chosen] = item
                n_chosen += 1
        if n_chosen > 0:
            raise_peaks(
                lane,
                n_points - 2,
                n_chosen,
                chosen,
                sizes,
                intervals,
                quantities,
                history,
                modes,
                scratch,
                track,
            )
        for interval in range(n_points - 1):
            if strongly_cut(interval, lane, intervals, history):
                for item in range(n_quantities):
                    chosen[item] = item
                raise_peaks(
                    lane,
                    interval,
                    n_quantities,
                    chosen,
                    sizes,
                    intervals,
                    quantities,
                    history,
                    modes,
                    scratch,
                    track,
                )


@inline
def add_candidate(candidates, lane, interval, item, bound):
    """Keep an interval in which a quantity may exceed its peak."""
    count = candidates.number[lane]
    candidates.place[lane, count, 0] = interval
    candidates.place[lane, count, 1] = item
    candidates.bound[lane, count] = bound
    candidates.number[lane] = count + 1


@inline
def record_layout(steps, n_pad):
    """Numbers of an element in a step's record; where the step's own numbers are."""
    own = steps.shape[1] // LANES - STEP
    return (own - 2 * n_pad) // N_ELEMENTS, own


@inner
def strongly_cut(interval, lane, intervals, history):
    """Whether a grid interval has no step that is longer than an eighth of it."""
    steps, cuts = history.steps, history.cuts
    if cuts[interval, lane] < STRONGLY_CUT:
        return False
    _, own = record_layout(steps, 0)
    own = own * LANES + lane
    n_intervals = intervals.windows[intervals.window_of[interval], 2]
    number = history.first_step[interval, lane]
    for _ in range(cuts[interval, lane]):
        if steps[number, own + LENGTH * LANES] * n_intervals * STRONGLY_CUT > 1.0:
            return False
        number = int(steps[number, own + NEXT * LANES])
    return True


@inline
def gather(points, present, forces, start, stride, n_points):
    """Grid points of the next evaluation and the elements' forces there, after any change."""
    for p in range(POINTS):
        points[p] = min(start + stride * p, n_points - 1)
        for e in range(N_ELEMENTS):
            at = ((points[p] * N_ELEMENTS + e) * FORCES + AFTER) * LANES
            for lane in range(LANES):
                present[(p * N_ELEMENTS + e) * LANES + lane] = forces[at + lane]


@by_lanes
def look(track, at, inputs, after):
    """Raise a block's peaks to its values at a grid point."""
    for k in range(ROWS):
        value = abs(inputs[after + k])
        track[at + PEAK * ROWS + k] = max(track[at + PEAK * ROWS + k], value)


@by_lanes
def follow(track, at, inputs, before, after, turn, inverse, weight):
    """Take a block's values at the end of an interval; whether some are near their peaks."""
    near = 0
    for k in range(ROWS):
        begun, ended = track[at + LEFT * ROWS + k], inputs[before + k]
        track[at + LEFT * ROWS + k] = inputs[after + k]
        track[at + (SLOPES + turn) * ROWS + k] = (ended - begun) * inverse
        last = track[at + TOP * ROWS + k]
        top = max(abs(begun), abs(ended))
        track[at + LAST * ROWS + k] = last
        track[at + TOP * ROWS + k] = top
        peak = max(track[at + PEAK * ROWS + k], top)
        track[at + PEAK * ROWS + k] = peak
        near += 1 if last > NEAR * peak else 0
        square = fused(begun, begun, ended * ended)
        track[at + TOTAL * ROWS + k] = fused(weight, square, track[at + TOTAL * ROWS + k])
    return near


@inner
def bound_inside(track, at, middle, reach, rows, rows_at, n_items, n_directions, n_modes, bulges):
    """Bounds inside the interval before the last one; whether some exceed their peaks.

    What follows the modes is smooth: its change of slope tells. What follows a force directly has
    kinks where the current begins to change: there the force's own course in the interval tells.
    """
    exceeded = 0
    for r in range(n_items):
        for lane in range(LANES):
            k = at + r * LANES + lane
            slope = track[k + (SLOPES + middle) * ROWS]
            before = track[k + (SLOPES + (middle + 2) % 3) * ROWS]
            after = track[k + (SLOPES + (middle + 1) % 3) * ROWS]
            bound = fused(reach, abs(slope - before) + abs(after - slope), track[k + LAST * ROWS])
            for e in range(N_ELEMENTS):
                for direction in range(n_directions):
                    own = rows_at + 8 * (2 * n_modes + e) + r * n_directions + direction
                    weight = abs(rows[own * TABLE_LANES + lane % TABLE_LANES])
                    bound = fused(weight, bulges[e * LANES + lane], bound)
            track[k + BOUND * ROWS] = bound
            exceeded += 1 if bound > track[k + PEAK * ROWS] else 0
    return exceeded > 0


@inner
def find_bulges(bulges, interval, intervals, history, n_pad):
    """How far every force leaves the straight line inside an interval, N in the device's scale."""
    forces, steps, cuts = history.forces, history.steps, history.cuts
    window = intervals.window_of[interval]
    n_intervals = intervals.windows[window, 2]
    within = interval - intervals.windows[window, 0]
    width, own = record_layout(steps, n_pad)
    for lane in range(LANES):
        n_sub = max(-cuts[interval, lane], 1)
        begin = interval - within % n_sub
        for e in range(N_ELEMENTS):
            first = forces[((interval * N_ELEMENTS + e) * FORCES + AFTER) * LANES + lane]
            last = forces[((interval + 1) * N_ELEMENTS + e) * FORCES * LANES + lane]
            most = 0.0
            if cuts[interval, lane] > 1:
                numbers = own * LANES + lane
                number = history.first_step[interval, lane]
                for step in range(cuts[interval, lane]):
                    if step > 0:
                        number = int(steps[number, numbers + NEXT * LANES])
                    force = steps[number, (2 * n_pad + e * width) * LANES + lane]
                    tau = steps[number, numbers + BEGIN * LANES] * n_intervals - within
                    most = max(most, abs(force - first - (last - first) * tau))
            else:
                tau = (within % n_sub + 0.5) / n_sub
                at = (begin * N_ELEMENTS + e) * FORCES + AT_NODES
                middle = 0.0
                for k in range(3):
                    weight = LAGRANGE[k][0] + tau * (LAGRANGE[k][1] + tau * LAGRANGE[k][2])
                    middle += weight * forces[(at + k) * LANES + lane]
                most = abs(middle - 0.5 * (first + last))
            bulges[e * LANES + lane] = BULGE * most


@inner
def undo_changes(inputs, after, before, rows, at, n_modes, forces, point):
    """A block's rows just before the current changed, from those just after it."""
    for r in range(8):
        for lane in range(LANES):
            value = inputs[after + r * LANES + lane]
            for e in range(N_ELEMENTS):
                own = (point * N_ELEMENTS + e) * FORCES * LANES + lane
                change = forces[own + BEFORE * LANES] - forces[own + AFTER * LANES]
                weight = (at + (2 * n_modes + e) * 8 + r) * TABLE_LANES + lane % TABLE_LANES
                value = fused(rows[weight], change, value)
            inputs[before + r * LANES + lane] = value


@inline
def take_norms(inputs, at, n_items, n_directions):
    """Norms over the directions, in place of the first rows."""
    if n_directions > 1:
        for r in range(n_items):
            for lane in range(LANES):
                own = at + r * n_directions * LANES + lane
                square = 0.0
                for direction in range(n_directions):
                    part = inputs[own + direction * LANES]
                    square = fused(part, part, square)
                inputs[at + r * LANES + lane] = np.sqrt(square)


@inner
def add_fast_modes(track, at, first, n_items, quantities, z, z_at, n_pad):
    """Add what the modes that are too fast for the grid could add to the values at the ends."""
    fast, moduli = quantities.fast, quantities.fast_moduli
    for item in range(n_items):
        for lane in range(LANES):
            size = 0.0
            for k in range(fast.shape[0]):
                real = z[(z_at + fast[k]) * LANES + lane]
                imaginary = z[(z_at + n_pad + fast[k]) * LANES + lane]
                weight = moduli[first + item, k, lane % TABLE_LANES]
                size += weight * np.sqrt(real * real + imaginary * imaginary)
            own = at + item * LANES + lane
            track[own + TOP * ROWS] += max(size, track[own + QUICK * ROWS])
            track[own + QUICK * ROWS] = size


@inner
def look_inside(lane, sizes, intervals, quantities, history, modes, candidates, scratch, track):
    """Evaluate a lane's candidates, those of an interval at once, the most promising first."""
    place, bound, number, chosen = candidates
    per_block = 8 // quantities.n_directions
    while True:
        best, most = -1, 1.0
        for k in range(number[lane]):
            own = row_of(place[lane, k, 1], per_block) * LANES + lane
            promise = bound[lane, k] / track[own + PEAK * ROWS]
            if promise > most:
                best, most = k, promise
        if best < 0:
            break
        interval, n_chosen = place[lane, best, 0], np.int64(0)
        for k in range(number[lane]):
            if place[lane, k, 0] == interval:
                item = place[lane, k, 1]
                own = row_of(item, per_block) * LANES + lane
                if bound[lane, k] > track[own + PEAK * ROWS]:
                    chosen[n_chosen] = item
                    n_chosen += 1
                bound[lane, k] = 0.0
        raise_peaks(
            lane,
            interval,
            n_chosen,
            chosen,
            sizes,
            intervals,
            quantities,
            history,
            modes,
            scratch,
            track,
        )
    number[lane] = 0


@inline
def row_of(item, per_block):
    """Place of a quantity's row in track, before its numbers."""
    return item // per_block * KINDS * 8 + item % per_block


@exact
def raise_peaks(
    lane, interval, n_chosen, chosen, sizes, intervals, quantities, history, modes, scratch, track
):
    """Raise the peaks of some quantities by what they reach inside a grid interval, in one lane.

    scratch.dense: a row of numbers each for the modes' states, decay and three integrals against
    powers of time, for the forces' polynomials, for the quantities' last two values, and for which
    length and lane the decay and the integrals are.
    """
    n_modes, n_pad = sizes.n_modes, sizes.n_pad
    windows, window_of, lengths, ground = intervals
    rows, _, n_directions, _, _ = quantities
    z, _, forces, steps, _, cuts, first_step, _ = history
    dense, integral, phi = scratch.dense, scratch.integral, scratch.phi
    own = lane % TABLE_LANES
    per_block = 8 // n_directions
    size = 8 * (2 * n_modes + N_ELEMENTS + N_GROUND)
    window = window_of[interval]
    n_intervals = windows[window, 2]
    n_steps = max(cuts[interval, lane], 1)
    n_sub = max(-cuts[interval, lane], 1)
    within = interval - windows[window, 0]
    first_column = n_modes * (1 + 2 * N_ELEMENTS)
    fastest = 0.0
    for m in range(n_modes):
        fastest = max(fastest, abs(modes[m, own]))
    width, numbers = record_layout(steps, n_pad)
    numbers = numbers * LANES + lane
    number, following = first_step[interval, lane], 0
    begun_at, part = 0.0, 1.0  # where the step begins in the interval, and its share of it
    past = 0.0
    count = 0
    for step in range(n_steps):
        begin = interval - within % n_sub  # where the step begins
        if n_steps > 1:
            begun_at = steps[number, numbers + BEGIN * LANES] * n_intervals - within
            part = steps[number, numbers + LENGTH * LANES] * n_intervals
            if step + 1 < n_steps:
                following = int(steps[number, numbers + NEXT * LANES])
        length = lengths[interval] * part
        n_dense = max(int(np.ceil(FEWEST_DENSE * part)), int(PER_RADIAN * fastest * length) + 1)
        resolved = n_dense <= MOST_DENSE
        n_dense = min(n_dense, MOST_DENSE)
        length = length / n_dense
        known = dense[7, 0].real == length and (TABLE_LANES == 1 or dense[7, 0].imag == lane)
        dense[7, 0] = complex(length, lane)
        for m in range(0 if known else n_modes):
            powers(modes[m, own], length, length, integral, phi)
            dense[1, m] = phi[0]
            for power in range(3):
                dense[2 + power, m] = integral[power]
        share = 1.0 / (n_sub * n_dense)
        tau = (within % n_sub) / n_sub
        for m in range(n_modes):
            if n_steps == 1:
                at = (interval * 2 * n_pad + m) * LANES + lane
                dense[0, m] = complex(z[at], z[at + n_pad * LANES])
            else:
                at = m * LANES + lane
                dense[0, m] = complex(steps[number, at], steps[number, at + n_pad * LANES])
        for e in range(N_ELEMENTS):
            at = (begin * N_ELEMENTS + e) * FORCES * LANES + lane
            end = ((begin + n_sub) * N_ELEMENTS + e) * FORCES * LANES + lane
            ending = forces[end + BEFORE * LANES]
            for k in range(8):
                dense[5, 8 * e + k] = 0.0
            for k in range(5):
                if n_steps > 1:
                    to = (2 * n_pad + e * width) * LANES + lane
                    if k < 4:
                        force = steps[number, to + k * LANES]
                    else:
                        force = ending if step + 1 == n_steps else steps[following, to]
                elif k < 4:
                    force = forces[at + (AFTER + k) * LANES]
                else:
                    force = ending
                for power in range(3):
                    if 0 < k < 4:
                        dense[5, 8 * e + power] += LAGRANGE[k - 1][power] * force
                for power in range(5):
                    dense[5, 8 * e + 3 + power] += THROUGH_ENDS[k][power] * force
        for j in range(n_dense + 1):
            a = tau + j * share
            b = begun_at + part * j / n_dense
            if j > 0 or step == 0:
                for k in range(n_chosen):
                    item = chosen[k]
                    base = item // per_block * size + item % per_block * n_directions
                    square = 0.0
                    for direction in range(n_directions):
                        value = 0.0
                        for m in range(n_modes):
                            at = (base + direction + 8 * m) * TABLE_LANES + own
                            value += rows[at] * dense[0, m].real
                            at += 8 * n_modes * TABLE_LANES
                            value += rows[at] * dense[0, m].imag
                        for e in range(N_ELEMENTS):
                            force = 0.0
                            for power in range(4, -1, -1):
                                force = force * a + dense[5, 8 * e + 3 + power].real
                            at = base + direction + 8 * (2 * n_modes + e)
                            value += rows[at * TABLE_LANES + own] * force
                        for i in range(N_GROUND):
                            low = ground[(interval * N_GROUND + i) * LANES + lane]
                            high = ground[((interval + 1) * N_GROUND + i) * LANES + lane]
                            at = base + direction + 8 * (2 * n_modes + N_ELEMENTS + i)
                            moved = low + (high - low) * b
                            value += rows[at * TABLE_LANES + own] * moved
                        square += value * value
                    value = np.sqrt(square)
                    before, middle = dense[6, item].real, dense[6, item].imag
                    at = row_of(item, per_block) * LANES + PEAK * ROWS + lane
                    # the values at both ends have been counted
                    if count > 0 and (step + 1 < n_steps or j < n_dense):
                        track[at] = max(track[at], value)
                    # the parabola through three points has its top between them
                    if resolved and count >= 2:
                        rise, fall = (middle - before) / past, (value - middle) / length
                        bend = (fall - rise) / (past + length)
                        slope = (rise * length + fall * past) / (past + length)
                        if bend < 0.0 and 2.0 * bend * length <= -slope <= -2.0 * bend * past:
                            track[at] = max(track[at], middle - 0.25 * slope * slope / bend)
                    dense[6, item] = complex(dense[6, item].imag, value)
                count += 1
                past = length
            if j < n_dense:
                for m in range(n_modes):
                    state = dense[1, m] * dense[0, m]
                    for e in range(N_ELEMENTS):
                        c0, c1, c2 = dense[5, 8 * e], dense[5, 8 * e + 1], dense[5, 8 * e + 2]
                        push = (c0 + a * (c1 + a * c2)) * dense[2, m]
                        push += share * (c1 + 2.0 * a * c2) * dense[3, m]
                        push += share * share * c2 * dense[4, m]
                        state += modes[first_column + n_modes * (N_GROUND + e) + m, own] * push
                    for i in range(N_GROUND):
                        low = ground[(interval * N_GROUND + i) * LANES + lane]
                        high = ground[((interval + 1) * N_GROUND + i) * LANES + lane]
                        rise = (high - low) * part / n_dense
                        begun = low + (high - low) * b
                        push = begun * dense[2, m] + rise * dense[3, m]
                        state += modes[first_column + n_modes * i + m, own] * push
                    dense[0, m] = state
        number = following
