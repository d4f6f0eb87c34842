"""Interface between a controller and the plant: sensors, timing, the coil driver."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ground_motions import Record
from ground_motions.argument_types import checked

from ..errors import InputError
from ..structures import IsolatedStructure


@checked
@dataclass(frozen=True)
class CoilDriver:
    """Turns a commanded current into the coil's: rate = clip((command - i) / lag, +-slew).

    A supply's highest voltage U at a coil of resistance R and inductance L shows as two of these
    limits: no more than U / R for ``high``, and a ``slew`` of (U - R i) / L at the current i.

    Attributes
    ----------
    lag : float
        Time constant of the coil and its supply, s; 0 for an ideal supply.
    slew : float
        Largest rate of the current, A/s.
    low, high : float or None
        Limits of the supply, A; None for the range in which the device's law is meaningful.
    initial : float or None
        Current before the first command, A; None for the nearest to 0 within the limits.
    step : float
        Step of the supply's digital input, A: a command becomes the nearest multiple of it
        within the limits; 0 for none.
    """

    lag: float = 0.0
    slew: float = np.inf
    low: float | None = None
    high: float | None = None
    initial: float | None = None
    step: float = 0.0

    def __post_init__(self) -> None:
        for name, value, accepted in (
            ("lag", self.lag >= 0 and np.isfinite(self.lag), "0 s or more"),
            ("slew", self.slew > 0, "above 0 A/s"),
            ("step", self.step >= 0 and np.isfinite(self.step), "0 A or more"),
        ):
            if not value:
                number = getattr(self, name)
                raise InputError(f"coil driver: {name} is {number}; expected: {accepted}")
        if self.low is not None and self.high is not None and self.low > self.high:
            raise InputError(
                f"coil driver: low {self.low} A is above high {self.high} A; expected: low <= high"
            )


@checked
@dataclass(frozen=True)
class Sensors:
    """Sensors: the measurements that a controller receives.

    Attributes
    ----------
    noise : mapping of str to float
        Standard deviation of white noise, by output name (``"floor5_acceleration_m_s2"``) or by
        quantity (``"acceleration_m_s2"``), in that unit; what a controller does not measure
        has no effect on it.
    delay : float
        Age of a measurement when it reaches the controller, s.
    sampling : float or None
        Interval at which sensors sample, s; None for as often as the controller asks.
    seed : int
        Seed of noise and dropout.
    dropout : float
        Probability that a sample with all its channels is lost; the last received sample is then
        used again. Losses are independent. The first sample, of the building at rest, is received.
    compensation : float
        Time over which the measured motion is extrapolated, s: the nominal sum of all delays. The
        extrapolation uses the measured velocity and, at constant acceleration, accelerometers on
        structure and ground with their noise. Accelerations, forces and currents stay as measured.

    References
    ----------
    Ahmadizadeh, Mosqueda and Reinhorn 2008, Compensation of actuator delay and dynamics for
    real-time hybrid structural simulation: extrapolation at constant acceleration.
    """

    noise: Mapping[str, float] = field(default_factory=dict)
    delay: float = 0.0
    sampling: float | None = None
    seed: int = 0
    dropout: float = 0.0
    compensation: float = 0.0

    def __post_init__(self) -> None:
        if not self.delay >= 0:
            raise InputError(f"sensors: delay is {self.delay} s; expected: 0 or more")
        if not 0 <= self.dropout < 1:
            raise InputError(f"sensors: dropout is {self.dropout}; expected: 0 or more, below 1")
        if not 0 <= self.compensation < np.inf:
            raise InputError(f"sensors: compensation is {self.compensation} s; expected: 0 or more")
        if self.sampling is not None and not self.sampling > 0:
            raise InputError(f"sensors: sampling is {self.sampling} s; expected: above 0")
        for name, value in self.noise.items():
            if not value >= 0:
                raise InputError(f"sensors: noise of {name} is {value}; expected: 0 or more")


@dataclass(frozen=True)
class Schedule:
    """Commands that are known before the run."""

    time: NDArray  # (n,): Instants from which the commands hold, s, increasing from 0
    current: NDArray  # (n, n_channels): Commands, A

    def __post_init__(self) -> None:
        time = np.asarray(self.time, float)
        if not (time.ndim == 1 and time.size and time[0] >= 0 and (time[1:] > time[:-1]).all()):
            raise InputError(
                "a schedule's instants must increase from 0 s or later; given "
                f"{np.array2string(time, threshold=6)}"
            )


@dataclass(frozen=True)
class CompiledDecision:
    """A controller's decision in compiled code, called from inside the compiled loop."""

    # Of a C function ``(t, measured*, settings*, memory*, command*, sizes*)``: doubles and, last,
    # the int64 lengths of the four arrays
    address: int
    settings: NDArray  # (n_settings,): Constants of the controller
    memory: NDArray  # (n_memory,): What it keeps between decisions; its value at the start
    keep: Any  # Whatever must stay alive while the address is in use
    # Returns the whole source of the decision, for a translation into another language
    text: Callable[[], str] | None = None
    # Names of what it is given after the measurements; a run gives nothing more
    inputs: tuple[str, ...] = ()


@dataclass(frozen=True)
class RunContext:
    """Information that a controller receives before a run."""

    # The model that the controller may reason with; not the plant, though it may equal it
    nominal: IsolatedStructure
    period: float  # Interval between decisions, s
    duration: float  # Length of the run, s
    # low, high: (n_channels,): Limits of the supply, A
    low: NDArray
    high: NDArray
    # (n_channels,): Highest current at which the plant's devices were tested, A; inf where nobody
    # says
    tested: NDArray
    # Names of what it will be given, in order: its ``measures``, then the coil currents
    outputs: tuple[str, ...]
    # Nominal lag, slew and initial current of the coils; an ideal supply by default
    driver: CoilDriver = field(default_factory=CoilDriver)
    # Nominal age of a measurement at a decision, and time from this to its command, s
    delays: tuple[float, float] = (0.0, 0.0)
    # The ground motion, one record per direction; None for a controller without ``preview_time``
    ground: tuple[Record, ...] | None = None


class Control(Protocol):
    """Interface of a controller for a run; ``controllers.controller.Controller`` provides it."""

    @property
    def name(self) -> str:
        """Name to print."""

    @property
    def period(self) -> float | None:
        """Interval between decisions, s; None for the record's sampling interval."""

    @property
    def preview_time(self) -> float:
        """Preview time of the ground motion, s."""

    def prepare(self, context: RunContext, trial: Any) -> None:
        """Get ready on the plant itself; ``trial(controller)`` simulates another one there."""

    def measures(self, nominal: IsolatedStructure) -> tuple[str, ...]:
        """Names of the outputs that it wants measured."""

    def schedule(self, context: RunContext) -> Schedule | None:
        """Commands known before the run; None if it decides as it goes."""

    def compiled(self, context: RunContext) -> CompiledDecision | None:
        """Its decision in compiled code; None if it is plain Python."""

    def reset(self, context: RunContext) -> None:
        """Forget the last run."""

    def current(self, t: float, measurement: Any) -> Any:
        """Command from a measurement, a named tuple: one current or one per channel, A."""


def instants(period: float, duration: float) -> NDArray:
    """Decision instants of a run, s: 0, period, 2 period, ... below the duration."""
    return np.arange(int(np.ceil(duration / period * (1 - 1e-12)))) * period
