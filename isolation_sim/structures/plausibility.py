"""Warnings about implausible matrices, periods and masses of a structure."""

from __future__ import annotations

from contextlib import suppress
from functools import lru_cache
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from ..errors import InputError
from .modes import translational_period, undamped_modes

FIXED_BASE_PERIODS = (0.03, 10.0)
"""Plausible first fixed-base periods, s: from a stiff single storey to a tall tower."""
ISOLATED_PERIODS = (0.15, 20.0)
"""Plausible first periods of isolated buildings, s."""
LEAST_ISOLATION = 1.1
"""Least ratio of the isolated to the fixed-base period of an isolated building."""
FULL_STOREY, LIGHTEST_FLOOR = 2.5, 2000.0
"""Height of a storey at full scale, m, and the least mean mass of its floors, kg."""
DAMPER_MASS, DAMPER_FREQUENCY = 0.2, 1.2
"""Largest mass over that of a mean floor, and largest own frequency over the first one of the rest
of the building on a fixed base, with which a last dof is taken for a mass damper."""
LEAST_RIGID_DAMPING = 0.0628
"""Damping of rigid motion over the mass that is said, 1/s: a ratio of 1 % at a period of 2 s."""


@lru_cache(maxsize=256)
def implausible_matrices(structure: Any) -> tuple[str, ...]:
    """Warnings about damping in place of stiffness, and about springs and dampers to the ground."""
    above = np.ix_(structure.superstructure, structure.superstructure)
    with suppress(InputError):
        omega, shapes = undamped_modes(structure.mass[above], structure.stiffness[above])
        ratios = np.einsum("ik,ij,jk->k", shapes, structure.damping[above], shapes) / (2 * omega)
        if ratios.size and ratios[0] > 1:
            return (
                f"{structure.name} has a damping ratio of {100 * ratios[0]:.3g} % in the first "
                "mode on a fixed base: check the order of the matrices, M, C, K, and the unit of C "
                "(N s/m)",
            )
    if not structure.base:
        return ()
    lines = []
    slow = (2 * np.pi / ISOLATED_PERIODS[1]) ** 2
    for name, rigid in zip(structure.directions, structure.above_foundation.T, strict=True):
        mass = rigid @ structure.mass @ rigid
        for what, each, unit, least in (
            ("stiffness", structure.stiffness, "N/m", slow),
            ("damping", structure.damping, "N s/m", LEAST_RIGID_DAMPING),
        ):
            if rigid @ each @ rigid > least * mass > 0:
                held = each @ rigid
                dof = int(np.argmax(np.abs(held)))
                lines.append(
                    f"{structure.name}: rigid motion along {name} has a {what} of "
                    f"{rigid @ each @ rigid:.3g} {unit}, at {structure.names[dof]} "
                    f"{held[dof]:.3g} {unit}; expected: none without the isolators; check the "
                    f"{what} for parts to the ground (matrices of a fixed-base building lack the "
                    "base's row and column), and influence"
                )
    return tuple(lines)


def _fixed_base_period(isolated: Any) -> float:
    """Period on a fixed base, s, of the first mode in which the building sways.

    It is found once per structure where all elements are at the base.
    """
    structure = isolated.structure
    below = [*structure.base, *structure.foundation]
    at_base = all(
        np.any(np.abs(held) > 1e-9) and np.any(element.direction[below])
        for element, held in zip(isolated.elements, isolated.holding, strict=True)
    )
    if at_base and structure in _fixed_base_periods:
        return _fixed_base_periods[structure]
    period = translational_period(isolated.fixed_base())
    if at_base:
        _fixed_base_periods[structure] = period
    return period


_fixed_base_periods: WeakKeyDictionary[Any, float] = WeakKeyDictionary()


@lru_cache(maxsize=256)
def implausible(isolated: Any, isolated_period: float) -> tuple[str, ...]:
    """Warnings about implausible periods and masses; ``isolated_period``: of the first mode, s."""
    structure = isolated.structure
    if wrong := implausible_matrices(structure):
        return wrong
    fixed = 0.0
    if structure.base and structure.superstructure:
        try:
            fixed = _fixed_base_period(isolated)
        except InputError:
            return ()
    low, high = FIXED_BASE_PERIODS
    if fixed and not low <= fixed <= high:
        short, long = "masses in t (expected: kg)", "stiffnesses in kN/m (expected: N/m)"
        unit = short if fixed < low else long
        return (
            f"{structure.name} has a fixed-base period of {fixed:.3g} s; buildings have "
            f"{low:g} to {high:g} s: check for {unit}",
        )
    if not structure.base or not isolated.elements:
        return ()
    low, high = ISOLATED_PERIODS
    if not low <= isolated_period <= high:
        return (
            f"{structure.name} has an isolated period of {isolated_period:.3g} s; isolated "
            f"buildings have {low:g} to {high:g} s: check length_scale and force_scale, or give "
            "target_period_s",
        )
    if fixed * LEAST_ISOLATION > isolated_period:
        relation = "below" if isolated_period < fixed else "hardly longer than"
        return (
            f"{structure.name} has an isolated period of {isolated_period:.3g} s, {relation} its "
            f"fixed-base period of {fixed:.3g} s: check the units of masses (kg) and stiffnesses "
            "(N/m), and the isolators' scale",
        )
    return (*light_floors(structure), *_mass_dampers(structure))


def _mass_dampers(structure: Any) -> tuple[str, ...]:
    """Warnings about mass dampers that count as floors: a light mass on a soft spring."""
    lines = []
    above = list(structure.superstructure)
    ends = np.count_nonzero(structure.drift_rows, axis=0)
    for moved in structure.above_foundation.T:
        floors = [i for i in above if moved[i]]
        for dof in floors:
            others = [i for i in above if i != dof]
            mean = np.mean([structure.mass[i, i] for i in floors if i != dof] or [0.0])
            if ends[dof] != 1 or structure.mass[dof, dof] > DAMPER_MASS * mean:
                continue
            # the rest of the building, which this mass follows without a force
            k, block = structure.stiffness, np.ix_(others, others)
            rest = k[block] - np.outer(k[others, dof], k[dof, others]) / max(k[dof, dof], 1e-300)
            with suppress(InputError):
                first = undamped_modes(structure.mass[block], rest)[0][0]
                own = np.sqrt(k[dof, dof] / structure.mass[dof, dof])
                if own <= DAMPER_FREQUENCY * first:
                    name = structure.names[dof]
                    lines.append(
                        f"{structure.name}: {name}, {structure.mass[dof, dof]:.3g} kg with a "
                        f"period of {2 * np.pi / own:.3g} s of its own, counts as a floor, and its "
                        "stroke as a drift; for a mass damper give drift_rows without it"
                    )
    return tuple(dict.fromkeys(lines))


def light_floors(structure: Any) -> tuple[str, ...]:
    """Warning about masses that are far too small for storeys of this height."""
    along = np.abs(structure.drift_rows) @ np.abs(structure.influence[:, 0]) > 0
    if structure.heights is None or not along.any():
        return ()
    floor = structure.total_mass / np.count_nonzero(along)
    height = float(np.mean(structure.heights[along]))
    if height < FULL_STOREY or floor >= LIGHTEST_FLOOR:
        return ()
    return (
        f"{structure.name} has {floor:.3g} kg per storey of {height:.3g} m; floors have "
        f"{LIGHTEST_FLOOR:g} kg or more: check for masses in t (expected: kg) and stiffnesses in "
        "kN/m (expected: N/m)",
    )
