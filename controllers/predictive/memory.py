"""The memory of a predictive decision at the start of a run."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..compiled import Decision
from ..device_states import SCRATCH
from ..observers.observer import N_Y
from . import decision as at
from .flat_arrays import flat_arrays
from .ground_kernel import PRIOR
from .prediction import Prediction
from .slow_ground import slow_lengths


class Sizes(NamedTuple):
    """Lengths of a decision's arrays."""

    n_steps: int  # Of the horizon
    n_late: int  # From the measurement to the decision
    n_known: int  # Samples of the ground motion that are known after the measured one
    n_blocks: int
    reach: int  # Steps until a coil has responded
    order: int  # Of the autoregressive model


def initial_memory(
    prediction: Prediction, step: float, sizes: Sizes, prior: float, observer: Decision | None
) -> NDArray:
    """Everything at rest; ``prior``: sums of the force scale at the start."""
    p, (n_steps, n_late, n_known, n_blocks, reach, order) = prediction, sizes
    initial, n_channels = p.coils[:, 4], len(p.coils)
    n_dofs, n_directions = p.to_modes.shape[1] // 2, p.along.shape[1]
    n_z, n_devices, n_path = p.rows.shape[-1], len(p.lengths), n_late + n_steps
    n_d, n_a = p.n_displacements, p.n_accelerations
    n_peaks, n_outputs, width = n_d + n_a, 2 * n_d + n_a, n_blocks * n_channels
    rest, (n_samples, n_rates) = p.initial_states(), slow_lengths(step)
    n_seen = int(observer.settings[N_Y]) if observer else 0
    zeros = {
        at.Z_THEN: n_z, at.CURRENT_THEN: n_channels, at.Z_NOW: n_z, at.CURRENT_NOW: n_channels,
        at.GROUND_MOTION: (n_directions, 2), at.GROUND_PAST: (n_directions, order),
        at.COEFFICIENTS: (n_directions, order), at.NOISE: (n_directions, 1),
        at.PEAKS_PAST: (2, n_peaks), at.PEAKS: 3, at.FREE_Z: n_z, at.FREE_PAST: (2, n_peaks),
        at.FREE_PEAKS: 3, at.PEAK_HISTORY: (1 + n_path, 2),
        at.FREE_GROUND: (n_directions, p.n_sub + 1),
        at.SLOW_SAMPLES: (n_samples, n_directions), at.SLOW_RATES: n_rates, at.SLOW_STATE: 2,
        at.UNITS: 3, at.OBSERVED: n_seen + n_channels, at.MOTION_SEEN: 2 * n_dofs, at.Z_SEEN: n_z,
        at.SAMPLE: n_directions, at.BEFORE: n_channels, at.TRIAL: (n_steps, n_channels),
        at.FORCES: n_devices, at.ACCELERATION_AHEAD: (n_directions, n_path + 1),
        at.PATH: (n_directions, n_path * p.n_sub + 1), at.DEVIATIONS: (reach + 1, n_a, 2),
        at.GROUND_END: (n_directions, 2), at.GAIN: order, at.INNOVATIONS: n_path + 1,
        at.SHAPE: reach, at.OUTPUTS: n_outputs, at.LEVELS: 2, at.REGRET_LEVELS: n_steps + 1,
        at.RESTING: n_outputs, at.SLOPES: width, at.FOLLOWING: SCRATCH * max(p.model.n_states, 1),
    }  # fmt: skip
    arrays = {k: np.zeros(shape) for k, shape in zeros.items()} | {
        at.STATE: np.eye(8)[at.FACTOR], at.FORCE_SCALES: np.ones(n_devices),
        at.OBSERVER_SETTINGS: observer.settings if observer else np.zeros(0),
        at.OBSERVER_MEMORY: observer.memory if observer else np.zeros(0),
        at.PLAN: np.tile(initial, (n_steps, 1)), at.PENDING: np.tile(initial, (n_late, 1)),
        at.STATES_THEN: rest, at.STATES_NOW: rest, at.FREE_STATES: rest,
        at.COVARIANCE: np.tile(PRIOR * np.eye(order), (n_directions, 1, 1)),
        at.SCALE_SUMS: np.full(2, prior),
    }  # fmt: skip
    n, jumps = width + 3, bool(np.any(p.coils[:, 0] == 0))
    # both signs of every output, of accelerations before and after a jump, with the regret's
    n_rows = (n_steps + 1) * (2 * n_d + (8 if jumps else 4) * n_a) + n_steps * n_channels
    programme = [(n, n), (n,), (n_rows, n), (n + n_rows,), (n + n_rows,)]
    solver = [(n, n), (n, n), (4, n + 1), (n + 1,)]
    values, derivatives, side = p.work(width)
    groups = {
        at.VALUES: values, at.DERIVATIVES: derivatives, at.SIDE: [side],
        at.RESULTS: p.results(n_steps, width),
        at.FREE_RESULTS: p.results(max(n_path - n_known, n_late, 1), 0),
        at.PROGRAMME: [np.zeros(shape) for shape in programme], at.SOLUTION: [np.zeros(n)],
        at.SOLVER: [np.zeros(shape) for shape in solver],
    }  # fmt: skip
    for first, group in groups.items():
        arrays |= dict(enumerate(group, first))
    return flat_arrays(arrays)
