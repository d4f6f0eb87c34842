"""Comparison of a run's deformations and currents with those of the device tests."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..structures import IsolatedStructure
from ..written_names import as_written
from .complex_modes import Modes
from .workspace import Workspace, modal_motion

OVER_TESTED = ("deformation_over_tested", "current_over_tested")
"""Names of the ratios of peaks to tested values, in ``Batch`` and in a sweep's table."""


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


def tested_range_warnings(runs: Mapping[str, Any]) -> list[str]:
    """Warnings about deformations and currents beyond the tests, of several runs of one plant."""
    peaks: dict[str, TestComparison] = {name: run.test_comparison for name, run in runs.items()}
    first, isolated = next(iter(peaks.values())), next(iter(runs.values())).isolated
    sentences = []
    for name, (e, *_) in zip(isolated.device_names, isolated.groups, strict=True):
        beyond = {
            run: 1e3 * each.deformation[e]
            for run, each in peaks.items()
            if each.deformation[e] > each.tested_deformation[e]
        }
        if beyond:
            tested = 1e3 * first.tested_deformation[e]
            sentences.append(
                f"{name} deforms further than its law was tested, {tested:.0f} mm at this scale: "
                f"{_listed(beyond, '.0f', 'mm')}"
            )
    for c in range(isolated.n_channels):
        beyond = {
            run: each.current[c]
            for run, each in peaks.items()
            # a controller with this limit may exceed it by a rounding error
            if each.current[c] > each.tested_current[c] * (1 + 1e-9)
        }
        if beyond:
            tested = first.tested_current[c]
            sentences.append(
                f"coil {c} carries more current than its devices were tested with, {tested:.3g} A: "
                f"{_listed(beyond, '.3g', 'A')}"
            )
    return sentences


def _listed(values: Mapping[str, float], form: str, unit: str) -> str:
    return ", ".join(f"{as_written(name)} {value:{form}} {unit}" for name, value in values.items())


def beyond_tests(deformation: ArrayLike, current: ArrayLike) -> list[str]:
    """Warnings for many runs, from their ratios to the tested values, (n_runs,) each."""
    sentences = []
    for ratios, what in (
        (deformation, "deform an isolator or element further than its law was tested"),
        (current, "need more current than the devices were tested with"),
    ):
        over = np.asarray(ratios, float)
        n = int(np.count_nonzero(over > 1 + 1e-9))
        if n:
            sentences.append(f"{n} of {over.size} runs {what}, up to {np.nanmax(over):.3g} times")
    return sentences
