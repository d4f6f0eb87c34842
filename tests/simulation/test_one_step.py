"""The compiled steps against the readable one, each from the kernel's own state before it."""

from __future__ import annotations

import numpy as np
import pytest

from isolation_sim.simulation.one_step import StepState, step
from isolation_sim.simulation.run import simulate


@pytest.mark.parametrize("plant", ["stiffening", "hybrid"])
def test_compiled_steps_are_the_readable_ones(plant, request, el_centro, held):
    isolated, record = request.getfixturevalue(plant), el_centro.cut(0.0, 2.0).resampled(0.004)
    amperes = 1.5
    run = simulate(isolated, record, held(amperes), tolerance=1e-9)
    x = np.concatenate([run.history.displacement.values, run.history.velocity.values], axis=1)
    references = run.modes.stiffness, run.modes.damping
    peak, peak_states = np.abs(x).max(axis=0), np.abs(run.states[:, 0]).max(axis=0)
    cuts, compared = run.work.cuts[run.grid.samples, 0], 0
    for k in range(0, len(record) - 1, 2):
        if cuts[k] not in (-1, -2) or (k and cuts[k] == -2 and cuts[k - 1] == -2):
            continue  # cut into several steps, or the second sample of a step
        n = -int(cuts[k])
        state = StepState(x[k], (run.states[k, 0],))
        ground = record.acceleration[k : k + n + 1, None]
        after = step(isolated, references, state, n * record.dt, ground, np.array([amperes]))
        np.testing.assert_array_less(np.abs(after.x - x[k + n]), 1e-11 * peak)
        np.testing.assert_array_less(
            np.abs(after.devices[0] - run.states[k + n, 0]), 1e-9 * peak_states + 1e-300
        )
        compared += 1
    assert compared > 100
