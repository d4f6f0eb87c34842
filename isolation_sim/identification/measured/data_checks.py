"""Checks of measured data before any model is fitted."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ground_motions.units import STANDARD_GRAVITY

from ...errors import InputError
from .channel_checks import (
    clipped_channels,
    coarse_channels,
    drifting_channels,
    noisy_channels,
    rms,
)
from .force_channel import averaging_note
from .noise import fast_part, white_noise
from .run_table import TestRun
from .velocity import smooth

_LARGEST_DEFORMATION = 1.0
"""m. A larger deformation is asked for its unit. Convention."""
_REVERSED = 0.02
"""Power that a device gives off in the median run, over RMS force times RMS velocity, that is
noted; one without damping gives off none. Convention."""
_REVERSED_ALONE = 0.1
"""The same of single runs; a late channel alone may turn loops of little damping. Blind."""
_TURNED = 0.5
"""Share of the force in phase with the displacement that is noted where it is negative in single
runs, and positive in the median run. Convention."""
_TRANSIENT = 3.0
"""Factor on the usual residual of a static function of the motion at both ends of a run.
Convention; the MR damper's filtered tests reach 3 to 20."""
_ABOVE_ALL = 2.0
"""Factor on the largest such residual of a stretch as long as an end, elsewhere in the run.
Convention; those tests reach 1.3 to 10, a sweep of the amplitude 2.
"""
_SMALLER = 0.5
"""RMS velocity at an end over that of the run below which the motion begins or ends there.
Convention."""
_CHANGING = 0.1
"""Range of a run's current over the largest of all runs from which it changes. Convention."""
_OFFSET = 0.1
"""Share of a run's RMS force by which its mean may differ from that of the others.
Convention."""
_NOT_DERIVATIVE = 0.2
"""Share of a measured velocity or acceleration that the displacement does not give. Convention."""
_GAIN_ERROR = 0.05
"""Relative error of the size of a velocity or acceleration that is noted. Convention."""
_SHIFT = 0.5
"""Delay between two channels, in samples, that is noted. Convention."""
_UNIT_ERROR = 0.05
"""Relative deviation from 9.81 or 1000 up to which a factor looks like a confusion of units.
Convention."""
_UNIT_FACTOR = 300.0
"""Factor on one run's stiffness over the others' that looks like one of 1000. Convention."""
_COLUMN_UNITS = (1.0, 1e3, 1e6)
"""Unit of a force column over that of a displacement column, N/m: N or kN over m or mm."""
_FAR_OFF, _NEAR = 30.0, 4.0
"""Factors on the stiffness of the other runs: of one whose columns may be swapped, and of the same
run with its columns exchanged. Convention."""
_LARGEST_CURRENT, _LARGEST_FORCE = 100.0, 1e8
"""A, N. A larger current or force is asked for its unit. Convention."""
_SMALLEST_FORCE, _SMALLEST_DEFORMATION = 1.0, 1e-5
"""N, m. Runs that all stay below it are asked for their unit. Convention."""
_SHORTEST_STEP, _LONGEST_STEP = 1e-5, 0.5
"""s. Runs that are sampled faster or slower are asked for the unit of their times. Convention."""
_FAST_PART = 0.05
"""Share of the velocity near the highest frequencies that is noted. Convention."""
_SAME_MOTION = 0.03
"""Relative difference up to which two runs repeat one motion and current. Convention."""
_SAME_TEMPERATURE = 3.0
"""Difference in degC up to which such runs have one temperature: 1 % of force or so. Convention."""
_REPEATED = 0.02
"""Relative difference of the forces of repeated runs that is noted. Convention."""
_SHOWN_PAIRS = 4
"""Pairs of such runs that are named. Convention."""
_LEAST_EDGE = 8
"""Samples of a run's end that say whether it is a transient: fewer are moved by the smoothing."""


def data_notes(runs: Sequence[TestRun], averaging: NDArray) -> list[str]:
    """Describe suspicious features of the runs; ``averaging`` of each run's force, (n_runs,), s."""
    notes = [note for check in _CHECKS for note in check(runs)]
    return [*notes, *filter(None, [averaging_note(averaging)])]


def unit_notes(runs: Sequence[TestRun]) -> list[str]:
    """Name runs whose sizes suggest that a column has another unit than its name says."""
    return [*_implausible_sizes(runs), *_unit_of_force(runs)]


def same_forces_notes(runs: Sequence[TestRun]) -> list[str]:
    """Name runs whose forces are those of another run, sample by sample."""
    first: dict[bytes, TestRun] = {}
    again = [run for run in runs if first.setdefault(run.force.tobytes(), run) is not run]
    if not again:
        return []
    return [f"{_names(again, runs)}: the forces are those of another test, sample by sample"]


def refuse_swapped(runs: Sequence[TestRun]) -> None:
    """Refuse runs whose displacement and force are swapped: a law that meets them diverges."""
    wrong = _swapped(runs)
    if wrong:
        raise InputError(
            f"{_names(wrong, runs)}: displacement and force look swapped: exchanged, they are as "
            "large as in the other runs; expected: each column under its own name"
        )


def _swapped(runs: Sequence[TestRun]) -> list[TestRun]:
    """Runs whose sizes are far off those of most others, but not with their columns exchanged."""
    if len(runs) < 3:
        return []
    size, force = (
        np.array([_range(values) for values in channel])
        for channel in zip(*((run.displacement, run.force) for run in runs), strict=True)
    )
    stiffness, usual = force / size, float(np.median(force / size))
    spread = float(np.quantile(size, 0.75) / np.quantile(size, 0.25))
    # a column is read in the unit of the other's name
    unit = np.array(_COLUMN_UNITS)
    near = _off(unit**2 / stiffness[:, np.newaxis] / usual) < _NEAR
    near &= _off(force[:, np.newaxis] / unit / np.median(size)) < _NEAR * min(spread, _FAR_OFF)
    # exchanged columns turn the loop round
    turned = np.array([np.mean(run.force * run.velocity) < 0 for run in runs])
    wrong = turned & (_off(stiffness / usual) > _FAR_OFF) & near.any(axis=1)
    return [run for run, one in zip(runs, wrong, strict=True) if one]


def _range(values: NDArray) -> float:
    """Range of a channel without its extremes, which single wrong samples would make."""
    low, high = np.quantile(values, (0.02, 0.98))
    return float(high - low) or 1e-300


def _off(ratio: Any) -> Any:
    """A factor, or its inverse if that is larger."""
    return np.maximum(ratio, 1 / ratio)


def _implausible_sizes(runs: Sequence[TestRun]) -> Iterator[str]:
    if max(np.max(np.abs(run.force)) for run in runs) < _SMALLEST_FORCE:
        yield f"all forces are below {_SMALLEST_FORCE:g} N; is their unit right?"
    if max(np.max(np.abs(run.displacement)) for run in runs) < _SMALLEST_DEFORMATION:
        yield f"all deformations are below {1e3 * _SMALLEST_DEFORMATION:g} mm; is their unit right?"
    currents = {run.name: float(np.max(np.abs(run.current))) for run in runs}
    wrong = [run for run in runs if currents[run.name] > _LARGEST_CURRENT]
    if wrong:
        usual = max((one for one in currents.values() if one <= _LARGEST_CURRENT), default=None)
        others = "" if usual is None else f", in the other runs {usual:.3g} A"
        most = max(currents.values())
        yield f"{_names(wrong, runs)}: current reaches {most:.3g} A{others}; is its unit right?"
    odd = [run for run in runs if not _SHORTEST_STEP <= run.step <= _LONGEST_STEP]
    if odd:
        step = f"a sample every {odd[0].step:.3g} s"
        yield f"{_names(odd, runs)}: {step}; is the unit of the time right?"
    for run in runs:
        for what, values, most, unit in (
            ("deformation", run.displacement, _LARGEST_DEFORMATION, "m"),
            ("force", run.force, _LARGEST_FORCE, "N"),
        ):
            largest = float(np.max(np.abs(values)))
            if largest > most:
                yield f"{run.name}: {what} reaches {largest:.3g} {unit}; is its unit right?"


def _sampling(runs: Sequence[TestRun]) -> Iterator[str]:
    gaps = sorted({f"{1e3 * run.step:.3g}" for run in runs}, key=float)
    if len(gaps) > 1:
        listed = ", ".join(gaps)
        yield f"sampling intervals differ: {listed} ms"


def _slow_sampling(runs: Sequence[TestRun]) -> Iterator[str]:
    parts = [(fast_part(run.displacement), run) for run in runs]
    if fast := [one for one in parts if one[0] > _FAST_PART]:
        most, run = max(fast, key=lambda one: one[0])
        yield (
            f"{_names([one for _, one in fast], runs)}: the motion reaches the highest frequencies "
            f"that {1 / run.step:.3g} samples a second show ({100 * most:.2g} % of the velocity): "
            "it counts as noise there; sample faster"
        )


def turned_runs(runs: Sequence[TestRun]) -> tuple[list[TestRun], str]:
    """Runs in which the device gives off energy, or has the others' stiffness with another sign."""
    power = np.array(
        [np.mean(run.force * run.velocity) / rms(run.force) / rms(run.velocity) for run in runs]
    )
    if np.median(power) < -_REVERSED:
        wrong = list(runs)
    else:
        wrong = [run for run, one in zip(runs, power, strict=True) if one < -_REVERSED_ALONE]
    if wrong:
        return wrong, "the loops run the wrong way round, the device gives off energy"
    moved = ((run.force - run.force.mean(), run.displacement) for run in runs)
    stiffness = np.array([np.mean(f * x) / rms(f) / rms(x) for f, x in moved])
    if np.median(stiffness) > _TURNED:
        wrong = [run for run, one in zip(runs, stiffness, strict=True) if one < -_TURNED]
    return wrong, "the stiffness is negative, and that of the other tests is not"


def _reversed_loops(runs: Sequence[TestRun]) -> Iterator[str]:
    wrong, why = turned_runs(runs)
    if wrong:
        yield (
            f"{_names(wrong, runs)}: {why}: the sign of force or displacement is turned, or both "
            "are swapped"
        )


def _transient_ends(runs: Sequence[TestRun]) -> Iterator[str]:
    """Runs whose force at both ends does not belong to the motion as it does in between."""
    wrong = []
    steady = _steady_current(runs)
    for run, is_steady in zip(runs, steady, strict=True):
        n = len(run.time)
        edge = n // 50
        if edge < _LEAST_EDGE or not is_steady:
            continue
        # hysteresis of a smaller motion follows no function of the larger one
        if min(rms(run.velocity[:edge]), rms(run.velocity[-edge:])) < _SMALLER * rms(run.velocity):
            continue
        columns, inside = _static_functions(run), slice(n // 10, n - n // 10)
        values = np.linalg.lstsq(columns[inside], run.force[inside])[0]
        error = run.force - columns @ values
        least = 1e-3 * rms(run.force)
        usual = max(rms(error[inside]), least)
        largest = max(rms(error[k : k + edge]) for k in range(n // 10, n - n // 10, edge))
        at_ends = min(rms(error[:edge]), rms(error[-edge:]))
        if at_ends > max(_TRANSIENT * usual, _ABOVE_ALL * largest):
            wrong.append(run)
    if wrong:
        yield (
            f"{_names(wrong, runs)}: at both ends the force does not belong to the motion as it "
            "does in between: the transients of a zero-phase filter; cut them off"
        )


def _steady_current(runs: Sequence[TestRun]) -> NDArray:
    """Whether the current of each run is steady: no static function follows a coil otherwise."""
    changing = _CHANGING * max(float(np.max(np.abs(run.current))) for run in runs)
    return np.array([not np.ptp(run.current) > changing > 0 for run in runs])


def _static_functions(run: TestRun) -> NDArray:
    """A constant and functions of the motion and the current of a run, (n, 11)."""
    x, v = run.displacement / rms(run.displacement), run.velocity / rms(run.velocity)
    i = run.current
    return np.stack(
        [np.ones(len(x)), x, v, x**3, v**3, np.abs(x) * v, x * np.abs(v), np.tanh(2 * v),
         np.tanh(5 * v), i * x, i * v], axis=1,
    )  # fmt: skip


def _differing_offsets(runs: Sequence[TestRun]) -> Iterator[str]:
    """Runs whose forces have means of their own."""
    if len(runs) < 3:
        return
    means = np.array([_mean_forces(run) for run in runs])
    off = means - np.median(means[:, 0])
    sizes = np.array([rms(run.force) for run in runs])
    least = _OFFSET * np.maximum(sizes, np.median(sizes))
    # an offset is there all the time; the mean of few or of uneven cycles moves
    towards = off[:, 1:] * np.sign(off[:, :1])
    offset = (np.abs(off[:, 0]) > least) & (towards > least[:, np.newaxis] / 2).all(axis=1)
    offset &= _steady_current(runs)
    wrong = [run for run, one in zip(runs, offset, strict=True) if one]
    if wrong:
        largest = np.max(np.abs(off[offset, 0]))
        yield (
            f"{_names(wrong, runs)}: the force's mean is up to {largest:.3g} N off that of the "
            "other runs: an offset of the load cell, or of the displacement where it follows the "
            "stiffness"
        )


def _mean_forces(run: TestRun) -> list[float]:
    """Force that no static function of motion and current gives: of a run, and of its thirds, N."""
    functions = _static_functions(run)
    # at rest a device may hold a force of its own
    moves = np.flatnonzero(np.abs(run.velocity) > 0.1 * rms(run.velocity))
    parts = moves, *np.array_split(moves, 3)
    return [np.linalg.lstsq(functions[at], run.force[at])[0][0] for at in parts]


def _velocity_channel(runs: Sequence[TestRun]) -> Iterator[str]:
    """Velocities and accelerations that are not the derivatives of the displacement."""
    for run in runs:
        slope, bend = smooth(run.displacement, run.step)[1:]
        channels = (
            [("acceleration", run.acceleration, bend)] if run.acceleration is not None else []
        )
        if run.velocity_measured:
            channels.insert(0, ("velocity", run.velocity, slope))
        for what, values, expected in channels:
            factor, late, rest = _against(values, expected, run.step)
            if unit := _unit_factor(factor):
                yield f"{run.name}: {what} is {unit} times the displacement's: is its unit right?"
            elif rest > _NOT_DERIVATIVE:
                if what == "acceleration":
                    continue  # the second derivative of a noisy displacement says no more
                yield (
                    f"{run.name}: {what} is not the displacement's derivative, {100 * rest:.0f} % "
                    "of it is something else"
                )
            elif abs(factor - 1) > _GAIN_ERROR:
                yield f"{run.name}: {what} is {factor:.3g} times the displacement's"
            elif abs(late) > _SHIFT * run.step:
                side = "behind" if late > 0 else "ahead of"
                yield (
                    f"{run.name}: {what} is {1e3 * abs(late):.2g} ms {side} the displacement: "
                    "channels shifted in time"
                )


def _unit_of_force(runs: Sequence[TestRun]) -> Iterator[str]:
    """Forces of one run a thousand times those of the others, or as many as kilograms are newtons.

    A factor of 9.81 is reported only where another run has the same motion.
    """
    stiffness = np.array([rms(run.force) / rms(run.displacement) for run in runs])
    for run, one in zip(runs, stiffness / np.median(stiffness), strict=True):
        if max(one, 1 / one) > _UNIT_FACTOR:
            yield (
                f"{run.name}: force over displacement is {one:.3g} times that of the other runs; "
                "are its units right?"
            )
    for first, second, n in _repeated(runs):
        factor = rms(second.force[:n]) / rms(first.force[:n])
        if (unit := _unit_factor(factor)) and not factor > _UNIT_FACTOR:
            yield f"{second.name}: force is {unit} times that of {first.name} under the same motion"


def _repeated_runs(runs: Sequence[TestRun]) -> Iterator[str]:
    pairs, most = [], 0.0
    for first, second, n in _repeated(runs):
        one, other = first.force[:n], second.force[:n]
        size = rms(one)
        differ = rms(other - one) / size
        noise = float(np.hypot(white_noise(one), white_noise(other))) / size
        if differ > max(_REPEATED, 3 * noise) and not _unit_factor(rms(other) / size):
            pairs.append(f"{first.name} and {second.name}")
            most = max(most, differ)
    if pairs:
        which = "; ".join(pairs[:_SHOWN_PAIRS])
        if len(pairs) > _SHOWN_PAIRS:
            which += f"; {len(pairs) - _SHOWN_PAIRS} more pairs"
        yield (
            f"{which} repeat one motion and current, but their forces differ by "
            f"{'up to ' * (len(pairs) > 1)}{100 * most:.2g} %: without a memory of earlier tests "
            "no law can be nearer to both than half of that"
        )


def _repeated(runs: Sequence[TestRun]) -> Iterator[tuple[TestRun, TestRun, int]]:
    """Pairs of runs of one motion and current, with the number of samples that they share."""
    for first, second in combinations(runs, 2):
        n, longer = sorted((len(first.time), len(second.time)))
        if abs(first.step - second.step) > 1e-6 * second.step or n < 0.9 * longer:
            continue
        if first.temperature is not None and second.temperature is not None:
            warmer = float(np.mean(first.temperature) - np.mean(second.temperature))
            if abs(warmer) > _SAME_TEMPERATURE:
                continue
        channels = ((run.displacement[:n], run.current[:n]) for run in (first, second))
        if all(
            np.linalg.norm(a - b) <= _SAME_MOTION * np.linalg.norm(b)
            for a, b in zip(*channels, strict=True)
        ):
            yield first, second, n


_CHECKS: tuple[Callable[[Sequence[TestRun]], Iterator[str]], ...] = (
    _reversed_loops, noisy_channels, clipped_channels, coarse_channels, _implausible_sizes,
    drifting_channels, _differing_offsets, _unit_of_force, _velocity_channel, _repeated_runs,
    _transient_ends, _sampling, _slow_sampling,
)  # fmt: skip


def _names(some: Sequence[TestRun], runs: Sequence[TestRun]) -> str:
    """Names of the runs concerned, not more than three."""
    if len(some) == len(runs) > 1:
        return "all runs"
    listed = ", ".join(run.name for run in some[:3])
    return listed if len(some) < 4 else f"{listed} and {len(some) - 3} more runs"


def _unit_factor(factor: float) -> str:
    """The confusion of units that a factor looks like; empty if none."""
    for unit, text in ((STANDARD_GRAVITY, "9.81"), (1000.0, "1000")):
        if abs(factor / unit - 1) < _UNIT_ERROR:
            return text
        if abs(factor * unit - 1) < _UNIT_ERROR:
            return f"1/{text}"
    return ""


def _against(values: NDArray, expected: NDArray, step: float) -> tuple[float, float, float]:
    """Factor, delay (s) and share that remains of a channel against the one it should be."""
    # The delay is found to first order: a late channel lacks a multiple of its own derivative.
    inside = slice(len(values) // 20, len(values) - len(values) // 20)
    rate = np.gradient(expected, step)
    columns = np.stack([expected, rate], axis=1)[inside]
    size = np.linalg.norm(columns, axis=0)
    factor, slope = np.linalg.lstsq(columns / size, values[inside])[0] / size
    rest = values[inside] - columns @ [factor, slope]
    return float(factor), float(-slope / factor), rms(rest) / rms(values[inside])
