"""Modes of linear structures, and of isolated structures for small vibrations.

``Structure`` and ``IsolatedStructure`` import this module, so it does not import them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

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
        raise InputError(
            f"{structure.name}: a mode has no period, since no isolator resists it; expected: "
            "elements with a stiffness in every motion"
        ) from None
    damping = np.einsum("ik,ij,jk->k", shapes, structure.damping, shapes)
    return ModalFacts(2 * np.pi / omega, damping / (2 * omega), shapes)
