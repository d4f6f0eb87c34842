"""Frequency response of the linear structure, as a record's sensors show it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...simulation.result import Run
from .causes.candidate import TYPICAL_PERIOD
from .model import BuildingModel
from .record import BuildingRecord


def frequency_response(
    model: BuildingModel, record: BuildingRecord, run: Run, frequencies: NDArray, forces: NDArray
) -> NDArray:
    """Channels by harmonic forces, (n_frequencies, n_channels, n_forces), unit/N.

    The isolators exert no force. ``forces`` (n_dofs, n_forces) act on the dofs of the run, at
    ``frequencies`` (n_frequencies,), Hz, above zero.
    """
    omega = 2 * np.pi * frequencies[:, np.newaxis, np.newaxis]
    stiffness = _dynamic_stiffness(model, run, frequencies)
    moved = np.linalg.solve(stiffness, np.broadcast_to(forces, (len(omega), *forces.shape)))
    outputs = np.concatenate([moved, 1j * omega * moved, -(omega**2) * moved], axis=1)
    return _channels(model, record, run, outputs)


def end_response(
    model: BuildingModel, record: BuildingRecord, run: Run, frequencies: NDArray
) -> NDArray:
    """Channels by displacements and velocities of the dofs at a record's end, and by their jumps.

    (n_frequencies, n_channels, 2 n_dofs + 2 n_channels). They are the boundary terms of the Fourier
    transform of a record that begins at rest and ends in motion, and those by which a sum over its
    samples differs from an integral; as ``frequency_response`` otherwise.
    """
    structure, n = run.isolated.structure, run.isolated.structure.n_dofs
    omega = 2 * np.pi * frequencies[:, np.newaxis, np.newaxis]
    rest, unit = np.zeros((len(omega), n, n)), np.broadcast_to(np.eye(n), (len(omega), n, n))
    momentum = np.concatenate(
        [1j * omega * structure.mass + structure.damping, rest + structure.mass], axis=2
    )
    moved = -np.linalg.solve(_dynamic_stiffness(model, run, frequencies), momentum)
    speeds = 1j * omega * moved + np.concatenate([unit, rest], axis=2)
    accelerations = 1j * omega * speeds + np.concatenate([rest, unit], axis=2)
    outputs = np.concatenate([moved, speeds, accelerations], axis=1)
    by_motion = _channels(model, record, run, outputs)
    jumps = np.broadcast_to(np.eye(by_motion.shape[1]), (len(omega), *2 * by_motion.shape[1:2]))
    return np.concatenate([by_motion, jumps, 1j * omega * jumps], axis=2)


def linear_stiffness(run: Run, element: int, frequencies: NDArray) -> NDArray:
    """Complex stiffness of an element at its mean current, (n_frequencies,), N/m."""
    one = run.isolated.elements[element]
    current = 0.0 if one.channel is None else float(run.current[:, one.channel].mean())
    alike = one.device.linearised(current, 1 / TYPICAL_PERIOD)
    return alike.real + 1j * alike.imag * frequencies * TYPICAL_PERIOD


def _dynamic_stiffness(model: BuildingModel, run: Run, frequencies: NDArray) -> NDArray:
    """Stiffness, damping and inertia without isolators, (n_frequencies, n_dofs, n_dofs), N/m."""
    structure, omega = run.isolated.structure, 2 * np.pi * frequencies[:, np.newaxis, np.newaxis]
    result = structure.stiffness + 1j * omega * structure.damping - omega**2 * structure.mass
    for e, element in enumerate(run.isolated.elements):
        if e not in model.isolators:
            spring = linear_stiffness(run, e, frequencies)[:, np.newaxis, np.newaxis]
            result = result + spring * np.outer(element.direction, element.direction)
    return result


def _channels(model: BuildingModel, record: BuildingRecord, run: Run, outputs: NDArray) -> NDArray:
    """Channels of displacements, velocities and accelerations, (n_frequencies, 3 n_dofs, ...)."""
    columns = model.measured(record, run.isolated, run.outputs.names)[: outputs.shape[1]]
    return np.einsum("fok,oc->fck", outputs, columns)
