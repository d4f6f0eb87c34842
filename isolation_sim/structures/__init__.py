"""Linear structures and the nonlinear elements that they stand on."""

from .isolated import Element, IsolatedStructure
from .matrices import from_fixed_base, from_matrices, read_matrices
from .reference import reference_building, reference_isolators
from .shear_building import shear_building
from .structure import Structure

__all__ = [
    "Element",
    "IsolatedStructure",
    "Structure",
    "from_fixed_base",
    "from_matrices",
    "read_matrices",
    "reference_building",
    "reference_isolators",
    "shear_building",
]
