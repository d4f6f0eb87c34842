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

from ...compilation.options import OPTIONS, inline
from .device_arguments import Workspace
from .law_functions import (
    N_PARAMETERS,
    N_STATES,
    begin,
    respond,
    respond_with_slopes,
    step_alone,
    step_with_slopes,
)
from .run_walk import next_sample

MOST_STEPS = 4096


@njit(cache=True, nogil=True, **OPTIONS)
def simulate(runs, x, v, current, n_steps, theta, work, force, jacobian):
    """Forces at the samples, and their derivatives by theta, of one test run after another.

    runs: see ``Runs``. n_steps: integration steps a sample, of each run; a run with none is left
    out. theta: coefficients of each parameter, ascending powers of the current. work: see
    ``device_arguments.py``.
    jacobian may have no rows: then it is left out.
    """
    s, parameters, by, powers, slope = work.s, work.parameters, work.by, work.powers, work.slope
    n_powers = theta.shape[1]
    differentiate = jacobian.shape[0] > 0
    for run in range(n_steps.shape[0]):
        if n_steps[run] == 0:
            continue
        end = runs.starts[run + 1]
        sample, left = runs.starts[run] + runs.lead[run], runs.ahead[run]
        carried = 0
        if differentiate:
            # under one current, derivatives by other powers of it are multiples of the first
            carried = 1 if is_steady(current, runs.starts[run], end) else n_powers
        last = current[sample]
        use_current(last, theta, work)
        begin(s, parameters, by)
        for i in range(N_STATES):
            for k in range(carried):
                for j in range(N_PARAMETERS):
                    slope[i, k, j] = by[i, N_STATES + j] * powers[k]
        while sample < end:
            i0 = current[sample]
            after, interval = next_sample(runs, run, sample, left)
            if left > 0:
                left -= 1
            else:
                if i0 != last:
                    last = i0
                    use_current(last, theta, work)
                if carried > 0:
                    response = respond_with_slopes(x[sample], v[sample], s, parameters, by)
                else:
                    response = respond(x[sample], v[sample], s, parameters)
                force[sample] = response
                if not abs(response) < np.inf:  # the rest would be no better
                    for rest in range(sample, end):
                        force[rest] = np.nan
                        if differentiate:
                            for k in range(jacobian.shape[1]):
                                jacobian[rest, k] = np.nan
                    break
                for k in range(carried):
                    for j in range(N_PARAMETERS):
                        total = by[0, N_STATES + j] * powers[k]
                        for i in range(N_STATES):
                            total += by[0, i] * slope[i, k, j]
                        jacobian[sample, j * n_powers + k] = total
                if differentiate:
                    for k in range(carried, n_powers):
                        for j in range(N_PARAMETERS):
                            first = jacobian[sample, j * n_powers]
                            jacobian[sample, j * n_powers + k] = first * powers[k]
            if N_STATES > 0 and after < end:
                i1 = current[after]
                advance(
                    x[sample], v[sample], i0, x[after], v[after], i1, interval, n_steps[run],
                    carried, theta, work,
                )  # fmt: skip
                if i1 != i0:
                    last = np.nan
            sample = after


@inline
def is_steady(current, start, end):
    """Whether the current stays the same from one sample to another."""
    for sample in range(start + 1, end):
        if current[sample] != current[start]:
            return False
    return True


@njit(cache=True, nogil=True, **OPTIONS)
def follow(x0, v0, x1, v1, dt, tolerance, settings, s, trial, parameters, none, slope, by):
    """Force, N, after a motion over dt, s; the states s are moved on.

    settings: steps to begin with, none at rest, and largest force so far, N; both are kept up. The
    steps are halved until that changes the force by what an error of fourth order may.
    trial, by: workspace. none, slope: no powers of the current, and no derivatives by them.
    """
    if settings[0] == 0.0:
        begin(s, parameters, by)
    work = Workspace(trial, parameters, none, slope, by)
    coarse, last = max(int(settings[0]) // 2, 1), 0.0
    n_steps = coarse
    while True:
        # element by element: the compiler takes seconds for an array assigned to an array
        for k in range(N_STATES):
            trial[k] = s[k]
        if N_STATES > 0:  # the current, which the parameters hold already, does not change
            advance(x0, v0, 0.0, x1, v1, 0.0, dt, n_steps, 0, by, work)
        force = respond(x1, v1, trial, parameters)
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
def use_current(current, theta, work):
    """Parameters at a current, and its powers that their coefficients multiply."""
    power = 1.0
    for k in range(theta.shape[1]):
        work.powers[k] = power
        power *= current
    for j in range(N_PARAMETERS):
        total = 0.0
        for k in range(theta.shape[1]):
            total += theta[j, k] * work.powers[k]
        work.parameters[j] = total


@inline
def advance(x0, v0, i0, x1, v1, i1, dt, n_steps, carried, theta, work):
    """States from one sample to the next, and their slopes by ``carried`` powers of the current."""
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
                use_current(i0 + m * (i1 - i0), theta, work)
            xa, va = cubic(x0, v0, x1, v1, rate, a)
            xm, vm = cubic(x0, v0, x1, v1, rate, m)
            xb, vb = cubic(x0, v0, x1, v1, rate, b)
            if carried > 0:
                step_with_slopes(xa, va, xm, vm, xb, vb, h, carried, work)
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
