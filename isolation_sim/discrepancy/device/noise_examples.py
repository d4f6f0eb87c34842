"""Residuals that noise alone would leave: the measure against which a misfit is held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...identification.measured.noise import coloured_noise
from ..decisions import RUNAWAY_SHIFT
from .model import FittedModel

_FINER = 2
"""Factor on the integration steps: noise asks for finer ones than smooth motion."""


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
