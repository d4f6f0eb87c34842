"""Runs cut out of a longer test: the device goes through a part of their motion before they begin.

Laboratories often keep the steady cycles of a test alone. The force of such a run repeats from its
first sample on, while that of a device at rest does not, where it depends on the past. Other motion
may begin in the middle as well. The device then goes through the motion up to where it comes back
to its first displacement and velocity; a fitted law tells whether that is nearer to the truth. A
device that rests may also hold a force from the test before, as friction does.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...laws.law import Law
from .loop_cycles import find_frequency
from .noise import sensor_noise, white_noise
from .run_table import TestRun
from .velocity import cycle_time

_SAME_MOTION = 0.03
"""RMS change of the motion from cycle to cycle, over its RMS, up to which it is periodic."""
_SAME_FORCE = 0.015
"""The same of the force in the first half cycle, beyond noise: that of a device that begins at rest
and depends on the past changes by more. Convention."""
_BEGINNING, _SAME_THERE = 1 / 32, 0.3
"""Part of a cycle in which a run has to move as it does a cycle later, and RMS change over the
range of that motion up to which it does: a test that begins softly rests there. Convention."""
_AS_LATER = 1.5
"""Factor on the change between later cycles up to which the first half cycle changes as they do."""
_FEWEST = 4
"""Samples of a run's beginning, at least."""
_LEAST_SAMPLES = 16
"""Samples of a cycle, at least."""
_OVERLAP = 0.25
"""Cycles beyond the first, at least; fewer are one closed cycle or none."""
_CLOSED = 3.0
"""Gap between the ends of one cycle, over the changes from sample to sample beside it."""
_CYCLES = 3
"""Cycles that are gone through before a run, up to the part before the device is at rest."""
RETURNS = 8
"""Returns of the motion to its beginning that a fitted law compares. Effort."""
_APART = 0.2
"""Cycles between two returns, at least."""
_JUMP = 10.0
"""Weight of a jump of the deformation at a return, over that of the velocity, in RMS values."""
_LATE = 10.0
"""Cycles after which a return counts as one RMS value of the velocity further away."""
_MOVING = 0.05
"""Velocity or displacement at the first sample, over its RMS, from which a run may begin in the
middle."""
_FAST = 0.5
"""Velocity over its RMS, in both directions, of a run that is less than a cycle. Convention."""
_AT_ZERO = 0.01
"""Displacement at the first sample, over its RMS, up to which a run is taken to begin at rest with
whatever velocity: a motion that was cut begins there once in a hundred times, and a sine or a sum
of sines that a test begins with always does."""
_BEYOND_NOISE = 4.0
"""Standard deviations of the noise that they must exceed as well: half of the runs that begin at
rest would otherwise count, at 1 % of noise. Theory: one run in 10,000 exceeds it by chance."""
_STILL, _HELD = 0.02, 0.1
"""Change of the displacement in this part of a cycle over its RMS, below which a device rests, and
force over its RMS, beyond which it may hold one there. Convention."""
_SLOPES = (1 / 8, 1 / 32)
"""Parts of a cycle to whose displacement a parabola is fitted for the first velocity. The longest
tells it from noise."""


class Runs(NamedTuple):
    """Where runs lie among the samples, and the part of each that is gone through before it."""

    starts: NDArray  # (n_runs + 1,) int: First sample of each run, and the end
    # (n_runs,) each
    dt: NDArray  # s: Sample interval
    cycle: NDArray  # int: Samples of the first cycle; 0 where a run begins at rest
    lead: NDArray  # int: The sample of the cycle at which the device is at rest
    ahead: NDArray  # int: Samples from there to the run's first one: two cycles, and a part of one
    join: NDArray  # s: From the last sample of the cycle to the first of the next


def lead_in(starts: NDArray, dt: NDArray, periods: NDArray, displacement: NDArray) -> Runs:
    """Find how runs that begin in motion are led in, from a sample where the device may rest."""
    # That is the sample nearest to the middle of the motion in the second half of the cycle.
    cycle = np.round(periods / dt).astype(np.int64)
    cycle[cycle > np.diff(starts)] = 0
    lead = np.zeros_like(cycle)
    for run in np.flatnonzero(cycle).tolist():
        x = displacement[starts[run] : starts[run] + cycle[run]]
        half = cycle[run] // 2
        lead[run] = half + np.argmin(np.abs(x[half:] - (x.max() + x.min()) / 2))
    join = np.where(cycle > 0, periods - (cycle - 1) * dt, dt)
    return Runs(starts, dt, cycle, lead, _CYCLES * cycle - lead, join)


class Starts(NamedTuple):
    """Where runs begin, (n_runs, ...), s; a run for which all are 0 begins at rest."""

    periods: NDArray  # s: Period of every run whose first cycle is steady
    # (n_runs, RETURNS), s: Times after which the motion of a run comes back to its beginning, where
    # it may be in motion
    return_times: NDArray


def find_starts(runs: Sequence[TestRun], force_noise: NDArray) -> Starts:
    """Find where runs begin by their motion and force; noise of each, (n_runs,), N."""
    starts = [_start(run, noise) for run, noise in zip(runs, force_noise, strict=True)]
    periods, times = zip(*starts, strict=True)
    return Starts(np.array(periods), np.array(times))


def start_note(periods: NDArray, law: Law) -> str:
    """Say which runs do not begin at rest; empty if all do, or if the law has no memory."""
    count = int(np.count_nonzero(periods))
    if not (count and law.states):
        return ""
    if len(periods) == 1:
        which = "The run begins"
    else:
        which = ("All" if count == len(periods) else f"{count} of {len(periods)}") + " runs begin"
    return (
        f"{which} in motion, or under a force that was left from before: the model first goes "
        "through the motion up to where it comes back to its beginning"
    )


def unsettled_note(names: Sequence[str], seconds: Sequence[float]) -> str:
    """Say from when on runs that begin in the middle of a motion count; empty if all do at once."""
    some = [f"{name}: {s:.2g} s" for name, s in zip(names, seconds, strict=True) if s > 0]
    if not some:
        return ""
    return (
        f"the first part of runs that begin in the middle of a motion, or under a force, is left "
        f"out, since the force depends there on an unknown past ({', '.join(some)})"
    )


def _return_times(run: TestRun) -> NDArray:
    """Times at which a run comes nearest to where it begins, (RETURNS,), s; 0 where it does not."""
    x, v, current = run.displacement, run.velocity, run.current
    size, speed = float(np.std(x)), float(np.std(v))
    result = np.zeros(RETURNS)
    begins_late = _rests_under_a_force(run, size) or _begins_in_motion(run, size, speed)
    if not (speed > 0 and begins_late):
        return result
    if _is_part_of_a_cycle(run, speed):  # which stands for the motion before
        result[0] = run.step * (len(x) - 1)
        return result
    cycles = run.step * np.arange(len(x)) / cycle_time(size, speed)
    # the deformation counts most: where it jumps the device would yield
    away = _JUMP * np.abs(x - x[0]) / size + np.abs(v - v[0]) / speed + cycles / _LATE
    away += np.abs(current - current[0]) / (float(np.ptp(current)) or 1.0)
    away[cycles < 1] = np.inf
    for k in range(RETURNS):
        at = int(np.argmin(away))
        if not np.isfinite(away[at]):
            break
        share = (x[0] - x[at]) / (v[at] * run.step) if v[at] != 0 else 0.0
        result[k] = run.step * (at + float(np.clip(share, -0.5, 0.5)))
        away[np.abs(cycles - cycles[at]) < _APART] = np.inf
    return result


def _begins_in_motion(run: TestRun, size: float, speed: float) -> bool:
    """Whether a run may begin in the middle of a motion of this RMS size and velocity."""
    x, noise = run.displacement, sensor_noise(run.displacement).deviation
    if abs(x[0]) > max(_MOVING * size, _BEYOND_NOISE * noise):
        return True
    if abs(x[0]) <= _AT_ZERO * size and not _is_part_of_a_cycle(run, speed):
        return False
    # The smoothed velocity is least certain at the first sample: the slope of the displacement must
    # agree with it, over a short time as well, in which a run at rest does not yet move.
    rates, chance = [float(run.velocity[0])], 0.0
    for share in _SLOPES:
        n = min(max(round(share * cycle_time(size, speed) / run.step), 4) + 1, len(x))
        slope = np.linalg.pinv(np.vander(run.step * np.arange(n), 3, increasing=True))[1]
        rates.append(float(slope @ x[:n]))
        chance = chance or noise * float(np.linalg.norm(slope))
    least = min(rate * np.sign(rates[0]) for rate in rates)
    return bool(least > _MOVING * speed and abs(rates[1]) > _BEYOND_NOISE * chance)


def _rests_under_a_force(run: TestRun, size: float) -> bool:
    """Whether a run of this RMS displacement begins with a rest in which its device is loaded."""
    cycle = cycle_time(size, float(np.std(run.velocity)))
    n = max(int(_BEGINNING * cycle / run.step), _FEWEST)
    x, force = run.displacement[:n], run.force[:n]
    moves = max(_STILL * size, _BEYOND_NOISE * sensor_noise(run.displacement).deviation)
    least = max(_HELD * float(np.std(run.force)), _BEYOND_NOISE * white_noise(run.force))
    mean = float(np.mean(force))
    held = min(abs(mean), abs(mean - float(np.mean(run.force))))  # an offset stays
    return bool(np.ptp(x) < moves and np.ptp(force) < held / 2 and held > least)


def _is_part_of_a_cycle(run: TestRun, speed: float) -> bool:
    """Whether a run begins in fast motion, turns, and never moves again as it began."""
    along = run.velocity * np.sign(run.velocity[0])
    turned = np.flatnonzero(along < -_FAST * speed)
    fast = along[0] > _FAST * speed and turned.size > 0
    return bool(fast and np.max(along[turned[0] :]) < _MOVING * speed)


def _start(run: TestRun, noise: float) -> tuple[float, NDArray]:
    """Period of a run whose first cycle is steady, and return times of other motion, s; else 0."""
    never = np.zeros(RETURNS)
    t, x, force = run.time - run.time[0], run.displacement, run.force
    size = float(np.std(x))
    if len(t) < _LEAST_SAMPLES or not size > 0 or not np.std(force) > 0:
        return 0.0, never
    if _is_part_of_a_cycle(run, float(np.std(run.velocity))):
        return 0.0, _return_times(run)
    closed = _one_cycle(run, noise)
    if closed is not None:
        return closed, never
    period = 1 / find_frequency(t, x)
    if not _LEAST_SAMPLES * run.step <= period <= t[-1] / (1 + _OVERLAP):
        return 0.0, _return_times(run)
    # a motion that is periodic throughout, or in its first cycles alone
    for last in (np.inf, 2.1 * period):
        steady = _steady_period(run, period, last, noise)
        if steady is not None:
            break
    if steady:
        return steady, never
    if steady is None or _rests_under_a_force(run, size):
        return 0.0, _return_times(run)
    return 0.0, never


def _steady_period(run: TestRun, period: float, last: float, noise: float) -> float | None:
    """Period of the motion up to a time, 0 where its force begins at rest; None if it has none."""
    t = run.time - run.time[0]
    some = t <= last
    t, x, force, current = t[some], run.displacement[some], run.force[some], run.current[some]
    if not period <= t[-1] / (1 + _OVERLAP):
        return None
    period = _refined(t, x, period)

    def change(y: NDArray, first: float = 0.0, last: float = np.inf) -> float:
        inside = (t >= first) & (t < last) & (t + period <= t[-1])
        if not inside.any():
            return 0.0
        return float(np.sqrt(np.mean((np.interp(t[inside] + period, t, y) - y[inside]) ** 2)))

    same_current = change(current) <= _SAME_MOTION * float(np.max(np.abs(run.current)))
    if not (same_current and change(x) <= _SAME_MOTION * float(np.std(x))):
        return None
    # a run that begins at rest is still where later ones move
    begins = t <= max(_BEGINNING * period, _FEWEST * run.step)
    later = np.interp(t[begins] + period, t, x)
    noise_of_motion = sensor_noise(run.displacement).deviation
    least = max(_SAME_THERE * float(np.ptp(later)), _BEYOND_NOISE * noise_of_motion)
    if np.sqrt(np.mean((later - x[begins]) ** 2)) > least:
        return 0.0
    # the force of a periodic motion tells
    least = float(np.hypot(_SAME_FORCE * np.std(force), np.sqrt(2) * noise))
    afterwards = change(force, period / 2)
    steady = change(force, 0.0, period / 2) <= max(least, _AS_LATER * afterwards)
    return period if steady else 0.0


def _refined(t: NDArray, x: NDArray, period: float) -> float:
    """The period near a first value that repeats a motion best, s."""
    from scipy.interpolate import CubicSpline
    from scipy.optimize import minimize_scalar

    at = CubicSpline(t, x)
    begin = t[t <= t[-1] - 1.02 * period]

    def change(trial: float) -> float:
        return float(np.mean((at(begin + trial) - at(begin)) ** 2))

    bounds = (0.98 * period, 1.02 * period)
    return float(minimize_scalar(change, bounds=bounds, method="bounded").x)


def _one_cycle(run: TestRun, noise: float) -> float | None:
    """Length of one closed cycle, s, 0 if its force is not closed; None for other motion."""
    x, force = run.displacement, run.force
    steps = np.abs(np.diff(x))
    beside = float(np.mean(np.concatenate([steps[:3], steps[-3:]])))
    gap = abs(float(x[0] - x[-1]))
    both = gap < 0.5 * beside  # the closing sample is there
    turns = np.count_nonzero(np.diff(np.sign(run.velocity[run.velocity != 0])))
    around = cycle_time(float(np.std(x)), float(np.std(run.velocity)))
    length = (len(x) - (1 if both else 0)) * run.step
    # about one sinusoid, and closed
    if gap > _CLOSED * beside or turns > 3 or not 0.8 < around / length < 1.25:
        return None
    steps = np.abs(np.diff(force))
    beside = float(np.mean(np.concatenate([steps[:3], steps[-3:]])))
    return length if abs(force[0] - force[-1]) <= _CLOSED * (beside + noise) else 0.0
