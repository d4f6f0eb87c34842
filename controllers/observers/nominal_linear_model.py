"""A nominal model as linear equations: design model of observers and regulators."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from isolation_sim.structures import IsolatedStructure, Structure

from ..clipped_lqr import linear_model
from .ground_noise import GroundNoise


@dataclass(frozen=True)
class NominalLinearModel:
    """Linear equations z' = A z + B r + G w, with accelerations C z + D r."""

    # The state z holds displacements, velocities and the ground's filters. Each element is a spring
    # and a dashpot; r is the remainder of its force, and w white noise at bedrock.

    a: NDArray  # (n_z, n_z): Dynamics
    b: NDArray  # (n_z, n_elements), 1/kg: Of the elements' further forces
    g: NDArray  # (n_z, n_directions): Of the white noise
    c: NDArray  # (n_dofs, n_z): Absolute accelerations from the state
    # (n_dofs, n_elements), 1/kg: Absolute accelerations from the elements' further forces
    d: NDArray
    passive: NDArray  # (n_elements, 2), N/m and N s/m: Springs and dashpots
    rows: NDArray  # (n_elements, n_dofs): Deformations from displacements

    @property
    def deformations(self) -> NDArray:
        """Deformations of the elements from the state, shape (n_elements, n_z)."""
        n = self.rows.shape[1]
        return np.pad(self.rows, ((0, 0), (0, len(self.a) - n)))


def structure_and_ground(
    structure: Structure, rows: NDArray, ground: GroundNoise
) -> tuple[NDArray, NDArray, NDArray, NDArray, NDArray]:
    """Equations of a structure under filtered noise."""
    n, n_directions = structure.n_dofs, len(structure.directions)
    ground_a, ground_b, ground_c, ground_d = ground.filter()
    n_ground = n_directions * len(ground_a)
    inverse = np.linalg.inv(structure.mass)
    c = np.zeros((n, 2 * n + n_ground))
    c[:, : 2 * n] = -inverse @ np.hstack([structure.stiffness, structure.damping])
    d = -inverse @ rows.T
    a = np.zeros((2 * n + n_ground, 2 * n + n_ground))
    a[:n, n : 2 * n] = np.eye(n)
    a[n : 2 * n] = c
    a[n : 2 * n, 2 * n :] = -structure.influence @ np.kron(np.eye(n_directions), ground_c)
    a[2 * n :, 2 * n :] = np.kron(np.eye(n_directions), ground_a)
    b = np.zeros((len(a), len(rows)))
    b[n : 2 * n] = d
    g = np.zeros((len(a), n_directions))
    g[n : 2 * n] = -structure.influence * ground_d
    g[2 * n :] = np.kron(np.eye(n_directions), ground_b[:, np.newaxis])
    return a, b, g, c, d


def nominal_linear_model(
    nominal: IsolatedStructure, currents: NDArray, ground: GroundNoise
) -> NominalLinearModel:
    """Linearise a nominal model about rest, at some currents."""
    frequency, linear = linear_model(nominal, currents)
    passive = []
    for element in nominal.elements:
        amperes = 0.0 if element.channel is None else float(currents[element.channel])
        k = element.device.linearised(amperes, frequency)
        passive.append([k.real, k.imag / (2 * np.pi * frequency)])
    rows = nominal.element_rows
    return NominalLinearModel(
        *structure_and_ground(linear, rows, ground), np.array(passive).reshape(-1, 2), rows
    )


def sampled(
    a: NDArray, b: NDArray, noise: NDArray, h: float
) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Exact step of z' = A z + B r + white noise, r linear within it.

    References
    ----------
    Van Loan 1978, Computing integrals involving the matrix exponential.
    """
    from scipy.linalg import expm

    n, m = b.shape
    ramp = np.zeros((n + 2 * m, n + 2 * m))
    ramp[:n, :n], ramp[:n, n : n + m] = a * h, b * h
    ramp[n : n + m, n + m :] = np.eye(m)
    held = expm(ramp)[:n]
    pair = expm(np.block([[-a, noise], [np.zeros((n, n)), a.T]]) * h)
    transition = pair[n:, n:].T
    covariance = transition @ pair[:n, n:]
    at_end = held[:, n + m :]
    return transition, held[:, n : n + m] - at_end, at_end, (covariance + covariance.T) / 2
