"""Generated kernels on disk: written once, found again, and honest about compiling."""

import os
import subprocess
import sys

import pytest

from isolation_sim.laws import LAWS
from isolation_sim.simulation import kernel

SCRIPT = """
import numpy as np
from ground_motions import Record
from isolation_sim.laws import law
from isolation_sim.simulation.control import Schedule
from isolation_sim.simulation.run import simulate
from isolation_sim.structures import reference_building

class Nothing:
    name, period = "nothing", None
    def prepare(self, context, trial): pass
    def measures(self, nominal): return ()
    def schedule(self, context): return Schedule(np.zeros(1), np.zeros((1, 0)))
    def reset(self, context): pass

plant = reference_building().on(law("linear", parameters={"k": 1.5e7}))
for k in range(2):
    run = simulate(plant, Record(np.sin(np.arange(50.0)), 0.02), Nothing())
    print(run.work.module.__file__, repr(float(run.values.sum())))
"""


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize(("lanes", "shared"), [(1, False), (16, False), (16, True)])
def test_text_is_the_same_every_time(name, lanes, shared):
    first = kernel.kernel_text([LAWS[name]], 1, lanes, shared)
    assert first == kernel.kernel_text([LAWS[name]], 1, lanes, shared)
    compile(first, "kernel", "exec")


def test_text_depends_on_what_it_is_for():
    law, other = LAWS["linear"], LAWS["kelvin_voigt"]
    texts = {
        kernel.kernel_text(laws, n_ground, lanes, shared)
        for laws, n_ground, lanes, shared in (
            ([law], 1, 1, False), ([law], 2, 1, False), ([law], 1, 16, False),
            ([law], 1, 16, True), ([law, law], 1, 1, False), ([other], 1, 1, False),
            ([law, other], 1, 1, False), ([other, law], 1, 1, False),
        )
    }  # fmt: skip
    assert len(texts) == 8


def test_same_laws_load_the_same_module():
    assert kernel.load([LAWS["linear"]], 1, 1) is kernel.load([LAWS["linear"]], 1, 1)


@pytest.fixture(scope="module")
def processes(tmp_path_factory):
    """Two processes after another with one empty cache folder."""
    folder = tmp_path_factory.mktemp("cache")
    environment = {**os.environ, "ISOLATION_SIM_CACHE": str(folder), "PYTHONPATH": os.pathsep.join(
        filter(None, [os.getcwd(), os.environ.get("PYTHONPATH", "")])
    )}  # fmt: skip
    done = [
        subprocess.run(
            [sys.executable, "-c", SCRIPT], env=environment, capture_output=True, text=True,
            check=True, timeout=120,
        )
        for _ in range(2)
    ]  # fmt: skip
    return folder, done


def test_second_process_finds_what_the_first_compiled(processes):
    folder, (first, second) = processes
    assert first.stdout == second.stdout
    assert first.stdout.splitlines()[0].startswith(str(folder))
    assert len(list(folder.glob("kernel_*.py"))) == 1


def test_compiling_is_said_once_and_only_when_it_happens(processes):
    _, (first, second) = processes
    assert first.stderr.count("compiling") == 1
    assert second.stderr == ""


def test_nothing_unfinished_is_left_in_the_cache(processes):
    assert not list(processes[0].rglob(".*"))
