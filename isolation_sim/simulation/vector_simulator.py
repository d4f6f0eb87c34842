"""Many plants of one kind, simulated step by step in parallel."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ground_motions.argument_types import checked

from ..errors import InputError
from ..structures import IsolatedStructure
from .batch import LANES
from .control import CoilDriver, Sensors
from .kernel.loading import compiling
from .kernel.slots import ALIVE, COMMAND
from .outputs import output_names
from .plan import Plan
from .run import check_options, prepare_lane
from .simulator import Outside, still_ground

FEWEST_BLOCKS = 8
"""Least number of blocks of lanes per thread."""


@checked
class VectorSimulator:
    """Many plants of one kind, simulated step by step in parallel.

    Each plant has its own current, ground motion and start. Any of them can be reset to rest while
    the others continue. Each gives the results of a `Simulator` with ideal sensors.

    Parameters
    ----------
    isolated : IsolatedStructure
        The plant.
    n : int
        Number of plants.
    period : float, s
        Length of a step.
    dt : float, optional
        Sampling interval of the ground motion, s; ``period`` by default, or ``period`` divided by
        an integer.
    measures : sequence of str, optional
        Outputs to measure; all by default.
    driver : CoilDriver, optional
        Lag, slew, limits and step of the coils; ideal by default. Currents are clamped to its
        limits.
    tolerance : float, default 1e-6
        Target accuracy, relative to each quantity's peak; 1e-12 to 1e-2.
    threads : int, optional
        Number of threads; one per processor by default.

    Attributes
    ----------
    n : int
        Number of plants.
    measures : tuple of str
        Names of the measured values: the outputs, then the coil currents.
    low, high : numpy.ndarray, shape (n_channels,), A
        Limits of the coil currents.
    samples : int
        Number of samples of the ground motion per step.

    Raises
    ------
    InputError
        If an argument cannot be used.
    """

    def __init__(
        self,
        isolated: IsolatedStructure,
        n: int,
        *,
        period: float,
        dt: float | None = None,
        measures: Sequence[str] | None = None,
        driver: CoilDriver | None = None,
        tolerance: float = 1e-6,
        threads: int | None = None,
    ):
        check_options(tolerance, "clamp", 0.0)
        if n < 1:
            raise InputError("n", f"{n}", "1 or more plants")
        dt = period if dt is None else dt
        # a step's start and end, and a step before, in which the coils take their first currents
        records = still_ground(isolated, period, 3 * period, dt)
        self.n, self.period, self.samples = n, float(period), round(period / dt)
        names = output_names(isolated) if measures is None else tuple(measures)
        lane = prepare_lane(
            isolated, records, Outside(self.period, names), None, driver or CoilDriver(),
            (0.0, 0.0), None,
        )  # fmt: skip
        self.measures, self.low, self.high = (
            lane.context.outputs, lane.context.low, lane.context.high,
        )  # fmt: skip
        self._blocks = []
        for _ in range(-(-n // LANES)):
            plan = Plan([lane] * LANES, Sensors(), 0.0, alike=True)
            self._blocks.append(_Block(plan, tolerance, len(self.low), len(self.measures)))
        threads = min(threads or os.cpu_count() or 1, len(self._blocks) // FEWEST_BLOCKS)
        self._pool = ThreadPoolExecutor(threads) if threads > 1 else None
        bounds = np.linspace(0, len(self._blocks), max(threads, 1) + 1).astype(int)
        self._parts = [range(a, b) for a, b in pairwise(bounds)]
        whole = len(self._blocks) * LANES
        self._currents = np.zeros((whole, len(self.low)))
        self._ground = np.zeros((whole, self.samples, len(records)))
        self._measured = np.zeros((whole, len(self.measures)))
        self._alive = np.ones(whole, bool)

    def reset(
        self, which: ArrayLike | None = None, ground_acceleration: ArrayLike = 0.0
    ) -> NDArray:
        """Reset plants to rest.

        Parameters
        ----------
        which : array_like of bool, shape (n,), optional
            Plants to reset; all by default.
        ground_acceleration : array_like, shape (n, n_directions), default 0, m/s^2
            Initial ground acceleration of each plant; ignored for plants that are not reset.

        Returns
        -------
        numpy.ndarray, shape (n, n_measures)
            The measurements now; see ``measures``.
        """
        chosen = np.ones(self.n, bool) if which is None else np.asarray(which, bool)
        ground = np.broadcast_to(ground_acceleration, (self.n, self._ground.shape[2]))
        for number in np.unique(np.flatnonzero(chosen) // LANES):
            here = slice(number * LANES, min((number + 1) * LANES, self.n))
            lanes = np.flatnonzero(chosen[here])
            rows = self._blocks[number].rest(lanes, ground[here][lanes])
            self._measured[here.start + lanes] = rows
        self._alive[: self.n][chosen] = True
        return self._measured[: self.n].copy()

    def step(self, currents: ArrayLike, ground_acceleration: ArrayLike) -> NDArray:
        """Simulate one period of all plants.

        Parameters
        ----------
        currents : array_like, shape (n, n_channels), A
            Commands from now on.
        ground_acceleration : array_like, shape (n, samples, n_directions), m/s^2
            At the samples after the step's start, the last one at its end; linear between.

        Returns
        -------
        numpy.ndarray, shape (n, n_measures)
            The measurements at the end of the step; see ``measures``.

        Raises
        ------
        InputError
            If a current is not a number.
        """
        self._currents[: self.n] = currents
        self._ground[: self.n] = ground_acceleration
        if np.isnan(self._currents).any():
            raise InputError("currents contain NaN; expected: numbers, A")
        if self._pool is None:
            self._step_blocks(self._parts[0])
        else:
            list(self._pool.map(self._step_blocks, self._parts))
        return self._measured[: self.n].copy()

    @property
    def alive(self) -> NDArray:
        """Whether each plant's response is still within the range of its law, (n,) bool array."""
        return self._alive[: self.n].copy()

    def _step_blocks(self, numbers: range) -> None:
        for number in numbers:
            here = slice(number * LANES, (number + 1) * LANES)
            self._blocks[number].step(
                self._currents[here], self._ground[here], self._measured[here], self._alive[here]
            )


class _Block:
    """A block of lanes, integrated repeatedly over the same part of its grid."""

    def __init__(self, plan: Plan, tolerance: float, n_channels: int, n_measures: int):
        work = plan.workspace(tolerance, True, record_steps=False)
        self.work, self.n_channels = work, n_channels
        decisions = np.flatnonzero(work.grid.events[:, 1] >= 0)[1:3]
        self.segment = int(decisions[0])
        self.begin, self.end = (int(p) for p in work.grid.segments[decisions, 0])
        n_points = len(work.grid.time)
        self.z = work.z.reshape(n_points + 2, -1, LANES)
        self.ground = work.ground
        self.measured = work.measured[2, :, :n_measures]
        with compiling(plan.kernel):
            self.integrate = work.integrator()
            self.integrate()
        # state between two steps, lanes last, and its value at rest
        self.carried = [array.reshape(-1, LANES) for array in work.carried().values()]
        self.at_rest = [array.copy() for array in self.carried]
        self.at_rest_measured = work.measured[0, :, :n_measures].copy()
        self.of_ground = work.sensing.measure[:, -work.kernel.shape.n_ground :, 0]
        self.rest(np.arange(LANES), np.zeros((LANES, work.kernel.shape.n_ground)))

    def rest(self, lanes: NDArray, ground: NDArray) -> NDArray:
        """Reset lanes to rest at a ground acceleration; returns their measurements."""
        for array, value in zip(self.carried, self.at_rest, strict=True):
            array[:, lanes] = value[:, lanes]
        self.z[self.begin][:, lanes] = 0.0
        self.work.states[self.begin][..., lanes] = 0.0
        self.ground[self.begin][:, lanes] = ground.T
        rows = self.at_rest_measured[lanes]
        rows[:, : len(self.of_ground)] += ground @ self.of_ground.T
        return rows

    def step(self, currents: NDArray, ground: NDArray, measured: NDArray, alive: NDArray) -> None:
        """Simulate all lanes over one period."""
        work, begin, end = self.work, self.begin, self.end
        work.chosen[1, :, : self.n_channels] = currents
        self.ground[begin + 1 : end + 1] = ground.transpose(1, 2, 0)
        # continue after the decision at the start of this part
        work.position[:] = self.segment, COMMAND
        self.integrate()
        work.step_count[0] = 0
        self.z[begin] = self.z[end]
        work.states[begin] = work.states[end]
        self.ground[begin] = self.ground[end]
        np.equal(work.alive, ALIVE, out=alive)
        measured[:] = self.measured
