"""The way through the samples of a test run, which the kernels for laws and effects share."""

from ...compilation.options import exact_inline


@exact_inline
def next_sample(runs, run, sample, left):
    """Sample after another one of a run, and the time between them, s; see ``Runs``.

    left: samples that are still to come before the run begins.
    """
    if left > 0:
        begin = runs.starts[run]
        if sample + 1 >= begin + runs.cycle[run]:
            return begin, runs.join[run]
    return sample + 1, runs.dt[run]
