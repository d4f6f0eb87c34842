"""The compiled time integration, for any laws: their functions are called by their addresses.

Exponential collocation. The linear structure is kept in complex modes and propagated exactly; each
element's force, less that of its reference spring and dashpot (which are part of the linear
structure), is a quadratic through the three Gauss points of a step; device states are collocated
on the same points; both are iterated to a fixed point from the extrapolated last step.

The grid holds the record's samples and the controller's instants. A segment is a number of equal
grid intervals during which no command changes. A step is a segment's 2**level-th part, at a
multiple of its own length: so it spans several samples where the response is smooth and a fraction
of one where it is not, and halving closes in on a kink within the segment. How far the force
polynomial misses the force at the step's ends decides on the level.

Arrays are flat or end in the lane: LANES runs go through side by side and the compiler turns the
innermost loops into vector instructions. A lane's result does not depend on its neighbours.

Segments, choice of steps and records are in ``segments.py``, the step itself in ``step.py``.
"""

from numba import njit

from ...compilation.options import OPTIONS, inline
from .segments import (
    any_lane,
    begin_segment,
    choose_step,
    close_segment,
    close_step,
    judge_step,
    keep_force,
    keep_step,
    move_currents,
    shift_force,
    take_current,
)  # fmt: skip
from .shape import LANES
from .slots import (
    ACCEPT,
    AFTER,
    BEFORE,
    BUFFER_FULL,
    DECIDE,
    F_START,
    FINISHED,
    INSIDE,
    MEASURE,
    PREPARE_HELD,
    PREPARE_MOVING,
    PROBE,
    RELAX,
    RESTART,
    SEGMENT_NOW,
    STAGE,
    UNDER_WAY,
)  # fmt: skip
from .step import element, solve_step


@njit(cache=True, nogil=True, **OPTIONS)
def integrate(
    position, sizes, limits, time_grid, propagation, measurements, coils, law_numbers, lanes,
    history, scratch,
):  # fmt: skip
    """Integrate until a controller must decide, the step record is full, or the grid ends.

    position: segment and stage at which the next call continues. The other groups are described in
    ``arguments.py``. Returns FINISHED, DECIDE or BUFFER_FULL; the status of each lane is in
    ``lanes.alive``.
    """
    w, u = scratch
    active, going, channel = lanes.active, lanes.going, law_numbers.channel
    states, forces = history.states, history.forces
    functions, n_states = law_numbers.functions, sizes.n_states
    width = 4 + 4 * n_states if sizes.record_steps else 4
    while position[SEGMENT_NOW] < sizes.n_segments:
        segment = position[SEGMENT_NOW]
        g = time_grid.segments[segment, 0]
        if segment == 0 and position[STAGE] == MEASURE:
            for e in range(sizes.n_elements):  # forces at rest, under the initial currents
                update_current(e, g, coils, law_numbers, going, w)
                keep_force(sizes, forces, BEFORE, g, e, w, F_START, going)
                keep_force(sizes, forces, AFTER, g, e, w, F_START, going)
        if position[STAGE] != UNDER_WAY:
            if not begin_segment(
                position, sizes, time_grid, measurements, coils, channel, lanes, history.z, w
            ):
                return DECIDE
            for e in range(sizes.n_elements):
                if update_current(e, g, coils, law_numbers, going, w):
                    keep_force(sizes, forces, AFTER, g, e, w, F_START, going)
        position[STAGE] = MEASURE
        while any_lane(lanes.todo):
            if history.step_count[0] == history.steps.shape[0]:
                position[STAGE] = UNDER_WAY  # the segment is under way; the caller makes room
                return BUFFER_FULL
            step = choose_step(segment, sizes, limits, time_grid, propagation, lanes, u)
            if step.fresh:
                for e in range(sizes.n_elements):
                    element(functions, RESTART, e, w, 0.0, 0.0, w, 0, going)
            if step.fresh or step.number == 0:
                if step.number == 0:
                    for lane in range(LANES):
                        going[lane] = active[lane]
                for e in range(sizes.n_elements):
                    element(functions, RELAX, e, w, step.length, 0.0, w, 0, going)
            for e in range(sizes.n_elements):
                if move_currents(step, segment, e, time_grid, coils, law_numbers, lanes, w):
                    element(functions, PREPARE_MOVING, e, w, 0.0, 0.0, w, 0, going)
            solve_step(step, sizes, law_numbers, propagation.table, history.z, u, w, lanes)
            if not judge_step(step, sizes, limits, lanes):
                continue
            keep_step(step, segment, width, sizes, propagation, lanes, history, u, w)
            for i in range(1, step.n_sub):
                for e in range(sizes.n_elements):
                    at = ((step.point + i) * sizes.n_elements + e) * n_states * LANES
                    element(functions, INSIDE, e, w, i / step.n_sub, 0.0, states, at, active)
            for e in range(sizes.n_elements):
                at = (step.end * sizes.n_elements + e) * n_states * LANES
                element(functions, ACCEPT, e, w, 0.0, 0.0, states, at, active)
            close_step(step, sizes, limits, lanes, forces, w)
        if not close_segment(position, sizes, time_grid, limits, coils, channel, lanes, w):
            break
    return FINISHED


@inline
def update_current(e, g, coils, law_numbers, going, w):
    """Set an element's current from a grid point on; return whether it changes."""
    changed = take_current(e, g, coils, law_numbers, going, w)
    if changed:
        functions, numbers = law_numbers.functions, law_numbers.numbers
        element(functions, PREPARE_HELD, e, w, 0.0, 0.0, w, 0, going)
        element(functions, PROBE, e, w, 0.0, 0.0, w, 0, going)
        shift_force(e, numbers[e, 2], w, going)
    return changed
