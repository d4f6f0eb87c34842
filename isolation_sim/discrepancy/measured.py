"""Measured runs in the form in which a model is held against them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..effects.effect import REFERENCE_TEMPERATURE
from ..identification.noise import white_noise
from ..identification.run_table import TestRun
from ..identification.sensitivities import Motion
from ..identification.velocity import smooth

LEAST_NOISE = 2e-3
"""Of a run's RMS force: a run is never trusted more than this."""
RUNAWAY = 10.0
"""Of the largest measured force: beyond it a model has run away."""
HELD_OUT_PART = 4
"""One run in so many is held out where the campaign does not say which."""
_BY_SAMPLE = ("x", "v", "a", "force", "current", "temperature", "fitted")


@dataclass(frozen=True, eq=False)
class Measured:
    """Measured runs, one after another.

    Attributes
    ----------
    names : tuple of str
        Of the runs.
    starts : (n_runs + 1,) int array
        First sample of each run, and the end.
    dt : (n_runs,) array
        Sample interval of each run, s.
    x, v, a : (n_samples,) array, m, m/s, m/s^2
        Motion: the measured displacement smoothed within its noise, and its derivatives, or the
        measured velocity.
    force, current, temperature : (n_samples,) array, N, A, deg C
        As measured; 20 deg C where the temperature was not.
    fitted : (n_samples,) bool array
        Whether a sample is fitted; the others are held out.
    force_noise, displacement_noise : (n_runs,) array, N, m
        Standard deviation of the white noise of each run.
    velocity_measured : (n_runs,) bool array
        Whether the velocity is data.
    has_temperature : bool
        Whether the temperature was measured.
    """

    names: tuple[str, ...]
    starts: NDArray
    dt: NDArray
    x: NDArray
    v: NDArray
    a: NDArray
    force: NDArray
    current: NDArray
    temperature: NDArray
    fitted: NDArray
    force_noise: NDArray
    displacement_noise: NDArray
    velocity_measured: NDArray
    has_temperature: bool

    @property
    def motion(self) -> Motion:
        """The motion as the compiled simulation takes it."""
        return Motion(self.starts, self.x, self.v, self.current, self.dt)

    @property
    def lengths(self) -> NDArray:
        """Number of samples of each run."""
        return np.diff(self.starts)

    @property
    def runs(self) -> list[slice]:
        """Samples of each run."""
        return [slice(int(a), int(b)) for a, b in pairwise(self.starts)]

    @cached_property
    def force_size(self) -> NDArray:
        """RMS of each run's measured force, N."""
        return np.array([np.sqrt(np.mean(self.force[run] ** 2)) for run in self.runs])

    @cached_property
    def weight(self) -> NDArray:
        """One over each sample's noise, 1/N, so that every run counts by what it can tell."""
        noise = np.maximum(self.force_noise, LEAST_NOISE * self.force_size)
        return np.repeat(1 / noise, self.lengths)

    def cost(self, force: NDArray, chosen: NDArray) -> float:
        """Sum of squared residuals over their noise, over some samples.

        Parameters
        ----------
        force : (n_samples,) array
            Modelled, N.
        chosen : (n_samples,) bool array
            Which samples.

        Returns
        -------
        float
        """
        return float(np.sum(((force - self.force) * self.weight)[chosen] ** 2))

    def bounded(self, force: NDArray) -> NDArray:
        """Put a limit to the force of a model that runs away.

        Parameters
        ----------
        force : (n_samples,) array
            Modelled, N.

        Returns
        -------
        (n_samples,) array
            Ten times the largest measured force in place of what is beyond or no number.
        """
        most = RUNAWAY * float(np.max(np.abs(self.force)))
        return np.clip(np.nan_to_num(force, nan=most), -most, most)

    def relative(self, residual: NDArray, chosen: NDArray) -> float:
        """RMS of a residual over RMS of the measured force, over some samples.

        Parameters
        ----------
        residual : (n_samples,) array
            N.
        chosen : (n_samples,) bool array
            Which samples.

        Returns
        -------
        float
            Not a number where no sample is chosen.
        """
        if not chosen.any():
            return float("nan")
        return float(np.sqrt(np.sum(residual[chosen] ** 2) / np.sum(self.force[chosen] ** 2)))

    def kept(self, most: int) -> NDArray:
        """Places of the samples that are left when every run is thinned evenly.

        Parameters
        ----------
        most : int
            Samples to leave, about, shared evenly among the runs.

        Returns
        -------
        (n_kept,) int array
        """
        runs = zip(self.runs, self._every(most), strict=True)
        return np.concatenate([np.arange(run.start, run.stop, every) for run, every in runs])

    def _every(self, most: int) -> NDArray:
        return np.maximum(np.round(self.lengths * len(self.dt) / most), 1).astype(int)

    def thinned(self, most: int) -> Measured:
        """Thin every run evenly.

        Parameters
        ----------
        most : int
            As of ``kept``.

        Returns
        -------
        Measured
        """
        at, every = self.kept(most), self._every(most)
        return replace(
            self,
            starts=np.concatenate([[0], np.cumsum(-(-self.lengths // every))]),
            dt=self.dt * every,
            **{name: getattr(self, name)[at] for name in _BY_SAMPLE},
        )

    def without_held_out(self) -> Measured:
        """Leave out the samples that are held out.

        Returns
        -------
        Measured
            Of the runs that are fitted; of a run held out in part, its first samples.
        """
        lengths = np.add.reduceat(self.fitted.astype(np.int64), self.starts[:-1])
        runs = lengths > 0
        by_run = ("dt", "force_noise", "displacement_noise", "velocity_measured")
        return replace(
            self,
            names=tuple(name for name, kept in zip(self.names, runs, strict=True) if kept),
            starts=np.concatenate([[0], np.cumsum(lengths[runs])]),
            **{name: getattr(self, name)[runs] for name in by_run},
            **{name: getattr(self, name)[self.fitted] for name in _BY_SAMPLE},
        )


def measured(runs: Sequence[TestRun]) -> Measured:
    """Put runs together and estimate their noise.

    Parameters
    ----------
    runs : sequence of TestRun
        The runs; those with ``hold_out`` are held out. Where none is, one in four is, spread over
        their sizes; of a single run, its last third.

    Returns
    -------
    Measured
    """
    lengths = [len(run.time) for run in runs]
    motions = [smooth(run.displacement, run.step) for run in runs]
    velocities = [
        run.velocity if run.velocity_measured else motion[1]
        for run, motion in zip(runs, motions, strict=True)
    ]
    noise = [white_noise(run.displacement) for run in runs]
    known = all(run.temperature is not None for run in runs)
    temperature = [
        run.temperature if run.temperature is not None else np.full(n, REFERENCE_TEMPERATURE)
        for run, n in zip(runs, lengths, strict=True)
    ]
    return Measured(
        names=tuple(run.name for run in runs),
        starts=np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64),
        dt=np.array([run.step for run in runs]),
        x=np.concatenate([m[0] for m in motions]),
        v=np.concatenate(velocities),
        a=np.concatenate(
            [
                m[2] if run.acceleration is None else run.acceleration
                for run, m in zip(runs, motions, strict=True)
            ]
        ),
        force=np.concatenate([run.force for run in runs]),
        current=np.concatenate([run.current for run in runs]),
        temperature=np.concatenate(temperature),
        fitted=_fitted(runs, lengths),
        force_noise=np.array([white_noise(run.force) for run in runs]),
        displacement_noise=np.array(noise),
        velocity_measured=np.array([run.velocity_measured for run in runs]),
        has_temperature=known,
    )


def _fitted(runs: Sequence[TestRun], lengths: Sequence[int]) -> NDArray:
    held = [run.hold_out for run in runs]
    if len(runs) == 1 and not held[0]:
        n = lengths[0]
        return np.arange(n) < n - n // 3
    if not any(held) and len(runs) >= HELD_OUT_PART:
        # every fourth by size, so that large and small ones stay in both parts
        sizes = np.argsort([np.ptp(run.displacement) for run in runs], kind="stable")
        for k in sizes[2::HELD_OUT_PART]:
            held[k] = True
    return np.repeat(~np.array(held), lengths)
