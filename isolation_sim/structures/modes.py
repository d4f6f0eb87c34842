"""Modes of linear structures, of isolated ones for small vibrations, and facts about them.

``Structure`` and ``IsolatedStructure`` import this module, so it does not import them.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .element import base_devices

LEAST_SWAY = 0.3
"""Least share of the mass that sways along the ground's directions in a translational mode."""
_MOST_ITERATIONS = 50


def undamped_modes(mass: np.ndarray, stiffness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Undamped frequencies and mass-normalised mode shapes."""
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    squares, vectors = np.linalg.eigh(inverse @ stiffness @ inverse.T)
    if squares.size and squares[0] <= 1e-12 * squares[-1]:
        raise InputError(
            "a mode has no stiffness; expected: a positive definite stiffness matrix, and "
            "isolators with a stiffness at rest"
        )
    return np.sqrt(squares), inverse.T @ vectors


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
    for _ in range(_MOST_ITERATIONS):
        result = modes_of(isolated.linearised(currents, frequency))
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


def modes_of(structure: Any) -> ModalFacts:
    """Modes of a linear structure with its damping, by their undamped shapes."""
    try:
        omega, shapes = undamped_modes(structure.mass, structure.stiffness)
    except InputError:
        turning = [structure.names[d] for d in structure.base if not structure.influence[d].any()]
        hint = f"; {', '.join(turning)}: biaxial isolators (biaxial = true) with their positions"
        raise InputError(
            f"{structure.name}: a mode has no period, since no isolator resists it; expected: "
            f"elements with a stiffness in every motion{hint if turning else ''}"
        ) from None
    damping = np.einsum("ik,ij,jk->k", shapes, structure.damping, shapes)
    return ModalFacts(2 * np.pi / omega, damping / (2 * omega), shapes)


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
