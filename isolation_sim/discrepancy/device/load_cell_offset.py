"""A load cell that is set to zero before every run: no run tells the offset of another.

It is a form of ``force_offset`` that needs the measured force itself, so that it cannot be an
effect of the catalogue: the mean of each run's residual is taken out, in held-out runs as well.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...effects import Effect, EffectParameter
from ...identification.measured_runs import MeasuredRuns

EACH_RUN = Effect(
    cause="force_offset",
    form="each_run",
    title="Force offset, another in each run",
    parameters=(
        EffectParameter("spread", "N", "RMS of the offsets", strength=True, starts=(0.01,)),
    ),
    of_device=False,
    source="zero of the load cell",
)
"""Its parameter is not fitted; it is found from the runs."""


def run_means(data: MeasuredRuns, values: NDArray) -> NDArray:
    """Mean of each run in place of its samples."""
    sums = np.add.reduceat(values, data.starts[:-1], axis=0)
    lengths = data.lengths.reshape(-1, *[1] * (values.ndim - 1))
    return np.repeat(sums / lengths, data.lengths, axis=0)
