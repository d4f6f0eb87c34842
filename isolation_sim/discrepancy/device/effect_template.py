"""Compiled trajectory of an effect along runs; ``effect_evaluation.py`` completes this text.

Names that are not defined here (N_STATES, respond, step) come from the effect.
"""


@njit(cache=True, nogil=True, error_model="numpy")
def trajectory(starts, dt, x, v, a, current, force, temperature, parameters, first, s, out):
    """The effect at every sample of one test run after another.

    starts: first sample of each run, and the end. dt: sample interval of each run, s.
    first: states at each run's start. out: one row per function that the effect has.
    """
    for run in range(starts.shape[0] - 1):
        h = dt[run]
        for i in range(N_STATES):
            s[i] = first[run, i]
        for k in range(starts[run], starts[run + 1]):
            respond(x[k], v[k], a[k], current[k], force[k], temperature[k], s, parameters, out, k)
            if N_STATES == 0 or k + 1 == starts[run + 1]:
                continue
            # a state that is far faster than a step ends where the current does, so that a law
            # without lag is a lag of zero
            n = k + 1
            step(
                x[k],
                v[k],
                a[k],
                current[k],
                force[k],
                temperature[k],
                x[n],
                v[n],
                a[n],
                current[n],
                force[n],
                temperature[n],
                h,
                s,
                parameters,
            )
