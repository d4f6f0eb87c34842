"""The command line, as its user sees it: what it prints where, its exit code, what it leaves."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.main import get_command

import isolation_sim
import studies
from isolation_sim import cli
from isolation_sim.io.files import json_text

SHORT = """
[ground]
stop_s = 4.0

[[controller]]
name = "passive_off"

[[controller]]
name = "passive_on"
"""

WARNS = """
import warnings
from controllers import Controller

class Warns(Controller):
    name = "warns"
    def prepare(self, context, trial):
        warnings.warn("the current is a guess")
    def current(self, t, measurement):
        return 1.0
"""

CRITERIA = (
    {
        f"{kind}_{name}"
        for kind in ("peak", "rms")
        for name in (
            "base_displacement_m",
            "floor_acceleration_m_s2",
            "superstructure_acceleration_m_s2",
            "drift_m",
            "base_shear_N",
            "structural_shear_N",
            "isolator_force_N",
        )
    }
    | {f"J{k}" for k in range(1, 10)}
    | {
        "normalised_peak_base_displacement",
        "normalised_peak_drift",
        "normalised_peak_floor_acceleration",
        "normalised_rms_base_displacement",
        "normalised_rms_floor_acceleration",
        "normalised_device_dissipation",
    }
)


@pytest.fixture
def here(tmp_path, monkeypatch):
    """Work in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def call(here, capsys):
    """Run the command line in this process: exit code, standard output, standard error."""

    def run(*arguments):
        with pytest.raises(SystemExit) as ended:
            cli.main([str(argument) for argument in arguments])
        streams = capsys.readouterr()
        return ended.value.code or 0, streams.out, streams.err

    return run


def refused(call, *arguments):
    """Return the one line with which bad input is refused."""
    code, out, err = call(*arguments)
    assert code == 2
    assert out == ""
    assert "Traceback" not in err
    assert err.startswith("isolation-sim: ") and err.endswith("\n") and err.count("\n") == 1
    return err.removeprefix("isolation-sim: ").rstrip("\n")


def test_run_prints_a_table_and_writes_results(here, call):
    (here / "short.toml").write_text(SHORT)
    code, out, err = call("run", "short.toml", "--out", "out")
    assert code == 0
    assert "base displacement, mm" in out and "closure error" in out
    assert out.endswith("results: out\n")
    assert "Traceback" not in err
    names = {path.name for path in (here / "out").iterdir()}
    assert names == {
        "passive_off.nc", "passive_on.nc", "criteria.csv", "criteria.json", "table.txt",
        "scenario.toml", "figures", "report.html", "README.txt", "result.npz",
    }  # fmt: skip
    assert len(list((here / "out" / "figures").iterdir())) == 12


def test_results_reproduce_themselves(here, call):
    (here / "short.toml").write_text(SHORT)
    call("run", "short.toml", "--out", "first", "--no-figures")
    call("run", "first/scenario.toml", "--out", "second", "--no-figures")
    for name in ("criteria.json", "scenario.toml"):
        assert (here / "first" / name).read_text() == (here / "second" / name).read_text()


def test_results_are_never_overwritten(here, call):
    (here / "short.toml").write_text(SHORT)
    for expected in ("short", "short-2"):
        _, out, _ = call("run", "short.toml", "--quiet", "--no-figures")
        assert out == f"results: results/{expected}\n"
    assert sorted(p.name for p in (here / "results").iterdir()) == ["short", "short-2"]


def test_json_is_the_report_and_nothing_else(here, call):
    (here / "short.toml").write_text(SHORT)
    code, out, err = call("run", "short.toml", "--json", "--no-figures")
    assert code == 0
    report = json.loads(out)
    assert set(report) == {"runs", "diverged", "warnings"} and report["diverged"] == []
    assert [run["controller"] for run in report["runs"]] == ["passive_off", "passive_on"]
    for run in report["runs"]:
        assert set(run) == {"controller", "criteria", "energy"}
        assert set(run["criteria"]) == CRITERIA
        assert {"closure_error", "field_work_J"} <= set(run["energy"])
        assert run["energy"]["closure_error"] < 1e-6
    assert "results: results/short" in err


def test_a_run_tells_how_the_predictive_controllers_decisions_went(here, call):
    text = SHORT.replace('name = "passive_on"', 'name = "mpc"\nlabel = "late"\ndeadline = 1e-9')
    (here / "job.toml").write_text(text)
    code, out, _ = call("run", "job.toml", "--no-figures")
    assert code == 0
    assert re.search(r"^late: 200 decisions, 0 failed and 200 late \(the previous plan", out, re.M)
    assert "passive off: " not in out


def test_deformation_beyond_the_tests_is_reported(here, call):
    (here / "strong.toml").write_text(SHORT.replace("stop_s", "scale_factor = 3.0\nstop_s"))
    _, _, err = call("run", "strong.toml", "--quiet", "--no-figures")
    assert re.search(r"warning: isolator deforms further .* 80 mm .* passive off \d+ mm", err)


def test_clamped_commands_are_counted(here, call):
    text = SHORT + '[driver]\nhigh_A = 1.0\n[[controller]]\nname = "constant"\namperes = 2.0\n'
    text += '[simulation]\ncurrent_outside = "clamp"\n'
    (here / "job.toml").write_text(text.replace('[[controller]]\nname = "passive_on"\n', ""))
    _, _, err = call("run", "job.toml", "--quiet", "--no-figures")
    assert "warning: constant: 1 commands were clamped to the supply's limits" in err


def test_divergence_keeps_the_other_results(here, call, monkeypatch):
    from isolation_sim.errors import Diverged
    from isolation_sim.scenario import Job

    genuine = Job.run

    def run(job, label):
        if label == "passive_on":
            raise Diverged("short.toml: controller 'passive_on': the run diverged at t = 1 s")
        return genuine(job, label)

    monkeypatch.setattr(Job, "run", run)
    (here / "short.toml").write_text(SHORT)
    code, out, err = call("run", "short.toml", "--json", "--no-figures")
    assert code == 1
    report = json.loads(out)
    assert [each["controller"] for each in report["runs"]] == ["passive_off"]
    reason = "short.toml: controller 'passive_on': the run diverged at t = 1 s"
    assert report["diverged"] == [{"controller": "passive_on", "reason": reason}]
    results = here / "results" / "short"
    assert json.loads((results / "criteria.json").read_text()) == report
    assert f"passive on has no result: {reason}" in (results / "table.txt").read_text()
    # as data of the page
    assert "passive on has no result: short.toml" in (results / "report.html").read_text()
    assert "isolation-sim: short.toml: controller 'passive_on': the run diverged at t = 1 s" in err
    assert (here / "results" / "short" / "passive_off.nc").exists()


@pytest.mark.parametrize(
    ("current", "reason", "error"),
    [
        (
            "1 / 0",
            "Boom failed at t = 1 s: ZeroDivisionError: division by zero (boom.py:6)",
            "ControllerError",
        ),
        ("99.0", "Boom: current 99 A at t = 1 s is outside 0 to 5.203 A", "RefusedCurrent"),
        ("'3'", "Boom: current() gave '3' at t = 1 s", "RefusedCurrent"),
    ],
)
def test_an_error_of_a_controller_keeps_the_other_results(here, call, current, reason, error):
    (here / "boom.py").write_text(
        "from controllers import Controller\n\n\nclass Boom(Controller):\n"
        f"    def current(self, t, m):\n        return {current} if t >= 1 else 0.0\n"
    )
    (here / "job.toml").write_text(SHORT + '[[controller]]\nname = "boom.py:Boom"\n')
    code, _, err = call("run", "job.toml", "--no-figures")
    assert code == 1 and "Traceback" not in err
    assert reason in err
    assert (here / "results" / "job" / "passive_off.nc").exists()
    saved = isolation_sim.load(here / "results" / "job").diverged
    assert [type(each).__name__ for each in saved.values()] == [error]


def test_divergence_of_all_is_one_line_and_exit_code_1(here, call):
    # a kick that no isolator was made for
    text = SHORT.replace("stop_s", "scale_factor = 1e4\nstop_s")
    (here / "job.toml").write_text(text)
    code, out, err = call("run", "job.toml")
    assert (code, out) == (1, "")
    assert re.fullmatch(
        r"isolation-sim: job\.toml: controller 'passive_off': the run diverged at t = .*\n", err
    )
    assert [p.name for p in here.iterdir()] == ["job.toml"]


def test_new_then_run(here, call):
    code, out, _ = call("new", "mine.toml")
    assert (code, out) == (0, "wrote mine.toml; run it with: isolation-sim run mine.toml\n")
    text = (here / "mine.toml").read_text()
    (here / "mine.toml").write_text(text.replace("# stop_s =", "stop_s = 4.0"))
    code, out, _ = call("run", "mine.toml", "--no-figures")
    assert code == 0
    assert out.endswith("results: results/mine\n")
    assert (here / "results" / "mine" / "clipped_lqr.nc").exists()


def test_new_does_not_overwrite_without_force(here, call):
    (here / "scenario.toml").write_text("mine")
    line = refused(call, "new")
    assert line == "scenario.toml: exists; expected: a new name, or --force to replace it"
    assert (here / "scenario.toml").read_text() == "mine"
    assert call("new", "--force")[0] == 0
    assert "[ground]" in (here / "scenario.toml").read_text()


@pytest.mark.parametrize(
    ("subject", "shown"),
    [
        ("laws", "strain_stiffening"),
        ("sets", "0.2T_0.1mm_20Hz"),
        ("controllers", "clipped_lqr"),
        ("records", "el_centro_1940_ns"),
        ("effects", "effect"),
        ("structures", "reference"),
        ("studies", "papers"),
    ],
)
def test_list(call, subject, shown):
    code, out, err = call("list", subject)
    assert (code, err) == (0, "")
    assert shown in out


def test_version(call):
    assert call("--version") == (0, f"isolation-sim {isolation_sim.__version__}\n", "")


CSV = "time_s,ground_acceleration_m_s2\n0.00,0.1\n0.01,-0.2\n0.02,0.1\n"
BAD_INPUT = {
    "missing scenario": (None, {}, "job.toml: no such file; expected: a scenario"),
    "no motion": (
        "[ground]\nscale_factor = 0",
        {},
        "job.toml: ground: the ground acceleration is 0 at all times; expected: ",
    ),
    "missing time": (
        '[ground]\nfile = "motion.csv"',
        {"motion.csv": CSV.replace("time_s", "t")},
        "job.toml: ground: {here}/motion.csv, line 1: given columns 't, ground_acceleration_m_s2'; "
        "expected: a column time_s among them",
    ),
    "missing column": (
        '[ground]\nfile = "motion.csv"\ncolumn = "ground_acceleration_g"',
        {"motion.csv": CSV},
        "job.toml: ground: {here}/motion.csv, line 1, column: given "
        "'ground_acceleration_g'; did you mean 'ground_acceleration_m_s2'? expected: ",
    ),
    "wrong unit in a column": (
        '[ground]\nfile = "motion.csv"',
        {"motion.csv": CSV.replace("_m_s2", "_yd_s2")},
        "job.toml: ground: {here}/motion.csv, line 1: given columns 'time_s, "
        "ground_acceleration_yd_s2'; expected: an acceleration column whose name ends in a unit: ",
    ),
    "NaN": (
        '[ground]\nfile = "motion.csv"',
        {"motion.csv": CSV.replace("-0.2", "nan")},
        "job.toml: ground: {here}/motion.csv, line 3, column ground_acceleration_m_s2: given "
        "'nan'; expected: a finite number",
    ),
    "time that does not increase": (
        '[ground]\nfile = "motion.csv"',
        {"motion.csv": CSV.replace("0.02", "0.01")},
        "job.toml: ground: {here}/motion.csv, column time_s, line 4: given 0.01 after 0.01; "
        "expected: times that increase",
    ),
    "current out of range": (
        '[[controller]]\nname = "constant"\namperes = 6.0',
        {},
        "job.toml: controller 'constant': constant: current 6 A at t = 0 s is outside 0 to 5.203 A",
    ),
    "supply out of range": (
        "[driver]\nhigh_A = 6.0",
        {},
        "job.toml: controller 'passive_off': coil driver: high 6.0 A is outside 0 to 5.203 A",
    ),
    "noise of nothing": (
        '[sensors]\nnoise = { velocity_mm_s = 1.0 }\n[[controller]]\nname = "on_off"',
        {},
        "job.toml: controller 'on_off': sensors: noise: given 'velocity_mm_s'; did "
        "you mean 'velocity_m_s'? expected: displacement_m, velocity_m_s, ",
    ),
}


@pytest.mark.parametrize(("text", "files", "message"), BAD_INPUT.values(), ids=list(BAD_INPUT))
def test_bad_input_is_one_line(here, call, text, files, message):
    settings = dict(files)
    if text is not None:
        settings["job.toml"] = text
    for name, content in settings.items():
        (here / name).write_text(content)
    assert refused(call, "run", "job.toml").startswith(message.format(here=here))
    # nothing lost, nothing left behind
    assert {p.name: p.read_text() for p in here.iterdir()} == settings


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("run --out table.csv", "table.csv: a file; expected: a new folder"),
        ("run folder", "folder: cannot be read (Is a directory)"),
        ("run latin.toml", "latin.toml: cannot be read (not UTF-8)"),
        ("run table.csv", "table.csv: not TOML"),
        ("new folder --force", "folder: a folder; expected: a file"),
        ("new nowhere/mine.toml", "nowhere/mine.toml: No such file or directory"),
        ("fit nowhere --law linear", "nowhere: a folder that does not exist"),
        ("fit folder --law linear", "folder: no campaign.toml in it"),
        ("fit table.csv --law linear", "table.csv: a file; expected: a folder"),
        ("fit folder --law linear --out a.html", "--out a.html: is also the file of the report"),
        ("diagnose folder", "folder: no campaign.toml in it"),
        ("diagnose table.csv", "table.csv: columns 'a,b'; expected:"),
        ("diagnose folder --out table.csv/a", "table.csv/a: results cannot be written there"),
        ("cite folder", "folder: holds no result"),
        ("cite latin.toml", "latin.toml: cannot be read (not UTF-8)"),
        ("sweep folder", "folder: cannot be read (Is a directory)"),
        ("sweep plan.toml --out table.csv", "table.csv: a file; expected: a new folder"),
        ("sweep show folder", "folder: no sweep there"),
        ("sweep show table.csv", "table.csv: no sweep there"),
        ("sweep new folder --force", "folder: a folder; expected: a file"),
        ("study level_and_period --out table.csv/a", "table.csv/a: results cannot be written"),
    ],
)
def test_the_wrong_thing_in_a_place_is_reported_in_one_line(here, call, arguments, message):
    (here / "folder").mkdir()
    (here / "latin.toml").write_bytes(b'name = "caf\xe9"\n')
    (here / "table.csv").write_text("a,b\n1,2\n")
    (here / "plan.toml").write_text('[[vary]]\nfield = "isolator.count"\nvalues = [1.0]\n')
    before = set(here.rglob("*"))
    assert refused(call, *arguments.split()).startswith(message)
    assert set(here.rglob("*")) == before


def test_results_that_cannot_be_written_are_refused_before_the_work(here, call):
    (here / "file").write_text("")
    line = refused(call, "run", "--out", "file/out")
    assert line.startswith("file/out: results cannot be written there")


def test_the_installed_command(tmp_path):
    environment = os.environ | {"COLUMNS": "100"}
    done = subprocess.run(
        [sys.executable, "-m", "isolation_sim", "run", "none.toml"],
        cwd=tmp_path, env=environment, capture_output=True, text=True, check=False,
        stdin=subprocess.DEVNULL,
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("isolation-sim: none.toml: no such file")
    assert done.stderr.count("\n") == 1


def test_a_run_leads_to_its_report(here, call):
    (here / "short.toml").write_text(SHORT)
    _, out, _ = call("run", "short.toml", "--no-figures")
    assert "report: results/short/report.html\n" in out
    report = (here / "results" / "short" / "report.html").read_text()
    assert "stop_s = 4.0" in report  # the scenario, to run it again


def commands(group, above=()):
    """Paths of all commands, groups themselves included."""
    for name, command in group.commands.items():
        if not command.hidden:
            yield (*above, name)
            yield from commands(command, (*above, name)) if hasattr(command, "commands") else ()


def parsed(command, arguments):
    """Let a command understand what follows it, and do nothing; return the path taken."""
    context = command.make_context("isolation-sim", arguments)
    if not hasattr(command, "commands"):
        return ()
    name, inner, rest = command.resolve_command(context, [*context._protected_args, *context.args])
    return (name, *parsed(inner, rest))


@pytest.mark.parametrize("path", list(commands(get_command(cli.app))), ids=" ".join)
def test_help_shows_commands_that_are_understood(call, monkeypatch, path):
    monkeypatch.setenv("COLUMNS", "120")
    code, out, err = call(*path, "--help")
    assert (code, err) == (0, "")
    shown = out[out.index("Examples:") :].splitlines()[1:]
    assert shown
    for line in shown:
        program, *arguments = shlex.split(line.split(">")[0])
        assert program == "isolation-sim"
        assert parsed(get_command(cli.app), arguments)[0] == path[0]


@pytest.mark.parametrize("subject", ["laws", "controllers", "records", "structures"])
def test_lists_as_json(call, subject):
    code, out, err = call("list", subject, "--json")
    assert (code, err) == (0, "")
    entries = json.loads(out)
    assert len({next(iter(entry.values())) for entry in entries}) == len(entries) > 0


@pytest.mark.parametrize(
    ("value", "message"), [(["rnu"], "Did you mean 'run'?"), (["run", "--jsno"], "--json")]
)
def test_a_mistyped_word_is_answered_with_the_right_one(call, value, message):
    code, out, err = call(*value)
    assert (code, out) == (2, "")
    assert message in err


def test_shells_complete_commands(here):
    environment = os.environ | {
        "_ISOLATION_SIM_COMPLETE": "complete_bash", "COMP_WORDS": "isolation-sim li",
        "COMP_CWORD": "1",
    }  # fmt: skip
    program = "import sys; sys.argv[0] = 'isolation-sim'; import isolation_sim.cli as c; c.main()"
    done = subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    assert done.stdout.split() == ["list"]


def test_a_warning_is_one_line_without_a_place_in_the_package(here, call):
    """What Python code is warned of at its own line has no line on the command line."""
    (here / "mine.py").write_text(WARNS)
    (here / "short.toml").write_text(SHORT.replace('"passive_on"', '"mine.py:Warns"'))
    code, _, err = call("run", "short.toml", "--no-figures", "--quiet")
    assert code == 0
    assert "warning: the current is a guess\n" in err
    assert "UserWarning" not in err and "mine.py" not in err


def test_studies_have_the_options_of_other_commands(call):
    _, out, _ = call("study", "--help")
    assert "completion" not in out and "--help" in out


def test_no_colours_where_nobody_looks(here, call):
    (here / "short.toml").write_text(SHORT)
    _, out, err = call("run", "short.toml", "--no-figures")
    assert "\x1b" not in out + err


def test_a_degree_of_the_current_is_refused_for_a_building_record(here, call):
    (here / "record.csv").write_text("time_s,ground_acceleration_m_s2,base_acceleration_m_s2\n")
    (here / "short.toml").write_text(SHORT)
    arguments = ("record.csv", "--scenario", "short.toml", "--current-degree", "1")
    code, out, err = call("diagnose", *arguments)
    assert (code, out) == (2, "")
    assert re.match("isolation-sim: record.csv: current degree: given 1, which has no meaning", err)
    assert not (here / "results").exists()


def test_json_has_no_nan():
    """Every command writes JSON by one helper, which writes null for NaN and infinity."""
    settings = {"a": [1.5, np.nan, (np.inf, np.float64("nan"))], "b": {"c": -np.inf, "d": "NaN"}}
    read = json.loads(json_text(settings), parse_constant=pytest.fail)
    assert read == {"a": [1.5, None, [None, None]], "b": {"c": None, "d": "NaN"}}
    commands = [
        *Path(cli.__file__).parent.glob("*.py"),
        Path(studies.__file__).with_name("command.py"),
    ]
    assert [path.name for path in commands if "json.dumps" in path.read_text("utf-8")] == []
