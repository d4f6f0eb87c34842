"""The ``[isolator]``, ``[[element]]`` and ``[belief]`` sections: devices, true and believed."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

from pydantic import Field

from ..errors import InputError
from ..laws import Device, law
from ..structures import IsolatedStructure
from ..structures.reference import FORCE_SCALE, LENGTH_SCALE
from .fields import Coefficients, Number, Positive, Section

_Parameters = Annotated[
    str | Annotated[dict[str, Coefficients], Field(min_length=1)] | None,
    Field(
        description="published set, or { name = SI number or [ascending powers of the current] }"
    ),
]
_Range = Annotated[
    list[Number] | None,
    Field(min_length=2, max_length=2, description="where the numbers are meaningful; the set's"),
]


class _Device(Section):
    law: Annotated[str, Field(description="isolation-sim list laws")] = "strain_stiffening"
    parameters: _Parameters = None
    current_range_A: _Range = None
    tested_deformation_m: Annotated[
        Positive | None, Field(description="of one device; the set's")
    ] = None
    length_scale: Annotated[
        Positive | None,
        Field(description="deformation here over the tested device's; reference building: 10"),
    ] = None
    force_scale: Annotated[
        Positive | None,
        Field(description="force here over the tested device's; reference building: 3014.69"),
    ] = None
    count: Annotated[Positive, Field(description="devices side by side")] = 1.0

    def device(self, length_scale: float = 1.0, force_scale: float = 1.0) -> Device:
        """Return the device.

        Parameters
        ----------
        length_scale, force_scale : float
            Where the section has none.

        Returns
        -------
        Device
        """
        device = law(self.law, self.parameters)
        if self.current_range_A is not None:
            low, high = self.current_range_A
            device = replace(device, current_range=(low, high))
        if self.tested_deformation_m is not None:
            device = replace(device, tested_deformation=self.tested_deformation_m)
        return device.scaled(
            length_scale if self.length_scale is None else self.length_scale,
            self.count * (force_scale if self.force_scale is None else self.force_scale),
        )


class Isolator(_Device):
    """The isolators between the ground and the base, all alike."""

    def on_reference(self) -> Device:
        """Return the device at the reference building's scale where the section gives none."""
        return self.device(LENGTH_SCALE, FORCE_SCALE)

    def scaled(self) -> Device:
        """Return the device; its scales must be given, since no building is like another."""
        for key in ("length_scale", "force_scale"):
            if getattr(self, key) is None:
                raise InputError(
                    f"{key} is missing; accepted: a number above 0, which has a default for the "
                    "reference building alone"
                )
        return self.device()


class Element(_Device):
    """One more nonlinear element."""

    name: Annotated[str, Field(description="to print")] = ""
    direction: Annotated[
        str | list[Number],
        Field(description="a storey (its drift), a dof (to the ground), or a row over the dofs"),
    ]
    channel: Annotated[
        int | None, Field(ge=0, description="coil channel; 0 is the isolators', none has no coil")
    ] = None

    def added(self, isolated: IsolatedStructure) -> IsolatedStructure:
        """Return the structure with the element."""
        return isolated.with_element(self.device(), self.direction, self.channel, self.name)


class Belief(Section):
    """What controllers believe of the isolators where it differs from the truth."""

    law: Annotated[str | None, Field(description="another law")] = None
    parameters: _Parameters = None
    length_factor: Annotated[
        Positive, Field(description="believed over true length scale")
    ] = 1.0
    force_factor: Annotated[
        Positive, Field(description="believed over true force scale")
    ] = 1.0

    def of(self, isolator: Isolator) -> Isolator:
        """Return the isolator as it is believed to be, its scales not yet changed.

        Parameters
        ----------
        isolator : Isolator
            The truth.

        Returns
        -------
        Isolator
        """
        if self.law is not None and self.law != isolator.law:
            # another law brings its own numbers and their range
            changes = {"law": self.law, "parameters": self.parameters}
            return isolator.model_copy(
                update={**changes, "current_range_A": None, "tested_deformation_m": None}
            )
        if isinstance(self.parameters, dict) and isinstance(isolator.parameters, dict):
            merged = {**isolator.parameters, **self.parameters}
            return isolator.model_copy(update={"parameters": merged})
        if self.parameters is not None:
            return isolator.model_copy(update={"parameters": self.parameters})
        return isolator
