"""Residuals that noise alone would leave: the measure against which a misfit is held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..identification.velocity import smooth
from .candidates import Fitted
from .measured import Measured

_FINER = 2
_RUNAWAY = 0.3
"""Of a run's force: noise does not do more to a law that is stable under its motion."""


def motion_noise(full: Measured, number: int, seed: int = 0) -> NDArray:
    """Draw noise of the displacement as it passes the smoothing.

    Parameters
    ----------
    full : Measured
        The data with all samples.
    number : int
        How many.
    seed : int
        Of the random numbers.

    Returns
    -------
    (number, 3, n_samples) array
        Errors of displacement, velocity and acceleration, m, m/s, m/s^2.
    """
    random = np.random.default_rng(seed)
    return np.stack(
        [
            np.concatenate([_carried(full, run, random) for run in range(len(full.dt))], axis=1)
            for _ in range(number)
        ]
    )


def noise_residuals(base: Fitted, shifts: NDArray, seed: int = 0) -> NDArray:
    """Draw residuals that noise in force and displacement leaves of a perfect model.

    Noise in the displacement reaches the residual through the model and is smoothed as the data
    are, so that it is neither white nor of the force's size.

    Parameters
    ----------
    base : Fitted
        A fitted model.
    shifts : (number, 3, n_samples) array
        Noise of the motion at its samples; see ``motion_noise``.
    seed : int
        Of the random numbers.

    Returns
    -------
    (n_samples, number) array
        Residuals of all samples over their noise.
    """
    # noise asks for finer steps than smooth motion does
    model = replace(base.model, n_steps=_FINER * base.model.n_steps)
    data = model.data
    random = np.random.default_rng(seed)
    without = data.bounded(model.forces(base.values, False)[0])
    white = np.repeat(data.force_noise, data.lengths)
    columns = []
    for dx, dv, da in shifts:
        moved = replace(model, data=replace(data, x=data.x + dx, v=data.v + dv, a=data.a + da))
        shift = data.bounded(moved.forces(base.values, False)[0]) - without
        for run, size in zip(data.runs, data.force_size, strict=True):
            # where the law itself runs away there is the noise of the force alone
            if np.sqrt(np.mean(shift[run] ** 2)) > _RUNAWAY * size:
                shift[run] = 0.0
        shift += white * random.standard_normal(len(shift))
        columns.append(shift * data.weight)
    return np.stack(columns, axis=1)


def _carried(full: Measured, run: int, random: np.random.Generator) -> NDArray:
    """Noise of a run's displacement as it passes the smoothing: (3, n_samples)."""
    a, b = full.starts[run], full.starts[run + 1]
    level = full.displacement_noise[run]
    if level < 1e-6 * float(np.std(full.x[a:b])):
        return np.zeros((3, b - a))
    # with the signal, so that the smoothing is the same one and its own error is in the result
    clean = full.x[a:b]
    noisy = smooth(clean + level * random.standard_normal(b - a), float(full.dt[run]))
    shift = np.stack(noisy) - [clean, full.v[a:b], full.a[a:b]]
    if full.velocity_measured[run]:
        shift[1] = 0.0
    return shift
