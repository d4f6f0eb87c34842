"""Tests that look wrong beside the others: another unit, or the same data twice."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..run_table import TestRun

_FACTOR = 100.0
"""Multiple of the usual stiffness from which a unit looks wrong."""
_LARGEST = {"displacement": (2.0, "m"), "current": (30.0, "A"), "force": (1e8, "N")}
"""Values beyond which a unit looks wrong."""


def range_notes(runs: Sequence[TestRun]) -> list[str]:
    """Notes of tests whose ranges look wrong, or whose forces are those of another test."""
    notes = []
    for what, (most, unit) in _LARGEST.items():
        peaks = [float(np.quantile(np.abs(getattr(run, what)), 0.95)) for run in runs]
        large = [run.name for run, peak in zip(runs, peaks, strict=True) if peak > most]
        if large:
            notes.append(
                f"{_names(large)}: {what} up to {max(peaks):.4g} {unit}; check the unit of the "
                "column"
            )
    stiffness = np.array([_spread(run.force) / _spread(run.displacement) for run in runs])
    ratios = stiffness / np.median(stiffness)
    for far, words in ((ratios > _FACTOR, "above"), (ratios < 1 / _FACTOR, "below")):
        if far.any():
            names = _names([run.name for run, off in zip(runs, far, strict=True) if off])
            most = float(np.max(np.exp(np.abs(np.log(ratios[far])))))
            notes.append(
                f"{names}: force over displacement {most:.3g} times {words} that of the other "
                "tests; check the units of both columns"
            )
    first: dict[bytes, str] = {}
    origins = [first.setdefault(run.force.tobytes(), run.name) for run in runs]
    again = [run.name for run, origin in zip(runs, origins, strict=True) if run.name != origin]
    if again:
        notes.append(f"{_names(again)}: the forces are those of another test, sample by sample")
    return notes


def _spread(values: np.ndarray) -> float:
    # quantiles: a few wrong samples do not count
    low, high = np.quantile(values, (0.02, 0.98))
    return float(high - low) or float(np.ptp(values))


def _names(names: Sequence[str]) -> str:
    return ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
