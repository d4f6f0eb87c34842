"""A single device, moved step by step: the numerical substructure of a hybrid test."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ground_motions.argument_types import checked

from ..errors import InputError
from ..identification.kernel.device_kernel_text import compiled
from ..laws.device import Device


@checked
class DeviceSimulator:
    """A device moved step by step, which returns its force.

    Parameters
    ----------
    device : Device
        Law, numbers and scale, such as ``reference_isolators()``.
    period : float, s
        Length of a step.
    tolerance : float, default 1e-6
        Target accuracy of the force, relative to its present peak; 1e-12 to 1e-2.

    Attributes
    ----------
    device : Device
        The device.
    period : float, s
        Length of a step.

    Raises
    ------
    InputError
        If an argument cannot be used.

    Examples
    --------
    >>> import isolation_sim as iso
    >>> simulator = iso.DeviceSimulator(iso.reference_isolators(), period=0.001)
    >>> force = [simulator.step(displacement, current=1.0) for displacement in (0.0, 1e-4, 2e-4)]
    """

    def __init__(self, device: Device, period: float, tolerance: float = 1e-6):
        if not 0 < period < np.inf:
            raise InputError("period", f"{period} s", "above 0")
        if not 1e-12 <= tolerance <= 1e-2:
            raise InputError("tolerance", f"{tolerance}", "1e-12 to 1e-2")
        self.device, self.period, self._tolerance = device, float(period), tolerance
        self._module = compiled(device.law)
        n, n_parameters = len(device.law.states), len(device.law.parameters)
        self._states, self._trial = np.zeros((2, max(n, 1)))
        self._parameters = np.zeros(n_parameters)
        # the kernel's arguments for derivatives, which are not needed here
        self._unused = np.zeros(0), np.zeros((max(n, 1), 0, 0))
        self._by = np.zeros((max(n, 1), n + n_parameters))
        # steps within a period, none at rest, and largest force so far; time, displacement,
        # velocity, current
        self._settings, self._end = np.zeros(2), np.zeros(4)
        self.reset()

    def __repr__(self) -> str:
        name = self.device.name or self.device.law.name
        return f"DeviceSimulator({name}; period {self.period:g} s; at {self.time:.4g} s)"

    @property
    def time(self) -> float:
        """Time at the end of the last step, s."""
        return float(self._end[0])

    def reset(self) -> None:
        """Reset the device to rest at time 0."""
        self._settings[:] = 0.0, 1e-300
        self._end[:] = 0.0, 0.0, 0.0, np.nan

    def step(
        self, displacement: float, current: float = 0.0, velocity: float | None = None
    ) -> float:
        """Move the device over one period.

        Parameters
        ----------
        displacement : float, m
            Deformation at the end of the step, in the structure's scale.
        current : float, default 0, A
            Coil current during the step, A.
        velocity : float, optional, m/s
            Velocity at the end of the step; the motion is the cubic through both ends. Without it
            the velocity is constant.

        Returns
        -------
        float, N
            Restoring force at the end of the step, in the structure's scale.

        Raises
        ------
        InputError
            If the current is outside the device's range, or the motion is not finite.
        """
        device, (_, x0, v0, last) = self.device, self._end
        if current != last:
            self._parameters[:] = device.parameters_at(float(device.checked_current(current)))
        slope = (displacement - x0) / self.period
        v0, v1 = (slope, slope) if velocity is None else (v0, velocity)
        if not (np.isfinite(displacement) and np.isfinite(v1)):
            raise InputError(
                "displacement", f"{displacement} m, velocity {v1} m/s", "finite numbers"
            )
        scale = device.length
        force = self._module.follow(
            x0 / scale,
            v0 / scale,
            displacement / scale,
            v1 / scale,
            self.period,
            self._tolerance,
            self._settings,
            self._states,
            self._trial,
            self._parameters,
            *self._unused,
            self._by,
        )
        self._end[:] = self._end[0] + self.period, displacement, v1, current
        return device.force_scale * force

    @property
    def state(self) -> dict[str, NDArray]:
        """Complete state of the simulation; after an assignment it continues from there."""
        return {
            "states": self._states.copy(), "settings": self._settings.copy(),
            "end": self._end.copy(),
        }  # fmt: skip

    @state.setter
    def state(self, values: Mapping[str, NDArray]) -> None:
        own = self.state
        if set(own) != set(values) or any(own[n].shape != values[n].shape for n in own):
            raise InputError("state is of another device; expected: one of the same law")
        self._states[:], self._settings[:] = values["states"], values["settings"]
        self._end[:] = values["end"]
        if np.isfinite(self._end[3]):
            self._parameters[:] = self.device.parameters_at(float(self._end[3]))
