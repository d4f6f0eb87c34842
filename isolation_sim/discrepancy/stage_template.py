"""Compiled course of an effect along measured runs; ``stages.py`` completes this text.

Names that are not defined here (N_STATES, respond, step) come from the effect.
"""


@njit(cache=True, nogil=True, error_model="numpy")
def course(starts, dt, x, v, a, current, force, temperature, parameters, first, s, out):
    """What the effect does at every sample of one test run after another.

    starts: first sample of each run, and the end. dt: sample interval of each run, s.
    first: states at each run's start. out: one row a function that the effect has.
    """
    for run in range(starts.shape[0] - 1):
        h = dt[run]
        for i in range(N_STATES):
            s[i] = first[run, i]
        for k in range(starts[run], starts[run + 1]):
            respond(x[k], v[k], a[k], current[k], force[k], temperature[k], s, parameters, out, k)
            if N_STATES == 0 or k + 1 == starts[run + 1]:
                continue
            # signals in the middle: the cubic through both ends, and linear; a current that has
            # changed by the next sample is taken to have changed at once, so that a law without
            # lag is a lag of zero
            step(0.5 * (x[k] + x[k + 1]) + 0.125 * h * (v[k] - v[k + 1]), 0.5 * (v[k] + v[k + 1]),
                 0.5 * (a[k] + a[k + 1]), current[k + 1], 0.5 * (force[k] + force[k + 1]),
                 temperature[k], h, s, parameters)
