"""Residuals that noise alone would leave: the measure against which a misfit is held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...identification.measured.holds import hold_still
from ...identification.measured.noise import coloured_noise
from ...identification.measured_runs import MeasuredRuns, smooth_motion
from ..decisions import RUNAWAY_SHIFT
from .model import FittedModel

_FINER = 2
"""Factor on the integration steps: noise asks for finer ones than smooth motion."""
_LEAST = 1e-6
"""Noise over the size of a channel below which there is none."""


def motion_noise(full: MeasuredRuns, number: int, seed: int = 0) -> NDArray:
    """Draw noise of displacement, velocity and acceleration after smoothing, (number, 3, n)."""
    random = np.random.default_rng(seed)
    return np.stack(
        [
            np.concatenate([_carried(full, run, random) for run in range(len(full.dt))], axis=1)
            for _ in range(number)
        ]
    )


def noise_residuals(base: FittedModel, shifts: NDArray, seed: int = 0) -> NDArray:
    """Draw residuals of a perfect model under noise in force and displacement."""
    # Noise in the displacement reaches the residual through the model and is smoothed as the data
    # are, so that it is neither white nor of the force's size.
    data = base.model.data
    data = data.with_steps(_FINER * data.n_steps, data.stiff)
    model = replace(base.model, data=data)
    random = np.random.default_rng(seed)
    without = data.bounded(model.forces(base.values, False)[0])
    columns = []
    for dx, dv, da in shifts:
        moved = replace(model, data=replace(data, x=data.x + dx, v=data.v + dv, a=data.a + da))
        shift = data.bounded(moved.forces(base.values, False)[0]) - without
        for run, size in zip(data.runs, data.force_size, strict=True):
            # where the law itself runs away there is the noise of the force alone
            if np.sqrt(np.mean(shift[run] ** 2)) > RUNAWAY_SHIFT * size:
                shift[run] = 0.0
        sizes = zip(data.force_noise, data.lengths, data.dt, data.force_corner, strict=True)
        shift += np.concatenate(
            [noise * coloured_noise(random, n, dt, corner) for noise, n, dt, corner in sizes]
        )
        columns.append(shift * data.weight)
    return np.stack(columns, axis=1)


def _carried(full: MeasuredRuns, run: int, random: np.random.Generator) -> NDArray:
    """Noise of a run's displacement and velocity as it passes the smoothing: (3, n_samples)."""
    a, b = full.starts[run], full.starts[run + 1]
    x, v = full.x[a:b], full.v[a:b]
    level, of_velocity = full.displacement_noise[run], full.velocity_noise[run]
    noisy_velocity = bool(0 < of_velocity < np.inf)
    if level < _LEAST * np.std(x) and not noisy_velocity:
        return np.zeros((3, b - a))
    # with the signal, so that the smoothing is the same one and its own error is in the result
    step = float(full.dt[run])
    displacement = x + level * random.standard_normal(b - a)
    velocity = v + of_velocity * random.standard_normal(b - a) if noisy_velocity else None
    noisy = hold_still(*smooth_motion(displacement, step, velocity, None), step, level)
    shift = np.stack(noisy) - [x, v, full.a[a:b]]
    if of_velocity == 0:
        shift[1] = 0.0
    return shift
