"""The sections of the building: ``[structure]``, ``[yielding]``, ``[moat_wall]``, ``[soil]``."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Literal

from pydantic import Discriminator, Field, Tag

from ..effects import effect, extend
from ..errors import InputError
from ..laws import law
from ..structures import (
    IsolatedStructure,
    Structure,
    cones,
    on_soil,
    plan_building,
    read_matrices,
    reference_building,
    shear_building,
    yielding_storeys,
)
from ..structures.isolators import rows_of_base
from ..validation import InputPath, NonNegative, Number, Positive, Section, kind_by_keys

_Row = Annotated[list[Positive], Field(min_length=1)]
_Ratio = Annotated[float, Field(ge=0, lt=1)]


def _check_lengths(section: ShearBuilding | PlanBuilding) -> None:
    """Refuse a list of another length than that of the floors."""
    n = len(section.floor_masses_kg)
    for key, value in section:
        if key.startswith("storey_") and value is not None and len(value) != n:
            raise InputError(
                f"{key} has {len(value)} numbers; expected: {n}, as floor_masses_kg has"
            )


class ReferenceBuilding(Section):
    """The reference: five storeys of 250 t on a slab of 300 t, fixed-base period 0.5 s."""

    kind: Literal["reference"] = "reference"

    def build(self) -> Structure:
        """Return the structure."""
        return reference_building()


class ShearBuilding(Section):
    """A shear building of any number of storeys on a rigid base."""

    kind: Literal["shear"] = "shear"
    floor_masses_kg: Annotated[_Row, Field(description="from below")]
    storey_stiffnesses_N_per_m: Annotated[_Row, Field(description="from below")]
    base_mass_kg: Annotated[Positive, Field(description="base slab")]
    damping: Annotated[
        Literal["rayleigh", "modal"], Field(description="rayleigh, modal; with the base fixed")
    ] = "rayleigh"
    damping_ratio: Annotated[
        _Ratio | list[_Ratio], Field(description="one number; with modal also one per mode")
    ] = 0.02
    rayleigh_modes: Annotated[
        list[int],
        Field(min_length=2, max_length=2, description="two modes with this ratio, from 1"),
    ] = Field(default_factory=lambda: [1, 2])
    storey_heights_m: Annotated[_Row | None, Field(description="from below")] = None
    name: Annotated[str, Field(min_length=1, description="name in reports")] = "shear building"

    def build(self) -> Structure:
        """Return the structure."""
        _check_lengths(self)
        first, second = self.rayleigh_modes
        return shear_building(
            self.floor_masses_kg,
            self.storey_stiffnesses_N_per_m,
            base_mass=self.base_mass_kg,
            damping_ratio=self.damping_ratio,
            damping=self.damping,
            rayleigh_modes=(first, second),
            heights=self.storey_heights_m,
            name=self.name,
        )


class PlanBuilding(Section):
    """A shear building in plan: floors along x and y and in rotation, on a rigid base slab."""

    kind: Literal["plan"] = "plan"
    floor_masses_kg: Annotated[_Row, Field(description="from below")]
    storey_stiffnesses_x_N_per_m: Annotated[_Row, Field(description="from below")]
    storey_stiffnesses_y_N_per_m: Annotated[_Row, Field(description="from below")]
    base_mass_kg: Annotated[Positive, Field(description="base slab")]
    plan_m: Annotated[
        list[Positive], Field(min_length=2, max_length=2, description="sides along x and y")
    ]
    isolator_positions_m: Annotated[
        list[Annotated[list[Number], Field(min_length=2, max_length=2)]] | None,
        Field(min_length=1, description="x, y from the plan's centre; the corners if left out"),
    ] = None
    eccentricity_m: Annotated[
        list[Number],
        Field(min_length=2, max_length=2, description="centre of mass from the plan's centre"),
    ] = Field(default_factory=lambda: [0.0, 0.0])
    damping_ratio: Annotated[_Ratio, Field(description="of every mode with the base fixed")] = 0.02
    storey_heights_m: Annotated[_Row | None, Field(description="from below")] = None
    name: Annotated[str, Field(min_length=1, description="to print")] = "plan building"

    def build(self) -> Structure:
        """Return the structure."""
        _check_lengths(self)
        a, b = self.plan_m
        x, y = self.eccentricity_m
        return plan_building(
            self.floor_masses_kg,
            self.storey_stiffnesses_x_N_per_m,
            self.storey_stiffnesses_y_N_per_m,
            base_mass=self.base_mass_kg,
            plan=(a, b),
            isolator_positions=self.isolator_positions_m,
            eccentricity=(x, y),
            damping_ratio=self.damping_ratio,
            heights=self.storey_heights_m,
            name=self.name,
        )


class MatricesFile(Section):
    """Matrices in a .npz or MATLAB .mat file: M (kg), C (N s/m), K (N/m), base included."""

    kind: Literal["matrices"] = "matrices"
    file: Annotated[
        InputPath,
        Field(
            description=".npz or .mat; optional arrays: influence, base, drift_rows, "
            "storey_heights_m, isolator_positions_m"
        ),
    ]
    dof_names: Annotated[list[str] | None, Field(description="one per row of the matrices")] = None
    directions: Annotated[
        list[str] | None, Field(description="directions of ground motion; one [[ground]] each")
    ] = None
    name: Annotated[
        str | None, Field(min_length=1, description="name in reports; the file's by default")
    ] = None

    def build(self) -> Structure:
        """Return the structure."""
        return read_matrices(
            self.file, names=self.dof_names, directions=self.directions, name=self.name
        )


Building = Annotated[
    Annotated[ReferenceBuilding, Tag("reference")]
    | Annotated[ShearBuilding, Tag("shear")]
    | Annotated[PlanBuilding, Tag("plan")]
    | Annotated[MatricesFile, Tag("matrices")],
    Discriminator(kind_by_keys(ReferenceBuilding, ShearBuilding, PlanBuilding, MatricesFile)),
]


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
