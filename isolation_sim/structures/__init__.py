"""Linear structures and their nonlinear elements."""

from .element import Element
from .matrices import from_fixed_base, from_matrices, read_matrices
from .opensees import from_opensees
from .reference import reference_building, reference_isolators
from .shear_building import shear_building
from .structure import IsolatedStructure, Structure
from .yielding import yielding_storeys

__all__ = [
    "Element",
    "IsolatedStructure",
    "Structure",
    "from_fixed_base",
    "from_matrices",
    "from_opensees",
    "read_matrices",
    "reference_building",
    "reference_isolators",
    "shear_building",
    "yielding_storeys",
]
