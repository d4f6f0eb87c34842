"""A plant simulated step by step for a caller: a learner, a laboratory or another program."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ground_motions import Record
from ground_motions.argument_types import checked

from ..errors import InputError
from ..structures import IsolatedStructure
from .control import CoilDriver, RunContext, Sensors
from .kernel.loading import compiling
from .kernel.slots import ALIVE
from .outputs import output_names
from .plan import Plan
from .run import NoControl, check_options, one_per_direction, prepare_lane


class Outside(NoControl):
    """Controller of a run whose currents come from the caller."""

    name = "simulator"

    def __init__(self, period: float | None, measures: tuple[str, ...]):
        self.period, self._measures = period, measures

    def measures(self, nominal: IsolatedStructure) -> tuple[str, ...]:
        """Outputs to measure for the caller."""
        return self._measures

    def schedule(self, context: RunContext) -> None:
        """No commands are known before: the caller decides."""


@checked
class Simulator:
    """A plant simulated step by step.

    It uses the compiled integration, sensors, timing and coil driver of `simulate`, and gives the
    same results to the last bit. The caller sets the currents and optionally the ground motion.

    Parameters
    ----------
    isolated : IsolatedStructure
        The plant.
    ground : Record or sequence of Record, optional
        Ground acceleration, m/s^2, one record per direction. Without it every call of ``step``
        needs the ground acceleration, and ``period`` and ``duration`` are required.
    period : float, optional
        Length of a step, s; the record's sampling interval by default.
    duration : float, optional
        Longest simulated time without a record, s.
    dt : float, optional
        Sampling interval of the ground motion without a record, s; ``period`` by default, or
        ``period`` divided by an integer.
    measures : sequence of str, optional
        Outputs to measure, such as ``"base_displacement_m"``; all by default.
    driver : CoilDriver, optional
        Lag, slew, limits and step of the coils; ideal by default.
    sensors : Sensors, optional
        Noise, delay, dropout and sampling of the measurements; ideal by default.
    computation_delay : float, default 0, s
        Time from the start of a step to the beginning of its command.
    tolerance : float, default 1e-6
        Target accuracy, relative to each quantity's peak; 1e-12 to 1e-2.
    current_outside : {"refuse", "clamp"}
        Treatment of a current outside the driver's limits: an error, or the nearest limit.

    Attributes
    ----------
    isolated : IsolatedStructure
        The plant.
    measures : tuple of str
        Names of the measured values: the outputs, then the coil currents.
    low, high : numpy.ndarray, shape (n_channels,), A
        Limits of the coil currents.
    period : float, s
        Length of a step.
    n_steps : int
        Steps from the start to the end.

    Raises
    ------
    InputError
        If an argument cannot be used.

    Notes
    -----
    The memory for all steps, about 1 kB per step for a building of six degrees of freedom, is
    allocated at the start.

    Examples
    --------
    >>> import isolation_sim as iso
    >>> from ground_motions import el_centro_1940
    >>> building = iso.reference_building().on(iso.reference_isolators())
    >>> simulator = iso.Simulator(building, el_centro_1940(), measures=["base_velocity_m_s"])
    >>> measurement = simulator.reset()
    >>> while not simulator.done:
    ...     measurement = simulator.step(1.0 if measurement.base_velocity_m_s > 0 else 0.0)
    """

    def __init__(
        self,
        isolated: IsolatedStructure,
        ground: Record | Sequence[Record] | None = None,
        *,
        period: float | None = None,
        duration: float | None = None,
        dt: float | None = None,
        measures: Sequence[str] | None = None,
        driver: CoilDriver | None = None,
        sensors: Sensors | None = None,
        computation_delay: float = 0.0,
        tolerance: float = 1e-6,
        current_outside: str = "refuse",
    ):
        check_options(tolerance, current_outside, computation_delay)
        self.isolated = isolated
        self._ground_by_step = ground is None
        if ground is None:
            records: tuple[Record, ...] = still_ground(isolated, period, duration, dt)
        else:
            for name, value in (("duration", duration), ("dt", dt)):
                if value is not None:
                    raise InputError(name, f"{value} s", "none, since there is a record")
            records = one_per_direction(ground)
        first = records[0]
        self.period = first.dt if period is None else float(period)
        names = output_names(isolated) if measures is None else tuple(measures)
        self._sensors, self._delay = sensors or Sensors(), computation_delay
        self._tolerance, self._clamp = tolerance, current_outside == "clamp"
        outside = Outside(self.period, names)
        delays = self._sensors.delay, computation_delay
        if self.period > 0:
            self.n_steps = int(np.ceil(first.duration / self.period * (1 - 1e-12)))
            # the ground is at rest after the record, since the last step ends with a measurement
            rest = int(self.n_steps * self.period / first.dt * (1 + 1e-9)) + 2 - len(first)
            records = tuple(
                replace(r, acceleration=np.append(r.acceleration, np.zeros(max(rest, 0))))
                for r in records
            )
        self._lane = prepare_lane(
            isolated, records, outside, None, driver or CoilDriver(), delays, None
        )
        context = self._lane.context
        self.measures, self.low, self.high = context.outputs, context.low, context.high
        self._measurement: Any = namedtuple("Measurement", self.measures)  # type: ignore[misc]
        self._width = len(self._lane.coils)
        self._seed: int | None = None
        self.reset()

    def __repr__(self) -> str:
        at = f"{self.time:.4g} s, step {self._k} of {self.n_steps}"
        return f"Simulator({self.isolated.structure.name}; period {self.period:g} s; at {at})"

    @property
    def time(self) -> float:
        """Time at the end of the last step, s."""
        return self._k * self.period

    @property
    def done(self) -> bool:
        """Whether the last step has been taken."""
        return self._k >= self.n_steps

    def reset(self, seed: int | None = None, ground_acceleration: ArrayLike = 0.0) -> Any:
        """Reset the plant to rest at time 0.

        Parameters
        ----------
        seed : int, optional
            Seed of the sensors' noise and dropout; the last seed by default, at first the sensors'.
        ground_acceleration : float or array_like, shape (n_directions,), default 0, m/s^2
            Ground acceleration at time 0; only without a record.

        Returns
        -------
        named tuple of float
            The measurement at time 0; see ``measures``.

        Raises
        ------
        InputError
            If an argument cannot be used.
        """
        if seed is None:
            seed = self._sensors.seed if self._seed is None else self._seed
        if seed != self._seed:
            self._seed = seed
            sensors = replace(self._sensors, seed=seed)
            self._plan = Plan([self._lane], sensors, self._delay, alike=True)
            self._measured_for = self._plan.sensing.measured_for.tolist()
        plan = self._plan
        self._work = plan.workspace(self._tolerance, self._clamp, record_steps=False)
        if self._ground_by_step:
            self._work.ground[0, :, 0] = self._checked_ground(ground_acceleration, 1)
        elif np.any(ground_acceleration):
            raise InputError("ground_acceleration is set; expected: none, since there is a record")
        with compiling(plan.kernel):
            self._integrate = self._work.integrator()
            self._integrate()
        # of each step: the grid points at its start and its end
        decisions = np.flatnonzero(self._work.grid.events[:, 1] >= 0)
        self._segments = decisions[: self.n_steps + 1]
        self._points = self._work.grid.segments[self._segments, 0].tolist()
        self._k = 0
        return self._measure()

    def step(self, current: ArrayLike, ground_acceleration: ArrayLike | None = None) -> Any:
        """Simulate one period.

        Parameters
        ----------
        current : float or array_like, shape (n_channels,), A
            Command from now on: one current for all coils, or one per coil.
        ground_acceleration : float or array_like, optional, m/s^2
            Without a record: at the step's end, shape (n_directions,), or at all samples of the
            ground motion after its start, shape (n_samples, n_directions). It is linear between.

        Returns
        -------
        named tuple of float
            The measurement at the end of the step; see ``measures``.

        Raises
        ------
        InputError
            If the last step has been taken, a current is refused, or an argument cannot be used.
        Diverged
            If the response leaves the range of numbers or of the law; with the time and the cause.
        """
        k, work = self._k, self._work
        if k >= self.n_steps:
            raise InputError(f"the last step, to {self.time:.4g} s, has been taken; reset() begins")
        try:
            work.chosen[k, 0, : self._width] = current
        except (TypeError, ValueError):
            raise InputError(
                "current", f"{current!r} A", f"one number, or {self._width}, one per coil"
            ) from None
        if self._ground_by_step:
            self._put_ground(ground_acceleration)
        elif ground_acceleration is not None:
            raise InputError("ground_acceleration is set; expected: none, since there is a record")
        self._integrate()
        if work.alive[0] != ALIVE:
            self._k = self.n_steps
            failure = self._plan.failure(work, 0)
            assert failure is not None
            raise failure
        # the records of short steps are not needed here
        work.step_count[0] = 0
        self._k = k + 1
        return self._measure()

    def _measure(self) -> Any:
        row = self._work.measured[self._measured_for[self._k], 0, : len(self.measures)]
        return self._measurement._make(row.tolist())

    def _put_ground(self, values: ArrayLike | None) -> None:
        """Write a step's ground acceleration to its grid points."""
        if values is None:
            raise InputError(
                "ground_acceleration is missing; expected: a number, m/s^2, as there is no record"
            )
        first, last = self._points[self._k], self._points[self._k + 1]
        dt = self._lane.records[0].dt
        n = round(self.period / dt)
        ground, rows = self._work.ground[:, :, 0], self._checked_ground(values, n)
        if last - first == n:
            ground[first + 1 : last + 1] = rows
            return
        # instants between the samples: of sensors, of a delayed command
        samples = (self._k * n + np.arange(n + 1)) * dt
        for column, values in zip(ground.T, rows.T, strict=True):
            known = np.append(column[first], values)
            times = self._work.grid.time[first + 1 : last + 1]
            column[first + 1 : last + 1] = np.interp(times, samples, known)
        grid_samples = self._work.grid.samples
        ground[grid_samples[self._k * n + 1 : (self._k + 1) * n + 1]] = rows

    def _checked_ground(self, values: ArrayLike, n_samples: int) -> NDArray:
        """Ground acceleration at a step's samples, (n_samples, n_directions)."""
        n_directions = self._work.ground.shape[1]
        rows = np.asarray(values, float)
        if rows.size != n_samples * n_directions or not np.isfinite(rows).all():
            raise InputError(
                "ground_acceleration",
                repr(values),
                f"finite numbers, shape ({n_samples}, {n_directions}): one per sample and "
                "direction, m/s^2",
            )
        return rows.reshape(n_samples, n_directions)

    @property
    def state(self) -> dict[str, NDArray]:
        """Complete state of the simulation; after an assignment it continues with the same bits.

        It is a dictionary of arrays: ``np.savez(path, **simulator.state)`` saves it, and
        ``simulator.state = np.load(path)`` restores it, also in another process. The other
        simulator must have the same arguments.
        """
        work, grid = self._work, self._work.grid
        segment, point = self._segments[self._k], self._points[self._k]
        n_measured, n_commands = self._so_far(segment)
        return {
            "k": np.array([self._k, self._seed or 0, n_measured, n_commands]),
            "grid": np.array([self.period, *grid.time[[-1]], len(grid.time)]),
            "measured": work.measured[self._measured_for[self._k] : n_measured].copy(),
            "chosen": work.chosen[n_commands : self._k].copy(),
            "command": work.command[point].copy(),
            "ground": work.ground[point].copy(),
            **work.state_at(point),
        }

    @state.setter
    def state(self, values: Mapping[str, NDArray]) -> None:
        own = self.state
        alike = set(own) == set(values) and np.array_equal(own["grid"], values["grid"])
        free = ("measured", "chosen")
        if not alike or any(own[n].shape[n in free :] != values[n].shape[n in free :] for n in own):
            raise InputError(
                "state is of another simulator; expected: the same plant, ground motion and options"
            )
        k, seed, n_measured, n_commands = (int(number) for number in values["k"])
        if seed != self._seed:
            self.reset(seed)
        self._k, work, point = k, self._work, self._points[k]
        work.measured[self._measured_for[k] : n_measured] = values["measured"]
        work.chosen[n_commands:k] = values["chosen"]
        work.command[point], work.ground[point] = values["command"], values["ground"]
        work.step_count[0] = 0
        work.restore(point, values)

    def _so_far(self, segment: int) -> tuple[int, int]:
        """Numbers of measurements and commands before the decision at a segment's start."""
        events = self._work.grid.events
        return int(events[: segment + 1, 0].max()) + 1, int(events[:segment, 2].max(initial=-1)) + 1


def still_ground(
    isolated: IsolatedStructure, period: float | None, duration: float | None, dt: float | None
) -> tuple[Record, ...]:
    """Records at rest, one per direction, as placeholders for the caller's ground acceleration."""
    for name, value in (("period", period), ("duration", duration)):
        if value is None or not 0 < value < np.inf:
            raise InputError(name, f"{value}, without a record", "a time above 0 s")
    assert period is not None and duration is not None
    dt = period if dt is None else dt
    parts = round(period / dt) if dt > 0 else 0
    if parts < 1 or abs(parts * dt - period) > 1e-9 * period:
        raise InputError("dt", f"{dt} s", f"the period, {period} s, divided by an integer")
    n = int(np.ceil(duration / period * (1 - 1e-12))) * parts + 1
    still = Record(np.zeros(max(n, 2)), dt, name="given step by step")
    return (still,) * len(isolated.structure.directions)
