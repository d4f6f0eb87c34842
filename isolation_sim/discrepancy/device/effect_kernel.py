"""Trajectory of an effect along runs, for effects with states.

The functions of the effect are those of ``effect_functions.py``. ``effect_evaluation.py`` writes
those of another effect, and inserts them in the copy of this module that is compiled.
"""

from numba import njit

from .effect_functions import (
    N_OUTPUTS,
    N_PARAMETERS,
    N_STATES,
    respond,
    respond_with_slopes,
    step,
    step_with_slopes,
)

# columns of the derivatives ``by``: the states, the parameters, then the force
OF_PARAMETERS = N_STATES
OF_FORCE = N_STATES + N_PARAMETERS
OF_LAST_FORCE = N_STATES + N_PARAMETERS + 1


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


@njit(cache=True, nogil=True, error_model="numpy")
def trajectory_with_slopes(
    starts, dt, cycle, lead, ahead, join, x, v, a, current, force, temperature, parameters, first,
    s, out, by_force, own, slope, new_slope, by, by_out,
):  # fmt: skip
    """The effect as in ``trajectory``, and its derivatives in as many directions as wanted.

    by_force: derivatives of the force, (n_samples, n_directions). own: first of the directions that
    are the effect's own parameters. slope: derivatives of each run's first states, (n_runs,
    n_states, n_directions), which are overwritten. by_out: derivatives of the rows of out.
    new_slope, by: workspace.
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
                respond_with_slopes(
                    x[k], v[k], a[k], current[k], force[k], temperature[k], s, parameters, out, k,
                    by,
                )  # fmt: skip
                for row in range(N_OUTPUTS):
                    for d in range(by_force.shape[1]):
                        total = by[row, OF_FORCE] * by_force[k, d]
                        for i in range(N_STATES):
                            total += by[row, i] * slope[run, i, d]
                        by_out[row, k, d] = total
                    for d in range(N_PARAMETERS):
                        by_out[row, k, own + d] += by[row, OF_PARAMETERS + d]
            if n < end:
                step_with_slopes(
                    x[k], v[k], a[k], current[k], force[k], temperature[k],
                    x[n], v[n], a[n], current[n], force[n], temperature[n], h, s, parameters, by,
                )  # fmt: skip
                for i in range(N_STATES):
                    for d in range(by_force.shape[1]):
                        total = by[i, OF_FORCE] * by_force[k, d]
                        total += by[i, OF_LAST_FORCE] * by_force[n, d]
                        for j in range(N_STATES):
                            total += by[i, j] * slope[run, j, d]
                        new_slope[i, d] = total
                    for d in range(N_PARAMETERS):
                        new_slope[i, own + d] += by[i, OF_PARAMETERS + d]
                for i in range(N_STATES):
                    for d in range(by_force.shape[1]):
                        slope[run, i, d] = new_slope[i, d]
            k = n
