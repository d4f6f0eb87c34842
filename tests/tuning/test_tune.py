"""Tuning: a known optimum, a search that goes on after a kill, input refused in one line."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import controllers
import isolation_sim as iso
from controllers import setting
from controllers.settings import Number, SearchRange
from ground_motions import el_centro_1940, write_csv
from isolation_sim.cli import main
from isolation_sim.scenario import Scenario
from isolation_sim.tuning.trials import Trials
from isolation_sim.tuning.tune import _motion_sets
from isolation_sim.tuning.tuning import MeanInterval

pytestmark = pytest.mark.usefixtures("no_drawing")

EXAMPLE = Path(__file__).resolve().parents[2] / "docs" / "examples" / "outwards.py"
CRITERIA = {"peak_base_displacement_m": 1.0, "peak_floor_acceleration_m_s2": 0.4}
"""Weights under which neither end of the range of current is best."""
PLANT = "[driver]\nlag_s = 0.05\nhigh_A = 3.0\n[ground]\nstop_s = 8.0\n"


@pytest.fixture(scope="module")
def scenario():
    return iso.Scenario.from_toml(PLANT)


@pytest.fixture(scope="module")
def strong():
    """The strong part of El Centro, and another motion to judge by."""
    record = el_centro_1940()
    return [record.cut(0.0, 8.0)], [record.cut(0.0, 6.0)]


@pytest.fixture(scope="module")
def tuned(scenario, strong, tmp_path_factory):
    """A constant current, tuned on one motion."""
    folder = tmp_path_factory.mktemp("tuned") / "out"
    return tune_constant(scenario, strong, folder), folder


def tune_constant(scenario, strong, folder, **options):
    settings = {"motions": strong[0], "unseen": strong[1], "criteria": CRITERIA} | options
    return iso.tune("constant", scenario, evaluations=50, out=folder, workers=1, **settings)


def weighted(scenario, record, current):
    """The criterion of one run by ``simulate``, without the tuning's own code."""
    job = scenario.build()
    run, off = (
        iso.simulate(job.isolated, record, iso.controller("constant", amperes=i), **job.options)
        for i in (current, 0.0)
    )
    return sum(weight * run.criteria[key] / off.criteria[key] for key, weight in CRITERIA.items())


def test_a_constant_current_is_tuned_to_the_least_of_a_scan(scenario, strong, tuned):
    tuning, _ = tuned
    currents = np.linspace(0.0, 3.0, 25)
    scan = [weighted(scenario, strong[0][0], i) for i in currents]
    best = int(np.argmin(scan))
    assert 0 < best < 24, "the optimum must be inside"
    result = tuning.settings["amperes"]
    assert currents[best - 1] < result < currents[best + 1]
    (seen, unseen) = tuning.outcomes
    assert seen.constant[0] <= scan[best] + 1e-9
    assert seen.current[0] == pytest.approx(result, abs=0.05)
    # one motion's best constant current is what it is measured by
    assert seen.after[0] == pytest.approx(0.0, abs=1e-3)
    start = weighted(scenario, strong[0][0], 1.5)
    assert seen.before[0] == pytest.approx(start - seen.constant[0], abs=1e-9)
    after = weighted(scenario, strong[1][0], result)
    assert unseen.after[0] == pytest.approx(after - unseen.constant[0], abs=1e-9)


def test_the_sensitivity_is_that_of_runs_over_the_range(scenario, strong, tuned):
    values, scores = tuned[0].sensitivity["amperes"]
    assert values == [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]
    least = tuned[0].outcomes[0].constant[0]
    for k in (0, 4):
        expected = weighted(scenario, strong[0][0], values[k]) - least
        assert scores[k] == pytest.approx(expected, abs=1e-9)


def test_an_interrupted_search_goes_on_to_the_same_bits(scenario, strong, tuned, monkeypatch):
    whole, folder = tuned
    other = folder.parent / "interrupted"

    def kill(what, done):
        if what == "searching" and done == 8:
            (other / "tuning.json").rename(other / "kept.json")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        tune_constant(scenario, strong, other, progress=kill)
    # the state of a generation is there before anybody is told of the next one
    state = json.loads((other / "kept.json").read_text())
    shutil.copy(other / "kept.json", other / "tuning.json")
    selected = len(state["trials"])
    assert 0 < selected < len(whole.trials) and state["outcomes"] == []
    run = []
    genuine = Trials.scores
    monkeypatch.setattr(
        Trials, "scores", lambda self, each: run.append(len(each)) or genuine(self, each)
    )
    resumed = tune_constant(scenario, strong, other, resume=True)
    assert resumed == whole
    assert sum(run) == len(whole.trials) - selected + 7 + 2 * 2
    for name in ("tuning.json", "controller.toml", "report.html"):
        assert (other / name).read_bytes() == (folder / name).read_bytes()
    with pytest.raises(iso.InputError, match=r"seed differs from the tuning begun there; expected"):
        tune_constant(scenario, strong, other, resume=True, seed=1)
    with pytest.raises(iso.InputError, match=r"is not empty; .* --resume"):
        tune_constant(scenario, strong, other)
    # before anything is read
    with pytest.raises(iso.InputError, match="is not empty"):
        iso.tune("constant", "missing.toml", out=other)


def test_what_was_saved_is_read_again_and_runs(scenario, tuned):
    tuning, folder = tuned
    assert iso.Tuning.read(folder) == tuning
    text = (folder / "controller.toml").read_text()
    assert "isolation-sim tune constant" in text and "--evaluations 50 --seed 0" in text
    (entry,) = iso.Scenario.from_toml(text).controller
    assert entry.build().amperes == tuning.settings["amperes"]
    report = (folder / "report.html").read_text()
    for words in ("Progress of the search", "Current to hold", "el_centro_1940_ns"):
        assert words in report


def test_a_controller_of_a_file_is_tuned_from_the_command_line(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    shutil.copy(EXAMPLE, tmp_path)
    (tmp_path / "plant.toml").write_text(PLANT.replace("8.0", "3.0"))
    (tmp_path / "records").mkdir()
    write_csv(el_centro_1940().cut(1.0, 4.0), tmp_path / "records" / "short.csv")
    with pytest.raises(SystemExit, match="0"):
        main([
        "tune", "outwards.py:Outwards", "--scenario", "plant.toml", "--motions", "records",
        "--unseen", "scenario", "--pga-g", "0.3", "--evaluations", "9", "--workers", "1", "--json",
        "--fix", "highest=2.0",
        ])  # fmt: skip
    # one motion has no interval, and JSON has no NaN
    report = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    gain = report["outcomes"][0]["gain"]
    assert (gain["low"], gain["high"]) == (None, None) and report["outcomes"][0]["count"] == 1
    state = (tmp_path / "results/tune-Outwards/tuning.json").read_text()
    json.loads(state, parse_constant=pytest.fail)
    assert report["trials"] == 9 and set(report["settings"]) <= {"highest", "full_speed"}
    assert [one["motions"] for one in report["outcomes"]] == ["records", "unseen: scenario"]
    assert report["outcomes"][0]["gain"]["mean"] >= 0
    toml = (tmp_path / "results/tune-Outwards/controller.toml").read_text()
    assert "highest = 2.0" in toml and 'outwards.py" = "' in toml


@pytest.mark.slow
def test_predictive_control_is_tuned_by_its_declared_ranges(scenario, strong):
    """A setting whose default depends on the preview time starts in the middle of its range."""
    result = iso.tune(
        "mpc", scenario, motions=[strong[0][0].cut(1.0, 3.0)], unseen=[strong[0][0].cut(1.0, 2.5)],
        settings=("regret", "change"), evaluations=9, workers=1,
    )  # fmt: skip
    assert len(result.trials) == 9 and result.best.mean < result.trials[0].mean
    assert iso.controller("mpc", **result.settings).change == result.settings["change"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("clipped_lqx", "did you mean 'clipped_lqr'? expected: "),
        ("passive_off", "passive_off: no setting has a search range; expected: "),
        ("fuzzy --setting fats", "did you mean 'fast'? expected: fast, large_deformation"),
        ("fuzzy --fix fast=1 --fix large_deformation=1", "all settings are fixed; expected: one"),
        ("fuzzy --fix fast=-1", "fuzzy: fast: given -1; expected: a number above 0, in m/s"),
        ("fuzzy --fix fast", "--fix fast: expected: a name and a value, such as rule=skyhook"),
        ("fuzzy --criterion peak_drift", "--criterion peak_drift: expected: a name and a value"),
        ("fuzzy --criterion peak_drift_m=-1", "expected: finite weights above 0 by criterion"),
        ("fuzzy --criterion peak_drift_m=big", "--criterion peak_drift_m=big: expected: a number"),
        ("fuzzy --criterion peak_drit_m=1", "did you mean 'peak_drift_m'? expected: "),
        ("fuzzy --motions mixture:0", "motions: given mixture:0; expected: mixture, mixture:COUNT"),
        ("fuzzy --motions nowhere", "motions: given nowhere; expected: mixture, mixture:COUNT"),
        ("fuzzy --unseen empty", "empty: given no file of a record; expected: files"),
        ("fuzzy --motions scenario --unseen scenario", "given those tuned on; expected: others"),
        ("fuzzy --workers 0", "workers: given 0; expected: a whole number, 1 or more"),
        ("fuzzy --evaluations 0", "evaluations: given 0; expected: a whole number, 1 or more"),
        ("fuzzy --out empty/../file", "expected: a new folder"),
    ],
)
def test_input_that_cannot_be_used_is_refused_in_a_line(
    words, message, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    (tmp_path / "file").write_text("")
    (tmp_path / "short.toml").write_text(PLANT.replace("8.0", "2.0"))
    values = ["tune", *words.split(), "--scenario", "short.toml"]
    values += [] if "--motions" in words else ["--motions", "scenario"]
    with pytest.raises(SystemExit) as stop:
        main(values)
    shown = capsys.readouterr()
    assert stop.value.code == 2
    assert message in shown.err and shown.err.count("\n") == 1 and "Traceback" not in shown.err
    assert not (tmp_path / "results").exists()  # the mended command finds a free folder


def test_wrong_types_are_refused_with_what_is_accepted(strong):
    class Own(controllers.Controller):
        pass

    accepted = r"expected: a name, a place such as my_controllers.py:Outwards, or the name of a cl"
    for wrong, shown in ((Own, "the class Own"), (Own(), "an Own")):
        with pytest.raises(iso.InputError, match=f"name: given {shown}; {accepted}"):
            iso.tune(wrong)
    with pytest.raises(iso.InputError, match=(
        r"motions: given 3; expected: mixture, mixture:COUNT, scenario, a folder of ground "
        r"motions, a record, or records$"
    )):  # fmt: skip
        iso.tune("fuzzy", motions=3)
    with pytest.raises(iso.InputError, match=r"motions\[1\]: given 3; expected: a Record"):
        iso.tune("fuzzy", motions=[strong[0][0], 3])


def test_a_bound_and_a_single_motion_are_said(scenario, strong, tmp_path):
    """Floor acceleration is least without current, the lower bound."""
    computed = iso.tune(
        "constant", scenario, motions=strong[0][0], unseen=strong[1][0], evaluations=50,
        criteria={"peak_floor_acceleration_m_s2": 1.0}, out=tmp_path / "out", workers=1,
    )  # fmt: skip
    assert computed.settings["amperes"] == 0.0 and computed.outcomes[0].name == "1 record"
    text = (
        "amperes = 0 is at the lower bound of its search range, 0 to 3: the optimum may lie beyond "
        "it."
    )
    assert text in str(computed) and f"# {text}\n" in (tmp_path / "out/controller.toml").read_text()
    assert text in (tmp_path / "out/report.html").read_text()
    assert "one motion gives no interval" in str(computed)
    for sentence in computed.verdict()[-2:]:
        assert "one motion: no interval" in sentence and "significantly" not in sentence


def test_an_optimum_inside_is_not_at_a_bound(tuned):
    assert tuned[0].at_bounds() == []
    assert "converged" not in " ".join(tuned[0].verdict())


def test_a_search_that_one_setting_alone_improves_has_not_converged(tuned):
    better = tuned[0].best.mean - 0.1
    short = replace(tuned[0], sensitivity={"amperes": ([0.5, 1.0], [better, better + 0.2])})
    assert f"amperes = 0.5 alone has a mean score of {better:+.3f}" in " ".join(short.verdict())


def test_a_search_of_fewer_evaluations_than_a_generation_is_told(tuned):
    short = replace(tuned[0], trials=tuned[0].trials[:1])
    assert short.verdict()[0].startswith("Only the initial controller was tried: give the search")
    assert "at least 9 evaluations" in short.verdict()[0]


def test_a_mean_that_is_rounded_to_zero_has_no_sign_of_its_own():
    assert str(MeanInterval(-1e-5, -2e-4, 0.25)) == "+0.000 (+0.000 to +0.250)"


def test_a_mixture_of_unseen_motions_has_its_full_name(scenario):
    job, unseen = scenario.build(), {"mixture:2": "mixture:2"}
    sets = _motion_sets("mixture:4", unseen, job, seed=3, pga_g=None)
    assert list(sets) == ["mixture of 4 motions, seed 6", "unseen: mixture of 2 motions, seed 7"]


class TooMuch(controllers.Controller):
    """Asks for more current than the supply has."""

    more: float = setting(1.0, "beyond the limit", Number(above=0), "A", SearchRange(0.5, 2.0))

    def current(self, t, measurement):
        return 3.0 + self.more


@pytest.mark.slow
def test_processes_run_plain_python_to_the_same_bits(scenario, strong):
    tuned = [
        iso.tune(f"{EXAMPLE}:Outwards", scenario, motions=[strong[1][0].cut(0.0, 3.0)],
                 unseen=[strong[1][0].cut(0.0, 2.5)], evaluations=9, workers=workers)
        for workers in (1, 2)
    ]  # fmt: skip
    assert tuned[0] == tuned[1] and len(tuned[0].trials) == 9


def test_currents_without_a_limit_leave_no_folder(tmp_path, strong):
    plant = Scenario.from_toml("""
    [isolator]
    law = "linear"
    parameters = { k = [2e4, 3e3] }
    length_scale = 10.0
    force_scale = 3000.0
    """)
    with pytest.raises(iso.InputError, match="nothing says how high the current of coil 0 may be"):
        iso.tune("fuzzy", plant, motions=strong[0], unseen=strong[1], out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_controller_that_always_fails_says_why(scenario, strong):
    place = f"{__file__}:TooMuch"
    with pytest.raises(
        iso.InputError, match=r"every run fails; the first reason: TooMuch: current 4 A .* out"
    ):
        iso.tune(place, scenario, motions=strong[0], unseen=strong[1], workers=1)
