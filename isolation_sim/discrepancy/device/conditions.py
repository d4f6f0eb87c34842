"""Conditions of tests: runs that share their current, their amplitude or their frequency."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ...identification.measured_runs import MeasuredRuns

_SAME = 0.15
"""Relative difference up to which two amplitudes or frequencies are one condition."""


def conditions(data: MeasuredRuns) -> Iterator[tuple[str, NDArray]]:
    """Name each condition that some runs share and others do not, and its runs, (n_runs,) bool."""
    spans = [(float(data.current[run].min()), float(data.current[run].max())) for run in data.runs]
    steady = all(high - low < 1e-3 for low, high in spans)
    sizes = np.array([np.max(np.abs(data.x[run])) for run in data.runs])
    rates = np.array([np.std(data.v[run]) / max(np.std(data.x[run]), 1e-300) for run in data.runs])
    families = [("mm", 1e3 * sizes, _SAME), ("Hz", rates / (2 * np.pi), _SAME)]
    if steady:
        families.insert(0, ("A", np.mean(spans, axis=1), 0.0))
    for unit, values, tolerance in families:
        groups = same_values(values, tolerance, 1e-3)
        for group in groups if len(groups) > 1 else ():
            yield f"{np.mean(values[group]):.2g} {unit}", group


def same_values(values: NDArray, tolerance: float, least: float = 1e-9) -> list[NDArray]:
    """Runs whose values lie together, relatively or within ``least``, the smallest first."""
    order = np.argsort(values, kind="stable")
    step = np.diff(values[order]) > tolerance * np.abs(values[order][1:]) + least
    number = np.empty(len(values), int)
    number[order] = np.concatenate([[0], np.cumsum(step)])
    return [number == k for k in range(int(number.max()) + 1)]
