"""What a record does not tell of a current that jumps: the moment within a sample.

A logger that is slower than the controller, or has another clock, shows a jump at the next sample.
"""

from __future__ import annotations

import numpy as np

from ...errors import Diverged
from .comparison import CauseValues, Comparison, with_causes
from .errors import pooled_error
from .model import BuildingModel, RecordedCurrent
from .record import BuildingRecord

_JUMP = 0.25
"""Change within a sample, over the range of the current, that is a jump. Convention."""
_MOSTLY = 0.8
"""Share of all changes that jumps make in a current that jumps. Convention."""
_DRAWS = 8
"""Simulations with jumps at random moments. Effort."""


def jumps(record: BuildingRecord) -> int:
    """Number of jumps of a record's current; 0 if it mostly changes otherwise."""
    if record.current is None or not np.ptp(record.current) > 0:
        return 0
    changes = np.abs(np.diff(record.current))
    jump = changes > _JUMP * np.ptp(record.current)
    return int(jump.sum()) if changes[jump].sum() > _MOSTLY * changes.sum() else 0


def switching_error(comparison: Comparison, causes: CauseValues, held_out: bool) -> float:
    """Error of all channels by jumps at unknown moments within their samples; 0 without jumps."""
    model = with_causes(comparison.model, causes)
    each = []
    for segment in comparison.segments(held_out):
        record = segment.record
        if not jumps(record):
            return 0.0
        try:
            runs = np.array([_simulated(model, record, seed) for seed in range(_DRAWS)])
        except Diverged:
            return 0.0
        spread = runs.std(axis=0, ddof=1)[segment.samples]
        each.append((spread, record.values[segment.samples]))
    return pooled_error(each, comparison.seen)


def _simulated(model: BuildingModel, record: BuildingRecord, seed: int) -> np.ndarray:
    """Simulate a record whose current jumps at random moments within its samples."""
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
