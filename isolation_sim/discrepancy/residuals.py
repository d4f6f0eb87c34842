"""Residual analysis: dependence of a residual, without any assumption on the cause.

The statistic differs with the data. Device tests have many samples: a general function is fitted to
every other half second and evaluated between. A building record is one long response whose
independent samples are few: the variance between groups of a variable is tested. A loop table has a
few rows: ranks are correlated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..identification.measured_runs import MeasuredRuns
from .decisions import DEPENDENCE_LEVEL, LEAST_DEPENDENCE, NEARLY_AS_MUCH, RESIDUAL_BLOCK

if TYPE_CHECKING:
    from .device.model import FittedModel
    from .loops.table import LoopTable

_HATS, _FINE_HATS = 12, 64
_RIDGE = 1e-6
_BINS = 6
DRIFT = "a zero of the force that drifts, test by test"
"""Dependence on no variable that a law could have."""


@dataclass(frozen=True)
class Dependence:
    """How well functions of some variables predict a residual."""

    variables: tuple[str, ...]  # Such as "displacement", "current", "past_deformation"
    text: str  # The dependence in words
    share: float  # Share of the residual's misfit that it predicts
    # Chance of such a share if there were no dependence; not a number where it is not tested
    p_value: float = float("nan")


def smallest_set(result: Sequence[Dependence]) -> tuple[str, ...]:
    """Smallest set of variables that predicts nearly as much as any; empty if none predicts."""
    best = max((d.share for d in result), default=0.0)
    if best < LEAST_DEPENDENCE:
        return ()
    near = [d for d in result if d.share > NEARLY_AS_MUCH * best]
    return min(near, key=lambda d: (len(d.variables), -d.share)).variables


def significant(result: Sequence[Dependence], least: float = LEAST_DEPENDENCE) -> tuple[str, ...]:
    """Variables of all dependences that are large enough and no accident."""
    return tuple(d.text for d in result if d.share > least and not d.p_value >= DEPENDENCE_LEVEL)


def of_device_tests(base: FittedModel, noise_cost: float) -> list[Dependence]:
    """Predict the residual of a law by general functions, the best first."""
    # ``noise_cost`` is the cost of noise alone; the share is that of the misfit above it.
    data = base.model.data
    force, weight = data.bounded(base.force), data.weight
    residual = (force - data.force) * weight
    first, second = _halves(data)
    part = float(np.sum(residual[second] ** 2) + np.sum(residual[first] ** 2))
    whole = base.cost if np.isfinite(base.cost) else np.inf  # of a law that diverges
    misfit = part * (1 - noise_cost / whole) if whole > noise_cost else 0.0
    if misfit == 0.0:
        return []  # a residual of noise depends on nothing
    result = []
    for names, text, columns in _sets(data, force):
        design = columns * weight[:, np.newaxis]
        explained = 0.0
        for fit, evaluate in ((first, second), (second, first)):
            predicted = _ridge(design[fit], residual[fit], design[evaluate])
            r = residual[evaluate]
            explained += float(r @ r - (r - predicted) @ (r - predicted))
        result.append(Dependence(names, text, min(explained / misfit, 1.0)))
    return sorted(result, key=lambda d: -d.share)


def of_loops(table: LoopTable, ratios: NDArray) -> list[Dependence]:
    """Correlate the ranks of modelled over measured stiffness and damping with the conditions."""
    from scipy.stats import spearmanr

    n = len(table.amplitude)
    halves = [r for r in (ratios[:n], ratios[n:]) if np.ptp(r) > 0]
    return [
        Dependence((name,), name, max((spearmanr(v, r)[0] ** 2 for r in halves), default=0.0))
        for name, v in (
            ("amplitude", table.amplitude), ("frequency", table.frequency),
            ("current", table.current),
        )
        if np.ptp(v) > 0
    ]  # fmt: skip


def of_building(
    residuals: Sequence[NDArray], variables: Sequence[dict[str, NDArray]]
) -> list[Dependence]:
    """Share of a residual's variance between groups of each variable, the largest first."""
    # ``residuals`` (n,) and ``variables`` are those of each record.
    from scipy.stats import f

    centred = [one - one.mean() for one in residuals]
    n_independent = sum(_independent(one) for one in centred)
    residual = np.concatenate(centred)
    result = []
    for name in dict.fromkeys(name for one in variables for name in one):
        values = np.concatenate([one[name] for one in variables])
        edges = np.unique(np.quantile(values, np.linspace(0, 1, _BINS + 1)[1:-1]))
        number = np.searchsorted(edges, values)
        counts = np.bincount(number, minlength=len(edges) + 1)
        sums = np.bincount(number, residual, minlength=len(edges) + 1)
        filled = counts > 0
        share = float((sums[filled] ** 2 / counts[filled]).sum() / np.sum(residual**2))
        degrees, rest = max(filled.sum() - 1, 1), max(n_independent - filled.sum(), 1.0)
        chance = float(f.sf(share / max(1 - share, 1e-12) * rest / degrees, degrees, rest))
        result.append(Dependence((name,), name, share, chance))
    return sorted(result, key=lambda d: -d.share)


def _independent(residual: NDArray) -> float:
    """Number of independent samples: the spectrum's participation number, twice."""
    power = np.abs(np.fft.rfft(residual)) ** 2
    return 2 * float(power.sum() ** 2 / max(np.sum(power**2), 1e-300))


def _halves(data: MeasuredRuns) -> tuple[NDArray, NDArray]:
    block = np.concatenate(
        [
            (np.arange(n) * dt / RESIDUAL_BLOCK).astype(int) % 2 == 0
            for n, dt in zip(data.lengths, data.dt, strict=True)
        ]
    )
    return block & data.fitted, ~block & data.fitted


def _ridge(design: NDArray, target: NDArray, evaluated: NDArray) -> NDArray:
    norm = np.sqrt(np.einsum("ij,ij->j", design, design))
    keep = norm > 1e-9 * max(float(norm.max(initial=0.0)), 1e-300)
    if not keep.any():
        return np.zeros(len(evaluated))
    scaled = design[:, keep] / norm[keep]
    square = scaled.T @ scaled + _RIDGE * np.eye(int(keep.sum()))
    return (evaluated[:, keep] / norm[keep]) @ np.linalg.solve(square, scaled.T @ target)


def _hats(values: NDArray, number: int = _HATS) -> NDArray:
    """Piecewise-linear functions of a variable, a column each."""
    low, high = np.quantile(values, [0.002, 0.998])
    if not high > low:
        return np.ones((len(values), 1))
    place = (np.clip(values, low, high) - low) / (high - low) * (number - 1)
    return np.maximum(1 - np.abs(place[:, np.newaxis] - np.arange(number)), 0.0)


def _times(left: NDArray, right: NDArray) -> NDArray:
    """All products of two sets of columns."""
    return (left[:, :, np.newaxis] * right[:, np.newaxis, :]).reshape(len(left), -1)


def _sets(data: MeasuredRuns, force: NDArray) -> list[tuple[tuple[str, ...], str, NDArray]]:
    """Variables, words and columns of each general function."""
    x, v = data.x / np.max(np.abs(data.x)), data.v / np.max(np.abs(data.v))
    linear = np.stack([np.ones_like(x), x, v, force / np.max(np.abs(force))], axis=1)
    peak, running = _amplitudes(data)
    result: list[tuple[tuple[str, ...], str, NDArray]] = [
        (("displacement",), "displacement alone", _hats(x)),
        (("displacement",), "displacement in short waves", _hats(x, _FINE_HATS)),
        (("velocity",), "velocity alone", _hats(v)),
        (("acceleration",), "acceleration", _hats(data.a)),
        (("displacement", "velocity"), "displacement and velocity",
         _times(_hats(x, 8), _hats(v, 8))),
        (("amplitude",), "stiffness or damping by the present amplitude",
         _times(_hats(running, 6), linear)),
        (("past_deformation",), "stiffness or damping by the largest past deformation",
         _times(_hats(peak, 6), linear)),
        (("time",), "stiffness or damping that drifts in time, test by test", _by_run(data, force)),
        (("time",), DRIFT, _by_run(data, np.ones_like(force))),
    ]  # fmt: skip
    if np.ptp(data.current) > 0:
        current = _hats(data.current, 6)
        rate = _rate(data)
        result += [
            (("current",), "stiffness or damping by the current", _times(current, linear)),
            (("current", "velocity"), "current and velocity", _times(current, _hats(v, 8))),
            (("current", "displacement"), "current and displacement",
             _times(current, _hats(x, 8))),
        ]  # fmt: skip
        if np.any(rate):
            result.append(
                (("current", "time"), "recent changes of the current", _times(rate, linear))
            )
    if np.ptp(data.temperature) > 0:
        result.append(
            (("temperature",), "stiffness or damping by the temperature",
             _times(_hats(data.temperature, 5), linear))
        )  # fmt: skip
    return result


def _amplitudes(data: MeasuredRuns) -> tuple[NDArray, NDArray]:
    """Largest deformation so far, and over the last second or so."""
    peak, recent = np.empty_like(data.x), np.empty_like(data.x)
    for run, dt in zip(data.runs, data.dt, strict=True):
        size = np.abs(data.x[run])
        peak[run] = np.maximum.accumulate(size)
        width = max(int(1.0 / dt), 1)
        square = np.cumsum(np.concatenate([np.zeros(1), size**2]))
        first = np.maximum(np.arange(len(size)) + 1 - width, 0)
        recent[run] = np.sqrt((square[1:] - square[first]) / (np.arange(len(size)) + 1 - first))
    return peak, recent


def _rate(data: MeasuredRuns) -> NDArray:
    """Remainders of changes of the current after 20, 60 and 200 ms."""
    columns = []
    for lag in (0.02, 0.06, 0.2):
        column = np.empty_like(data.current)
        for run, dt in zip(data.runs, data.dt, strict=True):
            keep, value, current = np.exp(-dt / lag), data.current[run.start], data.current[run]
            for k, now in enumerate(current.tolist()):
                value = now + (value - now) * keep
                column[run.start + k] = now - value
        columns.append(column)
    return np.stack(columns, axis=1)


def _by_run(data: MeasuredRuns, size: NDArray) -> NDArray:
    """Four slow functions of time, each run by itself, times a size at each sample."""
    columns = np.zeros((len(data.x), 4 * len(data.dt)))
    for k, run in enumerate(data.runs):
        columns[run, 4 * k : 4 * k + 4] = (
            _hats(np.arange(run.stop - run.start, dtype=float), 4) * size[run, np.newaxis]
        )
    return columns
