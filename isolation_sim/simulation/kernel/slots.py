"""Places in the kernel's arrays, and the codes that it exchanges with its caller."""

from __future__ import annotations

COMMON = (
    "dn0 dn1 dn2 vn0 vn1 vn2 dn3 vn3 d_end v_end free0 free1 free2 free3 free4 free5 free6 free7 "
    "k_ref c_ref force_scale to_structure force_end defect error roughness change kink bent "
    "weight d_start v_start f_start f0 f1 f2"
).split()
"""Slots in common of all laws: deformation and velocity at the nodes and at the step's end (number
3) without the effect of the element's own force; both at the step's end; their free response; the
reference spring and dashpot; the reciprocal scale of the force; whether the step has a kink, and
whether the current has one; the weight of the error estimate; deformation, velocity and residual
force at the step's start; and the residual forces at the nodes. The law's states at the nodes
follow."""
DN0, FREE0, F0 = map(COMMON.index, ("dn0", "free0", "f0"))
K_REF, C_REF = map(COMMON.index, ("k_ref", "c_ref"))
FORCE_SCALE, TO_STRUCTURE = map(COMMON.index, ("force_scale", "to_structure"))
D_END, V_END, FORCE_END = map(COMMON.index, ("d_end", "v_end", "force_end"))
F_START, CHANGE, DEFECT = map(COMMON.index, ("f_start", "change", "defect"))
ERROR, KINK, BENT, WEIGHT = map(COMMON.index, ("error", "kink", "bent", "weight"))

OPERATIONS = {
    "prepare_held": "",
    "prepare_moving": "",
    "relax": "h",
    "iterate": "h, table, first",
    "finish": "h, share, table, first",
    "inside": "tau, states, first",
    "accept": "states, first",
    "restart": "",
    "probe": "",
}
"""Functions of a law that the integration calls, in the order of their numbers, with their
arguments between the element's base and the mask of lanes. ``first`` is the first lane's place in
an array."""
PREPARE_HELD, PREPARE_MOVING, RELAX, ITERATE, FINISH, INSIDE, ACCEPT, RESTART, PROBE = range(9)

# forces of an element at a grid point: before and after a change of current, at the nodes
BEFORE, AFTER, AT_NODES = range(3)
FORCES = 5
# a step's own numbers: segment, begin and length in it, record of the interval's next step
SEGMENT, BEGIN, LENGTH, NEXT = range(4)
STEP = 4

# what ``integrate`` returns
FINISHED, DECIDE, BUFFER_FULL = range(3)
# where it is: entries of its position, and stages of a segment
SEGMENT_NOW, STAGE = range(2)
MEASURE, COMMAND, UNDER_WAY = range(3)
# what is counted of a lane: clamped commands, steps of all lanes together, steps that missed the
# tolerance, and segments until its end, if that came early
CLAMPED, STEPS, MISSED, ENDED = range(4)
# what became of a lane
ALIVE, NO_CONVERGENCE, NOT_FINITE, TOO_LARGE, CURRENT_REFUSED = range(5)

HOPELESS = 1e12
"""Change of an iteration above which it diverges, and largest rate of relaxation, 1/s."""
TINY = 1e-300
