"""Peaks and mean squares of the continuous response of a finished run.

Every quantity is evaluated at the grid points, on both sides of a change of current. An interval
between two points is a candidate where the quantity could exceed its peak inside it, by its values
at both ends and the change of slope there. The candidates that are left at the end are evaluated
densely: the modes are propagated exactly under the step's own force polynomial.
"""

import numpy as np
from numba import njit

from ...compilation.options import OPTIONS, exact, exact_inline, inline, inner
from .collocation import LAGRANGE, THROUGH_ENDS
from .operations import fused, make_rows_at, points_at_once
from .shape import LANES, TABLE_LANES
from .slots import AFTER, AT_NODES, BEFORE, BEGIN, FORCES, LENGTH, NEXT, STEP
from .tables import powers

by_lanes = inline if LANES == 1 else inner
POINTS, DENSE = points_at_once(LANES), points_at_once(1)
quantities_at = make_rows_at(LANES, TABLE_LANES)
dense_quantities_at = make_rows_at(1, 1)

CANDIDATES = 128  # kept per lane before they are evaluated
BEND = 0.14  # rise above both ends, over change of slope times interval; a parabola has 1/16
BULGE = 1.25  # largest distance of a force from its chord, over that in the middle
PER_RADIAN = 4.5  # points of a dense evaluation, by the fastest mode
FIRST_LOOK = 16  # every so many points are looked at first, to know about how large the peaks are
NEAR = 0.5  # of its peak: a smaller value does not rise above it inside the next interval
UNREST = 0.25  # of its peak: what fast modes add to a smaller value before it is looked at
FEWEST_DENSE, MOST_DENSE = 4, 64  # in a grid interval; in a step
STRONGLY_CUT = 8  # steps in a grid interval from which every quantity is a candidate
FEWEST_CUTS = 4  # steps in a grid interval in which a force may come and go
CHUNK = 8  # grid points whose quantities are kept at once
PAST = 3  # grid points before them that are still kept: an interval's bound needs two on each side
SLOTS = PAST + CHUNK
ROWS = 8 * LANES

PEAK, TOTAL = range(2)
KINDS = 2


@njit(cache=True, nogil=True, **OPTIONS)
def find_peaks(sizes, intervals, quantities, history, modes, candidates, scratch, dense, track):
    """Peaks and mean squares over the duration, lane by lane.

    The groups are described in ``arguments.py``. track: peak and mean square of each quantity.
    """
    n_modes, n_pad, n_elements, n_ground = sizes[:4]
    rows, n_quantities, n_directions, fast = quantities[:4]
    lengths, ground = intervals.lengths, intervals.ground
    z, forces = history.z, history.forces
    points, present, values, changed, near, bulges, margins, bounds = scratch[:8]
    swings, loudness, unrest = scratch[8:]
    per_block, n_blocks = 8 // n_directions, blocks_of(quantities)
    size = 8 * (2 * n_modes + n_elements + n_ground)
    n_points = lengths.shape[0] + 1
    duration = 0.0
    for k in range(n_points - 1):
        duration += lengths[k]
    for start in range(0, n_points, POINTS * FIRST_LOOK):
        gather(points, present, forces, n_elements, start, FIRST_LOOK, n_points)
        for block in range(n_blocks):
            to = block * 2 * SLOTS + PAST
            quantities_at(
                values, to * 8, rows, block * size, z, points, 2 * n_pad, n_modes, n_pad, present,
                n_elements, n_elements, ground, n_ground,
            )  # fmt: skip
            n_items = min(per_block, n_quantities - block * per_block)
            for p in range(POINTS):
                at = (to + p) * ROWS
                take_norms(values, at, n_items, n_directions)
                look(track, block * KINDS * ROWS, values, at, at, 0.0, 0.0)
    find_loudness(loudness, quantities, track)
    # one point more: the motion is mirrored at its end, where nothing is known of the next slope
    for start in range(0, n_points + 1, CHUNK):
        for first in range(0, CHUNK, POINTS):
            gather(points, present, forces, n_elements, start + first, 1, n_points)
            for p in range(POINTS):
                point = start + first + p
                changed[PAST + first + p] = 0 < point < n_points and changes(
                    forces, n_elements, point
                )
            for block in range(n_blocks):
                to = block * 2 * SLOTS + PAST + first
                quantities_at(
                    values, to * 8, rows, block * size, z, points, 2 * n_pad, n_modes, n_pad,
                    present, n_elements, n_elements, ground, n_ground,
                )  # fmt: skip
                n_items = min(per_block, n_quantities - block * per_block)
                for p in range(POINTS):
                    after = (to + p) * ROWS
                    if changed[PAST + first + p]:
                        before = after + SLOTS * ROWS
                        undo_changes(
                            values, after, before, rows, block * size, sizes, forces, points[p],
                        )  # fmt: skip
                        take_norms(values, before, n_items, n_directions)
                    take_norms(values, after, n_items, n_directions)
        if fast.shape[0] > 0:
            for slot in range(PAST, PAST + min(CHUNK, n_points + 1 - start)):
                interval = start + slot - PAST - 2
                if interval >= 0:
                    find_swings(
                        swings[slot], unrest[slot], loudness, interval, sizes, intervals,
                        quantities, history,
                    )  # fmt: skip
        for block in range(n_blocks):
            at = block * KINDS * ROWS
            to = block * 2 * SLOTS
            n_items = min(per_block, n_quantities - block * per_block)
            for slot in range(PAST, PAST + min(CHUNK, n_points + 1 - start)):
                point = start + slot - PAST
                if point < n_points:
                    left = 0.5 * lengths[point - 1] / duration if point > 0 else 0.0
                    right = 0.5 * lengths[point] / duration if point + 1 < n_points else 0.0
                    after = (to + slot) * ROWS
                    before = after + SLOTS * ROWS * changed[slot]
                    near[block, slot] = look(track, at, values, before, after, left, right)
                if point < 2:
                    continue
                if near[block, slot - 2] + near[block, slot - 1] + restless(unrest[slot]) > 0:
                    interval = point - 2
                    begun = (to + slot - 2) * ROWS
                    ended = (to + slot - 1 + SLOTS * changed[slot - 1]) * ROWS
                    find_bulges(
                        bulges, interval, intervals, history, sizes, values, begun, ended, track, at
                    )
                    find_margins(margins, block, n_items, sizes, quantities, bulges, swings[slot])
                    next_length = lengths[min(point, n_points - 1) - 1]
                    exceeded = bound_inside(
                        bounds, values, (to + slot - 3) * ROWS, (to + slot - 2) * ROWS,
                        (to + slot - 1) * ROWS, (to + slot) * ROWS,
                        SLOTS * ROWS * changed[slot - 2], SLOTS * ROWS * changed[slot - 1],
                        SLOTS * ROWS * changed[slot], 1.0 / lengths[max(interval, 1) - 1],
                        1.0 / lengths[interval], 1.0 / next_length, BEND * lengths[interval],
                        margins, track, at,
                    )  # fmt: skip
                    if exceeded > 0:
                        for k in range(n_items * LANES):
                            lane = k % LANES
                            peak = track[at + PEAK * ROWS + k]
                            top = max(abs(values[begun + k]), abs(values[ended + k]))
                            high = top > NEAR * peak or unrest[slot, lane] > UNREST
                            if high and bounds[k] > peak:
                                if candidates.number[lane] == CANDIDATES:
                                    look_inside(
                                        lane, sizes, intervals, quantities, history, modes,
                                        candidates, dense, track,
                                    )  # fmt: skip
                                add_candidate(
                                    candidates, lane, interval, block * per_block + k // LANES,
                                    bounds[k],
                                )  # fmt: skip
            for slot in range(PAST):
                for side in range(2):
                    if side == 0 or changed[slot + CHUNK]:
                        first = (to + slot + SLOTS * side) * ROWS
                        for k in range(ROWS):
                            values[first + k] = values[first + CHUNK * ROWS + k]
                near[block, slot] = near[block, slot + CHUNK]
        for slot in range(PAST):
            changed[slot] = changed[slot + CHUNK]
    # Numba compiles a function once more for an argument that is, or begins as, a constant
    for lane in range(LANES):
        look_inside(
            np.int64(lane), sizes, intervals, quantities, history, modes, candidates, dense, track
        )
    for interval in range(n_points - 1):
        for lane in range(LANES):
            if strongly_cut(interval, lane, intervals, history) or comes_and_goes(
                interval, lane, sizes, intervals, history
            ):
                for item in range(n_quantities):
                    candidates.chosen[item] = item
                raise_peaks(
                    np.int64(lane), interval, n_quantities, candidates.chosen, sizes, intervals,
                    quantities, history, modes, dense, track,
                )  # fmt: skip


@inline
def add_candidate(candidates, lane, interval, item, bound):
    """Keep an interval in which a quantity may exceed its peak."""
    count = candidates.number[lane]
    candidates.place[lane, count, 0] = interval
    candidates.place[lane, count, 1] = item
    candidates.bound[lane, count] = bound
    candidates.number[lane] = count + 1


@inline
def record_layout(steps, n_pad, n_elements):
    """Numbers of an element in a step's record; where the step's own numbers are."""
    own = steps.shape[1] // LANES - STEP
    return (own - 2 * n_pad) // n_elements, own


@inner
def strongly_cut(interval, lane, intervals, history):
    """Whether a grid interval has no step that is longer than an eighth of it."""
    steps, cuts = history.steps, history.cuts
    if cuts[interval, lane] < STRONGLY_CUT:
        return False
    own = steps.shape[1] // LANES - STEP
    own = own * LANES + lane
    n_intervals = intervals.segments[intervals.segment_of[interval], 2]
    number = history.first_step[interval, lane]
    for _ in range(cuts[interval, lane]):
        if steps[number, own + LENGTH * LANES] * n_intervals * STRONGLY_CUT > 1.0:
            return False
        number = int(steps[number, own + NEXT * LANES])
    return True


@inner
def comes_and_goes(interval, lane, sizes, intervals, history):
    """Whether a force inside a grid interval is above those at both ends, as at an impact."""
    n_elements, forces = sizes.n_elements, history.forces
    steps, cuts = history.steps, history.cuts
    if cuts[interval, lane] < FEWEST_CUTS:
        return False
    width, own = record_layout(steps, sizes.n_pad, n_elements)
    for e in range(n_elements):
        at = (interval * n_elements + e) * FORCES
        first = abs(forces[(at + AFTER) * LANES + lane])
        last = abs(forces[(at + n_elements * FORCES + BEFORE) * LANES + lane])
        number = history.first_step[interval, lane]
        for _ in range(cuts[interval, lane] - 1):
            number = int(steps[number, (own + NEXT) * LANES + lane])
            force = abs(steps[number, (2 * sizes.n_pad + e * width) * LANES + lane])
            if force > 2.0 * max(first, last):
                return True
    return False


@inline
def gather(points, present, forces, n_elements, start, stride, n_points):
    """Grid points of the next evaluation and the elements' forces there, after any change."""
    for p in range(POINTS):
        point = start + stride * p
        points[p] = max(min(point, 2 * (n_points - 1) - point), 0)
        for e in range(n_elements):
            at = ((points[p] * n_elements + e) * FORCES + AFTER) * LANES
            for lane in range(LANES):
                present[(p * n_elements + e) * LANES + lane] = forces[at + lane]


@inline
def changes(forces, n_elements, point):
    """Whether a current, and with it a force, changes at a grid point in some lane."""
    count = 0
    for e in range(n_elements):
        at = (point * n_elements + e) * FORCES * LANES
        for lane in range(LANES):
            at_end = forces[at + BEFORE * LANES + lane]
            count += 1 if forces[at + AFTER * LANES + lane] != at_end else 0
    return count > 0


@by_lanes
def look(track, at, values, before, after, left, right):
    """Count a block's values at a grid point; how many are near their peaks."""
    near = 0
    for k in range(ROWS):
        ended, begun = values[before + k], values[after + k]
        total = fused(left, ended * ended, track[at + TOTAL * ROWS + k])
        track[at + TOTAL * ROWS + k] = fused(right, begun * begun, total)
        value = max(abs(ended), abs(begun))
        peak = max(track[at + PEAK * ROWS + k], value)
        track[at + PEAK * ROWS + k] = peak
        near += 1 if value > NEAR * peak else 0
    return near


@by_lanes
def bound_inside(
    bounds, values, at0, at1, at2, at3, before1, before2, before3, inverse0, inverse1, inverse2,
    reach, margins, track, at,
):  # fmt: skip
    """Bounds between the second and third of four grid points; number above their peaks.

    The part from the modes is smooth: its bound follows from the change of slope. ``margins`` are
    for the other parts.
    """
    exceeded = 0
    for k in range(ROWS):
        begun, ended = values[at1 + k], values[at2 + before2 + k]
        change0 = values[at1 + before1 + k] - values[at0 + k]
        change1 = ended - begun
        change2 = values[at3 + before3 + k] - values[at2 + k]
        bend = abs(fused(change1, inverse1, -(change0 * inverse0)))
        bend += abs(fused(change2, inverse2, -(change1 * inverse1)))
        bound = fused(reach, bend, max(abs(begun), abs(ended)) + margins[k])
        bounds[k] = bound
        exceeded += 1 if bound > track[at + PEAK * ROWS + k] else 0
    return exceeded


@inner
def find_bulges(bulges, interval, intervals, history, sizes, values, begun, ended, track, at_block):
    """Largest distance of every force from its chord inside an interval, N, device scale."""
    n_pad, n_elements = sizes.n_pad, sizes.n_elements
    forces, steps, cuts = history.forces, history.steps, history.cuts
    segment = intervals.segment_of[interval]
    n_intervals = intervals.segments[segment, 2]
    within = interval - intervals.segments[segment, 0]
    width, own = record_layout(steps, n_pad, n_elements)
    for e in range(n_elements):
        for lane in range(LANES):
            n_sub = max(-cuts[interval, lane], 1)
            past = within & (n_sub - 1)  # of the step, which spans a power of two of intervals
            first = forces[((interval * n_elements + e) * FORCES + AFTER) * LANES + lane]
            last = forces[((interval + 1) * n_elements + e) * FORCES * LANES + lane]
            tau = (past + 0.5) / n_sub
            at = ((interval - past) * n_elements + e) * FORCES + AT_NODES
            middle = 0.0
            for k in range(3):
                weight = fused(tau, fused(tau, LAGRANGE[k][2], LAGRANGE[k][1]), LAGRANGE[k][0])
                middle = fused(weight, forces[(at + k) * LANES + lane], middle)
            bulges[e * LANES + lane] = BULGE * abs(fused(-0.5, first + last, middle))
    for lane in range(LANES):
        if cuts[interval, lane] > 1 and near_in(lane, values, begun, ended, track, at_block):
            for e in range(n_elements):
                first = forces[((interval * n_elements + e) * FORCES + AFTER) * LANES + lane]
                last = forces[((interval + 1) * n_elements + e) * FORCES * LANES + lane]
                most = 0.0
                number = history.first_step[interval, lane]
                for step in range(cuts[interval, lane]):
                    if step > 0:
                        number = int(steps[number, (own + NEXT) * LANES + lane])
                    force = steps[number, (2 * n_pad + e * width) * LANES + lane]
                    tau = steps[number, (own + BEGIN) * LANES + lane] * n_intervals - within
                    most = max(most, abs(fused(last - first, -tau, force - first)))
                bulges[e * LANES + lane] = BULGE * most


@inline
def near_in(lane, values, begun, ended, track, at):
    """Whether some quantity of a block is near its peak at an end of an interval, in one lane."""
    count = 0
    for k in range(lane, ROWS, LANES):
        top = max(abs(values[begun + k]), abs(values[ended + k]))
        count += 1 if top > NEAR * track[at + PEAK * ROWS + k] else 0
    return count > 0


@exact
def find_swings(swings, unrest, loudness, interval, sizes, intervals, quantities, history):
    """Amplitude of every fast mode inside an interval about its quasi-static response.

    Ground motion and forces that are linear in time do not excite this amplitude.
    """
    _, n_pad, n_elements, n_ground = sizes[:4]
    fast, follows = quantities.fast, quantities.follows
    ground, z, forces = intervals.ground, history.z, history.forces
    inverse = 1.0 / intervals.lengths[interval]
    for lane in range(LANES):
        own = lane % TABLE_LANES
        total = 0.0
        for k in range(fast.shape[0]):
            at = (interval * 2 * n_pad + fast[k]) * LANES + lane
            swing = complex(z[at], z[at + n_pad * LANES])
            for i in range(n_ground):
                at = (interval * n_ground + i) * LANES + lane
                begun, ended = ground[at], ground[at + n_ground * LANES]
                swing += follows[0, i, k, own] * begun
                swing += follows[1, i, k, own] * ((ended - begun) * inverse)
            for e in range(n_elements):
                at = (interval * n_elements + e) * FORCES
                begun = forces[(at + AFTER) * LANES + lane]
                ended = forces[(at + n_elements * FORCES + BEFORE) * LANES + lane]
                swing += follows[0, n_ground + e, k, own] * begun
                swing += follows[1, n_ground + e, k, own] * ((ended - begun) * inverse)
            swings[k, lane] = abs(swing)
            total += loudness[k, lane] * swings[k, lane]
        unrest[lane] = total


@inner
def find_loudness(loudness, quantities, track):
    """Largest effect of a fast mode on any quantity, over the present peak."""
    moduli, n_directions = quantities.fast_moduli, quantities.n_directions
    for k in range(quantities.fast.shape[0]):
        for lane in range(LANES):
            loudest = 0.0
            for item in range(quantities.n_quantities):
                share = 2.0 * moduli[item, k, lane % TABLE_LANES]
                peak = track[row_of(item, 8 // n_directions) * LANES + PEAK * ROWS + lane]
                if share > 0.0:
                    loudest = max(loudest, share / peak)
            loudness[k, lane] = loudest


@inline
def restless(unrest):
    """Number of lanes in which fast modes may raise a small value to a peak."""
    count = 0
    for lane in range(LANES):
        count += 1 if unrest[lane] > UNREST else 0
    return count


@inner
def find_margins(margins, block, n_items, sizes, quantities, bulges, swings):
    """Bounds for the effect of curved forces and fast modes on a block's values.

    Quantities that depend directly on a force have kinks at the start of a change of current. Modes
    too fast for the grid add their amplitude in both directions.
    """
    rows, n_directions, fast = quantities.rows, quantities.n_directions, quantities.fast
    moduli, forced = quantities.fast_moduli, quantities.fast_forced
    n_modes, _, n_elements, n_ground = sizes[:4]
    at = 8 * (block * (2 * n_modes + n_elements + n_ground) + 2 * n_modes)
    first = block * (8 // n_directions)
    for item in range(n_items):
        own = item * LANES
        for lane in range(LANES):
            margins[own + lane] = 0.0
        for e in range(n_elements):
            for direction in range(n_directions):
                weight = (at + 8 * e + item * n_directions + direction) * TABLE_LANES
                for lane in range(LANES):
                    share = abs(rows[weight + lane % TABLE_LANES])
                    bulge = bulges[e * LANES + lane]
                    margins[own + lane] = fused(share, bulge, margins[own + lane])
        if fast.shape[0] > 0:
            for lane in range(LANES):
                for k in range(fast.shape[0]):
                    share = 2.0 * moduli[first + item, k, lane % TABLE_LANES]
                    margins[own + lane] = fused(share, swings[k, lane], margins[own + lane])
                for e in range(n_elements):
                    share = forced[first + item, e, lane % TABLE_LANES]
                    bulge = bulges[e * LANES + lane]
                    margins[own + lane] = fused(share, bulge, margins[own + lane])


@inner
def undo_changes(values, after, before, rows, at, sizes, forces, point):
    """A block's rows just before the current changed, from those just after it."""
    n_modes, n_elements = sizes.n_modes, sizes.n_elements
    for r in range(8):
        for lane in range(LANES):
            value = values[after + r * LANES + lane]
            for e in range(n_elements):
                own = (point * n_elements + e) * FORCES * LANES + lane
                change = forces[own + BEFORE * LANES] - forces[own + AFTER * LANES]
                weight = (at + (2 * n_modes + e) * 8 + r) * TABLE_LANES + lane % TABLE_LANES
                value = fused(rows[weight], change, value)
            values[before + r * LANES + lane] = value


@inline
def take_norms(values, at, n_items, n_directions):
    """Norms over the directions, in place of the first rows."""
    if n_directions > 1:
        for r in range(n_items):
            for lane in range(LANES):
                own = at + r * n_directions * LANES + lane
                square = 0.0
                for direction in range(n_directions):
                    part = values[own + direction * LANES]
                    square = fused(part, part, square)
                values[at + r * LANES + lane] = np.sqrt(square)


@inner
def look_inside(lane, sizes, intervals, quantities, history, modes, candidates, dense, track):
    """Evaluate a lane's candidates by interval, the largest bounds first."""
    place, bound, number, chosen = candidates
    per_block = 8 // quantities.n_directions
    while True:
        best, most, left = -1, 1.0, 0
        for k in range(number[lane]):
            item = place[lane, k, 1]
            own = row_of(item, per_block) * LANES + lane
            promise = bound[lane, k] / track[own + PEAK * ROWS]
            if promise > 1.0:
                place[lane, left, 0], place[lane, left, 1] = place[lane, k, 0], item
                bound[lane, left] = bound[lane, k]
                if promise > most:
                    best, most = left, promise
                left += 1
        number[lane] = left
        if best < 0:
            break
        interval = place[lane, best, 0]
        n_chosen = np.int64(0)
        for k in range(number[lane]):
            if place[lane, k, 0] == interval:
                chosen[n_chosen] = place[lane, k, 1]
                n_chosen += 1
                bound[lane, k] = 0.0  # dropped in the next pass
        raise_peaks(
            lane, interval, n_chosen, chosen, sizes, intervals, quantities, history, modes, dense,
            track,
        )  # fmt: skip
    number[lane] = 0


@inline
def row_of(item, per_block):
    """Place of a quantity's row in track, before its numbers."""
    return item // per_block * KINDS * 8 + item % per_block


@inline
def blocks_of(quantities):
    """Number of blocks of eight rows that all quantities take."""
    return -(-quantities.n_quantities // (8 // quantities.n_directions))


@exact
def raise_peaks(
    lane, interval, n_chosen, chosen, sizes, intervals, quantities, history, modes, dense, track
):
    """Update the peaks of some quantities inside a grid interval, in one lane."""
    steps, cuts = history.steps, history.cuts
    segment = intervals.segment_of[interval]
    n_intervals = intervals.segments[segment, 2]
    n_steps = max(cuts[interval, lane], 1)
    n_sub = max(-cuts[interval, lane], 1)
    within = interval - intervals.segments[segment, 0]
    fastest = 0.0
    for m in range(sizes.n_modes):
        value = modes[m, lane % TABLE_LANES]
        fastest = max(fastest, value.real * value.real + value.imag * value.imag)
    fastest = np.sqrt(fastest)
    _, own = record_layout(steps, sizes.n_pad, sizes.n_elements)
    number, following = history.first_step[interval, lane], 0
    begun_at, part = 0.0, 1.0  # where the step begins in the interval, and its share of it
    past = 1.0  # distance between the instants before this step
    counted = np.int64(0)
    for step in range(n_steps):
        is_last = step + 1 == n_steps
        begin = interval - within % n_sub  # where the step begins
        if n_steps > 1:
            begun_at = steps[number, (own + BEGIN) * LANES + lane] * n_intervals - within
            part = steps[number, (own + LENGTH) * LANES + lane] * n_intervals
            if not is_last:
                following = int(steps[number, (own + NEXT) * LANES + lane])
        length = intervals.lengths[interval] * part
        n_dense = max(int(np.ceil(FEWEST_DENSE * part)), int(PER_RADIAN * fastest * length) + 1)
        resolved = n_dense <= MOST_DENSE
        n_dense = min(n_dense, MOST_DENSE)
        length = length / n_dense
        set_weights(length, lane % TABLE_LANES, sizes, modes, dense)
        share = 1.0 / (n_sub * n_dense)
        tau = (within % n_sub) / n_sub
        if n_steps == 1:
            begin_step(lane, interval, begin, n_sub, sizes, history, dense)
        else:
            begin_cut(lane, begin, n_sub, number, following, is_last, sizes, history, dense)
        for first in range(0, n_dense + 1, DENSE):
            n_here = min(DENSE, n_dense + 1 - first)
            for p in range(n_here):
                a = tau + (first + p) * share
                b = begun_at + part * (first + p) / n_dense
                put_instant(lane, p, interval, a, b, sizes, intervals, dense)
                if first + p < n_dense:
                    rise = part / n_dense
                    advance(lane, interval, a, share, b, rise, sizes, intervals, dense)
            raise_by_instants(
                lane, n_chosen, chosen, first, n_here, counted,
                n_dense if is_last else n_dense + 1, length, past if resolved else 0.0, sizes,
                quantities, dense, track,
            )  # fmt: skip
        past = length
        counted += n_dense
        number = following


@exact_inline
def begin_step(lane, interval, begin, n_sub, sizes, history, dense):
    """Modes at an interval's start, and the force polynomials of the step that spans it."""
    n_pad, n_elements, z, forces = sizes.n_pad, sizes.n_elements, history.z, history.forces
    for m in range(sizes.n_modes):
        at = (interval * 2 * n_pad + m) * LANES + lane
        dense.state[m] = complex(z[at], z[at + n_pad * LANES])
    for e in range(n_elements):
        at = (begin * n_elements + e) * FORCES * LANES + lane
        end = ((begin + n_sub) * n_elements + e) * FORCES * LANES + lane
        for k in range(5):
            own = at + (AFTER + k) * LANES if k < 4 else end + BEFORE * LANES
            add_force(dense.polynomials, e, k, forces[own])


@exact_inline
def begin_cut(lane, begin, n_sub, number, following, is_last, sizes, history, dense):
    """The same at the start of one of several steps in the interval."""
    n_pad, n_elements = sizes.n_pad, sizes.n_elements
    steps, forces = history.steps, history.forces
    width, _ = record_layout(steps, n_pad, n_elements)
    for m in range(sizes.n_modes):
        at = m * LANES + lane
        dense.state[m] = complex(steps[number, at], steps[number, at + n_pad * LANES])
    for e in range(n_elements):
        to = (2 * n_pad + e * width) * LANES + lane
        end = ((begin + n_sub) * n_elements + e) * FORCES * LANES + lane
        ending = forces[end + BEFORE * LANES] if is_last else steps[following, to]
        for k in range(5):
            force = steps[number, to + k * LANES] if k < 4 else ending
            add_force(dense.polynomials, e, k, force)


@exact_inline
def add_force(polynomials, e, k, force):
    """Add the force at a step's start, at one of its nodes or at its end to both polynomials."""
    if k == 0:
        for power in range(8):
            polynomials[e, power] = 0.0
    if 0 < k < 4:
        for power in range(3):
            polynomials[e, power] += LAGRANGE[k - 1][power] * force
    for power in range(5):
        polynomials[e, 3 + power] += THROUGH_ENDS[k][power] * force


@exact_inline
def put_instant(lane, p, interval, a, b, sizes, intervals, dense):
    """Modes, forces and ground motion of an instant, by its place in the step and interval."""
    n_modes, _, n_elements, n_ground = sizes[:4]
    for m in range(n_modes):
        dense.z[p * 2 * n_modes + m] = dense.state[m].real
        dense.z[p * 2 * n_modes + n_modes + m] = dense.state[m].imag
    for e in range(n_elements):
        force = 0.0
        for power in range(4, -1, -1):
            force = force * a + dense.polynomials[e, 3 + power]
        dense.forces[p * n_elements + e] = force
    for i in range(n_ground):
        low = intervals.ground[(interval * n_ground + i) * LANES + lane]
        high = intervals.ground[((interval + 1) * n_ground + i) * LANES + lane]
        dense.ground[p * n_ground + i] = low + (high - low) * b


@exact_inline
def advance(lane, interval, a, share, b, part, sizes, intervals, dense):
    """Carry the modes to the next instant, ``share`` of the step or ``part`` of the interval on."""
    state, weights, polynomials = dense.state, dense.weights, dense.polynomials
    n_modes, _, n_elements, n_ground = sizes[:4]
    for m in range(n_modes):
        state[m] *= weights[0, m]
    for e in range(n_elements):
        c1, c2 = polynomials[e, 1], polynomials[e, 2]
        to = 1 + 2 * n_ground + 3 * e
        add_input(state, weights, to, polynomials[e, 0] + a * (c1 + a * c2))
        add_input(state, weights, to + 1, share * (c1 + 2.0 * a * c2))
        add_input(state, weights, to + 2, share * share * c2)
    for i in range(n_ground):
        low = intervals.ground[(interval * n_ground + i) * LANES + lane]
        high = intervals.ground[((interval + 1) * n_ground + i) * LANES + lane]
        add_input(state, weights, 1 + 2 * i, low + (high - low) * b)
        add_input(state, weights, 2 + 2 * i, (high - low) * part)


@exact_inline
def raise_by_instants(
    lane, n_chosen, chosen, first, n_here, counted, inside, length, past, sizes, quantities, dense,
    track,
):  # fmt: skip
    """Evaluate the chosen quantities at some instants and raise their peaks."""
    n_directions = quantities.n_directions
    per_block = 8 // n_directions
    for block in range(blocks_of(quantities)):
        evaluated = False
        for k in range(n_chosen):
            item = chosen[k]
            if item // per_block == block:
                if not evaluated:
                    evaluate(block, lane, sizes, quantities, dense)
                    evaluated = True
                follow(
                    item % per_block * n_directions, n_directions, first, n_here, counted, inside,
                    length, past, item, row_of(item, per_block) * LANES + PEAK * ROWS + lane,
                    dense, track,
                )  # fmt: skip


@exact_inline
def set_weights(length, own, sizes, modes, dense):
    """Decay of the modes over a time, and the weights of the inputs' powers of time in it."""
    weights, integral, phi = dense.weights, dense.integral, dense.phi
    n_modes, _, n_elements, n_ground = sizes[:4]
    if dense.weights_for[0] == length and dense.weights_for[1] == own:
        return
    dense.weights_for[0], dense.weights_for[1] = length, own
    first = n_modes * (1 + 2 * n_elements)
    for m in range(n_modes):
        powers(modes[m, own], length, length, integral, phi)
        weights[0, m] = phi[0]
        for i in range(n_ground):
            column = modes[first + n_modes * i + m, own]
            for power in range(2):
                weights[1 + 2 * i + power, m] = column * integral[power]
        for e in range(n_elements):
            column = modes[first + n_modes * (n_ground + e) + m, own]
            for power in range(3):
                weights[1 + 2 * n_ground + 3 * e + power, m] = column * integral[power]


@exact_inline
def add_input(state, weights, k, value):
    """Add an input's effect to the modes."""
    for m in range(state.shape[0]):
        state[m] += weights[k, m] * value


@exact_inline
def evaluate(block, lane, sizes, quantities, dense):
    """A block's rows at the instants of a dense evaluation."""
    n_modes, _, n_elements, n_ground = sizes[:4]
    size = 8 * (2 * n_modes + n_elements + n_ground)
    for k in range(size):
        dense.rows[k] = quantities.rows[(block * size + k) * TABLE_LANES + lane % TABLE_LANES]
    dense_quantities_at(
        dense.values, 0, dense.rows, 0, dense.z, dense.points, 2 * n_modes, n_modes, n_modes,
        dense.forces, n_elements, n_elements, dense.ground, n_ground,
    )  # fmt: skip


@exact_inline
def follow(row, n_directions, first, n_here, earlier, inside, length, past, item, at, dense, track):
    """Update a quantity's peak with its next instants and the parabolas through three of them.

    earlier: instants before this step; inside: instants of the step before the interval's end;
    past: distance of the instants before the step, zero where they are too far apart for parabolas.
    """
    before, middle, peak = dense.last[item, 0], dense.last[item, 1], track[at]
    for p in range(n_here):
        j = first + p
        if j == 0 and earlier > 0:
            continue  # the end of the last step
        square = 0.0
        for direction in range(n_directions):
            part = dense.values[8 * p + row + direction]
            square += part * part
        value = np.sqrt(square)
        # the values at both ends have been counted
        if earlier + j > 0 and j < inside:
            peak = max(peak, value)
        # the parabola through three points has its top between them
        if past > 0.0 and earlier + j >= 2:
            s = length if j >= 2 else past
            rise, fall = middle - before, value - middle
            bend = fall * s - rise * length
            slope = rise * length * length + fall * s * s
            if bend < 0.0 and 2.0 * bend * length <= -slope <= -2.0 * bend * s:
                peak = max(peak, middle - 0.25 * slope * slope / (bend * s * length * (s + length)))
        before, middle = middle, value
    dense.last[item, 0], dense.last[item, 1], track[at] = before, middle, peak
