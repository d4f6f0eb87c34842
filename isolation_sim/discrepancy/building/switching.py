"""What a record does not tell of a current: at which moment within a sample it changes.

A logger that is slower than the controller, or has another clock, shows a jump at the next sample.
"""

from __future__ import annotations

import numpy as np

from ...errors import Diverged
from .comparison import BuildingComparison
from .errors import pooled_error
from .model import BuildingModel, RecordedCurrent
from .record import BuildingRecord

_DRAWS = 8
"""Simulations with changes at random moments. Effort."""


def switching_error(comparison: BuildingComparison, held_out: bool) -> float:
    """Error of all channels by changes of the current at unknown moments within their samples."""
    model, each = comparison.model, []
    for segment in comparison.segments(held_out):
        record = segment.record
        if record.current is None or not np.ptp(record.current) > 0:
            return 0.0
        try:
            runs = np.array([_simulated(model, record, seed) for seed in range(_DRAWS)])
        except Diverged:
            return 0.0
        spread = runs.std(axis=0, ddof=1)[segment.samples]
        each.append((spread, record.values[segment.samples]))
    return pooled_error(each, comparison.seen)


def _simulated(model: BuildingModel, record: BuildingRecord, seed: int) -> np.ndarray:
    """Simulate a record whose current changes at random moments within its samples."""
    random = np.random.default_rng(seed)
    control = model.control(record)
    assert isinstance(control, RecordedCurrent) and record.current is not None
    before = np.flatnonzero(np.diff(control.values))
    moments = (before + random.uniform(0.0, 1.0, before.size)) * record.dt + model.delay
    control.table = (
        np.append(0.0, moments), np.append(control.values[0], control.values[before + 1])
    )  # fmt: skip
    run = model.run(record, control=control)
    shown = run.combined(model.measured(record, run.isolated, run.outputs.names))
    return model.sensed(record, shown)
