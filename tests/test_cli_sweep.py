"""``isolation-sim sweep`` as a user types it."""

import json

import pytest

from isolation_sim import progress_lines
from isolation_sim.cli import main

PLAN = """
[scenario.ground]
stop_s = 2.0
[[scenario.controller]]
name = "passive_off"
[[scenario.controller]]
name = "on_off"
[[vary]]
field = "ground.scale_factor"
label = "scale"
values = [0.5, 1.0, {last}]
[[vary]]
field = "isolator.count"
low = 0.8
high = 1.2
count = 2
"""


@pytest.fixture
def plan(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "plan.toml"
    path.write_text(PLAN.format(last=2.0))
    return path


def command(capsys, *arguments):
    """Exit code, standard output and standard error."""
    code = 0
    try:
        main(list(arguments))
    except SystemExit as stop:
        code = int(stop.code or 0)
    return code, *capsys.readouterr()


def test_a_plan_is_announced_run_and_shown(plan, capsys):
    code, out, _ = command(capsys, "sweep", "plan.toml", "--workers", "1", "--export", "mat")
    assert code == 0
    assert "load results.mat" in (plan.parent / "results/plan/README.txt").read_text()
    assert (plan.parent / "results/plan/results.mat").stat().st_size > 1000
    assert out.startswith("12 runs (6 cases): about ") and " on 1 process, 0." in out
    assert out.endswith("report: results/plan/report.html\nresults: results/plan\n")
    assert "plan: medians over 6 cases" in out
    page = (plan.parent / "results/plan/report.html").read_text()
    code, out, _ = command(capsys, "sweep", "show", "results/plan")
    assert code == 0 and "report.html (unchanged; --force replaces it)" in out
    assert (plan.parent / "results/plan/report.html").read_text() == page
    code, out, _ = command(
        capsys, "sweep", "show", "results/plan", "--criterion", "rms_drift_m", "--csv", "t.csv",
        "--force",
    )  # fmt: skip
    assert code == 0
    assert "plan: medians over 6 cases" in out and "lowest RMS storey drift" in out
    assert command(capsys, "sweep", "show", "results/plan", "--quiet")[:2] == (0, "")
    names = ("comparison", "map")
    for name in names:
        for ending in ("svg", "png"):
            assert (plan.parent / f"results/plan/figures/{name}.{ending}").stat().st_size > 5000
    assert "report: results/plan/report.html" in out
    assert "RMS storey drift" in (plan.parent / "results/plan/report.html").read_text()
    assert "report.html" in (plan.parent / "results/plan/README.txt").read_text()
    assert (plan.parent / "t.csv").read_text().startswith("case,scale,")


def test_options_may_stand_before_the_plan(plan, capsys):
    code, out, err = command(capsys, "sweep", "--workers", "1", "--json", "plan.toml")
    report = json.loads(out)
    assert code == 0
    assert (report["runs"], report["status"]) == (12, {"ok": 12})
    assert [f"warning: {each}" for each in report["warnings"]] == err.splitlines()[:2]
    assert report["folder"] == "results/plan" and "results: results/plan" in err


def test_progress_in_a_log_is_a_line_from_time_to_time(plan, capsys, monkeypatch):
    sweep = "sweep", "plan.toml", "--workers", "1", "--overwrite"
    assert "running" not in command(capsys, *sweep)[2]
    monkeypatch.setattr(progress_lines, "BETWEEN_LINES", 0.0)
    lines = [line for line in command(capsys, *sweep)[2].splitlines() if "running" in line]
    assert lines[-1].startswith("running: 12 of 12, ")
    assert "running" not in command(capsys, *sweep, "--quiet")[2]


def test_quiet_says_where_the_results_are(plan, capsys):
    code, out, err = command(capsys, "sweep", "run", "plan.toml", "--workers", "1", "--quiet")
    assert (code, out) == (0, "results: results/plan\n")
    assert err.startswith("warning: 6 of 12 runs deform an isolator or element further than")
    assert "12 of 12 runs still move at the end" in err and len(err.splitlines()) == 2


def test_a_failing_case_is_reported_and_ends_with_one(plan, capsys):
    plan.write_text(PLAN.format(last=1e4))
    code, out, err = command(capsys, "sweep", "plan.toml", "--workers", "1", "--quiet")
    assert (code, out) == (1, "results: results/plan\n")
    assert "4 of 12 runs failed:" in err and "case 4" in err and "diverged: the run" in err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["show", "results/plan", "--best", "0"], "best: given 0; expected: 1 or more"),
        (["show", "results/plan", "--figures", "plan.toml"], "plan.toml: a file; expected:"),
        (["show", "results/plan", "--csv", "results", "--no-draw"], "results: a folder; expected"),
        (["show", "results/plan", "--criterion", "rms_drft_m"], "did you mean 'rms_drift_m'"),
    ],
)
def test_mistakes_are_reported_in_one_line(plan, capsys, arguments, said):
    if "results/plan" in arguments:
        command(capsys, "sweep", "plan.toml", "--workers", "1", "--quiet")
    code, _, err = command(capsys, "sweep", *arguments)
    assert code == 2
    assert said in err and len(err.splitlines()) == 1


def test_resume_and_a_plan_that_changed(plan, capsys):
    command(capsys, "sweep", "plan.toml", "--workers", "1", "--quiet")
    code, _, err = command(capsys, "sweep", "plan.toml", "--workers", "1")
    assert code == 2 and "--resume" in err
    code, out, _ = command(capsys, "sweep", "plan.toml", "--resume")
    assert code == 0 and out.endswith("results: results/plan\n")
    plan.write_text(PLAN.format(last=3.0))
    code, _, err = command(capsys, "sweep", "plan.toml", "--resume")
    assert code == 2 and "vary[0].values[2] was 2.0, is 3.0" in err
