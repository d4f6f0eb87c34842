"""Who runs the chunks makes no difference: processes, a cluster, some of them dying."""

import importlib
import os
import signal
import sys
import threading
import time

import pytest

import isolation_sim as iso
from isolation_sim import workers
from isolation_sim.errors import InputError
from isolation_sim.laws import LAWS
from isolation_sim.sweeps import run
from isolation_sim.sweeps.run import chunk_of, sweep

from .conftest import MIXED, design_of, plan_of


@pytest.fixture(scope="module")
def design():
    return design_of(**MIXED)


def chunks_of(design, size=4):
    for number, start in enumerate(range(0, design.n_cases, size)):
        yield chunk_of(design, number, range(start, start + size))


@pytest.fixture(scope="module")
def expected(design):
    """Tables of the chunks, run in this process."""
    return {each.number: each.table for each in workers.in_this_process(chunks_of(design))}


def test_processes_give_the_same_bytes(design, expected):
    result = list(workers.in_processes(chunks_of(design), 2))
    assert {each.number: each.table for each in result} == expected


SQUARES = """
class Square:
    def __init__(self, number):
        self.number = number

    def __call__(self):
        return {self.number: self.number**2}[abs(self.number)]
"""


@pytest.fixture
def squares(tmp_path, monkeypatch):
    """Tasks for which a worker has to import next to nothing: 0, 1, 4, …"""
    (tmp_path / "worker_squares.py").write_text(SQUARES)
    monkeypatch.syspath_prepend(str(tmp_path))
    Square = importlib.import_module("worker_squares").Square
    yield lambda *numbers: map(Square, numbers or range(9))
    del sys.modules["worker_squares"]


def test_chunks_are_taken_as_there_is_room(squares):
    taken = 0

    def counting():
        nonlocal taken
        for task in squares():
            taken += 1
            yield task

    finished = workers.in_processes(counting(), 1)
    next(finished)
    # one finished, two at hand
    assert taken <= 3
    finished.close()


@pytest.fixture
def started(monkeypatch):
    """Processes of the workers, in the order in which they start."""
    processes, original = [], workers._start_process

    def recorded():
        processes.append(original())
        return processes[-1]

    monkeypatch.setattr(workers, "_start_process", recorded)
    return processes


def test_a_worker_that_dies_is_replaced(squares, started):
    finished = workers.in_processes(squares(), 1)
    results = [next(finished)]
    os.kill(started[0].pid, signal.SIGKILL)
    results += finished
    assert sorted(results) == [n**2 for n in range(9)]
    assert len(started) == 2


def test_processes_serve_until_they_are_stopped(squares, started):
    with workers.Processes(1) as processes:
        for _ in range(2):
            assert sorted(processes.run(squares())) == [n**2 for n in range(9)]
        assert len(started) == 1
        # one who stops listening stops them; others start on demand
        broken_off = processes.run(squares())
        next(broken_off)
        broken_off.close()
        assert started[0].poll() is not None
        next(processes.run(squares()))
        assert len(started) == 2
    assert started[1].poll() is not None


def test_workers_that_die_again_and_again_stop_the_sweep(design, monkeypatch):
    monkeypatch.setattr(workers, "_COMMAND", "import os; os._exit(1)")
    with pytest.raises(InputError, match="cases 0 to 3: 3 worker processes died"):
        list(workers.in_processes(chunks_of(design), 1))


def test_a_worker_that_has_no_modules_says_so(design, squares):
    """An error outside the cases is the sweep's, and comes out of the worker."""
    broken = chunk_of(design, 0, range(1))
    object.__setattr__(broken, "parameters", {"nothing": float})
    with pytest.raises(KeyError, match="nothing"):
        broken()
    with pytest.raises(KeyError, match="7"):
        list(workers.in_processes(squares(2, -7), 1))


@pytest.fixture(scope="module")
def cluster():
    distributed = pytest.importorskip("distributed", reason="Dask is not installed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as started:
        yield started


def test_a_cluster_gives_the_same_table(tmp_path, cluster):
    here = sweep(plan_of(**MIXED), tmp_path / "here", workers=1)
    there = sweep(plan_of(**MIXED), tmp_path / "there", scheduler=cluster.scheduler_address)
    tables = [(each.folder / "table.npz").read_bytes() for each in (here, there)]
    assert tables[0] == tables[1]


@pytest.mark.slow
def test_a_cluster_survives_a_worker_killed_in_mid_run(tmp_path, cluster, monkeypatch):
    monkeypatch.setattr(run, "MOST_CASES", 1)
    victim = next(iter(cluster.workers.values()))
    pid = victim.pid
    finished = []

    def progress(done, failed):
        finished.append(done)
        if len(finished) == 6:
            # the scheduler has many chunks with this worker now
            os.kill(pid, signal.SIGKILL)

    result = sweep(
        plan_of(**MIXED), tmp_path / "killed", scheduler=cluster.scheduler_address,
        progress=progress,
    )  # fmt: skip
    here = sweep(plan_of(**MIXED), tmp_path / "here", workers=1)
    assert len(finished) == 36 and result.finished
    tables = [(each.folder / "table.npz").read_bytes() for each in (here, result)]
    assert tables[0] == tables[1]
    with pytest.raises(ProcessLookupError):
        _until_gone(pid)


OWN = """
from dataclasses import replace
from isolation_sim.laws.linear import LAW as LINEAR
LAW = replace(LINEAR, name="my_spring")
"""


def test_a_cluster_runs_a_law_of_one_s_own(tmp_path, cluster, monkeypatch):
    """By its file; a module that the workers cannot import is told; so is a registered name."""
    (tmp_path / "mine.py").write_text(OWN)
    (tmp_path / "here").mkdir()
    (tmp_path / "here" / "only_here.py").write_text(OWN)
    monkeypatch.syspath_prepend(str(tmp_path / "here"))

    def swept(law, folder):
        isolator = {"law": law, "parameters": {"k": 3e6}, "length_scale": 1.0, "force_scale": 1.0}
        plan = plan_of(scenario={"ground": {"name": "el_centro_1940_ns", "stop_s": 2.0},
                                 "isolator": isolator})  # fmt: skip
        return sweep(plan, tmp_path / folder, scheduler=cluster.scheduler_address)

    assert set(swept(f"{tmp_path / 'mine.py'}:LAW", "file").table["status"]) == {"ok"}
    (refused,) = swept("only_here:LAW", "module").table["reason"]
    assert refused == (
        "isolator: law 'only_here:LAW' cannot be loaded: ModuleNotFoundError: No module named "
        "'only_here'"
    )
    iso.register("law", LAWS[f"{tmp_path / 'mine.py'}:LAW"], replace=True)
    with pytest.raises(InputError, match="law 'my_spring' was registered in this process"):
        swept("my_spring", "registered")
    LAWS._registered.clear()


def _until_gone(pid):
    for _ in range(200):
        os.kill(pid, 0)
        time.sleep(0.02)


def test_an_address_without_a_scheduler_is_reported(tmp_path, monkeypatch):
    distributed = pytest.importorskip("distributed", reason="Dask is not installed")
    original = distributed.Client
    monkeypatch.setattr(distributed, "Client", lambda at, timeout: original(at, timeout="1s"))
    with pytest.raises(InputError, match="cannot be reached"):
        sweep(plan_of(), tmp_path / "sweep", scheduler="tcp://127.0.0.1:1")
    assert not (tmp_path / "sweep").exists()
    assert threading.active_count() < 100
