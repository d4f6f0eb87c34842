"""Functions of a law that ``device_kernel.py`` calls: here those of the Maxwell law.

``by`` gets derivatives by the states and then the parameters in its columns: those of the states in
its rows, or those of the force in its first row. ``slope`` has those of the states by coefficients.
"""

from ...compilation.options import inline

N_STATES = 1
N_PARAMETERS = 2


@inline
def begin(s, parameters, by):
    """Set the states at rest; by gets their derivatives by the parameters."""
    s[0] = 0.0
    by[0, 1] = 0.0
    by[0, 2] = 0.0


@inline
def respond(x, v, s, parameters):
    """Force."""
    return parameters[0] * s[0]


@inline
def respond_with_slopes(x, v, s, parameters, by):
    """Force; by gets its derivatives."""
    by[0, 0] = parameters[0]
    by[0, 1] = s[0]
    by[0, 2] = 0.0
    return parameters[0] * s[0]


@inline
def step_alone(xa, va, xm, vm, xb, vb, h, s, parameters):
    """Move the states by a step of h, s; motion at its beginning (a), middle (m) and end (b)."""
    relax, y = parameters[0] / parameters[1], s[0]
    r1 = va - relax * y
    r2 = vm - relax * (y + h / 2 * r1)
    r3 = vm - relax * (y + h / 2 * r2)
    r4 = vb - relax * (y + h * r3)
    s[0] = y + h / 6 * (r1 + 2 * r2 + 2 * r3 + r4)


@inline
def step_with_slopes(xa, va, xm, vm, xb, vb, h, carried, work):
    """The same with the derivatives of the states in ``slope``, by ``carried`` powers."""
    s, parameters, powers, slope = work.s, work.parameters, work.powers, work.slope
    relax, y = parameters[0] / parameters[1], s[0]
    r1 = va - relax * y
    r2 = vm - relax * (y + h / 2 * r1)
    r3 = vm - relax * (y + h / 2 * r2)
    d1 = -y  # derivatives of these by relax
    d2 = -(y + h / 2 * r1) - relax * h / 2 * d1
    d3 = -(y + h / 2 * r2) - relax * h / 2 * d2
    d4 = -(y + h * r3) - relax * h * d3
    step_alone(xa, va, xm, vm, xb, vb, h, s, parameters)
    by_relax = h / 6 * (d1 + 2 * d2 + 2 * d3 + d4)
    m = h * relax
    by_state = 1 - m * (1 - m / 2 * (1 - m / 3 * (1 - m / 4)))
    by_spring, by_dashpot = by_relax / parameters[1], -by_relax * relax / parameters[1]
    for k in range(carried):
        slope[0, k, 0] = by_state * slope[0, k, 0] + by_spring * powers[k]
        slope[0, k, 1] = by_state * slope[0, k, 1] + by_dashpot * powers[k]
