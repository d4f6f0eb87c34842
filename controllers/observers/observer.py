"""Base class of observers: their inputs, and a run over measurements."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ground_motions.argument_types import checked
from isolation_sim.errors import InputError
from isolation_sim.simulation.control import RunContext
from isolation_sim.structures import IsolatedStructure

from ..compiled import Decision, decision_step
from ..device_model import DeviceModel
from ..force_tracking import force_tracking
from .ground_noise import GroundNoise

# every observer's settings begin with these
N_DOFS, N_Z, N_Y, N_ELEMENTS = range(4)


@checked
@dataclass(frozen=True)
class Noise:
    """Noise of sensors and devices in the model of an observer.

    Attributes
    ----------
    acceleration : float, m/s^2
        Standard deviation of an accelerometer's.
    deformation : float, m
        Standard deviation of a displacement transducer's.
    states : float
        How far a device's state walks at random in 1 s, over the deformation of the device's tests
        (states in m) or over 1; for the extended filter.

    Raises
    ------
    InputError
        If a number is not above 0.
    """

    acceleration: float = 0.02
    deformation: float = 2e-4
    states: float = 3e-3

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"noise: {name}", f"{value}", "a number above 0")


@dataclass(frozen=True)
class Estimate:
    """Estimates of an observer, one row per instant.

    Attributes
    ----------
    time : numpy.ndarray, shape (n,), s
        Instants.
    displacement : numpy.ndarray, shape (n, n_dofs), m
        Relative to the ground.
    velocity : numpy.ndarray, shape (n, n_dofs), m/s
        Relative to the ground.
    ground : numpy.ndarray, shape (n, n_ground)
        States of the ground's filters: displacement (m) and velocity (m/s), one pair a direction.
    device_states : numpy.ndarray, shape (n, n_elements, n_states)
        Internal states in the devices' units.
    innovations : numpy.ndarray, shape (n, n_measured)
        Measurements minus predictions, made independent and of unit variance: white noise of
        variance 1 if the observer's assumptions hold. Their squares summed over a row are the
        normalised innovation squared.
    covariance : numpy.ndarray, shape (n, n_states, n_states)
        Of the error that the observer expects, of displacements, velocities and ground, followed
        by the device states where the observer estimates them.
    """

    time: NDArray
    displacement: NDArray
    velocity: NDArray
    ground: NDArray
    device_states: NDArray
    innovations: NDArray
    covariance: NDArray


def ground_outputs(nominal: IsolatedStructure) -> tuple[str, ...]:
    """Names of the measured ground accelerations, one a direction."""
    directions = nominal.structure.directions
    return tuple(
        f"ground_{'' if len(directions) == 1 else d + '_'}acceleration_m_s2" for d in directions
    )


@checked
class Observer(ABC):
    """Estimates the state from accelerometers and the isolators' displacement.

    Parameters
    ----------
    nominal : IsolatedStructure
        The model to reason with.
    period : float
        Interval between measurements, s.
    ground : GroundNoise, optional
        The unknown ground motion.
    noise : Noise, optional
        Of sensors and devices.
    reference : float, optional
        Current at which isolators are linearised, A; the middle of the range by default.
    limits : array_like, shape (2, n_channels), optional
        Lowest and highest current of each coil, A; by default those at which the devices are
        meaningful and, at most, were tested.
    measured_ground : bool, optional
        Whether the ground acceleration is measured too. White noise has no acceleration that could
        be measured: it is ignored then.
    jump : float, optional
        Instant within an interval at which the currents jump, as those of coils without lag, from 0
        to 1: 0 if commands act at the instants of the measurements. By default currents change
        steadily from one measurement to the next.

    Raises
    ------
    InputError
        If the period is not above 0.
    """

    devices: ClassVar[type[DeviceModel]] = DeviceModel
    tracking_at: ClassVar[int]
    """Place in the settings with the first place of the force tracking."""

    def __init__(
        self,
        nominal: IsolatedStructure,
        period: float,
        ground: GroundNoise | None = None,
        noise: Noise | None = None,
        reference: float | None = None,
        limits: ArrayLike | None = None,
        measured_ground: bool = False,
        jump: float | None = None,
    ):
        if not (np.isfinite(period) and period > 0):
            raise InputError("observer: period", f"{period} s", "above 0")
        n = nominal.n_channels
        tested = np.array([nominal.tested_current(c) for c in range(n)])
        if limits is None:
            limits = np.array([nominal.current_range(c) for c in range(n)]).reshape(n, 2).T
        else:
            tested[:] = np.inf
        self.nominal, self.period = nominal, float(period)
        self.ground, self.noise = ground or GroundNoise(), noise or Noise()
        self.measured_ground = measured_ground and self.ground.frequency is not None
        self.jump = -1.0 if jump is None else float(jump)
        low, high = np.asarray(limits, float)
        context = RunContext(nominal, self.period, 0.0, low, high, tested, self.outputs)
        self.tracking = force_tracking(nominal.elements, context, self.devices)
        self.reference = self.tracking.reference(reference)

    @staticmethod
    def measures(nominal: IsolatedStructure) -> tuple[str, ...]:
        """Names of the measured outputs.

        Parameters
        ----------
        nominal : IsolatedStructure
            The model to reason with.

        Returns
        -------
        tuple of str
            All levels' accelerations, then all elements' deformations.
        """
        return (
            *(f"{dof}_acceleration_m_s2" for dof in nominal.structure.names),
            *(f"{element}_deformation_m" for element in nominal.element_names),
        )

    @property
    def outputs(self) -> tuple[str, ...]:
        """Columns: its measured outputs, ground accelerations if measured, coil currents."""
        coils = (f"coil{c}_current_A" for c in range(self.nominal.n_channels))
        ground = ground_outputs(self.nominal) if self.measured_ground else ()
        return (*self.measures(self.nominal), *ground, *coils)

    def ground_rows(self) -> NDArray:
        """Ground accelerations, if measured, from the state of structure and filters."""
        n, directions = self.nominal.structure.n_dofs, self.nominal.structure.directions
        along = np.kron(np.eye(len(directions)), self.ground.filter()[2])
        return np.pad(along, ((0, 0), (2 * n, 0)))[: self.measured_ground * len(directions)]

    @abstractmethod
    def decision(self) -> Decision:
        """Compile the observer.

        Returns
        -------
        Decision
            Whose commands are the row that ``estimate`` reads.
        """

    @abstractmethod
    def width(self) -> int:
        """Length of the row that the compiled form writes."""

    @abstractmethod
    def estimate(self, time: NDArray, rows: NDArray) -> Estimate:
        """Unpack the output of the compiled form.

        Parameters
        ----------
        time : numpy.ndarray, shape (n,), s
            Instants.
        rows : numpy.ndarray, shape (n, width)
            The output.

        Returns
        -------
        Estimate
        """

    def reset(self) -> None:
        """Forget all measurements; the next one is taken at rest, at 0 s."""
        self._step = decision_step(self.decision(), len(self.outputs), self.width())
        self._taken = 0

    def update(self, measurement: ArrayLike) -> Estimate:
        """Estimate from the measurement of the present instant, one period after the last one.

        A controller whose ``measures`` are ``outputs`` without the coil currents passes the
        measurement that it receives.

        Parameters
        ----------
        measurement : array_like, shape (n_outputs,)
            One number each of ``outputs``: m/s^2, m and A.

        Returns
        -------
        Estimate
            Of one instant: its arrays have one row.

        Raises
        ------
        InputError
            If the measurement has another shape or is not finite.
        """
        row = self._checked(measurement, 1)
        if not hasattr(self, "_step"):
            self.reset()
        time = self._taken * self.period
        self._taken += 1
        written = np.reshape(self._step(time, row), (1, self.width()))
        return self.estimate(np.array([time]), written)

    def run(self, measurements: ArrayLike) -> Estimate:
        """Estimate from measurements one after another, starting at rest.

        Parameters
        ----------
        measurements : array_like, shape (n, n_outputs)
            One row an instant, one column each of ``outputs``: m/s^2, m and A.

        Returns
        -------
        Estimate

        Raises
        ------
        InputError
            If the measurements have another shape or are not finite.
        """
        rows = self._checked(measurements, 2)
        time = np.arange(len(rows)) * self.period
        step = decision_step(self.decision(), len(self.outputs), self.width())
        written = [step(t, row) for t, row in zip(time, rows, strict=True)]
        return self.estimate(time, np.reshape(written, (len(rows), self.width())))

    def _checked(self, measurements: ArrayLike, dimensions: int) -> NDArray:
        """Measurements as numbers, one column each of ``outputs``."""
        rows = np.asarray(measurements, dtype=float)
        shape, n = rows.shape, len(self.outputs)
        if len(shape) != dimensions or shape[-1] != n or not np.isfinite(rows).all():
            raise InputError(
                f"observer: measurements have shape {shape}; expected: finite numbers, one "
                f"{'column' if dimensions == 2 else 'number'} each of {', '.join(self.outputs)}"
            )
        return rows
