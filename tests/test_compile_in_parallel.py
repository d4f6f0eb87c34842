"""Further processes compile, and what comes out is what one process alone gives."""

import importlib
import os
import sys
import time

import numpy as np
import pytest

import isolation_sim as iso
from isolation_sim import workers
from isolation_sim.discrepancy.device.first_use import effects_to_compile
from isolation_sim.errors import InputError
from isolation_sim.identification.sensitivities import laws_to_compile
from isolation_sim.laws import LAWS
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
            labels.append(task.args[-1])
            return super().run(task)

    monkeypatch.setattr(compilation, "Worker", Noted)
    monkeypatch.setattr(compilation, "_is_first_use", lambda job: True)
    monkeypatch.setattr(compilation, "idle_processors", lambda: 1)
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


@pytest.fixture
def empty_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("ISOLATION_SIM_CACHE", str(tmp_path))


NOTES = """
import os, time

class Note:
    def __init__(self, path=None):
        self.path = path

    def __call__(self):
        if self.path is None:
            time.sleep(3600)
        self.path.write_text(str(os.getpid()))
"""


@pytest.fixture
def note(tmp_path, monkeypatch):
    """Tasks that write the number of their process to a file; with no file they never end."""
    (tmp_path / "worker_notes.py").write_text(NOTES)
    monkeypatch.syspath_prepend(str(tmp_path))
    yield importlib.import_module("worker_notes").Note
    del sys.modules["worker_notes"]


def test_tasks_run_beside_a_block_in_another_process(note, monkeypatch, tmp_path):
    monkeypatch.setattr(workers, "idle_processors", lambda: 1)
    notes = [tmp_path / "first", tmp_path / "second"]
    began = time.monotonic()
    with workers.run_beside(lambda: [*map(note, notes), note()]):
        while not (notes[1].exists() and notes[1].read_text()) and time.monotonic() < began + 60:
            time.sleep(0.01)
    process = int(notes[0].read_text())
    assert process == int(notes[1].read_text()) != os.getpid()
    with pytest.raises(ProcessLookupError):  # the task that never ends was stopped
        os.kill(process, 0)


def test_nothing_runs_beside_a_block_without_an_idle_processor(note, monkeypatch, tmp_path):
    monkeypatch.setattr(workers, "idle_processors", lambda: 0)
    with workers.run_beside(lambda: [note(tmp_path / "note")]):
        pass
    assert not (tmp_path / "note").exists()


@pytest.mark.usefixtures("empty_cache")
def test_another_process_compiles_a_law_and_an_effect():
    law, effect = ("kelvin_voigt",), ("cyclic_degradation", 0, False)
    laws = {task.args: task for task in laws_to_compile()}
    effects = {task.args: task for task in effects_to_compile()}
    assert len(laws) == len(LAWS)
    order = [differentiated for *_, differentiated in effects]
    assert order == sorted(order)
    worker = workers.Worker()
    worker.run(laws[law])
    worker.run(effects[effect])
    worker.stop()
    assert law not in [task.args for task in laws_to_compile()]
    assert effect not in [task.args for task in effects_to_compile()]
    assert [task.args for task in laws_to_compile(["linear"])] == [("linear",)]
