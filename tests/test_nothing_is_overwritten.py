"""Commands among files that exist already: whatever they are, none is changed."""

import shutil
import sys

import numpy as np
import pytest
from typer.main import get_command

import isolation_sim as iso
from ground_motions.readers.csv_file import write_csv
from isolation_sim.cli import app, main
from isolation_sim.effects import device_section
from isolation_sim.errors import InputError
from isolation_sim.identification.campaign import Campaign, write_campaign
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.io.results_folder import replace_results, write_contents

pytestmark = pytest.mark.usefixtures("no_drawing")

JOB = '[ground]\nstop_s = 0.5\n[[controller]]\nname = "passive_off"\n'
SUITE = '[ground]\nfiles = ["motion.csv"]\n[[controller]]\nname = "passive_off"\n'
PLAN = (
    '[scenario.ground]\nstop_s = 0.5\n[[scenario.controller]]\nname = "passive_off"\n'
    '[[vary]]\nfield = "isolator.count"\nvalues = [1.0]\n'
)
STUDY = """
from studies.study import Outcome
TITLE = "A study"
def outcome(folder, short, step):
    return Outcome([{"case": 1.0}], "Nothing.", {})
"""
COMMANDS = (
    "new", "new results", "sweep new", "sweep new out.toml", "list laws", "cite job.toml",
    "run job.toml --no-figures --quiet", "compare job.toml --no-figures --quiet --out out",
    "run job.toml --no-figures --quiet --out out --export mat",
    "run job.toml --no-figures --quiet --out other --overwrite",
    "sweep run plan.toml --workers 1 --quiet", "sweep plan.toml --workers 1 --quiet --out out",
    "sweep plan.toml --workers 1 --quiet --out done --resume",
    "sweep plan.toml --workers 1 --quiet --out other --overwrite",
    "suite suite.toml --workers 1 --quiet --out other --overwrite",
    "tune constant --scenario job.toml --motions scenario --unseen mixture:1 --evaluations 2 "
    "--workers 1 --quiet --out other --overwrite",
    "sweep show done --no-draw", "sweep show done --csv out.csv --figures figs --no-draw",
    "suite suite.toml --workers 1 --quiet --out out", "suite suite.toml --workers 1 --quiet",
    "import tests/sine.csv", "import tests/sine.csv --out out",
    "import tests/sine.csv --out out.toml",
    "import tests/sine.csv --building --out out.csv",
    "import tests/sine.csv --building --write-settings out.toml",
    "fit tests --law kelvin_voigt --starts 1 --quiet --out out.toml",
    "fit tests --law kelvin_voigt --starts 1 --quiet --report out.html --figure figs/loops",
    "evaluate law.toml tests --quiet --report out.html", "check job.toml --report out.toml",
    "diagnose tests --law kelvin_voigt --quiet --out other --overwrite",
    "diagnose loops.csv --out out.toml/x",
    "plan-tests tests", "plan-tests tests --quiet --out out.csv",
    "tune constant --scenario job.toml --motions scenario --unseen mixture:1 --evaluations 2 "
    "--workers 1 --quiet --out other",
    "export c job.toml --controller passive_off --out figs",
    "export fmu job.toml --controller passive_off --out out.fmu",
    "export opensees law.toml --current 0 --out out.tcl",
    "export mat done", "export mat done --out out.mat", "export xlsx done --out out.xlsx",
    "export csv done", "export csv done --out other", "export csv done --out out.csv",
    "study study.py --quiet", "study study.py --quiet --out out",
    "study study.py --quiet --out other --overwrite", "study papers --out out.toml/x",
)  # fmt: skip
PLACES = (
    "scenario.toml", "sweep.toml", "results", "results/job/mine.txt", "results/plan/mine.txt",
    "results/study/mine.txt", "results/suite/mine.txt", "out", "out/mine.txt", "other/mine.txt",
    "out.toml", "out.html", "out.csv", "out.fmu", "out.tcl", "out.mat",
    "out.xlsx", "done/results.mat", "done/results_csv/mine.csv",
    "figs/comparison.svg", "figs/loops.png", "figs/passive_off.h", "figs/passive_off.c",
    "README.txt",
)  # fmt: skip
ALWAYS = ("out.toml", "out.fmu", "out.tcl", "other/mine.txt")
"""Where writing would take long, or must be refused."""


@pytest.fixture(scope="module")
def desk(tmp_path_factory):
    """What commands work on: a scenario, a plan, tests of a device, a finished sweep."""
    folder = tmp_path_factory.mktemp("desk")
    (folder / "job.toml").write_text(JOB)
    (folder / "plan.toml").write_text(PLAN)
    (folder / "suite.toml").write_text(SUITE)
    (folder / "study.py").write_text(STUDY)
    write_csv(iso.el_centro_1940().cut(0, 0.5), folder / "motion.csv")
    t = np.arange(0, 2, 1 / 64)
    x, v = 4e-3 * np.sin(6 * t), 24e-3 * np.cos(6 * t)
    noise = np.random.default_rng(0).normal(0, 1, t.size)
    run = TestRun("sine", t, x, v, 2e4 * x + 300 * v + noise, np.zeros(t.size), False)
    write_campaign(Campaign("spring", "made for a test", (run,)), folder / "tests")
    spring = iso.law("kelvin_voigt", {"k": 2e4, "c": 300.0})
    (folder / "law.toml").write_text(device_section(spring, "made for a test"))
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


def test_every_command_is_tried():
    """The list above has all commands, those of other packages too."""

    def commands(group, before=()):
        for name in group.list_commands(None):
            one = group.get_command(None, name)
            if hasattr(one, "list_commands") and name != "study":
                yield from commands(one, (*before, name))
            else:
                yield " ".join([*before, name])

    tried = {text.partition(" -")[0] for text in COMMANDS}
    missing = [
        name for name in commands(get_command(app))
        if not any(text == name or text.startswith(f"{name} ") for text in tried)
    ]  # fmt: skip
    assert missing == []


def test_a_saved_result_is_replaced_only_on_request(tmp_path):
    """Into an empty folder, beside other files, upon a result, and upon a file of one's own."""
    building = iso.reference_building().on(iso.reference_isolators())
    run = iso.simulate(building, iso.el_centro_1940().cut(0, 0.5), "passive_off")
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "mine.txt").write_text("mine")
    iso.Comparison({"passive_off": run}).save(folder)
    before = content(folder)
    assert folder / "mine.txt" in before and folder / "result.npz" in before
    refused = r"out: contains a saved result \(result.npz\); expected: .* overwrite=True"
    for result in (run, iso.Comparison({"passive_off": run})):
        with pytest.raises(InputError, match=refused):
            result.save(folder)
    assert content(folder) == before
    run.save(folder, overwrite=True)
    assert set(content(folder)) == {*before, folder / "history.nc"}
    other = tmp_path / "other"
    other.mkdir()
    (other / "README.txt").write_text("mine")
    with pytest.raises(InputError, match=r"README.txt: exists; expected: .* overwrite=True"):
        iso.Comparison({"passive_off": run}).save(other)
    assert content(other) == {other / "README.txt": b"mine"} and len(list(other.iterdir())) == 1


@pytest.mark.skipif(sys.platform == "win32", reason="paths of the examples are POSIX")
@pytest.mark.parametrize("number", range(len(COMMANDS)))
def test_whatever_exists_stays_as_it_is(desk, tmp_path, monkeypatch, number):
    """Among all the places and among some of them, drawn at random."""
    random = np.random.default_rng(number)
    command = COMMANDS[number]
    for k, places in enumerate((PLACES, random.permutation(PLACES)[: random.integers(2, 9)])):
        folder = tmp_path / str(k)
        shutil.copytree(desk, folder)
        for place in (*ALWAYS, *places):
            path = folder / place
            # a file where another wants a folder: whichever comes first
            if not any(above.is_file() for above in path.parents) and not path.exists():
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(f"mine: {place}")
        with monkeypatch.context() as patched:
            patched.chdir(folder)
            before = content(folder)
            code = called(*command.split())
        after = content(folder)
        before.pop(folder / "done" / "README.txt")  # an export adds a line to it
        assert {path: after.get(path) for path in before} == before
        assert code in (0, 2)
        hidden = [path for path in set(after) - set(before) if path.name.startswith(".")]
        assert all(path.name == ".lock" for path in hidden)


def test_earlier_results_are_replaced_by_complete_ones_alone(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "old.csv").write_text("1")
    (folder / "figures").mkdir()
    (folder / "figures" / "map.svg").write_text("1")
    write_contents(folder, "Sweep")
    with pytest.raises(KeyboardInterrupt), replace_results(folder, overwrite=True, resume=False):
        folder.mkdir()
        (folder / "half.csv").write_text("2")
        raise KeyboardInterrupt
    assert sorted(path.name for path in folder.iterdir()) == ["README.txt", "figures", "old.csv"]
    own = ("notes.txt", "mine.csv", "new.csv", ".hidden", "thesis/1.txt", "figures/a/map.pdf")
    (folder / "thesis").mkdir()
    (folder / "figures" / "a").mkdir()
    for name in own:
        (folder / name).write_text("mine")
    write_contents(folder, "Sweep")  # as sweep show does
    with replace_results(folder, overwrite=True, resume=False):
        folder.mkdir()
        (folder / "new.csv").write_text("3")
    left = {str(path.relative_to(folder)): text.decode() for path, text in content(folder).items()}
    assert left == dict.fromkeys([*own, "new.csv-2"], "mine") | {"new.csv": "3"}
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    with pytest.raises(InputError, match="is no results folder"):
        with replace_results(folder, overwrite=True, resume=False):
            pass
    with pytest.raises(InputError, match="at most one of them"):
        with replace_results(folder, overwrite=True, resume=True):
            pass
