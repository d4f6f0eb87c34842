"""The next test of a building that tells best between a cause and its first rival."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .comparison import BuildingComparison, FittedBuilding, with_causes
from .record import BuildingRecord

_REST = 120.0
"""s: a rest in which devices cool that heat in an earthquake. Convention."""


def next_test(
    comparison: BuildingComparison, found: FittedBuilding, label: str, rival: FittedBuilding
) -> str:
    """The ground motion scaled, or another current, where a cause and its rival differ most."""
    segment = comparison.fitted[0]
    models = [with_causes(comparison.model, one.cause_values) for one in (found, rival)]
    best, most = "", -1.0
    for test, record in _tests(segment.record, comparison):
        apart = models[0].simulated(record) - models[1].simulated(record)
        apart = apart[len(record) - len(segment.record) :]
        size = float(np.mean(replace(segment, record=record).whiten(apart) ** 2))
        if np.isfinite(size) and size > most:
            best, most = test, size
    return (
        f"To distinguish {label} from {rival.causes[-1]}: {best}; their predictions differ there "
        f"by {np.sqrt(most):.3g} times the noise (RMS)."
    )


def _tests(
    record: BuildingRecord, comparison: BuildingComparison
) -> Iterator[tuple[str, BuildingRecord]]:
    for factor in (0.5, 1.0, 1.5, 2.0):
        again = f"times {factor:g}" if factor != 1 else "once more"
        ground = tuple(motion.scaled(factor) for motion in record.ground)
        yield f"the same ground motion {again}", replace(record, ground=ground)
    yield f"the same ground motion, and again after a rest of {_REST:g} s", _twice(record)
    if comparison.model.device.depends_on_current:
        low, high = comparison.model.nominal.current_range()
        high = min(high, comparison.model.nominal.tested_current())
        for current in filter(np.isfinite, (max(low, 0.0), high)):
            held = replace(record, current=np.full(len(record), current))
            yield f"the same ground motion with {current:g} A held", held


def _twice(record: BuildingRecord) -> BuildingRecord:
    """The motion of a record, a rest, and the motion once more."""

    def repeated(values: NDArray, rest: float = 0.0) -> NDArray:
        return np.concatenate([values, np.full(round(_REST / record.dt), rest), values])

    return replace(
        record,
        ground=tuple(replace(m, acceleration=repeated(m.acceleration)) for m in record.ground),
        response={name: repeated(values) for name, values in record.response.items()},
        current=None if record.current is None else repeated(record.current, record.current[0]),
    )
