"""Noise of the measured motion as it passes the smoothing, and how it moves fitted values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .law_fit import SEARCHED
from .law_model import LawModel
from .least_squares import DETERMINED, unit_columns
from .measured.holds import hold_still
from .measured_runs import MeasuredRuns, smooth_motion

_LEAST = 1e-6
"""Noise over the size of a channel below which there is none."""
INTERVAL_EXAMPLES = 12
"""Simulated displacement noises behind an interval; Student's t accounts for their number.
Effort."""
LEAST_EXAMPLES = 4
"""Examples under which the law must not diverge; with fewer an interval is unbounded. Effort."""


def motion_noise(full: MeasuredRuns, number: int, seed: int = 0) -> NDArray:
    """Draw noise of displacement, velocity and acceleration after smoothing, (number, 3, n)."""
    random = np.random.default_rng(seed)
    return np.stack(
        [
            np.concatenate([_carried(full, run, random) for run in range(len(full.dt))], axis=1)
            for _ in range(number)
        ]
    )


def errors_by_motion(model: LawModel, values: NDArray, shifts: Sequence[NDArray]) -> NDArray:
    """Scatter of fitted values by noise of the displacement alone: (n_examples, n_values).

    Examples under which the law diverges are left out.
    """
    # The fitted model's own force under the motion takes the place of the measured one; one step of
    # Gauss and Newton fits the model to it under the same motion with noise that passed the same
    # smoothing.
    full = model.data
    keep = full.places(SEARCHED)
    # thinned samples are longer, and take more integration steps
    thin = replace(model, data=full.thinned(SEARCHED)).resolve_steps(values)
    part, clean = thin.data, thin.forces(values, False)[0]
    errors = []
    for shift in shifts:
        dx, dv, da = shift[:, keep]
        data = replace(part, x=part.x + dx, v=part.v + dv, a=part.a + da, force=clean)
        residual, jacobian = replace(model, data=data).residuals(values, True)
        if np.isfinite(residual).all():
            scaled, norm = unit_columns(jacobian)
            errors.append(-np.linalg.lstsq(scaled, residual, rcond=DETERMINED)[0] / norm)
    return np.reshape(errors, (-1, len(values)))


def interval_of(errors: NDArray) -> tuple[NDArray, NDArray]:
    """Shift of values by ``errors_by_motion``, and half of the 95 % interval about it."""
    from scipy.special import stdtrit

    if len(errors) < LEAST_EXAMPLES:
        return np.zeros(errors.shape[1]), np.full(errors.shape[1], np.inf)
    # an example under which a law runs away must not count for all
    below, shift, above = np.percentile(
        errors, [15.87, 50.0, 84.13], axis=0, method="median_unbiased"
    )
    sure = stdtrit(len(errors) - 1, 0.975) * np.sqrt(1 + 1 / len(errors))
    return shift, sure * (above - below) / 2


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
