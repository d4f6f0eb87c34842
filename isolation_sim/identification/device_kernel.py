"""Simulation of a device under measured motion, with derivatives by its coefficients.

States go by classical Runge-Kutta steps along the cubic through the measured displacements and
velocities, or by steps for stiff laws. Steps end where its velocity reverses, at a yielding law's
corners. The current is a
straight line between samples; a step takes that of its middle. The derivatives of that discrete
solution by the parameters are propagated beside it, so that a fit's gradient is exact.

The functions of the law are those of ``law_functions.py``. ``sensitivities.py`` writes those of
another law, and inserts them in the copy of this module that is compiled.
"""

import numpy as np
from numba import njit

from ..compilation.options import OPTIONS, inline
from .device_arguments import Coefficients, Workspace
from .law_functions import N_PARAMETERS, N_STATES, begin, respond, step_alone, step_with_slopes
from .run_walk import next_sample

MOST_STEPS = 4096


@njit(cache=True, nogil=True, **OPTIONS)
def simulate(runs, x, v, current, n_steps, coefficients, work, force, jacobian):
    """Forces at the samples, and their derivatives by theta, of one test run after another.

    runs: see ``Runs``. n_steps: integration steps a sample, of each run; a run with none is left
    out. coefficients, work: see ``device_arguments.py``.
    jacobian may have no rows: then it is left out.
    """
    s, parameters, by, factor = work.s, work.parameters, work.by, work.factor
    slope, owner = work.slope, coefficients.owner
    n_theta = owner.shape[0]
    differentiate = jacobian.shape[0] > 0
    for run in range(n_steps.shape[0]):
        if n_steps[run] == 0:
            continue
        end = runs.starts[run + 1]
        sample, left = runs.starts[run] + runs.lead[run], runs.ahead[run]
        last = current[sample]
        use_current(last, coefficients, work)
        begin(s, parameters, by)
        for i in range(N_STATES):
            for k in range(n_theta):
                slope[i, k] = by[i, N_STATES + owner[k]] * factor[k]
        while sample < end:
            i0 = current[sample]
            after, interval = next_sample(runs, run, sample, left)
            if left > 0:
                left -= 1
            else:
                if i0 != last:
                    last = i0
                    use_current(last, coefficients, work)
                response = respond(x[sample], v[sample], s, parameters, by)
                force[sample] = response
                if not abs(response) < np.inf:  # the rest would be no better
                    for rest in range(sample, end):
                        force[rest] = np.nan
                        if differentiate:
                            for k in range(n_theta):
                                jacobian[rest, k] = np.nan
                    break
                if differentiate:
                    for k in range(n_theta):
                        total = by[0, N_STATES + owner[k]] * factor[k]
                        for i in range(N_STATES):
                            total += by[0, i] * slope[i, k]
                        jacobian[sample, k] = total
            if N_STATES > 0 and after < end:
                i1 = current[after]
                advance(
                    x[sample], v[sample], i0, x[after], v[after], i1, interval, n_steps[run],
                    differentiate, coefficients, work,
                )  # fmt: skip
                if i1 != i0:
                    last = np.nan
            sample = after


@njit(cache=True, nogil=True, **OPTIONS)
def follow(x0, v0, x1, v1, dt, tolerance, settings, s, trial, parameters, none, empty, slope, by):
    """Force, N, after a motion over dt, s; the states s are moved on.

    settings: steps to begin with, none at rest, and largest force so far, N; both are kept up. The
    steps are halved until that changes the force by what an error of fourth order may.
    trial, by: workspace. none, empty, slope: no coefficients, and no derivatives by them.
    """
    if settings[0] == 0.0:
        begin(s, parameters, by)
    coefficients = Coefficients(empty, none, none)
    work = Workspace(trial, parameters, slope, slope, by, empty)
    coarse, last = max(int(settings[0]) // 2, 1), 0.0
    n_steps = coarse
    while True:
        # element by element: the compiler takes seconds for an array assigned to an array
        for k in range(N_STATES):
            trial[k] = s[k]
        if N_STATES > 0:  # the current, which the parameters hold already, does not change
            advance(x0, v0, 0.0, x1, v1, 0.0, dt, n_steps, False, coefficients, work)
        force = respond(x1, v1, trial, parameters, by)
        if n_steps > coarse:
            settings[1] = max(settings[1], abs(force))
            if not abs(force - last) > 15.0 * tolerance * settings[1]:
                break
        if N_STATES == 0 or n_steps >= MOST_STEPS:
            break
        n_steps, last = 2 * n_steps, force
    settings[0] = n_steps
    for k in range(N_STATES):
        s[k] = trial[k]
    return force


@inline
def use_current(current, coefficients, work):
    """Parameters at a current, and the powers of it that their coefficients multiply."""
    for j in range(N_PARAMETERS):
        work.parameters[j] = 0.0
    for k in range(coefficients.theta.shape[0]):
        work.factor[k] = current ** coefficients.power[k]
        work.parameters[coefficients.owner[k]] += coefficients.theta[k] * work.factor[k]


@inline
def advance(x0, v0, i0, x1, v1, i1, dt, n_steps, differentiate, coefficients, work):
    """States, and their slopes if they are wanted, from one sample to the next."""
    rate = 1.0 / dt
    # per interval, so that the cubic needs no division
    v0, v1 = v0 * dt, v1 * dt
    # a law may have a corner where the velocity reverses: no step goes across one
    first, second = reversals(x0, v0, x1, v1)
    start = 0.0
    for end in (first, second, 1.0):
        if end <= start:
            continue
        count = int(np.ceil((end - start) * n_steps - 1e-9))
        part = (end - start) / count
        h = part * dt
        for step in range(count):
            a = start + step * part
            m, b = a + 0.5 * part, a + part
            if i1 != i0:
                use_current(i0 + m * (i1 - i0), coefficients, work)
            xa, va = cubic(x0, v0, x1, v1, rate, a)
            xm, vm = cubic(x0, v0, x1, v1, rate, m)
            xb, vb = cubic(x0, v0, x1, v1, rate, b)
            if differentiate:
                step_with_slopes(xa, va, xm, vm, xb, vb, h, coefficients.owner, work)
            else:
                step_alone(xa, va, xm, vm, xb, vb, h, work.s, work.parameters)
        start = end


@inline
def reversals(x0, v0, x1, v1):
    """Both zeros of the velocity on the cubic, fractions of the interval in order; 0 for none."""
    rise = x1 - x0
    c2 = 3.0 * rise - (2.0 * v0 + v1)
    c3 = (v0 + v1) - 2.0 * rise
    root = c2 * c2 - 3.0 * c3 * v0
    if root <= 0.0:
        return 0.0, 0.0
    q = -(c2 + np.copysign(np.sqrt(root), c2))
    one = v0 / q if q != 0.0 else 0.0
    other = q / (3.0 * c3) if c3 != 0.0 else 0.0
    if not 0.0 < one < 1.0:
        one = 0.0
    if not 0.0 < other < 1.0:
        other = 0.0
    return min(one, other), max(one, other)


@inline
def cubic(x0, v0, x1, v1, rate, t):
    """Displacement and velocity on the cubic through both ends, a fraction t between them.

    v0, v1: velocity times the interval's length; rate: 1 over that length.
    """
    rise = x1 - x0
    c2 = 3.0 * rise - (2.0 * v0 + v1)
    c3 = (v0 + v1) - 2.0 * rise
    return x0 + t * (v0 + t * (c2 + t * c3)), (v0 + t * (2.0 * c2 + t * 3.0 * c3)) * rate
