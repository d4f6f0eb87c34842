"""The ``[yielding]``, ``[moat_wall]`` and ``[soil]`` sections."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

from pydantic import Field

from ..effects import effect, extend
from ..laws import law
from ..structures import IsolatedStructure, cones, on_soil, yielding_storeys
from ..structures.isolators import rows_of_base
from ..validation import NonNegative, Positive, Section


class Yielding(Section):
    """Yielding storeys of a shear building."""

    yield_shear_N: Annotated[
        Positive | Annotated[list[Positive], Field(min_length=1)],
        Field(description="storey shear at yield; one for all, or one per storey from below"),
    ]
    hardening_ratio: Annotated[
        float, Field(ge=0, lt=1, description="stiffness after yielding over elastic stiffness")
    ] = 0.05
    smoothness: Annotated[
        float,
        Field(ge=1, description="exponent of the Bouc-Wen law; a large value gives a sharp corner"),
    ] = 5.0

    def add_to(self, isolated: IsolatedStructure) -> IsolatedStructure:
        """Return the structure with storeys that yield."""
        return yielding_storeys(isolated, self.yield_shear_N, self.hardening_ratio, self.smoothness)


class MoatWall(Section):
    """An elastic wall without friction around the base, on both sides in every direction."""

    gap_m: Annotated[float, Field(gt=0, le=10, description="between base and wall, at rest")]
    stiffness_N_per_m: Annotated[
        Positive, Field(description="of the wall; if exponent is not 1, the secant at gap / 10")
    ]
    exponent: Annotated[
        float,
        Field(ge=1, description="exponent of the penetration in the force; 1.5 for Hertz's law"),
    ] = 1.0

    def add_to(self, isolated: IsolatedStructure) -> IsolatedStructure:
        """Return the structure within the wall."""
        stop = {"gap": self.gap_m, "stiffness": self.stiffness_N_per_m, "exponent": self.exponent}
        device = extend(law("linear", {"k": 0.0}), [(effect("end_stop", "power"), stop)])
        size = f"gap {1e3 * self.gap_m:.4g} mm, stiffness {1e-6 * self.stiffness_N_per_m:.4g} kN/mm"
        device = replace(device, name=size)
        for name, row in rows_of_base(isolated.structure, "moat_wall").items():
            isolated = isolated.with_element(device, row, name=name)
        return isolated


class Soil(Section):
    """Soil under the foundation of the isolators: cone models of Wolf, frequency-independent."""

    radius_m: Annotated[Positive, Field(description="of a disk with the foundation's area")]
    shear_wave_velocity_m_s: Annotated[Positive, Field(description="at the earthquake's strains")]
    density_kg_m3: Annotated[Positive, Field(description="of the soil")] = 1800.0
    poisson_ratio: Annotated[float, Field(ge=0, le=0.5, description="of the soil")] = 0.33
    foundation_mass_kg: Annotated[Positive, Field(description="below the isolators")]
    foundation_inertia_kg_m2: Annotated[
        NonNegative, Field(description="about a horizontal axis; required with storey heights")
    ] = 0.0

    def add_to(self, isolated: IsolatedStructure) -> IsolatedStructure:
        """Return the structure on soil springs."""
        soil = cones(
            self.radius_m, self.shear_wave_velocity_m_s, self.density_kg_m3, self.poisson_ratio
        )
        return on_soil(isolated, soil, self.foundation_mass_kg, self.foundation_inertia_kg_m2)
