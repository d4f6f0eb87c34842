"""A second process compiles controllers, and what comes out is what one process alone gives."""

import numpy as np
import pytest

import isolation_sim as iso
from isolation_sim.errors import InputError
from isolation_sim.scenario import Scenario, compilation
from isolation_sim.simulation.control import CompiledDecision

SCENARIO = """
[ground]
stop_s = 2.0
[[controller]]
name = "passive_off"
[[controller]]
name = "clipped_lqr"
[[controller]]
name = "best_constant"
"""


@pytest.fixture
def scenario():
    return Scenario.from_toml(SCENARIO)


@pytest.fixture
def begun(monkeypatch):
    """Labels that the second process has compiled, in order."""
    labels = []

    class Noted(compilation.Worker):
        def run(self, task):
            labels.append(task.label)
            return super().run(task)

    monkeypatch.setattr(compilation, "Worker", Noted)
    monkeypatch.setattr(compilation, "_is_first_use", lambda job: True)
    monkeypatch.setattr(compilation, "_has_idle_processor", lambda: True)
    return labels


def test_the_same_bits_as_one_process_alone(scenario, begun):
    job = scenario.build()
    alone = {label: job.run(label) for label in job.controllers}
    beside = iso.run_scenario(scenario)
    assert begun[0] == "best_constant"
    for label, run in alone.items():
        np.testing.assert_array_equal(run.modal, beside.runs[label].modal)


def test_the_second_process_is_ended_whatever_happens(scenario, begun, monkeypatch):
    workers = []
    started = compilation.Worker.__init__

    def noted(self):
        started(self)
        workers.append(self)

    monkeypatch.setattr(compilation.Worker, "__init__", noted)
    with pytest.raises(KeyboardInterrupt):
        with compilation.compile_in_parallel(scenario, scenario.build()):
            raise KeyboardInterrupt
    assert workers[0]._process is None


def test_a_controller_compiles_without_a_run(scenario, monkeypatch):
    loaded = []
    before = CompiledDecision.__init__

    def noted(self, *value, **named):
        loaded.append(value)
        before(self, *value, **named)

    monkeypatch.setattr(CompiledDecision, "__init__", noted)
    scenario.build().compile("clipped_lqr")
    assert len(loaded) == 1
    with pytest.raises(InputError, match="learns from runs"):
        scenario.build().compile("best_constant")
