"""Measured runs side by side, with their noise: the data of a least-squares problem."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ..effects.effect import REFERENCE_TEMPERATURE, Past
from .current_basis import STEADY
from .measured.channel_checks import clipped_samples
from .measured.force_channel import Averaging, find_averaging, moving_average
from .measured.holds import hold_still
from .measured.noise import (
    ChannelNoise,
    channel_noise,
    displacement_noise,
    noise_beside_steps,
    sensor_noise,
    slow_noise,
    steady_noise,
    white_noise,
)
from .measured.run_starts import find_starts, unsettled_note
from .measured.run_table import TestRun
from .measured.velocity import cycle_time, smooth
from .sensitivities import Motion

LEAST_NOISE = 2e-3
"""Smallest force noise, as a share of a run's RMS force."""
HELD_OUT_RUNS = 4
"""One run in so many is held out, where a comparison needs some and none is marked. Convention."""
_SAME_CURRENT = 0.05
"""Difference over the largest current up to which runs have one current. Convention."""
RUNAWAY = 10.0
"""Multiple of the largest measured force beyond which a model diverges."""
_WHITE = 0.7
"""Part of a steady current's deviation that white noise must have: a drift has more. Convention."""
_JUMP = 0.05
"""Change of the current from sample to sample, over the largest current, from which it jumps.
Convention, seen on clean campaigns with anti-aliasing filters."""
_BESIDE_JUMP = 0.01
"""Factor on the weight of samples beside a jump of the current: next to none. Convention."""
_CLIPPED = 1e-6
"""The same of clipped samples, however far off: none, but a factor by which one may divide."""
_MIDDLE = 0.1
"""Part of the largest displacement that a half cycle must exceed: noise is no cycle. Convention."""
_SHOWN = 0.25
"""Share of the runs that must show a sensor's noise to grow as 1/f: of few lines it is not seen."""
_NO_NOISE = 1e-3
"""Noise over the RMS of a velocity up to which it is taken as it is."""
_BY_SAMPLE = ("x", "v", "a", "force", "current", "temperature", "fitted", "beside_jump", "clipped")


@dataclass(frozen=True, eq=False)
class MeasuredRuns:
    """Measured runs, one after another."""

    names: tuple[str, ...]  # Of the runs
    starts: NDArray  # (n_runs + 1,) int: First sample of each run, and the end
    dt: NDArray  # (n_runs,): Sample interval of each run, s
    # x, v, a: (n_samples,), m, m/s, m/s^2: Motion: the measured displacement smoothed within its
    # noise, and its derivatives, with what a measured velocity and acceleration show besides
    x: NDArray
    v: NDArray
    a: NDArray
    # force, current, temperature: (n_samples,), N, A, deg C: As measured; 20 deg C where the
    # temperature was not
    force: NDArray
    current: NDArray
    temperature: NDArray
    fitted: NDArray  # (n_samples,) bool: Whether a sample is fitted; the others are held out
    # (n_samples,) bool: Whether the current jumps within two samples. The instant of a jump is
    # known to within a sample, and filters of the force act there: these samples count for little
    beside_jump: NDArray
    clipped: NDArray  # (n_samples,) bool: Whether the force lies at the limit of its channel
    # force_noise, force_corner: (n_runs,), N, Hz: Standard deviation of the noise of each run's
    # force, and the corner of its low-pass; infinite if it is white
    force_noise: NDArray
    force_corner: NDArray
    displacement_noise: NDArray  # (n_runs,), m: ``SensorNoise.deviation`` of each run
    # (n_runs,), N: Standard deviation by which the residuals of each run are divided; see ``weigh``
    sigma: NDArray
    # (n_runs,), m/s: The same of a measured velocity; 0 where it is taken as it is, infinite
    # without one
    velocity_noise: NDArray
    has_temperature: bool  # Whether the temperature was measured
    # (n_runs,), s: Time over which the force channel of each run is averaged; 0 where it is not
    averaging: NDArray
    # (n_runs,), s: Period of each run whose first cycle is steady, or a time after which its motion
    # comes back to the beginning; 0 where it begins at rest
    periods: NDArray
    # (n_runs, n), s: Times after which each run's motion comes back, where it may begin at rest as
    # well; else 0
    return_times: NDArray
    n_steps: NDArray  # (n_runs,) int: Integration steps a sample of a law under each run
    stiff: NDArray  # (n_runs,) bool: Whether these are steps for stiff laws, see ``Simulator``
    # (n_runs,) each: What the device went through before each run, in the order of the campaign;
    # None where that is unknown
    past: Past | None = field(default=None, kw_only=True)
    # (n_samples,) bool: Whether the force still depends on the unknown state with which its run
    # begins: these samples count for next to nothing; None where every start is known
    unsettled: NDArray | None = field(default=None, kw_only=True)

    @cached_property
    def motion(self) -> Motion:
        """The motion as the compiled simulation takes it."""
        return Motion(self.starts, self.x, self.v, self.current, self.dt, self.periods)

    @property
    def lengths(self) -> NDArray:
        """Number of samples of each run."""
        return np.diff(self.starts)

    @property
    def runs(self) -> list[slice]:
        """Samples of each run."""
        return [slice(int(a), int(b)) for a, b in pairwise(self.starts)]

    @cached_property
    def sizes(self) -> tuple[float, float, float, float]:
        """RMS force (N), peak displacement (m), a time (s) and the highest current (A), or 1."""
        x, v = (float(np.max(np.abs(one))) for one in (self.x, self.v))
        current = float(np.max(np.abs(self.current))) or 1.0
        return float(np.sqrt(np.mean(self.force**2))), x, x / v, current

    @cached_property
    def force_size(self) -> NDArray:
        """RMS of each run's measured force, N."""
        return np.array([np.sqrt(np.mean(self.force[run] ** 2)) for run in self.runs])

    @property
    def assumed_noise(self) -> NDArray:
        """Standard deviation of each run's force noise, N, not below a share of the force."""
        return np.maximum(self.force_noise, LEAST_NOISE * self.force_size)

    @cached_property
    def weight(self) -> NDArray:
        """One over each sample's ``sigma``, 1/N; next to nothing where it tells little."""
        small = self.beside_jump if self.unsettled is None else self.beside_jump | self.unsettled
        every = np.where(small, _BESIDE_JUMP, 1.0) * np.repeat(1 / self.sigma, self.lengths)
        return np.where(self.clipped, _CLIPPED, 1.0) * every

    def record(self, force: NDArray) -> NDArray:
        """Simulated force, (n_samples,), as the force channel records it."""
        force = self.record_changes(force)
        if not (self.clipped.any() and len(force)):
            return force
        # beyond the limit of the channel nothing more is recorded
        beyond = self.clipped & (force * self.force > self.force**2)
        return np.where(beyond, self.force, force)

    def record_changes(self, force: NDArray) -> NDArray:
        """Changes of the force, (n_samples, ...), as a channel without limits records them."""
        if not (self.averaging.any() and len(force)):
            return force
        widths = self.averaging / self.dt
        return np.concatenate([
            moving_average(force[run], width) if width > 0 else force[run]
            for run, width in zip(self.runs, widths, strict=True)
        ])  # fmt: skip

    def noise_beside(self, force: NDArray) -> ChannelNoise:
        """Noise of the force channel if all that a force (N) leaves is noise."""
        forces, known, x = ([one[run] for run in self.runs] for one in (self.force, force, self.x))
        return channel_noise(forces, self.dt.tolist(), x, known)

    def weigh(self, force: NDArray) -> Self:
        """Weigh the runs by their noise and by the misfit of a model's force (N)."""
        # The misfit counts as a further random error of equal size in all runs. Where it exceeds
        # the noise by far, runs of little noise would otherwise decide alone. The mean square of
        # noise over ``sigma`` stays 1.
        counted = self.fitted & ~self.clipped
        noise = np.repeat(self.assumed_noise, self.lengths)[counted]
        residual = (self.bounded(force) - self.force)[counted]
        misfit = max(float(np.mean(residual**2 - noise**2)), 0.0)
        unit = float(np.mean(noise**2 / (noise**2 + misfit)))
        return replace(self, sigma=np.sqrt(unit * (self.assumed_noise**2 + misfit)))

    def with_steps(self, number: int | NDArray, stiff: bool | NDArray = False) -> Self:
        """Set the integration steps a sample and their kind, of all runs or of each, (n_runs,)."""
        shape = self.dt.shape
        return replace(
            self,
            n_steps=np.broadcast_to(np.asarray(number, np.int64), shape),
            stiff=np.broadcast_to(np.asarray(stiff, bool), shape),
        )

    @property
    def settled(self) -> list[int]:
        """The first sample of each run that counts."""
        if self.unsettled is None:
            return [0] * len(self.dt)
        return [int(np.count_nonzero(self.unsettled[run])) for run in self.runs]

    def unsettled_note(self) -> str:
        """Say which first parts of runs do not count; empty if all do."""
        return unsettled_note(self.names, (self.dt * self.settled).tolist())

    @property
    def total_steps(self) -> int:
        """Integration steps of all runs."""
        return int(self.n_steps @ self.lengths)

    @np.errstate(over="ignore")  # a law that diverges
    def cost(self, force: NDArray, chosen: NDArray) -> float:
        """Sum of squared residuals of a force (N) over their noise, of the chosen samples."""
        return float(np.sum(((force - self.force) * self.weight)[chosen] ** 2))

    def bounded(self, force: NDArray) -> NDArray:
        """Limit the force (N) of a model that diverges to ten times the largest measured force."""
        most = RUNAWAY * float(np.max(np.abs(self.force)))
        return np.clip(np.nan_to_num(force, nan=most), -most, most)

    def relative(self, residual: NDArray, chosen: NDArray) -> float:
        """RMS of a residual (N) over RMS of the measured force, of the chosen samples."""
        if self.unsettled is not None:
            chosen = _without(chosen, self.unsettled)
        if not chosen.any():
            return float("nan")
        return float(np.sqrt(np.sum(residual[chosen] ** 2) / np.sum(self.force[chosen] ** 2)))

    def places(self, most: int) -> NDArray:
        """Samples that are left if every run is thinned evenly to about ``most`` in all."""
        runs = zip(self.runs, self._every(most), strict=True)
        return np.concatenate([np.arange(run.start, run.stop, every) for run, every in runs])

    def _every(self, most: int) -> NDArray:
        return np.maximum(np.round(self.lengths * len(self.dt) / most), 1).astype(int)

    def thinned(self, most: int) -> MeasuredRuns:
        """Thin every run evenly, to about ``most`` samples in all."""
        return self._taken(self._every(most), self.lengths)

    def cycles(self, number: float, samples: int) -> MeasuredRuns:
        """Keep the first cycles of every run, with about so many samples a cycle at most."""
        # A run that is held out in part keeps its length. A cycle is that of a sinusoid with the
        # run's RMS velocity over displacement.
        around = [cycle_time(np.std(self.x[run]), np.std(self.v[run])) for run in self.runs]
        cycle = np.array(around) / self.dt
        whole = np.array([len(np.unique(self.fitted[run])) > 1 for run in self.runs])
        lengths = np.where(whole, self.lengths, np.minimum(number * cycle, self.lengths))
        return self._taken(np.maximum(cycle / samples, 1).astype(int), lengths.astype(int))

    def _taken(self, every: NDArray, lengths: NDArray) -> MeasuredRuns:
        """Every so many of each run's first samples, (n_runs,) and (n_runs,)."""
        at = np.concatenate(
            [np.arange(a, a + n, k) for a, n, k in zip(self.starts, lengths, every, strict=False)]
        )
        return replace(
            self,
            starts=np.concatenate([[0], np.cumsum(-(-lengths // every))]),
            dt=self.dt * every,
            **{name: getattr(self, name)[at] for name in _BY_SAMPLE},
            unsettled=None if self.unsettled is None else self.unsettled[at],
        )

    def without_held_out(self) -> MeasuredRuns:
        """Remove the held-out samples; the first part of a partly held-out run remains."""
        lengths = np.add.reduceat(self.fitted.astype(np.int64), self.starts[:-1])
        runs = lengths > 0
        by_run = (
            "dt", "force_noise", "force_corner", "displacement_noise", "sigma", "velocity_noise",
            "averaging", "periods", "return_times", "n_steps", "stiff",
        )  # fmt: skip
        return replace(
            self,
            names=tuple(name for name, keep in zip(self.names, runs, strict=True) if keep),
            starts=np.concatenate([[0], np.cumsum(lengths[runs])]),
            **{name: getattr(self, name)[runs] for name in by_run},
            **{name: getattr(self, name)[self.fitted] for name in _BY_SAMPLE},
            past=None if self.past is None else Past(*(one[runs] for one in self.past)),
            unsettled=None if self.unsettled is None else self.unsettled[self.fitted],
        )


def measured_runs(runs: Sequence[TestRun], averaging: Averaging | None = None) -> MeasuredRuns:
    """Put runs together and estimate their noise; an average is sought if it is not known."""
    # Runs with ``hold_out`` are held out.
    lengths = [len(run.time) for run in runs]
    force_noise, corner = channel_noise(
        [run.force for run in runs], [run.step for run in runs], [run.displacement for run in runs]
    )
    clipped = [clipped_samples(run.force) for run in runs]
    force_noise = np.array([
        # where a channel is clipped it shows no noise
        max(noise, noise_beside_steps(run.force, one)) if one.any() else noise
        for run, one, noise in zip(runs, clipped, force_noise, strict=True)
    ])  # fmt: skip
    starts = find_starts(runs, force_noise)
    velocity_noise = np.array([_velocity_noise(run) for run in runs])
    wander = _wander([run.displacement for run in runs])
    motions = [_motion(run, noise, wander) for run, noise in zip(runs, velocity_noise, strict=True)]
    temperatures = [run.temperature for run in runs]
    data = MeasuredRuns(
        names=tuple(run.name for run in runs),
        starts=np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64),
        dt=np.array([run.step for run in runs]),
        x=np.concatenate([x for x, _, _ in motions]),
        v=np.concatenate([v for _, v, _ in motions]),
        a=np.concatenate([a for _, _, a in motions]),
        force=np.concatenate([run.force for run in runs]),
        current=np.concatenate(_without_noise([run.current for run in runs])),
        temperature=np.concatenate(
            [
                np.full(n, REFERENCE_TEMPERATURE) if one is None else one
                for one, n in zip(temperatures, lengths, strict=True)
            ]
        ),
        fitted=np.repeat([not run.hold_out for run in runs], lengths),
        beside_jump=_beside_jumps([run.current for run in runs]),
        clipped=np.concatenate(clipped),
        force_noise=force_noise,
        force_corner=np.full(len(runs), corner),
        displacement_noise=displacement_noise(
            [run.displacement for run in runs], [run.step for run in runs]
        ),
        sigma=np.ones(len(runs)),
        velocity_noise=velocity_noise,
        has_temperature=all(one is not None for one in temperatures),
        averaging=(averaging or find_averaging(runs)).widths,
        # where a run may begin in motion or at rest, a fitted law tells
        periods=starts.periods,
        return_times=starts.return_times,
        n_steps=np.ones(len(runs), np.int64),
        stiff=np.zeros(len(runs), bool),
        past=_past(runs),
    )
    return replace(data, sigma=data.assumed_noise)


def _without(chosen: NDArray, unsettled: NDArray) -> NDArray:
    """Samples, as places or as a mask, without the unsettled ones."""
    return chosen & ~unsettled if chosen.dtype == bool else chosen[~unsettled[chosen]]


def smooth_motion(
    displacement: NDArray, step: float, velocity: NDArray | None, acceleration: NDArray | None
) -> tuple[NDArray, NDArray, NDArray]:
    """Displacement, velocity and acceleration; the latter two with what their sensors show."""
    x, v, a = smooth(displacement, step)
    # of a sensor, what it shows beyond its noise and the displacement does not
    if velocity is not None:
        v = v + smooth(velocity - v, step)[0]
    if acceleration is not None:
        a = a + smooth(acceleration - a, step)[0]
    return x, v, a


def _wander(displacements: Sequence[NDArray]) -> float:
    """Standard deviation, m, of a sensor's noise that grows as 1/f; zero if few runs show it."""
    shown = [noise for one in displacements if (noise := slow_noise(one, one)) > 0]
    return max(shown) if len(shown) >= _SHOWN * len(displacements) else 0.0


def _motion(run: TestRun, velocity_noise: float, wander: float) -> tuple[NDArray, NDArray, NDArray]:
    """Displacement, velocity and acceleration of a run."""
    noisy = 0 < velocity_noise < np.inf
    velocity = run.velocity if noisy else None
    x, v, a = smooth_motion(run.displacement, run.step, velocity, run.acceleration)
    v = v if noisy else run.velocity
    noise = max(sensor_noise(run.displacement).deviation, wander)
    return hold_still(x, v, a, run.step, noise)


def _velocity_noise(run: TestRun) -> float:
    """Standard deviation of the noise of a measured velocity, m/s, as ``MeasuredRuns`` has it."""
    if not run.velocity_measured:
        return np.inf
    noise = steady_noise(run.velocity)
    return noise if noise > _NO_NOISE * np.std(run.velocity) else 0.0


def _without_noise(currents: Sequence[NDArray]) -> list[NDArray]:
    """Currents of the runs; the mean of one that is steady up to white noise of its channel."""
    # a law's force follows the channel's noise, and a lag would be named for smoothing it
    small = STEADY * max(float(np.max(np.abs(current))) for current in currents)
    result = []
    for current in currents:
        deviation = float(np.std(current))
        steady = 0 < deviation < small and white_noise(current) > _WHITE * deviation
        result.append(np.full_like(current, np.mean(current)) if steady else current)
    # below no current parameters may change their sign, and a law diverges
    if -small < min(float(np.min(current)) for current in result) < 0:
        return [np.maximum(current, 0.0) for current in result]
    return result


def _beside_jumps(currents: Sequence[NDArray]) -> NDArray:
    """Whether the current of each run jumps within two samples, (n_samples,) bool."""
    least = _JUMP * max(float(np.max(np.abs(current))) for current in currents)
    result = []
    for current in currents:
        change = np.abs(np.diff(current))
        # a current that moves steadily moves as much two samples earlier or later
        around = np.pad(change, 2)
        jumps = change > np.maximum(least, 5 * np.maximum(around[:-4], around[4:]))
        beside = np.zeros(len(current) + 2, bool)
        for late in range(3):
            beside[np.flatnonzero(jumps) + late] = True
        result.append(beside[: len(current)])
    return np.concatenate(result)


def _past(runs: Sequence[TestRun]) -> Past:
    """What the device went through in the runs before each, (n_runs,) each."""
    power = [run.force * run.velocity for run in runs]

    def before(of_runs: list[float], so_far: Callable[[NDArray], NDArray]) -> NDArray:
        return so_far(np.array([0.0, *of_runs[:-1]]))

    def integral(of_runs: list[NDArray]) -> list[float]:
        return [float(np.sum(one)) * run.step for one, run in zip(of_runs, runs, strict=True)]

    return Past(
        deformation=before(
            [float(np.max(np.abs(run.displacement))) for run in runs], np.maximum.accumulate
        ),
        travel=before(integral([np.abs(run.velocity) for run in runs]), np.cumsum),
        current=before([float(np.max(run.current)) for run in runs], np.maximum.accumulate),
        work=before(integral([np.maximum(one, 0.0) for one in power]), np.cumsum),
        dissipated=before(integral(power), np.cumsum),
        cycles=before([_cycles(run.displacement) for run in runs], np.cumsum),
    )


def _cycles(x: NDArray) -> float:
    """Cycles of a motion, half of one at each passage through the middle."""
    ends = np.sign(x[np.abs(x) > _MIDDLE * float(np.max(np.abs(x)))])
    return 0.5 * float(np.count_nonzero(np.diff(ends)))


def hold_out_some(data: MeasuredRuns, runs: Sequence[TestRun]) -> MeasuredRuns:
    """Hold out one run in ``HELD_OUT_RUNS``, or the end of a single run, if none is yet."""
    held = np.zeros(len(runs), dtype=bool)
    if not data.fitted.all():
        return data
    if len(runs) == 1:
        # the last third of the path, since an earthquake ends quietly
        path = np.cumsum(np.abs(data.v))
        return replace(data, fitted=3 * path < 2 * path[-1])
    # of every few runs of similar size one, preferably of a current that was held out less often
    sizes = np.argsort([np.ptp(run.displacement) for run in runs], kind="stable")
    means = np.array([np.mean(run.current) for run in runs])
    level = np.round(means / (_SAME_CURRENT * float(np.max(np.abs(means))) or 1.0))
    for near in np.split(sizes, range(HELD_OUT_RUNS, len(runs), HELD_OUT_RUNS)):
        if len(near) > 2:
            often = [int(np.sum(held[level == level[k]])) for k in near]
            held[near[2 if often[2] == min(often) else int(np.argmin(often))]] = True
    return replace(data, fitted=np.repeat(~held, data.lengths))
