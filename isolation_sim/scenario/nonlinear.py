"""The ``[yielding]`` and ``[moat_wall]`` sections: a building that is not elastic, or not free."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from ..effects import effect, extend
from ..laws import law
from ..structures import IsolatedStructure, yielding_storeys
from .fields import Positive, Section


class Yielding(Section):
    """Storeys that yield, of a shear building."""

    yield_shear_N: Annotated[
        Positive | Annotated[list[Positive], Field(min_length=1)],
        Field(description="storey shear at yield; one for all, or one per storey from below"),
    ]
    hardening_ratio: Annotated[
        float, Field(ge=0, lt=1, description="stiffness after yielding over that before")
    ] = 0.05
    smoothness: Annotated[
        float,
        Field(ge=1, description="exponent of the Bouc-Wen law; a large value gives a sharp corner"),
    ] = 5.0

    def added(self, isolated: IsolatedStructure) -> IsolatedStructure:
        """Return the structure with storeys that yield."""
        return yielding_storeys(isolated, self.yield_shear_N, self.hardening_ratio, self.smoothness)


class MoatWall(Section):
    """A wall around the base, on both sides in every direction; elastic, without friction."""

    gap_m: Annotated[Positive, Field(description="between base and wall, at rest")]
    stiffness_N_per_m: Annotated[
        Positive, Field(description="of the wall; secant stiffness at gap / 10 if not linear")
    ]
    exponent: Annotated[
        float,
        Field(ge=1, description="exponent of the penetration in the force; 1.5 for Hertz's law"),
    ] = 1.0

    def added(self, isolated: IsolatedStructure) -> IsolatedStructure:
        """Return the structure within the wall."""
        stop = {"gap": self.gap_m, "stiffness": self.stiffness_N_per_m, "exponent": self.exponent}
        device = extend(law("linear", {"k": 0.0}), [(effect("end_stop", "power"), stop)])
        structure = isolated.structure
        for column, label in zip(structure.influence.T, structure.directions, strict=True):
            row = np.zeros(structure.n_dofs)
            row[list(structure.base)] = column[list(structure.base)]
            name = "moat_wall" if len(structure.directions) == 1 else f"moat_wall_{label}"
            isolated = isolated.with_element(device, row, name=name)
        return isolated
