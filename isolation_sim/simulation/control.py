"""Interface of controller and plant: sensors, timing, coil driver, calls of a controller."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ground_motions import Record
from ground_motions.argument_types import checked

from ..errors import ControllerError, Diverged, InputError, RefusedCurrent, line_within
from ..structures import IsolatedStructure


@checked
@dataclass(frozen=True)
class CoilDriver:
    """Coil and supply: rate of the coil current i = clip((command - i) / lag, +-slew).

    A supply of highest voltage U and a coil of resistance R and inductance L set two of these
    limits: ``high`` is at most U / R, and ``slew`` is (U - R i) / L at the current i.

    Attributes
    ----------
    lag : float
        Time constant of the coil and its supply, s; 0 for an ideal supply.
    slew : float
        Largest rate of the current, A/s.
    low, high : float or None
        Limits of the supply, A; None for the current range of the device.
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
        for name, valid, accepted in (
            ("lag", self.lag >= 0 and np.isfinite(self.lag), "0 s or more"),
            ("slew", self.slew > 0, "above 0 A/s"),
            ("step", self.step >= 0 and np.isfinite(self.step), "0 A or more"),
        ):
            if not valid:
                value = getattr(self, name)
                raise InputError(f"coil driver: {name}", f"{value}", accepted)
        if self.low is not None and self.high is not None and self.low > self.high:
            raise InputError(
                f"coil driver: low {self.low} A is above high {self.high} A; expected: low <= high"
            )


@checked
@dataclass(frozen=True)
class Sensors:
    """Sensors of a controller.

    Attributes
    ----------
    noise : mapping of str to float
        Standard deviation of white noise, by output name (``"floor5_acceleration_m_s2"``) or by
        quantity, in its unit: ``"displacement_m"``, ``"velocity_m_s"``, ``"acceleration_m_s2"``,
        ``"drift_m"``, ``"deformation_m"`` or ``"force_N"``. Noise of outputs that a controller
        does not measure has no effect.
    delay : float
        Age of a measurement when it reaches the controller, s.
    sampling : float or None
        Sampling interval of the sensors, s, counted from the start of the run: a decision uses the
        last sample that has arrived, which may be older than ``delay``. None for samples that
        arrive just at the decisions.
    seed : int
        Seed of noise and dropout.
    dropout : float
        Probability that a sample with all its channels is lost; the last received sample is then
        used again. Losses are independent. The first sample, of the building at rest, is not lost.
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
            raise InputError("sensors: delay", f"{self.delay} s", "0 or more")
        if not 0 <= self.dropout < 1:
            raise InputError("sensors: dropout", f"{self.dropout}", "0 or more, below 1")
        if not 0 <= self.compensation < np.inf:
            raise InputError("sensors: compensation", f"{self.compensation} s", "0 or more")
        if self.sampling is not None and not self.sampling > 0:
            raise InputError("sensors: sampling", f"{self.sampling} s", "above 0")
        for name, value in self.noise.items():
            if not value >= 0:
                raise InputError(f"sensors: noise of {name}", f"{value}", "0 or more")


@dataclass(frozen=True)
class Schedule:
    """Commands known before the run."""

    time: NDArray  # (n,): Instants from which the commands hold, s, increasing from 0
    current: NDArray  # (n, n_channels): Commands, A

    def __post_init__(self) -> None:
        time = np.asarray(self.time, float)
        if not (time.ndim == 1 and time.size and time[0] >= 0 and (time[1:] > time[:-1]).all()):
            raise InputError(
                "a schedule's instants must increase from 0 s or later; they are "
                f"{np.array2string(time, threshold=6)}"
            )


@dataclass(frozen=True)
class CompiledDecision:
    """A controller's decision in compiled code, called by the compiled integration."""

    # Address of a C function ``(t, measured*, settings*, memory*, command*, sizes*)`` with doubles
    # and, last, the int64 lengths of the four arrays and then ``numbers``
    address: int
    settings: NDArray  # (n_settings,): Constants of the controller
    memory: NDArray  # (n_memory,): Initial memory of the controller
    keep: Any  # Objects that must stay alive while the address is in use
    # Returns the whole source of the decision, for a translation into another language
    text: Callable[[], str] | None = None
    # Names of further inputs after the measurements; a run has none
    inputs: tuple[str, ...] = ()
    # Such as the addresses of the functions of the devices' laws that the decision calls
    numbers: tuple[int, ...] = ()


@dataclass(frozen=True)
class RunContext:
    """Run context: information for a controller before a run."""

    # The nominal model of the controller; it may differ from the plant
    nominal: IsolatedStructure
    period: float  # Interval between decisions, s
    duration: float  # Length of the run, s
    # low, high: (n_channels,): Limits of the supply, A
    low: NDArray
    high: NDArray
    # (n_channels,): Highest tested current of the plant's devices, A; inf if unknown
    tested: NDArray
    # Names of the measurements in order: its ``measures``, then the coil currents
    outputs: tuple[str, ...]
    # Nominal lag, slew and initial current of the coils; an ideal supply by default
    driver: CoilDriver = field(default_factory=CoilDriver)
    # Nominal age of a measurement at a decision, and delay from the decision to its command, s
    delays: tuple[float, float] = (0.0, 0.0)
    # The ground motion, one record per direction; None for a controller without ``preview_time``
    ground: tuple[Record, ...] | None = None


class Control(Protocol):
    """Interface of a controller; ``controllers.controller.Controller`` implements it."""

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
        """Prepare with runs of the plant; ``trial(controller)`` simulates another controller."""

    def measures(self, nominal: IsolatedStructure) -> tuple[str, ...]:
        """Names of the outputs to measure."""

    def schedule(self, context: RunContext) -> Schedule | None:
        """Commands known before the run; None if it decides during the run."""

    def compiled(self, context: RunContext) -> CompiledDecision | None:
        """Its decision in compiled code; None for plain Python."""

    def reset(self, context: RunContext) -> None:
        """Reset the controller for a new run."""

    def current(self, t: float, measurement: Any) -> Any:
        """Command from a measurement, a named tuple: one current or one per channel, A."""


def instants(period: float, duration: float) -> NDArray:
    """Decision instants of a run, s: 0, period, 2 period, ... below the duration."""
    return np.arange(int(np.ceil(duration / period * (1 - 1e-12)))) * period


def current_of(controller: Control, t: float, measurement: Any) -> NDArray:
    """Ask for a decision; (n_channels,) or (1,), A."""
    try:
        chosen = controller.current(t, measurement)
        currents = np.atleast_1d(np.asarray(chosen, float))
    except (InputError, Diverged):
        raise
    except Exception as error:
        cause = _missing(error, measurement) or _cause(error)
        raise _failed(controller, f"at t = {t:.4g} s", cause, error) from error
    # NumPy reads the text "3" as a number
    if chosen is None or np.asarray(chosen).dtype.kind in "US":
        raise RefusedCurrent(
            f"{controller.name}: current() gave {chosen!r} at t = {t:.4g} s; expected: a current, "
            f"A, {'after return' if chosen is None else 'as a number'}"
        )
    return currents


_CALLS = {
    "measures": "measures(nominal)", "prepare": "prepare(context, trial)", "reset": "reset(context)"
}  # fmt: skip


@contextmanager
def calling(controller: Control, method: str) -> Iterator[None]:
    """Name the controller and its method in an error before the run."""
    try:
        yield
    except (InputError, Diverged):
        raise
    except Exception as error:
        cause = _cause(error)
        if isinstance(error, TypeError) and "positional argument" in str(error):
            cause += f"; the call is {_CALLS[method]}" * (method in _CALLS)
        raise _failed(controller, f"in {method}()", cause, error) from error


def _failed(controller: Control, when: str, cause: str, error: Exception) -> ControllerError:
    line = line_within(type(controller).__module__, error)
    return ControllerError(f"{controller.name} failed {when}: {cause}{line}")


def _cause(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split()).removesuffix(":")


def _missing(error: Exception, measurement: Any) -> str:
    """Cause where a controller reads a field that it does not measure; empty otherwise."""
    if not isinstance(error, AttributeError) or error.obj is not measurement:
        return ""
    fields: tuple[str, ...] = getattr(measurement, "_fields", ())
    return (
        f"the measurement has no {error.name}; expected: {', '.join(fields)}, or "
        f"{error.name} among the names of measures()"
    )
