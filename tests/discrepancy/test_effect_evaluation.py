"""Effects along measured runs, whose signals may jump from sample to sample."""

import numpy as np
import pytest

from isolation_sim.discrepancy.device import effect_functions as example
from isolation_sim.discrepancy.device.effect_evaluation import evaluate
from isolation_sim.effects import EFFECTS, Signals
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.identification.measured_runs import measured_runs

FORMS = {form.form: form for form in EFFECTS["magnetic_remanence"]}


def jumping_current(dt):
    """A run whose current jumps every half second."""
    time = np.arange(0.0, 6.0, dt)
    x = 4e-3 * np.sin(2 * np.pi * time)
    levels = np.array([0.3, 2.0, 0.2, 1.2, 0.0, 0.9, 2.5, 1.6, 0.4, 1.4, 0.1, 0.8])
    current = levels[np.minimum((time / 0.5 + 1e-9).astype(int), 11)]
    run = TestRun("jumps", time, x, np.gradient(x, dt), 2e4 * x, current)
    return measured_runs([run])


@pytest.mark.parametrize("dt", [1e-3, 2e-3, 5e-3, 1e-2])
def test_a_play_is_dragged_by_a_jump_to_its_edge_and_no_further(dt):
    data, half = jumping_current(dt), 0.5
    exact, selected = [], max(data.current[0] - half, 0.0)
    for current in data.current:
        selected = min(max(selected, current - half), current + half)
        exact.append(selected)
    seen = evaluate(FORMS["play"], data, data.force, np.array([1.0, half]))["current"]
    assert seen == pytest.approx(np.array(exact), abs=1e-9)


@pytest.mark.parametrize("dt", [1e-3, 2e-3, 5e-3, 1e-2])
def test_the_largest_current_is_that_of_the_jumps(dt):
    data = jumping_current(dt)
    largest = np.maximum.accumulate(data.current)
    seen = evaluate(FORMS["largest"], data, data.force, np.array([0.5]))["current"]
    # some milliseconds after a jump the lag of the memory is over
    late = np.concatenate([[True], largest[1:] == largest[:-1]])
    late = late & (np.arange(len(late)) * dt % 0.5 > 0.05)
    exact = data.current + 0.5 * (largest - data.current)
    assert seen[late] == pytest.approx(exact[late], abs=1e-6)


def test_the_derivatives_of_the_example_are_those_of_its_step():
    def step(state, lag):
        states, by = np.array([state]), np.empty((1, 4))
        still = np.zeros(2)
        signals = Signals(still, still, still, np.array([1.2, 1.9]), still, still)
        parameters = np.array([lag])
        example.step_with_slopes.py_func(signals, 0, 1, 0.01, states, parameters, by)
        other = np.array([state])
        example.step.py_func(signals, 0, 1, 0.01, other, parameters)
        assert states[0] == other[0]
        return states[0], by[0]

    _, by = step(0.7, 0.05)
    for k, d in enumerate(((1e-5, 0.0), (0.0, 1e-5))):
        ends = [step(0.7 + side * d[0], 0.05 + side * d[1])[0] for side in (-1, 1)]
        assert by[k] == pytest.approx((ends[1] - ends[0]) / 2e-5, rel=1e-6)
