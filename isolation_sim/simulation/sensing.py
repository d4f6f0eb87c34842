"""Sensor models: noise, lost samples, compensation of delay."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..errors import wrong_choice
from ..structures import IsolatedStructure
from .control import Sensors
from .outputs import QUANTITIES


def latest_samples(n_samples: int, sensors: Sensors) -> NDArray:
    """Latest received sample at the time of each sample."""
    # a separate random stream: lost samples do not change the noise of the others
    random = np.random.default_rng([sensors.seed, 1])
    lost = random.random(n_samples) < sensors.dropout
    lost[:1] = False
    return np.maximum.accumulate(np.where(lost, 0, np.arange(n_samples)))


def check_noise(known: Sequence[str], sensors: Sensors) -> None:
    """Refuse noise of an unknown output or quantity, whether it is measured or not."""
    for key in sensors.noise:
        if not any(_concerns(key, name) for name in known):
            raise wrong_choice("sensors: noise", key, (*QUANTITIES, *known))


def _concerns(key: str, name: str) -> bool:
    return name == key or name.endswith("_" + key)


def noise_of(
    names: Sequence[str], known: Sequence[str], n_samples: int, sensors: Sensors
) -> NDArray:
    """Noise of every sensor of a controller."""
    if not sensors.noise:
        return np.zeros((0, 0))
    size = np.zeros(len(known))
    # the name of an output has priority over that of its quantity
    for key, value in sorted(sensors.noise.items(), key=lambda item: item[0] in known):
        size[[_concerns(key, name) for name in known]] = value
    random = np.random.default_rng(sensors.seed)
    measured = [list(known).index(name) for name in dict.fromkeys(names)]
    others = [k for k in range(len(known)) if k not in measured]
    noise = np.zeros((n_samples, len(known)))
    noise[:, measured] = random.standard_normal((n_samples, len(measured)))
    if sensors.compensation:
        # a separate random stream: the noise of a sample does not depend on the number of samples
        other = np.random.default_rng([sensors.seed, 2])
        noise[:, others] = other.standard_normal((n_samples, len(others)))
    return noise * size


def measured_motion(
    isolated: IsolatedStructure, names: Sequence[str], known: Sequence[str], ahead: float
) -> NDArray:
    """A controller's measurements, as rows over all outputs, with the extrapolated motion."""
    # Displacement + ahead * velocity + ahead^2 / 2 * relative acceleration, and velocity + ahead *
    # relative acceleration; a relative acceleration is that of accelerometers on the structure less
    # the ground's.
    structure, index = isolated.structure, {name: k for k, name in enumerate(known)}
    n, n_ground = structure.n_dofs, len(structure.directions)
    dofs = dict(zip(structure.names, np.eye(n), strict=True))
    storeys = dict(zip(structure.storeys, structure.drift_rows, strict=True))
    elements = dict(zip(isolated.element_names, isolated.element_rows, strict=True))
    # in the order of ``output_names``: displacements, velocities and accelerations come first
    velocity = np.zeros((n, len(known)))
    velocity[:, n : 2 * n] = np.eye(n)
    acceleration = np.zeros((n, len(known)))
    acceleration[:, 2 * n : 3 * n] = np.eye(n)
    acceleration[:, len(known) - n_ground :] = -structure.influence
    rows = np.zeros((len(names), len(known)))
    for row, name in zip(rows, names, strict=True):
        row[index[name]] = 1.0
        for suffix, places in (
            ("_displacement_m", dofs),
            ("_drift_m", storeys),
            ("_deformation_m", elements),
        ):
            owner = name.removesuffix(suffix)
            if name != owner and owner in places:
                row += places[owner] @ (ahead * velocity + ahead**2 / 2 * acceleration)
        owner = name.removesuffix("_velocity_m_s")
        if name != owner:
            row += ahead * (dofs | elements)[owner] @ acceleration
    return rows
