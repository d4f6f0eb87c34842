"""Trajectory of an effect along runs, for effects with states.

The functions of the effect are those of ``effect_functions.py``. ``effect_evaluation.py`` writes
those of another effect, and inserts them in the copy of this module that is compiled.
"""

from numba import njit

from .effect_functions import N_STATES, respond, step


@njit(cache=True, nogil=True, error_model="numpy")
def trajectory(
    starts, dt, cycle, lead, ahead, join, x, v, a, current, force, temperature, parameters, first,
    s, out,
):  # fmt: skip
    """The effect at every sample of one test run after another.

    starts: first sample of each run, and the end. dt: sample interval of each run, s. cycle, lead,
    ahead, join: of each run, see ``LeadIn``.
    first: states at each run's start. out: one row per function that the effect has.
    """
    for run in range(starts.shape[0] - 1):
        begin, end = starts[run], starts[run + 1]
        for i in range(N_STATES):
            s[i] = first[run, i]
        k, left = begin + lead[run], ahead[run]
        while k < end:
            if left > 0:  # before the run
                left -= 1
                n = k + 1 if k + 1 < begin + cycle[run] else begin
                h = dt[run] if n > begin else join[run]
            else:
                n, h = k + 1, dt[run]
                respond(
                    x[k], v[k], a[k], current[k], force[k], temperature[k], s, parameters, out, k
                )
            # a state that is far faster than a step ends where the current does, so that a law
            # without lag is a lag of zero
            if n < end:
                step(
                    x[k], v[k], a[k], current[k], force[k], temperature[k],
                    x[n], v[n], a[n], current[n], force[n], temperature[n], h, s, parameters,
                )  # fmt: skip
            k = n
