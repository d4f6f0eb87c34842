"""Commands among files that exist already: whatever they are, none is changed."""

import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from isolation_sim.cli import main
from isolation_sim.identification.campaign import Campaign, write_campaign
from isolation_sim.identification.run_table import TestRun

JOB = '[ground]\nstop_s = 0.5\n[[controller]]\nname = "passive_off"\n'
PLAN = (
    '[scenario.ground]\nstop_s = 0.5\n[[scenario.controller]]\nname = "passive_off"\n'
    '[[vary]]\nfield = "isolator.count"\nvalues = [1.0]\n'
)
COMMANDS = (
    "new", "new results", "sweep new", "sweep new out.toml", "list laws", "cite job.toml",
    "run job.toml --no-figures --quiet", "run job.toml --no-figures --quiet --out out",
    "sweep plan.toml --workers 1 --quiet", "sweep plan.toml --workers 1 --quiet --out out",
    "sweep show done --no-draw", "sweep show done --csv out.csv --figures figs --no-draw",
    "fit tests --law kelvin_voigt --starts 1 --quiet --out out.toml",
    "fit tests --law kelvin_voigt --starts 1 --quiet --report out.html",
    "diagnose tests --out out.toml/x", "study level_and_period --out out.toml/x",
)  # fmt: skip
PLACES = (
    "scenario.toml", "sweep.toml", "results", "results/job/mine.txt", "results/plan/mine.txt",
    "out", "out/mine.txt", "out.toml", "out.html", "out.csv", "figs/comparison.svg", "README.txt",
)  # fmt: skip


@pytest.fixture(scope="module")
def desk(tmp_path_factory):
    """What commands work on: a scenario, a plan, tests of a device, a finished sweep."""
    folder = tmp_path_factory.mktemp("desk")
    (folder / "job.toml").write_text(JOB)
    (folder / "plan.toml").write_text(PLAN)
    t = np.arange(0, 2, 1 / 64)
    x, v = 4e-3 * np.sin(6 * t), 24e-3 * np.cos(6 * t)
    noise = np.random.default_rng(0).normal(0, 1, t.size)
    run = TestRun("sine", t, x, v, 2e4 * x + 300 * v + noise, np.zeros(t.size), False)
    write_campaign(Campaign("spring", "made for a test", (run,)), folder / "tests")
    called(
        "sweep",
        str(folder / "plan.toml"),
        "--workers",
        "1",
        "--quiet",
        "--out",
        str(folder / "done"),
    )
    return folder


def called(*arguments):
    with pytest.raises(SystemExit) as ended:
        main(list(arguments))
    return ended.value.code or 0


def content(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.skipif(sys.platform == "win32", reason="paths of the examples are POSIX")
@settings(
    max_examples=4, deadline=None, derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)  # fmt: skip
@given(
    commands=st.lists(st.sampled_from(COMMANDS), min_size=2, max_size=3, unique=True),
    places=st.sets(st.sampled_from(PLACES), min_size=2),
)
def test_whatever_exists_stays_as_it_is(desk, tmp_path_factory, monkeypatch, commands, places):
    import shutil

    folder = tmp_path_factory.mktemp("work")
    shutil.copytree(desk, folder, dirs_exist_ok=True)
    for place in sorted(places):
        path = folder / place
        # a file where another wants a folder: whichever comes first
        if not any(above.is_file() for above in path.parents) and not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(f"mine: {place}")
    with monkeypatch.context() as patched:
        patched.chdir(folder)
        for command in commands:
            before = content(folder)
            code = called(*command.split())
            after = content(folder)
            assert {path: after.get(path) for path in before} == before, command
            assert code in (0, 2)
            hidden = [path for path in set(after) - set(before) if path.name.startswith(".")]
            assert all(Path(path).name == ".lock" for path in hidden)
