"""Compiled simulation of a device under measured motion; ``sensitivities.py`` completes this text.

States go by classical Runge-Kutta steps along the cubic through the measured displacements and
velocities; the derivatives of that discrete solution by the parameters are propagated beside it,
so that a fit's gradient is exact. Names that are not defined here (N_STATES, N_PARAMETERS,
step_alone, step_with_slopes, respond) come from the law.
"""


@njit(cache=True, nogil=True, **OPTIONS)
def simulate(starts, x, v, current, dt, n_steps, theta, owner, power, s, moved, slope, new_slope,
             force, jacobian):
    """Forces at the samples, and their derivatives by theta, of one test run after another.

    starts: first sample of each run, and the end. dt: sample interval of each run, s.
    theta: coefficients, of parameter owner[k] by the power[k]-th power of the current.
    jacobian may have no rows: then it is left out.
    """
    n_theta = theta.shape[0]
    wanted = jacobian.shape[0] > 0
    parameters = moved[0:N_PARAMETERS]
    for run in range(starts.shape[0] - 1):
        for i in range(N_STATES):
            s[i] = 0.0
            for k in range(n_theta):
                slope[i, k] = 0.0
        last = np.nan
        for sample in range(starts[run], starts[run + 1]):
            if current[sample] != last:
                last = current[sample]
                for j in range(N_PARAMETERS):
                    parameters[j] = 0.0
                for k in range(n_theta):
                    parameters[owner[k]] += theta[k] * last ** power[k]
            result = respond(x[sample], v[sample], s, parameters)
            force[sample] = result[0]
            if wanted:
                for k in range(n_theta):
                    total = result[1 + N_STATES + owner[k]] * last ** power[k]
                    for i in range(N_STATES):
                        total += result[1 + i] * slope[i, k]
                    jacobian[sample, k] = total
            if N_STATES == 0 or sample + 1 == starts[run + 1]:
                continue
            h = dt[run] / n_steps
            for step in range(n_steps):
                a, b = step / n_steps, (step + 1) / n_steps
                m = 0.5 * (a + b)
                xa, va = cubic(x[sample], v[sample], x[sample + 1], v[sample + 1], dt[run], a)
                xm, vm = cubic(x[sample], v[sample], x[sample + 1], v[sample + 1], dt[run], m)
                xb, vb = cubic(x[sample], v[sample], x[sample + 1], v[sample + 1], dt[run], b)
                if wanted:
                    step_with_slopes(xa, va, xm, vm, xb, vb, h, s, parameters, last, owner, power,
                                     slope, new_slope)
                else:
                    step_alone(xa, va, xm, vm, xb, vb, h, s, parameters)


@inline
def cubic(x0, v0, x1, v1, dt, t):
    """Displacement and velocity on the cubic through both ends, a fraction t between them."""
    rise = x1 - x0
    c2 = 3.0 * rise - dt * (2.0 * v0 + v1)
    c3 = dt * (v0 + v1) - 2.0 * rise
    return x0 + t * (dt * v0 + t * (c2 + t * c3)), v0 + t * (2.0 * c2 + t * 3.0 * c3) / dt
