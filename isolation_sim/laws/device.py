"""A device: a law with its parameters and scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ground_motions.argument_types import checked

from ..errors import InputError
from .current_dependence import CurrentDependence
from .law import Law


@checked
@dataclass(frozen=True)
class Device:
    """A law with its parameters, for one device or scaled to a structure.

    The methods take deformation, velocity and force in the structure's scale,
    ``x_structure = length * x_device`` and ``F_structure = force_scale * F_device``; internal
    states stay in the device's own units. They accept numbers, NumPy arrays and CasADi symbols.

    Attributes
    ----------
    law : Law
        The arithmetic.
    current : CurrentDependence
        The law's parameters as functions of the coil current, in the order of the law.
    current_range : tuple of float, A
        Lowest and highest current for which the parameters are valid; -inf and inf if the current
        has no effect.
    tested_deformation : float, m
        Largest deformation of the device tests, in the device's own scale; inf if unknown.
    tested_current : float, A
        Highest current of the device tests, which ``current_range`` may exceed; inf if unknown.
    length : float
        Deformation of the structure over that of the device.
    force_scale : float
        Force on the structure over that of the device.
    source : str
        Source of the parameters.
    name : str
        Name to print; the law's by default.

    Raises
    ------
    InputError
        If the parameters are not the law's or leave its bounds within ``current_range``, or a
        number is not usable.
    """

    law: Law
    current: CurrentDependence
    current_range: tuple[float, float] = (-np.inf, np.inf)
    tested_deformation: float = np.inf
    tested_current: float = np.inf
    length: float = 1.0
    force_scale: float = 1.0
    source: str = ""
    name: str = ""

    def __post_init__(self) -> None:
        set_field = object.__setattr__
        set_field(self, "name", self.name or self.law.name)
        set_field(self, "current", self.current.ordered(self.law.parameter_names))
        low, high = _pair(self.name, self.current_range)
        set_field(self, "current_range", (low, high))
        for what in ("tested_deformation", "length", "force_scale"):
            value = _positive(self.name, what, getattr(self, what))
            if what != "tested_deformation" and not np.isfinite(value):
                raise InputError(f"{self.name}: {what} {value} must be finite")
            set_field(self, what, value)
        tested = _number(self.tested_current)
        if not tested >= 0:
            raise InputError(
                f"{self.name}: tested_current", repr(self.tested_current), "0 A or more"
            )
        set_field(self, "tested_current", tested)
        self._check_bounds()

    def _check_bounds(self) -> None:
        low, high = self.current_range
        inner = self.current.breaks[1:-1]
        ends = [end for end in (low, high) if np.isfinite(end)] or [0.0]
        currents = np.linspace(ends[0], ends[-1], 9)
        currents = np.append(currents, inner[(inner >= low) & (inner <= high)])
        values = np.stack(self.current.at(currents)) if self.law.parameters else np.zeros((0, 9))
        slack = 1e-9 * np.max(np.abs(values), axis=1, keepdims=True)
        bounds = np.array([(q.lower, q.upper) for q in self.law.parameters]).reshape(-1, 2, 1)
        divides = np.array([[q.divides] for q in self.law.parameters], bool).reshape(-1, 1)
        wrong = (values < bounds[:, 0] - slack) | (values > bounds[:, 1] + slack)
        wrong |= divides & (values == 0)
        if not wrong.any():
            return
        for quantity, own, outside in zip(self.law.parameters, values, wrong, strict=True):
            if np.any(outside):
                worst = int(np.argmax(outside))
                at = f" at {currents[worst]:.4g} A" if self.depends_on_current else ""
                not_zero = quantity.divides and quantity.lower <= 0 <= quantity.upper
                raise InputError(
                    f"{self.name}: parameter {quantity.name!r}",
                    f"{own[worst]:.6g} {quantity.unit}{at}",
                    f"{quantity.lower:g} to {quantity.upper:g}{', not 0' * not_zero}",
                )

    @property
    def stores_energy(self) -> bool:
        """Whether the law has a stored-energy function."""
        return self.law.stored_energy is not None

    @property
    def depends_on_current(self) -> bool:
        """Whether any parameter changes with the current."""
        return self.current.depends_on_current

    @property
    def deformation_scale(self) -> float:
        """Typical deformation in the structure's scale, m: the tested one, or 0.1 m if untested."""
        tested = self.tested_deformation
        return self.length * (tested if np.isfinite(tested) else 0.1)

    def parameters_at(self, current: Any) -> tuple:
        """Parameters at a current.

        Parameters
        ----------
        current : float, numpy.ndarray or casadi.SX, A
            Coil current; not checked against ``current_range``.

        Returns
        -------
        tuple, one entry per parameter
            In the law's order and SI units.
        """
        return self.current.at(current)

    def force(self, x: Any, v: Any, states: Sequence, current: Any) -> Any:
        """Restoring force.

        Parameters
        ----------
        x : float, numpy.ndarray or casadi.SX, m
            Deformation in the structure's scale.
        v : float, numpy.ndarray or casadi.SX, m/s
            Its velocity.
        states : sequence, one entry per state
            Internal states in the device's units.
        current : float, numpy.ndarray or casadi.SX, A
            Coil current.

        Returns
        -------
        float, numpy.ndarray or casadi.SX, N
            In the structure's scale.
        """
        parameters = self.parameters_at(current)
        inner = self.law.force(x / self.length, v / self.length, tuple(states), parameters)
        return self.force_scale * inner

    def rates(self, x: Any, v: Any, states: Sequence, current: Any) -> tuple:
        """Time derivatives of the internal states.

        Parameters
        ----------
        x : float, numpy.ndarray or casadi.SX, m
            Deformation in the structure's scale.
        v : float, numpy.ndarray or casadi.SX, m/s
            Its velocity.
        states : sequence, one entry per state
            Internal states in the device's units.
        current : float, numpy.ndarray or casadi.SX, A
            Coil current.

        Returns
        -------
        tuple, one entry per state
            In the state's unit / s, in the device's scale.
        """
        parameters = self.parameters_at(current)
        return tuple(self.law.rates(x / self.length, v / self.length, tuple(states), parameters))

    def stored_energy(self, x: Any, states: Sequence, current: Any) -> Any:
        """Stored (recoverable) energy of the device.

        Parameters
        ----------
        x : float, numpy.ndarray or casadi.SX, m
            Deformation in the structure's scale.
        states : sequence, one entry per state
            Internal states in the device's units.
        current : float, numpy.ndarray or casadi.SX, A
            Coil current.

        Returns
        -------
        float, numpy.ndarray or casadi.SX, J
            In the structure's scale.

        Raises
        ------
        InputError
            If the law has no stored-energy function.
        """
        if self.law.stored_energy is None:
            raise InputError(f"{self.law.name} has no stored-energy function")
        parameters = self.parameters_at(current)
        inner = self.law.stored_energy(x / self.length, tuple(states), parameters)
        return self.length * self.force_scale * inner

    def initial_states(self) -> tuple[float, ...]:
        """Return the internal states of the undeformed device at rest: all zero."""
        return (0.0,) * len(self.law.states)

    @checked
    def scaled(self, length: float = 1.0, force: float = 1.0) -> Device:
        """Return the device with its scales multiplied.

        Parameters
        ----------
        length : float, default 1
            Factor on the deformation.
        force : float, default 1
            Factor on the force, such as the number of parallel devices.

        Returns
        -------
        Device

        Raises
        ------
        InputError
            If a factor is not a positive number.
        """
        length = _positive(self.name, "length", length)
        force = _positive(self.name, "force", force)
        if length == force == 1.0:
            return self
        return replace(self, length=self.length * length, force_scale=self.force_scale * force)

    def with_parameters(
        self,
        *,
        current_range: tuple[float, float] | None = None,
        **values: float | Sequence[float],
    ) -> Device:
        """Return the device with some parameters replaced.

        Parameters
        ----------
        current_range : (float, float), optional
            Currents for which the new parameters are valid, A; unchanged by default.
        **values : float or sequence of float
            Parameter name to a constant, or to ascending powers of the current in A, in SI units.

        Returns
        -------
        Device

        Raises
        ------
        InputError
            If a name is unknown, a number is not finite or outside the law's bounds.
        """
        source = self.source
        if source and values:
            source = f"{source}; changed: {', '.join(values)}"
        return replace(
            self,
            current=self.current.replaced(**values),
            current_range=self.current_range if current_range is None else current_range,
            source=source,
        )

    def checked_current(self, current: Any) -> Any:
        """Return the current if the device's parameters are valid for it.

        Parameters
        ----------
        current : float or numpy.ndarray, A
            Coil current.

        Returns
        -------
        float or numpy.ndarray, A
            The same.

        Raises
        ------
        InputError
            If a value is not a number or outside ``current_range``.
        """
        low, high = self.current_range
        values = np.atleast_1d(np.asarray(current, dtype=float)).ravel()
        outside = ~((values >= low) & (values <= high))
        if np.any(outside):
            raise InputError(
                f"current {values[outside][0]:.5g} A is outside {low:.4g} to {high:.4g} A, "
                f"where {self.name} is meaningful"
            )
        return current

    def linearised(self, current: float, frequency_hz: float = 1.0) -> complex:
        """Complex stiffness for small vibrations about rest, in the structure's scale.

        Parameters
        ----------
        current : float, A
            Coil current.
        frequency_hz : float, default 1, Hz
            Frequency of the vibration, above zero.

        Returns
        -------
        complex, N/m
            Storage stiffness + i loss stiffness, from exact derivatives of the law.

        Raises
        ------
        InputError
            If the current is outside ``current_range``, the frequency is not positive, or the law
            is not smooth at rest.
        """
        from .derivatives import complex_stiffness

        omega = 2 * np.pi * _positive(self.name, "frequency_hz", frequency_hz)
        parameters = self.parameters_at(float(self.checked_current(current)))
        return complex_stiffness(self.law, parameters, omega) * self.force_scale / self.length


@checked
def Scaled(device: Device, length: float = 1.0, force: float = 1.0) -> Device:
    """Return a device with its scales multiplied; the same as ``device.scaled(length, force)``.

    Parameters
    ----------
    device : Device
        Device to scale.
    length : float, default 1
        Factor on the deformation.
    force : float, default 1
        Factor on the force.

    Returns
    -------
    Device

    Raises
    ------
    InputError
        If a factor is not a positive number.
    """
    return device.scaled(length, force)


def _number(value: Any) -> float:
    """A number; NaN for anything else."""
    try:
        return float(value)
    except (TypeError, ValueError):
        return np.nan


def _positive(name: str, what: str, value: Any) -> float:
    number = _number(value)
    if not number > 0:
        raise InputError(f"{name}: {what}", repr(value), "a number above zero")
    return number


def _pair(name: str, values: Any) -> tuple[float, float]:
    try:
        low, high = (float(value) for value in values)
    except (TypeError, ValueError):
        low = high = np.nan
    if not low <= high:
        raise InputError(f"{name}: current_range", repr(values), "lowest and highest current in A")
    return low, high
