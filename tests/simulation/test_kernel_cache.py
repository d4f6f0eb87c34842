"""Generated kernels on disk: written once, found again, and honest about compiling."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from isolation_sim.laws import LAWS
from isolation_sim.simulation.kernel import loading

SCRIPT = """
import hashlib
import numpy as np
from ground_motions import Record
from isolation_sim.laws import law
from isolation_sim.simulation.kernel import loading
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
    print(run.work.kernel.integration.__file__, repr(float(run.values.sum())))
# a law that cannot be named otherwise is named by this text
text = loading.law_text(plant.elements[0].device.law, 1, 1, 1, 0)
print(hashlib.sha256(text.encode()).hexdigest())
"""


@pytest.mark.parametrize(
    ("name", "lanes", "table_lanes"),
    [*((name, 16, 1) for name in LAWS), ("bouc_wen", 1, 1), ("bouc_wen", 16, 16)],
)
def test_text_is_the_same_every_time(name, lanes, table_lanes):
    first = loading.law_text(LAWS[name], 1, lanes, table_lanes, 0)
    assert first == loading.law_text(LAWS[name], 1, lanes, table_lanes, 0)
    compile(first, "law", "exec")


def test_text_depends_on_what_it_is_for():
    shapes = [(1, 1, 1, 1, 128), (2, 1, 1, 1, 128), (1, 2, 1, 1, 128), (1, 1, 16, 16, 128),
              (1, 1, 16, 1, 128), (1, 1, 1, 1, 256)]  # fmt: skip
    assert len({loading.integration_text(loading.Shape(*shape)) for shape in shapes}) == len(shapes)
    forms = [("linear", 1, 1, 1), ("linear", 1, 16, 16), ("linear", 1, 16, 1),
             ("kelvin_voigt", 1, 1, 1)]  # fmt: skip
    assert len({loading.law_text(LAWS[name], *form, 0) for name, *form in forms}) == len(forms)


def test_laws_share_one_integration():
    linear, other = LAWS["linear"], LAWS["bouc_wen"]
    alone, mixed = loading.load([linear], 1, 1), loading.load([linear, other], 1, 1)
    assert loading.load([linear], 1, 1) is alone
    assert loading.load([other], 1, 1).integration is alone.integration
    assert loading.load([other, linear], 1, 1).integration is mixed.integration
    assert loading.load([other, linear], 1, 1).laws == mixed.laws[::-1]


@pytest.fixture(scope="module", params=["law", pytest.param("all", marks=pytest.mark.slow)])
def processes(request, tmp_path_factory):
    """Two processes after another with one cache folder, which lacks the law, or everything."""
    folder = tmp_path_factory.mktemp("cache")
    if request.param == "law":
        kernel = loading.load([LAWS["linear"]], 1, 1)
        (folder / "__pycache__").mkdir()
        for source in (
            Path(str(m.__file__)) for m in (kernel.integration, kernel.tables, kernel.peaks)
        ):
            for path in (source, *(source.parent / "__pycache__").glob(f"{source.stem}.*")):
                shutil.copy2(path, folder / path.relative_to(source.parent))
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
    assert len(list(folder.glob("kernel_*.py"))) == len(list(folder.glob("law_*.py"))) == 1


def test_compiling_is_said_once_and_only_when_it_happens(processes):
    _, (first, second) = processes
    assert first.stderr.count("compiling") == 1
    assert second.stderr == ""


def test_nothing_unfinished_is_left_in_the_cache(processes):
    assert not list(processes[0].rglob(".*"))
