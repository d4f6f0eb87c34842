"""Periods, damping and scales of an isolated structure, and checks of their plausibility.

``Structure`` and ``IsolatedStructure`` import this module, so it does not import them.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from functools import lru_cache
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..laws.current_dependence import CurrentDependence
from ..laws.device import Device
from .modes import undamped_modes

DISPLACEMENT_PER_PERIOD = 0.04
"""Default design displacement over target period, m/s: 80 mm at 2 s, as for the reference
isolators."""
FIXED_BASE_PERIODS = (0.03, 10.0)
"""Plausible first fixed-base periods, s: from a stiff single storey to a tall tower."""
ISOLATED_PERIODS = (0.15, 20.0)
"""Plausible first periods of isolated buildings, s."""
LEAST_ISOLATION = 1.1
"""Least ratio of the isolated to the fixed-base period of an isolated building."""
FULL_STOREY, LIGHTEST_FLOOR = 2.5, 2000.0
"""Height of a storey at full scale, m, and the least mean mass of its floors, kg."""
LEAST_RIGID_DAMPING = 0.0628
"""Damping of rigid motion over the mass that is said, 1/s: a ratio of 1 % at a period of 2 s."""
LEAST_SWAY = 0.3
"""Least share of the mass that sways along the ground's directions in a translational mode."""
_MOST_REFINED = 50


class ModalFacts(NamedTuple):
    """Modes of an isolated structure for small vibrations about rest."""

    periods: NDArray  # (n_modes,): s, decreasing
    # (n_modes,): Of critical damping: c_k / (2 omega_k), with c_k the diagonal of the modal damping
    # matrix
    damping_ratios: NDArray
    # (n, n_modes): Undamped mode shapes as columns with unit modal mass, 1/sqrt(kg)
    shapes: NDArray

    def __repr__(self) -> str:
        pairs = zip(self.periods, self.damping_ratios, strict=True)
        modes = ", ".join(f"{period:.3g} s ({100 * ratio:.2g} %)" for period, ratio in pairs)
        return f"ModalFacts(periods with damping: {modes})"


def modal_facts(
    isolated: Any, currents: float | Sequence[float], translational: bool = False
) -> ModalFacts:
    """Modes with each element linearised at the frequency of the first (translational) mode."""
    frequency = 1.0
    for _ in range(_MOST_REFINED):
        result = _modes_of(isolated.linearised(currents, frequency))
        mode = translational_mode(isolated.structure, result.shapes) if translational else 0
        first = 1 / result.periods[mode]
        if abs(first - frequency) <= 1e-10 * frequency:
            break
        frequency = first
    return result


def translational_mode(structure: Any, shapes: NDArray) -> int:
    """Number of the mode of the longest period that is no torsion; 0 if there is none."""
    sway = structure.above_foundation[:, : len(structure.horizontal)]
    masses = np.einsum("ij,ik,kj->j", sway, structure.mass, sway)
    shares = np.sum((shapes.T @ structure.mass @ sway) ** 2 / masses, axis=1)
    return int(np.argmax(shares >= LEAST_SWAY))


def translational_period(isolated: Any) -> float:
    """Period of small vibrations without current, of the first mode that is no torsion, s."""
    modes = modal_facts(isolated, 0.0, translational=True)
    return float(modes.periods[translational_mode(isolated.structure, modes.shapes)])


def _modes_of(structure: Any) -> ModalFacts:
    try:
        omega, shapes = undamped_modes(structure.mass, structure.stiffness)
    except InputError:
        raise InputError(
            f"{structure.name}: a mode has no period, since no isolator resists it; expected: "
            "elements with a stiffness in every motion"
        ) from None
    damping = np.einsum("ik,ij,jk->k", shapes, structure.damping, shapes)
    return ModalFacts(2 * np.pi / omega, damping / (2 * omega), shapes)


def middle_current(device: Device) -> float:
    """Middle of a device's tested currents, or of its range if it has none, A; 0 without a coil."""
    low, high = device.current_range
    high = max(low, min(high, device.tested_current))
    return (low + high) / 2 if np.isfinite(high - low) else 0.0


def scale_to_period(
    structure: Any,
    device: Device,
    target_period: float,
    displacement: float | None,
    biaxial: bool = False,
) -> Device:
    """Scale a device so that the first mode has the target period at the middle current."""
    from scipy.optimize import brentq

    if not (np.isfinite(target_period) and target_period > 0):
        raise InputError(f"target_period_s is {target_period!r}; expected: a number above 0")
    if displacement is not None and not (np.isfinite(displacement) and displacement > 0):
        raise InputError(f"design_displacement_m is {displacement!r}; expected: a number above 0")
    if displacement is None and device.length == 1.0:
        displacement = DISPLACEMENT_PER_PERIOD * target_period
    if displacement is not None and np.isfinite(device.tested_deformation):
        device = device.scaled(displacement / (device.length * device.tested_deformation))
    current = middle_current(device)

    def period(force: float) -> float:
        isolated = structure.on(device.scaled(force=force), biaxial=biaxial)
        return float(_modes_of(isolated.linearised(current, 1 / target_period)).periods[0])

    # a rigid structure: total mass on the storage stiffness
    stiffness = device.linearised(current, 1 / target_period).real
    if not stiffness > 0:
        raise InputError(
            f"{device.name}: no stiffness at rest at {current:.3g} A; expected with "
            "target_period_s: a device with a stiffness"
        )
    rigid = structure.total_mass * (2 * np.pi / target_period) ** 2 / stiffness
    # with a flexible superstructure the isolators must be stiffer
    stiffest = 1e4 * rigid
    if period(stiffest) >= target_period:
        raise InputError(
            f"target_period_s is {target_period:g}; expected: above {period(stiffest):.3g} s, the "
            f"period of {structure.name} on nearly rigid isolators"
        )
    logarithm = brentq(
        lambda at: period(np.exp(at)) - target_period,
        np.log(0.5 * rigid), np.log(stiffest), xtol=1e-12,
    )  # fmt: skip
    return device.scaled(force=float(np.exp(logarithm)))


def with_damping(isolated: Any, device: Device, damping: float, name: str = "damping") -> Any:
    """Add dashpots between ground and base to reach a damping ratio of the first mode."""
    from ..laws.kelvin_voigt import LAW

    if not (np.isfinite(damping) and 0 <= damping < 1):
        raise InputError(f"{name} is {damping!r}; expected: a ratio, 0 or more and below 1")
    result = modal_facts(isolated, middle_current(device))
    own = float(result.damping_ratios[0])
    if damping < own:
        raise InputError(
            f"{name} is {damping:g}; expected: {own:.4g} or more, the ratio of building and "
            "isolators alone"
        )
    held = [e for e, along in zip(isolated.elements, isolated.holding, strict=True) if along.any()]
    moved = np.array([element.direction @ result.shapes[:, 0] for element in held])
    omega = 2 * np.pi / result.periods[0]
    coefficient = 2 * omega * (damping - own) / float(moved @ moved)
    for element in held:
        numbers = CurrentDependence.polynomial({"k": 0.0, "c": coefficient}, ("k", "c"))
        damper = Device(LAW, numbers, name="damper added for a damping ratio")
        name = element.name.replace("isolator", "damper")
        isolated = isolated.with_element(damper, element.direction, None, name)
    return isolated


def isolation_elements(isolated: Any) -> list[int]:
    """Indices of the isolators: the elements at the base, without moat walls."""
    walls = moat_walls(isolated)
    return [e for e, held in enumerate(isolated.holding) if np.any(held) and e not in walls]


def base_devices(isolated: Any) -> list[int]:
    """Indices of the isolators with a coil; without any, of all elements at the base."""
    layer = isolation_elements(isolated)
    driven = [e for e in layer if isolated.elements[e].channel is not None]
    return driven or [*layer, *moat_walls(isolated)]


def moat_walls(isolated: Any) -> list[int]:
    """Indices of the moat walls."""
    return [e for e, name in enumerate(isolated.element_names) if name.startswith("moat_wall")]


def facts(isolated: Any) -> dict[str, str]:
    """Masses, periods and tested range as texts, as far as they can be computed."""
    structure = isolated.structure
    result = {"Mass": f"{1e-3 * structure.total_mass:.5g} t"}
    if structure.base and structure.superstructure:
        with suppress(InputError):
            modes = isolated.fixed_base().modes()
            result["Fixed-base period"] = f"{modes.periods[0]:.3g} s"
            result["Damping on a fixed base"] = _damping_text(modes.damping_ratios)
    currents = [0.0]
    for channel in range(isolated.n_channels):
        low, high = isolated.current_range(channel)
        currents = [max(low, 0.0), min(high, isolated.tested_current(channel))]
    sentences = []
    for current in dict.fromkeys(currents):
        with suppress(InputError, ArithmeticError, ValueError):
            modes = modal_facts(isolated, current, translational=True)
            k = translational_mode(structure, modes.shapes)
            at = f" at {current:.3g} A" if isolated.n_channels else ""
            torsion = f"; torsion {modes.periods[0]:.3g} s" if k else ""
            sentences.append(
                f"{modes.periods[k]:.3g} s{at} (damping {100 * modes.damping_ratios[k]:.2g} %"
                f"{torsion})"
            )
    if sentences and structure.base:
        result["Isolated period at rest"] = ", ".join(sentences)
    tested = [
        f"{element.name} {1e3 * element.device.length * element.device.tested_deformation:.3g} mm"
        for element in isolated.elements
        if np.isfinite(element.device.tested_deformation)
    ]
    if tested:
        result["Tested deformation"] = ", ".join(tested)
    amperes = [
        f"{isolated.tested_current(channel):.3g} A"
        for channel in range(isolated.n_channels)
        if np.isfinite(isolated.tested_current(channel))
    ]
    if amperes:
        result["Tested current"] = ", ".join(amperes)
    if isolated.n_channels and len(base_devices(isolated)) < len(isolated.elements):
        result["Control devices"] = _control_devices_text(isolated)
    return result


def _control_devices_text(isolated: Any) -> str:
    """Control devices, and the elements that J6 and J9 leave out."""
    names, controls = np.array(isolated.element_names), isolated.control_devices
    at_base = np.zeros(len(names), bool)
    at_base[base_devices(isolated)] = True
    counted = {"J6 and the control device force": at_base, "J9": controls}
    if np.array_equal(at_base, controls):
        counted = {"J6, J9 and the control device force": controls}
    texts = [", ".join(names[controls])]
    for what, those in counted.items():
        if not those.all():
            texts.append(f"left out of {what}: {', '.join(names[~those])}")
    return "; ".join(texts)


def _damping_text(ratios: NDArray) -> str:
    """Damping ratios of the first modes."""
    texts = [f"{100 * ratio:.3g} %" for ratio in ratios]
    if len(set(texts)) == 1 and len(texts) > 1:
        return f"{texts[0]} in every mode"
    return ", ".join(f"{text} in mode {k}" for k, text in enumerate(texts[:3], 1))


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
                    f"{what} for parts to the ground, and influence"
                )
    return tuple(lines)


def _fixed_base_period(isolated: Any) -> float:
    """First period on a fixed base, s; one per structure where all elements are at the base."""
    structure = isolated.structure
    below = [*structure.base, *structure.foundation]
    at_base = all(
        np.any(np.abs(held) > 1e-9) and np.any(element.direction[below])
        for element, held in zip(isolated.elements, isolated.holding, strict=True)
    )
    if at_base and structure in _fixed_base_periods:
        return _fixed_base_periods[structure]
    period = float(isolated.fixed_base().periods()[0])
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
    return light_floors(structure)


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
