"""Complex modes of the linear structure with the elements' reference springs and dashpots."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError


@dataclass(frozen=True, eq=False)
class Modes:
    """A structure in complex modes: z' = eigenvalues z + columns u, outputs Re(rows z)."""

    # One mode of each conjugate pair is stored, with doubled rows; real modes are stored unchanged.

    eigenvalues: NDArray  # (n_modes,) complex: 1/s
    # (2 n, n_modes) complex: Displacements (m) and velocities (m/s) of the n degrees of freedom
    # from the modes
    shapes: NDArray
    # (n_elements, 2, n_modes) complex: Each device's deformation (m) and velocity (m/s)
    deformation: NDArray
    # (n_directions, n_modes) complex: Modal input of a ground acceleration of 1 m/s^2
    ground: NDArray
    force: NDArray  # (n_elements, n_modes) complex: Modal input of a device force of 1 N
    # stiffness, damping: (n_elements,): Reference spring (N/m) and dashpot (N s/m) of each device
    # that the modes include
    stiffness: NDArray
    damping: NDArray

    def packed(self) -> NDArray:
        """All complex numbers in the kernel's order."""
        rows = self.deformation.reshape(-1, self.eigenvalues.size)
        numbers = [self.eigenvalues, rows.ravel(), self.ground.ravel(), self.force.ravel()]
        return np.concatenate(numbers).astype(complex)


def real_rows(rows: NDArray) -> NDArray:
    """Rows over the modes' real parts and imaginary parts, from complex ones."""
    return np.concatenate([rows.real, -rows.imag], axis=-1)


def complex_modes(
    mass: NDArray,
    damping: NDArray,
    stiffness: NDArray,
    influence: NDArray,
    directions: NDArray,
    lengths: NDArray,
    forces: NDArray,
    references: NDArray,
) -> Modes:
    """Complex modes of M q'' + C q' + K q = -M r a_g - sum b F, reference elements included."""
    n = len(mass)
    inverse = np.linalg.inv(mass)
    b = np.asarray(directions, float).reshape(-1, n)
    scale = forces / lengths
    # a mechanism (or an exactly critical damper) has no complete set of modes. Then the reference
    # elements are made a little stiffer. This does not change the solution, since their forces are
    # subtracted from the elements' forces
    for attempt in range(6):
        k_ref = references + attempt * 0.37 * (references + _floor(mass, b, scale))
        c_ref = attempt * 0.05 * k_ref
        k = stiffness + b.T @ np.diag(scale * k_ref) @ b
        c = damping + b.T @ np.diag(scale * c_ref) @ b
        a = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ k, -inverse @ c]])
        eigenvalues, vectors = np.linalg.eig(a)
        # balance displacement and velocity rows before testing the independence of the modes
        speed = np.sqrt(np.abs(eigenvalues).max() * np.abs(eigenvalues).mean())
        weights = np.concatenate([np.full(n, speed), np.ones(n)])
        if np.linalg.cond(weights[:, None] * vectors) < 1e6:
            break
    else:
        raise InputError(
            "the structure has no complete set of modes; expected: a stiffness or an element in "
            "every motion"
        )
    left = np.linalg.inv(vectors)
    tiny = 1e-9 * np.abs(eigenvalues)
    keep = np.flatnonzero(eigenvalues.imag > -tiny)
    pair = np.where(eigenvalues[keep].imag > tiny[keep], 2.0, 1.0)
    shapes = vectors[:, keep] * pair
    zeros = np.zeros((n, n))
    measure = b / np.asarray(lengths)[:, None]
    deformation = np.stack([measure @ shapes[:n], measure @ shapes[n:]], axis=1)
    on_mass = np.concatenate([zeros, inverse])
    ground = -(left[keep] @ np.concatenate([np.zeros_like(influence), influence])).T
    force = -(left[keep] @ on_mass @ (b.T * forces)).T
    return Modes(eigenvalues[keep], shapes, deformation, ground, force, k_ref, c_ref)


def _floor(mass: NDArray, b: NDArray, scale: NDArray) -> NDArray:
    """Stiffness that would give each element's direction a period of about two seconds."""
    moved = np.einsum("ei,ij,ej->e", np.abs(b), mass, np.abs(b)) / np.maximum(
        (b**2).sum(axis=1), 1e-300
    )
    return moved * np.pi**2 / scale
