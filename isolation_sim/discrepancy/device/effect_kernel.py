"""Trajectory of an effect along runs, for effects with states.

The functions of the effect are those of ``effect_functions.py``. ``effect_evaluation.py`` writes
those of another effect, and inserts them in the copy of this module that is compiled.
"""

from numba import njit

from ...compilation.options import EXACT
from ...identification.kernel.run_walk import next_sample
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


@njit(cache=True, nogil=True, **EXACT)
def trajectory(runs, signals, parameters, first, s, out):
    """The effect at every sample of one test run after another.

    runs: see ``Runs``. signals: at the samples. first: states at each run's start. out: one row per
    function that the effect has.
    """
    for run in range(runs.dt.shape[0]):
        end = runs.starts[run + 1]
        for i in range(N_STATES):
            s[i] = first[run, i]
        k, left = runs.starts[run] + runs.lead[run], runs.ahead[run]
        while k < end:
            n, h = next_sample(runs, run, k, left)
            if left > 0:
                left -= 1
            else:
                respond(signals, k, s, parameters, out)
            # a state that is far faster than a step ends where the current does, so that a law
            # without lag is a lag of zero
            if n < end:
                step(signals, k, n, h, s, parameters)
            k = n


@njit(cache=True, nogil=True, **EXACT)
def trajectory_with_slopes(
    runs, signals, parameters, first, s, out, by_force, own, slope, new_slope, by, by_out
):  # fmt: skip
    """The effect as in ``trajectory``, and its derivatives in as many directions as wanted.

    by_force: derivatives of the force, (n_samples, n_directions). own: first of the directions that
    are the effect's own parameters. slope: derivatives of each run's first states, (n_runs,
    n_states, n_directions), which are overwritten. by_out: derivatives of the rows of out.
    new_slope, by: workspace.
    """
    for run in range(runs.dt.shape[0]):
        end = runs.starts[run + 1]
        for i in range(N_STATES):
            s[i] = first[run, i]
        k, left = runs.starts[run] + runs.lead[run], runs.ahead[run]
        while k < end:
            n, h = next_sample(runs, run, k, left)
            if left > 0:
                left -= 1
            else:
                respond_with_slopes(signals, k, s, parameters, out, by)
                for row in range(N_OUTPUTS):
                    for d in range(by_force.shape[1]):
                        total = by[row, OF_FORCE] * by_force[k, d]
                        for i in range(N_STATES):
                            total += by[row, i] * slope[run, i, d]
                        by_out[row, k, d] = total
                    for d in range(N_PARAMETERS):
                        by_out[row, k, own + d] += by[row, OF_PARAMETERS + d]
            if n < end:
                step_with_slopes(signals, k, n, h, s, parameters, by)
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
