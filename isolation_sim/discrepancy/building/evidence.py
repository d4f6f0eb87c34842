"""What a building's residuals say in words: what they depend on, intervals, the next test."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..diagnosis import Interval
from .causes import TYPICAL_PERIOD
from .errors import pooled, relative_errors
from .fit import Comparison, Outcome, coordinates, values_of, with_causes
from .part import Part, band_edges, cell_means
from .record import DISPLACEMENT, BuildingRecord
from .selection import Selection, Trial, cell_p_values

_BINS, _LEAST_SHARE, _LEVEL = 6, 0.05, 1e-3


def intervals(outcome: Outcome) -> list[dict[str, Interval]]:
    """Numbers of all causes with their 95 % intervals.

    Parameters
    ----------
    outcome : Outcome
        A fit of all of them.

    Returns
    -------
    list of dict of str to Interval
        One a cause. From the curvature at the optimum, the noise counted as far as it is
        independent.
    """
    if outcome.optimum is None:
        return []
    jacobian = outcome.optimum.jacobian
    size = np.sqrt((jacobian**2).sum(axis=0))
    size[size == 0] = 1e-300
    inverse = np.linalg.pinv((jacobian / size).T @ (jacobian / size))
    # as many residuals as are independent carry the same sum of squares
    deviation = np.sqrt(outcome.cost / outcome.n_independent * inverse.diagonal()) / size
    said, at = [], 0
    for cause, values in outcome.found:
        x = coordinates(cause.parameters, values)
        width = 1.96 * deviation[at : at + len(x)]
        lower, upper = (
            np.clip(values_of(cause.parameters, end), [p.lower for p in cause.parameters],
                    [p.upper for p in cause.parameters])
            for end in (x - width, x + width)
        )  # fmt: skip
        numbers = {
            p.name: Interval(v * p.factor, float(a * p.factor), float(b * p.factor), p.unit)
            for p, v, a, b in zip(cause.parameters, values, lower, upper, strict=True)
        }
        fixed = {name: Interval(v, v, v, "1") for name, v in cause.numbers}
        said.append({**fixed, **numbers})
        at += len(x)
    return said


def evidence(selection: Selection, k: int, numbers: dict[str, Interval]) -> str:
    """One sentence on why a cause is believed.

    Parameters
    ----------
    selection : Selection
        What was found.
    k : int
        Which of the causes.
    numbers : dict of str to Interval
        Its numbers.

    Returns
    -------
    str
    """
    comparison, cause = selection.comparison, selection.after.found[k][0]
    without = selection.without[k]
    errors = [
        100 * pooled(relative_errors(comparison, outcome, True))
        for outcome in (without, selection.after)
    ]
    what = cause.says.format(**{name: one.value for name, one in numbers.items()})
    what = what.replace("%", " %")
    part = comparison.held_out[0]
    gain = cell_means(without.held_out[0]) - cell_means(selection.after.held_out[0])
    channel, low, high = _cell(part, int(np.argmax(gain * part.cell_sizes)))
    return (
        f"If {what}, the error on data not fitted falls from {errors[0]:.2g} to {errors[1]:.2g} %, "
        f"most of it in {channel} at {low:.1f} to {high:.1f} Hz."
    )


def dependences(comparison: Comparison, outcome: Outcome) -> list[tuple[str, float, float]]:
    """What a residual depends on.

    Parameters
    ----------
    comparison : Comparison
        The records.
    outcome : Outcome
        The model.

    Returns
    -------
    list of (str, float, float)
        Variable, part of the residual's variance that goes with it, p-value; the strongest first.
        The residual is that of the acceleration of the whole, the isolation layer's force.
    """
    from scipy.stats import f

    columns: dict[str, list[NDArray]] = {}
    residuals, n_independent = [], 0.0
    for record in comparison.records:
        residual = comparison.residual(outcome.found, record)[:, :-1].mean(axis=1)
        residuals.append(residual - residual.mean())
        n_independent += _independent(residuals[-1])
        for name, values in _variables(record).items():
            columns.setdefault(name, []).append(values)
    residual = np.concatenate(residuals)
    found = []
    for name, pieces in columns.items():
        values = np.concatenate(pieces)
        edges = np.unique(np.quantile(values, np.linspace(0, 1, _BINS + 1)[1:-1]))
        number = np.searchsorted(edges, values)
        counts = np.bincount(number, minlength=len(edges) + 1)
        sums = np.bincount(number, residual, minlength=len(edges) + 1)
        filled = counts > 0
        share = float((sums[filled] ** 2 / counts[filled]).sum() / np.sum(residual**2))
        degrees, rest = max(filled.sum() - 1, 1), max(n_independent - filled.sum(), 1.0)
        chance = float(f.sf(share / max(1 - share, 1e-12) * rest / degrees, degrees, rest))
        found.append((name, share, chance))
    return sorted(found, key=lambda row: -row[1])


def depends_on(
    comparison: Comparison, outcome: Outcome, shares: Sequence[tuple[str, float, float]]
) -> tuple[str, ...]:
    """Name what a residual depends on.

    Parameters
    ----------
    comparison : Comparison
        The records.
    outcome : Outcome
        The model.
    shares : sequence of (str, float, float)
        As ``dependences`` returns them.

    Returns
    -------
    tuple of str
        Variables, then the channel and band in which it exceeds the noise most.
    """
    named = [name for name, share, p in shares if share > _LEAST_SHARE and p < _LEVEL]
    part, whitened = comparison.fitted[0], outcome.fitted[0]
    if cell_p_values(part, whitened).min() < _LEVEL:
        excess = (cell_means(whitened) - part.expected) * part.cell_sizes
        channel, low, high = _cell(part, int(np.argmax(excess)))
        named.append(f"{channel} at {low:.1f} to {high:.1f} Hz")
    return tuple(named)


def next_test(selection: Selection) -> str | None:
    """The test that would best tell causes apart that these data do not.

    Parameters
    ----------
    selection : Selection
        What was found.

    Returns
    -------
    str or None
        The same ground motion stronger or weaker, or another current; chosen by what the rival
        models say of each. None if nothing is in doubt.
    """
    doubts: list[tuple[int, Trial]] = [
        (k, rivals[0]) for k, rivals in enumerate(selection.rivals) if rivals
    ]
    if not doubts:
        return None
    k, rival = doubts[0]
    comparison = selection.comparison
    part = comparison.fitted[0]
    models = [
        with_causes(comparison.model, found)
        for found in (selection.after.found, rival.outcome.found)
    ]
    best, most = "", -1.0
    for label, record in _tests(part.record, comparison):
        apart = models[0].simulated(record) - models[1].simulated(record)
        whole = replace(part, record=record)
        size = float(np.mean(whole.whitened(apart) ** 2))
        if np.isfinite(size) and size > most:
            best, most = label, size
    return (
        f"{best}: there {selection.after.found[k][0].label} and {rival.cause.label} differ by "
        f"{np.sqrt(most):.1f} times the noise"
    )


def _tests(
    record: BuildingRecord, comparison: Comparison
) -> list[tuple[str, BuildingRecord]]:
    tests = []
    for factor in (0.5, 1.0, 1.5, 2.0):
        label = f"the same ground motion times {factor:g}" if factor != 1 else "the same once more"
        tests.append((label, replace(record, ground=record.ground.scaled(factor))))
    if comparison.model.device.depends_on_current:
        low, high = comparison.model.nominal.current_range()
        high = min(high, comparison.model.nominal.tested_current())
        for current in filter(np.isfinite, (max(low, 0.0), high)):
            held = replace(record, current=np.full(len(record.ground), current))
            tests.append((f"the same ground motion with {current:g} A held", held))
    return tests


def _variables(record: BuildingRecord) -> dict[str, NDArray]:
    """What a residual could depend on, each (n,)."""
    x = record.response[DISPLACEMENT]
    dt = record.ground.dt
    half = max(int(TYPICAL_PERIOD / 2 / dt), 1)
    size = np.abs(x)
    padded = np.pad(size, half, mode="edge")
    amplitude = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1).max(axis=1)
    found = {
        "isolator displacement": x,
        "isolator velocity": np.gradient(x, dt),
        "present amplitude times displacement": amplitude * x,
        "largest past displacement times displacement": np.maximum.accumulate(size) * x,
        "time": record.ground.time,
    }
    if record.current is not None and np.ptp(record.current) > 0:
        found["coil current"] = record.current
        found["coil current times displacement"] = record.current * x
    return found


def _independent(residual: NDArray) -> float:
    """Number of independent samples: the spectrum's participation number, twice."""
    power = np.abs(np.fft.rfft(residual)) ** 2
    return 2 * float(power.sum() ** 2 / max(np.sum(power**2), 1e-300))


def _cell(part: Part, k: int) -> tuple[str, float, float]:
    """Channel and band of a cell, Hz."""
    band, channel = divmod(k, len(part.record.channels))
    edges = band_edges(len(part.frequencies))
    frequency = part.frequencies
    low, high = frequency[edges[band]], frequency[edges[band + 1] - 1]
    return part.record.channels[channel], float(low), float(high)
