"""The filter of a record whose file states none, from what slow motion it lacks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from ..decisions import INSTEAD
from .comparison import BuildingComparison, CauseValues, compare_building, squared
from .record import BuildingRecord
from .record_filter import RecordFilter

_CORNERS = (0.05, 0.1, 0.2)
"""Hz: first guesses of a corner; agencies use 0.02 to 0.3."""
_STEPS = (1.4, 1.2, 1.1, 1.05)
"""Factors by which the corner is then moved."""
_REFINED = 3
"""Shapes of filters whose corners are moved."""
_LOW_PASSES = (15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 50.0)
"""Hz: their other corner."""


def with_likeliest_filter(
    comparison: BuildingComparison, causes: CauseValues = ()
) -> BuildingComparison:
    """Compare again as if the records without a stated filter had passed the one that fits best.

    Causes are in the model.
    """
    if all(record.filter for record in comparison.records):
        return comparison
    before = squared(comparison.fitted_residuals(causes))
    costs = {one: _cost(comparison, causes, one) for one in _guesses()}
    shapes: dict[RecordFilter, RecordFilter] = {}
    for one in sorted(costs, key=lambda one: costs[one]):
        shapes.setdefault(_with_corner(one, 1.0), one)
    for best in list(shapes.values())[:_REFINED]:
        for step in _STEPS:
            near = [_with_corner(best, best.slow * factor) for factor in (step, 1 / step)]
            costs |= {one: _cost(comparison, causes, one) for one in near}
            best = min((best, *near), key=lambda one: costs[one])
    best = min(costs, key=lambda one: costs[one])
    noise = sum(segment.noise_cost for segment in comparison.fitted)
    if not costs[best] - noise < INSTEAD * (before - noise):
        return comparison
    records = _filtered(comparison.records, _with_low_pass(comparison, causes, best))
    return compare_building(comparison.model, records, causes)


def _guesses() -> Iterator[RecordFilter]:
    """Filters of agencies."""
    for corner, ground in product(_CORNERS, (True, False)):
        yield RecordFilter(high_pass_Hz=corner, ground=ground)
        yield RecordFilter(high_pass_Hz=(corner / 2, corner), ground=ground)
        for order in (2, 4):
            yield RecordFilter(high_pass_Hz=corner, order=order, zero_phase=False, ground=ground)


def _with_corner(one: RecordFilter, corner: float) -> RecordFilter:
    corner = float(f"{corner:.3g}")
    ramp = isinstance(one.high_pass_Hz, tuple)
    return one.model_copy(update={"high_pass_Hz": (corner / 2, corner) if ramp else corner})


def _with_low_pass(
    comparison: BuildingComparison, causes: CauseValues, found: RecordFilter
) -> RecordFilter:
    """Add the low-pass filter that leaves white noise above the building's band, if any does."""
    residual = comparison.residual(causes, comparison.records[0])
    dt, n = comparison.records[0].dt, len(residual)
    shaped = np.hanning(n)[:, np.newaxis] * residual
    power = (np.abs(np.fft.rfft(shaped, axis=0)) ** 2).T
    frequencies = np.fft.rfftfreq(n, dt)
    used = (frequencies > comparison.floors[0].band) & (frequencies < 0.45 / dt)

    def unevenness(one: RecordFilter) -> float:
        passed = np.abs(one.response(n, dt)[used]) ** 2
        bands = np.array_split(np.log(power[:, used] / np.maximum(passed, 1e-4)), 8, axis=1)
        return float(np.mean(np.var([band.mean(axis=1) for band in bands], axis=0)))

    lows = (None, *(low for low in _LOW_PASSES if low < 0.5 / dt))
    return min((found.model_copy(update={"low_pass_Hz": low}) for low in lows), key=unevenness)


def _filtered(
    records: Sequence[BuildingRecord], assumed: RecordFilter
) -> tuple[BuildingRecord, ...]:
    said = (
        f"slow motion is missing: simulated motion is compared behind the filter that "
        f"fits best, as if the file had the line '# {assumed.line}'"
    )
    return tuple(
        one if one.filter else replace(one, filter=assumed, notes=(*one.notes, said))
        for one in records
    )


def _cost(comparison: BuildingComparison, causes: CauseValues, assumed: RecordFilter) -> float:
    """Squared weighted residuals where the records are fitted, as if they had passed a filter."""
    other = replace(comparison, records=_filtered(comparison.records, assumed))
    return squared(comparison.as_assumed_by(other).fitted_residuals(causes))
