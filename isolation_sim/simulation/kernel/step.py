"""One step: forces and states at its nodes and its end, iterated to a fixed point."""

import numpy as np

from ...compilation.options import inline
from .operations import make_element, make_free_rows, make_respond_to_others
from .shape import LANES, STRIDE, TABLE_LANES
from .slots import CHANGE, DEFECT, DN0, ERROR, F0, FINISH, FREE0, HOPELESS, ITERATE, KINK, TINY
from .tables import layout

MOST_ITERATIONS = 40

element = make_element(STRIDE, LANES)
respond_to_others = make_respond_to_others(LANES, TABLE_LANES, STRIDE, DN0, FREE0, F0)
free_rows = make_free_rows(LANES, TABLE_LANES)


@inline
def solve_step(step, sizes, law_numbers, table, z, u, w, lanes):
    """Forces and states at the nodes and the end of one step; z and u are only read.

    Sets in ``lanes``: ``defects``, the difference of force polynomial and force at the step's ends
    over the peak force, infinite if the iteration did not converge; ``errors``, its estimated
    effect on the response; ``kinks``, whether an element has a kink within the step.
    """
    functions, numbers = law_numbers.functions, law_numbers.numbers
    n_modes, n_pad, n_sub, offset = sizes.n_modes, sizes.n_pad, step.n_sub, step.offset
    h, share, tolerance = step.length, step.share, step.left
    active, going, previous, contraction = (
        lanes.active,
        lanes.going,
        lanes.previous,
        lanes.contraction,
    )
    defects, errors, kinks = lanes.defects, lanes.errors, lanes.kinks
    ground_rows, force_rows, _, _, _ = layout(sizes[:4], n_sub)
    for e in range(sizes.n_elements):
        free_rows(
            w, e * STRIDE + FREE0, table, offset + e * 16 * n_modes,
            offset + ground_rows + e * sizes.n_ground * (n_sub + 1) * 8, z, step.start * 2 * n_pad,
            n_modes, n_pad, u, n_sub + 1, sizes.n_ground,
        )  # fmt: skip
    for lane in range(LANES):
        going[lane] = active[lane]
        previous[lane] = 0.0
        defects[lane] = 0.0
    waiting = 1
    for count in range(MOST_ITERATIONS):
        for e in range(sizes.n_elements):
            for lane in range(LANES):
                w[(e * STRIDE + CHANGE) * LANES + lane] = 0.0
            for direction in range(numbers[e, 2]):
                respond_to_others(e + direction, sizes.n_elements, w, table, offset + force_rows)
            at = offset + force_rows + (e * sizes.n_elements + e) * 24
            element(functions, ITERATE, e, w, h, 0.0, table, at * TABLE_LANES, going)
        waiting = 0
        for lane in range(LANES):
            if going[lane]:
                change = 0.0
                for e in range(sizes.n_elements):
                    change += w[(e * STRIDE + CHANGE) * LANES + lane]
                before = previous[lane]
                previous[lane] = change
                # What a linear convergence leaves: change r / (1 - r) with r = change / before; at
                # the first iteration r is twice the last step's.
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
    for e in range(sizes.n_elements):
        for direction in range(numbers[e, 2]):
            respond_to_others(e + direction, sizes.n_elements, w, table, offset + force_rows)
        at = offset + force_rows + (e * sizes.n_elements + e) * 24
        element(functions, FINISH, e, w, h, share, table, at * TABLE_LANES, active)
    for lane in range(LANES):
        defect, error, kink = defects[lane], 0.0, 0.0
        for e in range(sizes.n_elements):
            defect += w[(e * STRIDE + DEFECT) * LANES + lane]
            error += w[(e * STRIDE + ERROR) * LANES + lane]
            kink = max(kink, w[(e * STRIDE + KINK) * LANES + lane])
        defects[lane], errors[lane], kinks[lane] = defect, error, kink
