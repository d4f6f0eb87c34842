"""Linear structures and their nonlinear elements."""

from .element import Element
from .matrices import from_fixed_base, from_matrices, read_matrices
from .opensees import from_opensees
from .plan_building import plan_building
from .reference import reference_building, reference_isolators
from .shear_building import shear_building
from .soil import Cones, cones, on_soil
from .structure import IsolatedStructure, Structure
from .vertical_load import load_change_rows, overturning_rows, with_p_delta, with_vertical_motion
from .yielding import yielding_storeys

__all__ = [
    "Cones",
    "Element",
    "IsolatedStructure",
    "Structure",
    "cones",
    "from_fixed_base",
    "from_matrices",
    "from_opensees",
    "load_change_rows",
    "on_soil",
    "overturning_rows",
    "plan_building",
    "read_matrices",
    "reference_building",
    "reference_isolators",
    "shear_building",
    "with_p_delta",
    "with_vertical_motion",
    "yielding_storeys",
]
