"""A linear structure together with its nonlinear elements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError, unknown_name
from ..laws.device import Device
from .checks import numbers
from .structure import Structure


def check_device(device: Device, name: str) -> None:
    """Refuse anything that is not a device.

    Parameters
    ----------
    device : Device
        What the user gave.
    name : str
        Element that it is for, for the error.

    Raises
    ------
    InputError
        Such as for a law without its numbers.
    """
    if not isinstance(device, Device):
        raise InputError(
            f"element {name!r} needs a Device, a law with its numbers, as law() returns; "
            f"got {type(device).__name__}"
        )


@dataclass(frozen=True, eq=False)
class Element:
    """Nonlinear element: a device along a direction of the structure.

    It deforms by ``direction @ q`` and puts the force ``-direction * F`` on the dofs.

    Attributes
    ----------
    device : Device
        Law, numbers and scale.
    direction : numpy.ndarray, shape (n,)
        Deformation per unit of each displacement.
    channel : int or None
        Coil channel that drives it; None for an element that no coil drives.
    name : str
        Name to print.

    Raises
    ------
    InputError
        If the device has a coil but no channel, or a channel or direction cannot be used.
    """

    device: Device
    direction: np.ndarray
    channel: int | None = None
    name: str = "element"

    def __post_init__(self) -> None:
        check_device(self.device, self.name)
        if self.channel is None and self.device.depends_on_current:
            raise InputError(
                f"element {self.name!r} depends on the coil current but has no channel: "
                "give channel=0 or the number of its coil"
            )
        whole = isinstance(self.channel, (int, np.integer))
        if self.channel is not None and not (whole and self.channel >= 0):
            raise InputError(
                f"element {self.name!r} has channel {self.channel!r}; accepted: 0, 1, 2"
            )
        direction = numbers(f"direction of element {self.name!r}", self.direction)
        object.__setattr__(self, "direction", direction)


@dataclass(frozen=True, eq=False)
class IsolatedStructure:
    """Structure with nonlinear elements: M q'' + C q' + K q = -M r a_g - sum b_i F_i.

    Attributes
    ----------
    structure : Structure
        The linear part.
    elements : tuple of Element
        The nonlinear part.

    Raises
    ------
    InputError
        If a direction does not fit the structure, a name is used twice, or a channel is left out.
    """

    structure: Structure
    elements: tuple[Element, ...]

    def __post_init__(self) -> None:
        elements = tuple(
            replace(element, direction=self.structure.direction_row(element.direction))
            for element in self.elements
        )
        object.__setattr__(self, "elements", elements)
        names = self.element_names
        if len(set(names)) < len(names):
            raise InputError(f"two elements of {self.structure.name} share a name: {names}")
        used = sorted({e.channel for e in elements if e.channel is not None})
        if used != list(range(len(used))):
            raise InputError(f"coil channels are {used}; accepted: 0, 1, 2 without gaps")

    @property
    def element_names(self) -> tuple[str, ...]:
        """Names of the elements."""
        return tuple(element.name for element in self.elements)

    @property
    def n_channels(self) -> int:
        """Number of coil channels."""
        return len({element.channel for element in self.elements} - {None})

    @property
    def element_rows(self) -> np.ndarray:
        """Deformation of each element per unit of each displacement, shape (n_elements, n)."""
        rows = [element.direction for element in self.elements]
        return np.array(rows).reshape(len(rows), self.structure.n_dofs)

    @property
    def control_devices(self) -> np.ndarray:
        """Whether each element is a control device, shape (n_elements,) of bool.

        Those are the elements with a coil; where none has one, all that hold the structure to the
        ground.
        """
        driven = np.array([element.channel is not None for element in self.elements], dtype=bool)
        return driven if driven.any() else np.any(self.holding, axis=1)

    @property
    def holding(self) -> np.ndarray:
        """Deformation of each element when the structure moves rigidly against the ground.

        Shape (n_elements, n_directions); zero for an element inside the structure.
        """
        return self.element_rows @ self.structure.influence

    def current_range(self, channel: int = 0) -> tuple[float, float]:
        """Currents at which every device on a channel is meaningful.

        Parameters
        ----------
        channel : int, default 0
            Coil channel.

        Returns
        -------
        tuple of float, A
            Lowest and highest current.

        Raises
        ------
        InputError
            If no element is on the channel, or its devices have no current in common.
        """
        ranges = [e.device.current_range for e in self.elements if e.channel == channel]
        if not ranges:
            raise InputError(f"channel {channel} drives no element; channels: {self.n_channels}")
        low, high = max(r[0] for r in ranges), min(r[1] for r in ranges)
        if low > high:
            raise InputError(f"the devices on channel {channel} have no current in common")
        return low, high

    def tested_current(self, channel: int = 0) -> float:
        """Highest current at which every device that follows a channel's current was tested.

        Parameters
        ----------
        channel : int, default 0
            Coil channel.

        Returns
        -------
        float, A
            inf where no device says.
        """
        return min(
            (
                element.device.tested_current
                for element in self.elements
                if element.channel == channel and element.device.depends_on_current
            ),
            default=np.inf,
        )

    def element(self, name: str) -> Element:
        """Return an element by name.

        Parameters
        ----------
        name : str
            Its name.

        Returns
        -------
        Element

        Raises
        ------
        InputError
            If there is no such element.
        """
        for element in self.elements:
            if element.name == name:
                return element
        raise unknown_name("element", name, self.element_names)

    def with_element(
        self,
        device: Device,
        direction: str | Sequence[float] | np.ndarray,
        channel: int | None = None,
        name: str = "",
    ) -> IsolatedStructure:
        """Return the structure with one more nonlinear element.

        Parameters
        ----------
        device : Device
            Its law, numbers and scale.
        direction : str or sequence of float, shape (n,)
            Name of a storey (the element follows its drift) or of a dof (the element ties it to
            the ground), or the row that turns displacements into the element's deformation.
        channel : int, optional
            Coil channel; none by default.
        name : str, optional
            Name to print; the device's and a number by default.

        Returns
        -------
        IsolatedStructure

        Raises
        ------
        InputError
            If the direction, channel or name cannot be used.
        """
        row = self.structure.direction_row(direction)
        name = name or f"{device.name}_{len(self.elements) + 1}"
        return replace(self, elements=(*self.elements, Element(device, row, channel, name)))

    def linearised(
        self, currents: float | Sequence[float] = 0.0, frequency_hz: float = 1.0
    ) -> Structure:
        """Linear structure for small vibrations about rest.

        Parameters
        ----------
        currents : float or sequence of float, shape (n_channels,), A
            Current of each channel, or one for all.
        frequency_hz : float, default 1, Hz
            Frequency at which each element's complex stiffness becomes a spring and a dashpot.

        Returns
        -------
        Structure

        Raises
        ------
        InputError
            If a current is outside its device's range or the frequency is not positive.
        """
        try:
            amperes = np.broadcast_to(np.array(currents, dtype=float), (max(self.n_channels, 1),))
        except ValueError:
            raise InputError(
                f"currents are {currents!r}; accepted: a number or {self.n_channels} of them, in A"
            ) from None
        stiffness, damping = self.structure.stiffness.copy(), self.structure.damping.copy()
        for element in self.elements:
            current = 0.0 if element.channel is None else amperes[element.channel]
            complex_stiffness = element.device.linearised(float(current), frequency_hz)
            along = np.outer(element.direction, element.direction)
            stiffness += complex_stiffness.real * along
            damping += complex_stiffness.imag / (2 * np.pi * frequency_hz) * along
        return replace(self.structure, stiffness=stiffness, damping=damping)
