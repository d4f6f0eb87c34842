"""How far a run leaves the deformations and currents that its devices were tested at."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..structures import IsolatedStructure
from .modal import Modes
from .workspace import Workspace, padded

OVER_TESTED = ("deformation_over_tested", "current_over_tested")
"""Names of the peaks over those of the tests, in ``Batch`` and in a sweep's table."""


class Reached(NamedTuple):
    """Peaks of one run beside those of the tests, in the structure's scale.

    deformation, tested_deformation: of each element, m; current, tested_current: of each coil, A.
    """

    deformation: NDArray
    tested_deformation: NDArray
    current: NDArray
    tested_current: NDArray

    @property
    def deformation_ratio(self) -> float:
        """Largest deformation over the tested one; 0 where no element says."""
        return float(np.max(self.deformation / self.tested_deformation, initial=0.0))

    @property
    def current_ratio(self) -> float:
        """Largest current over the tested one; 0 where no device says."""
        tested = np.where(self.tested_current > 0, self.tested_current, np.inf)
        return float(np.max(self.current / tested, initial=0.0))


def reached(
    isolated: IsolatedStructure,
    modes: Modes,
    work: Workspace,
    criteria: Mapping[str, ArrayLike],
    lane: int = 0,
) -> Reached:
    """Compare one lane of a finished block with the tests; ``criteria``: of the whole block."""
    n_channels = isolated.n_channels
    return Reached(
        _peak_deformations(isolated, modes, work, criteria, lane),
        tested_deformations(isolated),
        np.max(np.abs(work.command[:, :n_channels, lane]), axis=0, initial=0.0),
        np.array([isolated.tested_current(c) for c in range(n_channels)]),
    )


def tested_deformations(isolated: IsolatedStructure) -> NDArray:
    """Largest deformation of the tests behind each element's law, in the structure's scale, m."""
    return np.array([e.device.length * e.device.tested_deformation for e in isolated.elements])


def _peak_deformations(
    isolated: IsolatedStructure,
    modes: Modes,
    work: Workspace,
    criteria: Mapping[str, ArrayLike],
    lane: int,
) -> NDArray:
    structure = isolated.structure
    peaks = np.zeros(len(isolated.elements))
    base = np.zeros(structure.n_dofs)
    base[list(structure.base)] = 1.0
    z: NDArray | None = None
    for e, element in enumerate(isolated.elements):
        if not np.isfinite(element.device.tested_deformation):
            continue
        if len(structure.base) == 1 and np.array_equal(element.direction, base):
            # the isolators of most buildings: known to the kernel already
            peaks[e] = np.atleast_1d(criteria["peak_base_displacement_m"])[lane]
            continue
        if z is None:
            n_pad = padded(work.module, modes.eigenvalues.size)
            n_points = len(work.grid.time)
            z = work.z.reshape(n_points + 2, 2, n_pad, -1)[:n_points, ..., lane]
        row = modes.deformation[e, 0]
        n = row.size
        peaks[e] = np.max(np.abs(z[:, 0, :n] @ row.real - z[:, 1, :n] @ row.imag))
    return peaks


def exceeded(runs: Mapping[str, Reached], isolated: IsolatedStructure) -> list[str]:
    """Lines that name elements and coils beyond their tests; the runs by the name to print."""
    told = []
    for e, name in enumerate(isolated.element_names):
        beyond = {
            run: 1e3 * each.deformation[e]
            for run, each in runs.items()
            if each.deformation[e] > each.tested_deformation[e]
        }
        if beyond:
            tested = 1e3 * next(iter(runs.values())).tested_deformation[e]
            told.append(
                f"{name} deforms further than its law was tested, {tested:.0f} mm at this scale: "
                f"{_listed(beyond, '.0f', 'mm')}"
            )
    for c in range(isolated.n_channels):
        beyond = {
            run: each.current[c]
            for run, each in runs.items()
            # a controller that is told a limit may pass it by a rounding error
            if each.current[c] > each.tested_current[c] * (1 + 1e-9)
        }
        if beyond:
            tested = next(iter(runs.values())).tested_current[c]
            told.append(
                f"coil {c} carries more current than its devices were tested with, {tested:.3g} A: "
                f"{_listed(beyond, '.3g', 'A')}"
            )
    return told


def _listed(values: Mapping[str, float], form: str, unit: str) -> str:
    return ", ".join(f"{name} {value:{form}} {unit}" for name, value in values.items())


def of_runs(runs: Mapping[str, Any]) -> list[str]:
    """Lines for several runs (``Run``) of one plant."""
    first = next(iter(runs.values()))
    return exceeded({name: run.reached_of_tests for name, run in runs.items()}, first.isolated)


def beyond_tests(deformation: ArrayLike, current: ArrayLike) -> list[str]:
    """Lines for many runs, from their peaks over those of the tests, (n_runs,) each."""
    told = []
    for ratios, what in (
        (deformation, "deform an isolator or element further than its law was tested"),
        (current, "need more current than the devices were tested with"),
    ):
        over = np.asarray(ratios, float)
        n = int(np.count_nonzero(over > 1 + 1e-9))
        if n:
            told.append(f"{n} of {over.size} runs {what}, up to {np.nanmax(over):.3g} times")
    return told
