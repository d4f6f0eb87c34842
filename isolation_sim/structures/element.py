"""Nonlinear elements of a structure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ground_motions.argument_types import checked

from ..errors import InputError
from ..laws.device import Device
from .checks import numbers


@checked
@dataclass(frozen=True, eq=False)
class Element:
    """Nonlinear element: a device along a direction of the structure.

    Its deformation is ``direction @ q``; its force on the dofs is ``-direction * F``. A biaxial
    device has one element per direction; the second one ``follows`` the first.

    Attributes
    ----------
    device : Device
        Law, numbers and scale.
    direction : numpy.ndarray, shape (n,)
        Deformation per unit of each displacement.
    channel : int or None
        Coil channel; None for an element without a coil.
    name : str
        Name to print.
    follows : str
        Name of the first element of the same device, if this element is a further direction;
        otherwise empty. See ``IsolatedStructure.with_biaxial``.

    Raises
    ------
    InputError
        If the device has a coil but no channel, or a channel or direction cannot be used.
    """

    device: Device
    direction: np.ndarray
    channel: int | None = None
    name: str = "element"
    follows: str = ""

    def __post_init__(self) -> None:
        if self.channel is None and self.device.depends_on_current:
            raise InputError(
                f"element {self.name!r} depends on the coil current but has no channel: "
                "give channel=0 or the number of its coil"
            )
        whole = isinstance(self.channel, (int, np.integer))
        if self.channel is not None and not (whole and self.channel >= 0):
            raise InputError(
                f"element {self.name!r} has channel {self.channel!r}; expected: 0, 1, 2"
            )
        direction = numbers(f"direction of element {self.name!r}", self.direction)
        object.__setattr__(self, "direction", direction)
