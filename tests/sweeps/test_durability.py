"""Killed, out of room, damaged, changed: nothing finished is lost and the table is the same."""

import errno
import multiprocessing
import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from isolation_sim.errors import InputError
from isolation_sim.io.results_folder import replace_results
from isolation_sim.sweeps import chunk, run, store
from isolation_sim.sweeps.run import sweep

from .conftest import MIXED, plan_of

SMALL = 3
"""Cases a chunk: 12 chunks."""


def slow_sweep(folder, workers):
    """A sweep that is slow enough to be killed at a known place, by its own process."""
    put = store.Store.put

    def slowly(self, finished):
        put(self, finished)
        time.sleep(0.05)

    run.MOST_CASES, store.Store.put = SMALL, slowly
    sweep(plan(), folder, resume=True, workers=workers)


def plan():
    return plan_of(**MIXED)


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    """Table of the sweep that nothing disturbs, in chunks of another size."""
    folder = tmp_path_factory.mktemp("whole") / "sweep"
    sweep(plan(), folder, workers=1)
    return (folder / "table.npz").read_bytes()


@pytest.fixture
def small_chunks(monkeypatch):
    monkeypatch.setattr(run, "MOST_CASES", SMALL)


def begin(folder, workers):
    """A process of its own, which has all imports: a new interpreter needs three seconds."""
    process = multiprocessing.get_context("fork").Process(target=slow_sweep, args=(folder, workers))
    process.start()
    return process


def finished_chunks(folder):
    return {path.name for path in (folder / "chunks").glob("*.npz")}


@pytest.mark.skipif(os.name != "posix", reason="kills processes by signal")
@pytest.mark.parametrize("workers", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_killed_at_random_moments(tmp_path, workers, uninterrupted):
    folder = tmp_path / "sweep"
    random = np.random.default_rng(workers)
    selected: set[str] = set()
    kills = 0
    while not (folder / "table.npz").exists():
        process = begin(folder, workers)
        # some time after some chunks more, in the middle of whatever it is doing then
        expected = len(selected) + int(random.integers(0, 4))
        deadline = time.monotonic() + 300
        while process.is_alive() and time.monotonic() < deadline:
            if (folder / "chunks").exists() and len(finished_chunks(folder)) >= expected:
                break
            time.sleep(0.002)
        time.sleep(random.uniform(0, 0.06))
        if kills < 3 - workers:
            process.kill()
            process.join()
            kills += process.exitcode == -signal.SIGKILL
        else:
            process.join()
            assert process.exitcode == 0
        if (folder / "chunks").exists():
            # what was finished is still there, and never less
            assert selected <= finished_chunks(folder)
            selected = finished_chunks(folder)
        assert time.monotonic() < deadline
    assert kills
    assert (folder / "table.npz").read_bytes() == uninterrupted
    assert sorted(path.name for path in folder.iterdir()) == [
        ".lock",
        "README.txt",
        "manifest.json",
        "table.npz",
    ]


def test_what_a_kill_left_can_be_replaced(tmp_path, small_chunks):
    folder = tmp_path / "sweep"

    def killed(n_runs, n_failed):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep(plan(), folder, workers=1, progress=killed)
    with replace_results(folder, overwrite=True, resume=False):
        assert sweep(plan(), folder, workers=1).finished


def alive(pid):
    """Whether a process is there and has not ended; one that nobody waits for may linger."""
    try:
        status = Path(f"/proc/{pid}/stat").read_text()
    except FileNotFoundError:
        return False
    return status.rpartition(")")[2].split()[0] != "Z"


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="looks processes up in /proc")
def test_workers_end_with_the_process_that_started_them(tmp_path):
    process = begin(tmp_path / "sweep", 2)
    workers: list[int] = []
    deadline = time.monotonic() + 120
    while len(workers) < 2 and process.is_alive() and time.monotonic() < deadline:
        # threads start the workers: each has its own list
        lists = Path(f"/proc/{process.pid}/task").glob("*/children")
        workers = [int(child) for each in lists for child in each.read_text().split()]
        time.sleep(0.01)
    process.kill()
    process.join()
    assert len(workers) == 2
    while any(map(alive, workers)):
        assert time.monotonic() < deadline
        time.sleep(0.02)


@pytest.mark.parametrize("at", [0, 2, 9, 24])
def test_a_full_disk_at_any_write(tmp_path, monkeypatch, small_chunks, uninterrupted, at):
    """The manifest, a chunk, or the final table does not fit."""
    folder, writes = tmp_path / "sweep", 0

    def no_room(descriptor):
        nonlocal writes
        writes += 1
        if writes > at:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", no_room)
        with pytest.raises(OSError, match="No space left"):
            sweep(plan(), folder, workers=1)
    assert not list(folder.rglob(f"*{store.UNFINISHED}"))
    assert not (folder / "table.npz").exists()
    before = finished_chunks(folder)
    if (folder / "manifest.json").exists():
        counted = []
        sweep(plan(), folder, workers=1, resume=True, progress=lambda n, bad: counted.append(n))
        # only what was not finished is run again
        assert len(counted) == 12 - len(before) + bool(before)
        assert (folder / "table.npz").read_bytes() == uninterrupted


def stopped_after(folder, count):
    """Leave a sweep with some chunks finished."""

    class Stop(Exception):
        pass

    left = [count]

    def progress(done, failed):
        left[0] -= 1
        if not left[0]:
            raise Stop

    with pytest.raises(Stop):
        sweep(plan(), folder, workers=1, progress=progress)


def test_a_damaged_chunk_is_run_again(tmp_path, small_chunks, uninterrupted):
    folder = tmp_path / "sweep"
    stopped_after(folder, 4)
    first, second, third, _ = sorted((folder / "chunks").iterdir())
    first.write_bytes(first.read_bytes()[:-7])
    data = bytearray(second.read_bytes())
    data[len(data) // 2] ^= 1
    second.write_bytes(data)
    (folder / "chunks" / f"{third.name}{store.UNFINISHED}").write_bytes(b"half")
    counted = []
    sweep(plan(), folder, workers=1, resume=True, progress=lambda n, bad: counted.append(n))
    assert counted == [18] + [9] * 10
    assert (folder / "table.npz").read_bytes() == uninterrupted


@pytest.mark.parametrize("stopped", [True, False])
def test_runs_that_ended_in_an_error_are_run_again(
    tmp_path, monkeypatch, small_chunks, uninterrupted, stopped
):
    """Before the table was made and after: what the machine lacked may be there by then."""
    folder = tmp_path / "sweep"

    def short_of_memory(cases, **options):
        raise MemoryError("none left")

    def short_of_memory_at_times(isolated, records, control, **options):
        if getattr(control, "amperes", 0.0) == 1.5:
            raise MemoryError("none left")
        return simulate(isolated, records, control, **options)

    simulate = chunk.simulate
    with monkeypatch.context() as patch:
        patch.setattr(chunk, "run_cases", short_of_memory)
        patch.setattr(chunk, "simulate", short_of_memory_at_times)
        if stopped:
            stopped_after(folder, 11)
        else:
            sweep(plan(), folder, workers=1)
    assert run.Sweep(folder).counts["error"] == 12
    counted = []
    again = sweep(plan(), folder, workers=1, resume=True, progress=lambda n, bad: counted.append(n))
    # the four chunks in which it happened, and what had not been reached
    assert counted == ([63] + [9] * 5 if stopped else [72] + [9] * 4)
    assert again.counts == {"ok": 108}
    assert (folder / "table.npz").read_bytes() == uninterrupted


def test_a_plan_that_changed_is_refused(tmp_path, small_chunks):
    folder = tmp_path / "sweep"
    stopped_after(folder, 2)
    before = finished_chunks(folder)
    keys = {**MIXED, "vary": [{**MIXED["vary"][0], "high": 1.7}, *MIXED["vary"][1:]]}
    with pytest.raises(InputError, match=r"vary\[0\]\.high was 1\.6, is 1\.7"):
        sweep(plan_of(**keys), folder, workers=1, resume=True)
    assert finished_chunks(folder) == before


def test_a_folder_that_holds_something_is_left_alone(tmp_path, uninterrupted):
    folder = tmp_path / "sweep"
    sweep(plan(), folder, workers=1)
    stamp = (folder / "table.npz").stat().st_mtime_ns
    with pytest.raises(InputError, match="--resume"):
        sweep(plan(), folder, workers=1)
    # to go on with what is finished does nothing
    again = sweep(plan(), folder, workers=1, resume=True)
    assert again.finished and (folder / "table.npz").stat().st_mtime_ns == stamp
    other = tmp_path / "other"
    other.mkdir()
    (other / "mine.txt").write_text("mine")
    with pytest.raises(InputError, match="is not empty"):
        sweep(plan(), other, workers=1, resume=True)
    assert [path.name for path in other.iterdir()] == ["mine.txt"]


def test_two_processes_do_not_run_one_sweep(tmp_path, small_chunks):
    pytest.importorskip("fcntl")
    folder = tmp_path / "sweep"
    stopped_after(folder, 1)
    with store.Store(folder).locked(), pytest.raises(InputError, match="another process"):
        sweep(plan(), folder, workers=1, resume=True)
    assert sweep(plan(), folder, workers=1, resume=True).finished


def test_an_unfinished_sweep_can_be_read(tmp_path, small_chunks):
    folder = tmp_path / "sweep"
    stopped_after(folder, 3)
    part = run.Sweep(folder)
    assert not part.finished and "unfinished" in repr(part)
    assert part.table["case"].tolist() == [k for k in range(9) for _ in range(3)]


def test_the_report_of_an_unfinished_sweep_says_so_and_goes_with_its_end(tmp_path, small_chunks):
    folder = tmp_path / "sweep"
    stopped_after(folder, 3)
    page = run.Sweep(folder).to_html(folder / "report.html").read_text()
    assert "This sweep is unfinished" in page
    (folder / "figures").mkdir()
    for name in ("map.svg", "mine.svg"):
        (folder / "figures" / name).write_text("")
    finished = sweep(plan(), folder, workers=1, resume=True)
    assert not (folder / "report.html").exists()
    assert [path.name for path in (folder / "figures").iterdir()] == ["mine.svg"]
    assert "unfinished" not in finished.to_html(folder / "report.html").read_text()
    sweep(plan(), folder, workers=1, resume=True)
    assert (folder / "report.html").exists()


def test_killed_before_the_manifest_and_after_the_table(tmp_path, small_chunks, uninterrupted):
    """The two ends, where what is left is no chunk."""
    folder = tmp_path / "sweep"
    folder.mkdir()
    (folder / f"manifest.json{store.UNFINISHED}").write_text("{")
    sweep(plan(), folder, workers=1, resume=True)
    (folder / "chunks").mkdir()
    (folder / "chunks" / "000000-left.npz").write_bytes(b"")
    assert sweep(plan(), folder, workers=1, resume=True).finished
    assert not (folder / "chunks").exists()
    assert (folder / "table.npz").read_bytes() == uninterrupted


def test_a_table_that_cannot_be_read_is_reported(tmp_path, uninterrupted):
    """A bit that fell over, and a folder of an earlier release."""
    folder = tmp_path / "sweep"
    sweep(plan(), folder, workers=1)
    data = bytearray(uninterrupted)
    data[len(data) // 2] ^= 1
    (folder / "table.npz").write_bytes(data)
    with pytest.raises(InputError, match=r"table\.npz: cannot be read as a table"):
        _ = run.Sweep(folder).table
    manifest = folder / "manifest.json"
    manifest.write_text(manifest.read_text().replace('"format": 2', '"format": 1'))
    with pytest.raises(InputError, match="a sweep of another release; expected: to run"):
        run.Sweep(folder)
