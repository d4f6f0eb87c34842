"""The kernel's data of the elements, which do not change between runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..structures import IsolatedStructure
from .complex_modes import Modes
from .kernel.loading import Kernel
from .kernel.operations import address_of_element
from .kernel.slots import C_REF, FORCE_SCALE, K_REF, TO_STRUCTURE

MOST_TESTED = 50.0
"""Ratio of deformation to tested deformation that ends a run, far outside the law's range."""


@dataclass(frozen=True)
class Elements:
    """Elements of the plants of a block of lanes, at rest; its arrays are read-only."""

    n_modes: int  # Modes of each plant
    # (n_elements,) int: Coil channel of each element; the number of channels for an element without
    # a coil
    channel: NDArray
    # lanes innermost: Each element's slots, see ``element_code.py``: reference springs, dashpots
    # and scales
    numbers: NDArray
    # (n_elements, n_pieces, n_parameters, n_powers, lanes): Polynomials of the parameters in the
    # current
    table: NDArray
    breaks: NDArray  # (n_elements, n_pieces + 1, lanes): Currents at which their pieces begin, A
    shape: NDArray  # (n_elements, 2) int: Numbers of pieces and powers that each element uses
    # (n_elements,) int: Address of each element's compiled law; 0 of a further direction of the
    # element before
    functions: NDArray
    # (n_elements, 3) int: Number of each element's parameters, slot of the first, directions
    sizes: NDArray
    starts: NDArray  # (n_elements,) int: Slot of each element's first state at a step's start
    n_states: int  # Largest number of states of an element
    # (lanes,): Largest device deformation, m, summed over elements, of a run that has not diverged:
    # ``MOST_TESTED`` times the tested deformation
    deformation_limit: NDArray

    def __post_init__(self) -> None:
        for array in (self.numbers, self.table, self.breaks):
            array.flags.writeable = False


def elements_of(
    kernel: Kernel, plants: Sequence[IsolatedStructure], modes: Sequence[Modes]
) -> Elements:
    """Gather a block's elements."""
    shape, laws = kernel.shape, kernel.laws
    first, lanes = plants[0], shape.lanes
    shapes = np.array([e.device.current.coefficients.shape for e in first.elements])
    pieces, parameters, n_powers = shapes.max(axis=0)
    numbers = np.zeros((shape.n_elements, shape.stride, lanes))
    table = np.zeros((shape.n_elements, pieces, parameters, n_powers, lanes))
    breaks = np.full((shape.n_elements, pieces + 1, lanes), np.inf)
    # lanes of one plant are filled together
    for plant, own in dict(zip(plants, modes, strict=True)).items():
        alike = np.array([p is plant for p in plants])
        # forces on the structure below this one need no accuracy, N
        least = 1e-5 * plant.structure.total_mass
        for e, element in enumerate(plant.elements):
            device = element.device
            # initial scales are 1e-4 of the tested deformation
            small = 1e-4 * device.deformation_scale / device.length
            force = max(small * own.stiffness[e], least / device.force_scale)
            numbers[e, K_REF, alike] = own.stiffness[e]
            numbers[e, C_REF, alike] = own.damping[e]
            numbers[e, FORCE_SCALE, alike] = 1.0 / force
            numbers[e, TO_STRUCTURE, alike] = device.force_scale
            a, b, c = shapes[e]
            table[e, :a, :b, :c, alike] = device.current.coefficients
            breaks[e, : a + 1, alike] = device.current.breaks
        for (e, *_), law in zip(plant.groups, plant.group_laws, strict=True):
            device = plant.elements[e].device
            scale = laws[e].SLOT_SCALE  # type: ignore[union-attr]
            extent = 1e-4 * device.deformation_scale / device.length
            numbers[e, scale : scale + len(law.states), alike] = 1.0 / extent
    sizes = np.zeros((len(laws), 3), np.int64)
    for (e, *further), written in zip(first.groups, filter(None, laws), strict=True):
        sizes[e] = written.N_PARAMETERS, written.SLOT_PARAMETER, 1 + len(further)
    width = first.n_channels
    return Elements(
        n_modes=modes[0].eigenvalues.size,
        channel=np.array([width if e.channel is None else e.channel for e in first.elements]),
        numbers=numbers.ravel(),
        table=table,
        breaks=breaks,
        shape=np.ascontiguousarray(shapes[:, [0, 2]]),
        functions=np.array([0 if law is None else address_of_element(law.element) for law in laws]),
        sizes=sizes,
        starts=np.array([0 if law is None else law.SLOT_START for law in laws]),
        n_states=max(law.N_STATES for law in laws if law is not None),
        deformation_limit=MOST_TESTED * np.array([_tested(plant) for plant in plants]),
    )


def _tested(plant: IsolatedStructure) -> float:
    """Sum of the tested deformations of a plant's devices, in their own scale, m."""
    return sum(e.device.deformation_scale / e.device.length for e in plant.elements)
