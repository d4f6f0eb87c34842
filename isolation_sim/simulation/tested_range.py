"""Comparison of a run's deformations and currents with those of the device tests."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..structures import IsolatedStructure
from .complex_modes import Modes
from .workspace import Workspace, modal_motion


class TestComparison(NamedTuple):
    """Peaks of one run and tested values, in the structure's scale."""

    # deformation, tested_deformation: of each element, m; that of a biaxial device is the vector's
    # and stands at its first element. current, tested_current: of each coil, A.

    deformation: NDArray
    tested_deformation: NDArray
    current: NDArray
    tested_current: NDArray

    @property
    def deformation_ratio(self) -> float:
        """Largest ratio of deformation to tested deformation; 0 without tests."""
        return float(np.max(self.deformation / self.tested_deformation, initial=0.0))

    @property
    def current_ratio(self) -> float:
        """Largest ratio of current to tested current; 0 without tests."""
        tested = np.where(self.tested_current > 0, self.tested_current, np.inf)
        return float(np.max(self.current / tested, initial=0.0))


def compare_with_tests(
    isolated: IsolatedStructure,
    modes: Modes,
    work: Workspace,
    criteria: Mapping[str, ArrayLike],
    currents: NDArray,
    lane: int = 0,
) -> TestComparison:
    """Compare one lane of a finished block with the tests."""
    # ``criteria`` and ``currents`` (from `peak_currents`) are those of the whole block.
    tested_deformation, tested_current = _tested(isolated)
    return TestComparison(
        _peak_deformations(isolated, modes, work, criteria, lane),
        tested_deformation,
        currents[: len(tested_current), lane],
        tested_current,
    )


def peak_currents(work: Workspace) -> NDArray:
    """Largest command of each coil in each lane, (n_channels + 1, lanes), A."""
    # a command is constant over a segment
    commands = work.command[work.grid.segments[:-1, 0]]
    return np.maximum(commands.max(axis=0), -commands.min(axis=0)) + 0.0


@lru_cache(maxsize=256)
def _tested(isolated: IsolatedStructure) -> tuple[NDArray, NDArray]:
    """Tested deformations of elements (m, in the structure's scale) and currents of coils (A)."""
    devices = [element.device for element in isolated.elements]
    return (
        np.array([device.length * device.tested_deformation for device in devices]),
        np.array([isolated.tested_current(c) for c in range(isolated.n_channels)]),
    )


def _peak_deformations(
    isolated: IsolatedStructure,
    modes: Modes,
    work: Workspace,
    criteria: Mapping[str, ArrayLike],
    lane: int,
) -> NDArray:
    peaks = np.zeros(len(isolated.elements))
    motion: NDArray | None = None
    at_base = _at_base(isolated)
    for group in isolated.groups:
        device = isolated.elements[group[0]].device
        if not np.isfinite(device.tested_deformation):
            continue
        if at_base[group[0]]:
            # the isolators of most buildings: the kernel already has this peak
            peaks[group[0]] = np.atleast_1d(criteria["peak_base_displacement_m"])[lane]
            continue
        if motion is None:
            motion = modal_motion(work, modes.eigenvalues.size, lane)
        # along x and y; a third element of a group is the load on it
        along = [motion @ modes.deformation[e, 0] for e in group[:2]]
        peaks[group[0]] = device.length * np.sqrt(np.max(sum(x.real**2 for x in along)))
    return peaks


@lru_cache(maxsize=256)
def _at_base(isolated: IsolatedStructure) -> tuple[bool, ...]:
    """Whether the deformation of each element is the displacement of the only base dof."""
    structure = isolated.structure
    base = np.zeros(structure.n_dofs)
    base[list(structure.base)] = 1.0
    alone = len(structure.base) == 1
    return tuple(alone and np.array_equal(e.direction, base) for e in isolated.elements)
