"""Suites of records: every record under every controller, statistics, resume, command line."""

import json

import numpy as np
import pandas as pd
import pytest

import isolation_sim as iso
from ground_motions import (
    STANDARD_GRAVITY,
    Record,
    asce7_22_two_period,
    el_centro_1940,
    read_csv,
    response_spectrum,
    write_csv,
)
from isolation_sim import progress_lines
from isolation_sim.cli import main
from isolation_sim.errors import InputError
from isolation_sim.io.results_folder import is_results
from isolation_sim.reports.suite_figures import spectra_panel
from isolation_sim.reports.suite_tables import statistics_table, verdict
from isolation_sim.scenario import Scenario
from isolation_sim.simulation.validity import _counted
from isolation_sim.structures import plan_building, with_vertical_motion
from isolation_sim.structures.modes import translational_period
from isolation_sim.sweeps.suites import Suite, run_suite
from isolation_sim.sweeps.suites.prepare import prepare

pytestmark = pytest.mark.usefixtures("no_drawing")

SCENARIO = """
name = "three"
[ground]
folder = "records"
rule = "en1998_1_2004"
isolated_period_s = 1.0
target = { kind = "en1998_1_2004", a_g_m_s2 = 1.0, ground = "B" }
[[controller]]
name = "passive_off"
[[controller]]
name = "constant"
amperes = 1.0
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Three records: one with two components, two with one."""
    place = tmp_path_factory.mktemp("suite")
    (place / "records").mkdir()
    whole = el_centro_1940()
    first, second = whole.cut(0.0, 5.0), whole.cut(4.0, 9.0)
    write_csv(whole.cut(1.0, 6.0), place / "records" / "b.csv")
    write_csv(whole.cut(0.0, 4.0).scaled(2.0), place / "records" / "c.csv")
    rows = [f"{t},{a},{b}" for t, a, b in zip(first.time, first.acceleration,
                                              second.acceleration, strict=True)]  # fmt: skip
    (place / "records" / "a.csv").write_text("\n".join(["time_s,x_m_s2,y_m_s2", *rows]))
    (place / "three.toml").write_text(SCENARIO)
    return place


@pytest.fixture(scope="module")
def suite(folder):
    return run_suite(folder / "three.toml", folder / "out", workers=1)


def test_the_tables_are_exported(suite, tmp_path):
    path = iso.export_results(suite.folder, "xlsx", tmp_path / "suite.xlsx")
    sheets = pd.read_excel(path, sheet_name=None)
    assert {"runs", "statistics"} <= set(sheets)
    peak = "peak_base_displacement_m"
    np.testing.assert_allclose(sheets["runs"][peak], suite.table[peak], rtol=1e-12)


def test_a_record_that_cannot_be_read_is_told_or_left_out(tmp_path, capsys):
    (tmp_path / "records").mkdir()
    motion = el_centro_1940().cut(1.0, 4.0)
    for name in "ab":
        write_csv(motion, tmp_path / "records" / f"{name}.csv")
    (tmp_path / "records" / "bad.AT2").write_text("UNITS OF G\n")
    text = '[ground]\nfolder = "records"\n[[controller]]\nname = "passive_off"\n'
    (tmp_path / "s.toml").write_text(text)

    def code(out):
        with pytest.raises(SystemExit) as ended:
            main(["suite", str(tmp_path / "s.toml"), "--workers", "1", "--out", str(out)])
        return ended.value.code

    assert code(tmp_path / "out") == 2
    told = capsys.readouterr().err
    assert "1 of 3 records cannot be read" in told and "bad.AT2, line" in told
    assert not (tmp_path / "out").exists()
    leave = text.replace('"records"', '"records"\nleave_out_unreadable = true')
    (tmp_path / "s.toml").write_text(leave)
    assert code(tmp_path / "out") == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "2 motions of 2 records, 1 left out" in printed
    assert (
        "A record cannot be used and is left out:" in printed and "no number of points" in printed
    )
    page = (tmp_path / "out" / "report.html").read_text()
    assert "is left out" in page and "bad.AT2" in page
    assert "bad.AT2" in Suite(tmp_path / "out").left_out[0]
    (tmp_path / "s.toml").write_text(leave.replace('folder = "records"', 'files = ["x", "y"]'))
    assert code(tmp_path / "none") == 2
    assert "2 of 2 records cannot be read" in capsys.readouterr().err


def test_warnings_of_single_runs_are_counted(suite):
    assert suite.warnings() == suite.sweep.warnings() and suite.warnings()
    assert all(f"warning: {line}" in str(suite).replace("\n", " ") for line in suite.warnings())
    page = (suite.folder / "report.html").read_text()
    assert "The records as used" in page and "Along each direction" in page
    assert "The scenario file: building" in page and "[[controller]]" in page
    assert all(f"Warning: {line.partition(';')[0]}" in page for line in suite.warnings())


def test_warnings_that_differ_in_the_motion_alone_are_one_line():
    lines = [f"ground motion {name} peaks at {peak} m/s^2, x g" for name, peak in
             (("a_H1", 21.5), ("b ns", 20.1), ("b ns", 20.1))]  # fmt: skip
    assert _counted([*lines, ""]) == [f"3 of 4 runs, such as: {lines[0]}"]


def test_every_motion_runs_under_every_controller(suite):
    assert [each["name"] for each in suite.index["motions"]] == ["a x", "a y", "b", "c"]
    assert suite.index["n_records"] == 3
    assert len(suite.table) == 8
    assert set(suite.table["status"]) == {"ok"}
    assert set(suite.table["record"]) == {"a", "b", "c"}


def test_a_run_is_the_one_of_its_scaled_record(suite, folder):
    motion = suite.index["motions"][2]
    record = read_csv(folder / "records" / "b.csv").scaled(motion["scale_factor"])
    isolated = iso.reference_building().on(iso.reference_isolators())
    run = iso.simulate(isolated, record, iso.controller("constant", amperes=1.0))
    (row,) = suite.table.query("motion == 'b' and controller == 'constant'").to_dict("records")
    for name in ("peak_base_displacement_m", "rms_drift_m", "peak_base_shear_N"):
        assert row[name] == pytest.approx(run.criteria[name], rel=1e-12)


def test_statistics_over_the_suite(suite):
    values = suite.table.query("controller == 'passive_off'").set_index("motion")
    values = values["peak_base_displacement_m"]
    row = suite.statistics.loc[("passive_off", "peak_base_displacement_m")]
    assert row["mean"] == pytest.approx(values.sum() / 4)
    assert row["median"] == pytest.approx(np.median(values))
    assert row["percentile_84"] == pytest.approx(np.percentile(values, 84))
    assert row["maximum"] == values.max()
    assert values[row["governing"]] == values.max()
    # EN 1998-1, 4.3.3.4.3(3): fewer than 7 records, so the largest response
    assert row["design"] == values.max()


def test_the_scaled_mean_reaches_the_floor_of_the_rule(suite, folder):
    """Independently: the motions as written, their spectra, the clause's 90 % of the target."""
    target = Scenario.read(folder / "three.toml").ground[0].target.spectrum()
    periods = np.append(0.0, np.geomspace(0.2, 2.0, 77))
    spectra = []
    for files in ([0, 1], [2], [3]):
        motions = [suite.folder / suite.index["motions"][k]["files"][0] for k in files]
        spectra.append(
            np.mean([response_spectrum(read_csv(each), periods).psa for each in motions], axis=0)
        )
    ratio = np.mean(spectra, axis=0) / target.psa(periods)
    assert ratio[0] >= 1.0 - 1e-6
    assert ratio[1:].min() >= 0.9 - 2e-3  # between the rule's own periods
    assert suite.meets_rule
    # one of the two is what decides
    assert min(ratio[0], ratio[1:].min() / 0.9) == pytest.approx(1.0, abs=0.02)


def test_a_record_with_the_name_of_another_line_keeps_its_own(suite):
    other, index = Suite(suite.folder), suite.index
    plotted = index["spectra"]["plotted"]
    rows = dict(zip(("mean", "target", "c"), plotted["psa_m_s2"].values(), strict=True))
    other.index = index | {"spectra": index["spectra"] | {"plotted": plotted | {"psa_m_s2": rows}}}
    lines, before = spectra_panel(other).lines, spectra_panel(suite).lines
    assert len(lines) == len(before) == 6
    for name in ("mean", "target"):
        np.testing.assert_array_equal(lines[f"record {name}"][1], rows[name])
        np.testing.assert_array_equal(lines[name][1], before[name][1])


def test_what_is_on_the_disk(suite):
    runs = pd.read_csv(suite.folder / "runs.csv")
    assert len(runs) == 8
    spectra = pd.read_csv(suite.folder / "spectra.csv")
    mean = spectra[[f"{name}_psa_m_s2" for name in "abc"]].mean(axis=1)
    np.testing.assert_allclose(spectra["suite_mean_psa_m_s2"], mean)
    report = (suite.folder / "report.html").read_text()
    for text in ("EN 1998-1:2004, 4.3.3.4.3(3)", "With 3 records the maximum", "a y"):
        assert text in report
    again = Suite(suite.folder)
    pd.testing.assert_frame_equal(again.statistics, suite.statistics)


def test_a_suite_that_was_stopped_goes_on(folder, suite, monkeypatch):
    monkeypatch.setattr("isolation_sim.sweeps.run._CHUNK_SECONDS", 0.0)  # a case a chunk
    out, done = folder / "stopped", []

    def stop(runs, failed):
        done.append(runs)
        if len(done) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_suite(folder / "three.toml", out, workers=1, progress=stop)
    with pytest.raises(InputError, match="--resume to continue"):
        run_suite(folder / "three.toml", out, workers=1)
    assert is_results(out)  # which --overwrite replaces
    after = []
    resumed = run_suite(
        folder / "three.toml", out, resume=True, workers=1, progress=lambda n, _: after.append(n)
    )
    assert after[0] == 4  # what was finished
    assert sum(after) == 8
    pd.testing.assert_frame_equal(resumed.table, suite.table)
    assert "isolation-sim suite scenario.toml runs it again" in (out / "README.txt").read_text()
    changed = Scenario.from_toml(SCENARIO.replace("= 1.0, ground", "= 2.0, ground"), folder)
    with pytest.raises(InputError, match="the suite has changed since"):
        run_suite(changed, out, resume=True)


def test_too_few_records_give_no_design_value(suite):
    other = Suite(suite.folder)
    other.index["inputs"]["section"]["rule"] = "asce7_22_16"
    assert other.design_statistic is None
    assert other.rule.floor == 0.9
    other.index["inputs"]["section"]["scaling"] = "matched"
    assert other.rule.floor == 1.1  # ASCE 7-22, 16.2.3
    assert other.statistics["design"].isna().all()
    assert "design" not in statistics_table(other, other.controllers[0]).headings
    assert statistics_table(suite, suite.controllers[0]).headings[-1] == "design"
    brief = statistics_table(suite, suite.controllers[0], brief=True)
    shown = {row[0] for row in brief.rows}
    assert "peak base shear" in shown and not any(name.startswith(("RMS", "J")) for name in shown)
    assert "11 records or more are required; the suite has 3" in " ".join(verdict(other))
    # the period was given
    assert "small vibrations" not in " ".join(verdict(suite))
    other.index["inputs"]["section"]["isolated_period_s"] = None
    assert "set isolated_period_s" in " ".join(verdict(other))


def test_factors_at_a_limit_are_told(suite):
    assert not any("scale_limits" in each for each in verdict(suite))
    other = Suite(suite.folder)
    factor = next(m["scale_factor"] for m in other.index["motions"] if m["record"] == "b")
    other.index["inputs"]["section"]["scale_limits"] = [0.01, factor]
    (sentence,) = (each for each in verdict(other) if "scale_limits" in each)
    assert f"1 of 3 records are at a limit of scale_limits, 0.01 and {factor:g}" in sentence
    assert sentence.endswith(f"target: b {factor:.3g}.")


def test_a_misspelt_criterion_is_refused_before_the_runs(folder, tmp_path, capsys):
    words = ("--out", tmp_path / "out", "--criterion", "peak_drft_m")
    code, _, error = run(capsys, "suite", folder / "three.toml", *words)
    assert code == 2 and "did you mean 'peak_drift_m'?" in error
    assert not (tmp_path / "out").exists()


def test_motions_that_touch_a_wall_are_counted(suite):
    other = Suite(suite.folder)
    first = suite.table["motion"] == suite.table["motion"].iloc[0]
    vars(other)["table"] = suite.table.assign(contacts=first.astype(int))
    (sentence,) = (each for each in verdict(other) if "touched" in each)
    total = suite.table["motion"].nunique()
    assert f"passive off 1 of {total}" in sentence
    assert not any("touched" in each for each in verdict(suite))


def test_the_level_of_an_asce_target_is_that_of_python(suite):
    settings = {"kind": "asce7_22_two_period", "S_DS_g": 1.0, "S_D1_g": 0.6, "T_L_s": 8.0}
    section = Scenario.model_validate({"ground": {"folder": "x", "target": settings}}).ground[0]
    target, g = section.target.spectrum(), STANDARD_GRAVITY
    assert target.psa(2.0)[0] == pytest.approx(0.3 * g)
    assert target.name == asce7_22_two_period(g, 0.6 * g, 8.0).name
    other = Suite(suite.folder)
    other.index["inputs"]["section"] |= {"rule": "asce7_22_17"}
    other.index["inputs"]["section"]["target"] = section.target.model_dump()
    assert "ask for MCE_R" in " ".join(verdict(other))
    other.index["inputs"]["section"]["target"]["level"] = "mce_r"
    assert "ask for MCE_R" not in " ".join(verdict(other))


def test_two_directions_are_shaken_together(tmp_path):
    ground = el_centro_1940().cut(0.0, 3.0)
    files = [write_csv(ground.scaled(k), tmp_path / f"{k}.csv") for k in (1.0, 0.5)]
    plan = iso.from_matrices(
        np.diag([1e5, 1e5]), np.zeros((2, 2)), np.zeros((2, 2)), influence=np.eye(2),
        directions=("x", "y"), base=(0, 1), names=("x", "y"),
    ).on(iso.law("linear", {"k": 4e6}))  # fmt: skip
    settings = {"ground": {"files": [list(map(str, files))], "scaling": "none"}}
    index = prepare(Scenario.model_validate(settings).ground[0], plan, tmp_path / "out")
    (motion,) = index["motions"]
    assert len(motion["files"]) == 2
    assert (motion["components"], motion["pga_m_s2"]) == ("1.0, 0.5", ground.pga)
    second = read_csv(tmp_path / "out" / motion["files"][1])
    assert isinstance(second, Record)
    swapped = Scenario.model_validate({"ground": settings["ground"] | {"components": "swapped"}})
    (motion,) = prepare(swapped.ground[0], plan, tmp_path / "swapped")["motions"]
    assert motion["components"] == "0.5, 1.0"
    one = Scenario.model_validate({"ground": settings["ground"] | {"components": "first"}})
    with pytest.raises(InputError, match="'first' for a structure with several directions"):
        prepare(one.ground[0], plan, tmp_path / "one")
    np.testing.assert_array_equal(second.acceleration, 0.5 * ground.acceleration)
    # what is refused leaves no file, and no record before it
    other = write_csv(ground, tmp_path / "other.csv")
    fine = write_csv(ground.resampled(ground.dt / 2), tmp_path / "fine.csv")
    for last, said in (
        ([str(other)], r"given 1 horizontal component; expected: 2, .*files = .*one_H1"),
        ([str(other), str(fine)], "record other: steps of its components: given "),
    ):
        settings = {"ground": {"files": [list(map(str, files)), last], "scaling": "none"}}
        with pytest.raises(InputError, match=said):
            prepare(Scenario.model_validate(settings).ground[0], plan, tmp_path / "refused")
        assert not (tmp_path / "refused").exists()
    # or the records that lack a component are left out
    settings["ground"]["files"] = [list(map(str, files)), str(other), str(fine)]
    with pytest.raises(InputError) as refused:
        prepare(Scenario.model_validate(settings).ground[0], plan, tmp_path / "refused")
    assert "2 of 3 records cannot be used: record other, record fine: given" in str(refused.value)
    assert str(refused.value).endswith("leave_out_unreadable = true in [ground] runs the others")
    settings["ground"]["leave_out_unreadable"] = True
    index = prepare(Scenario.model_validate(settings).ground[0], plan, tmp_path / "left_out")
    assert index["n_records"] == 1
    assert index["left_out"] == [f"record {k}: 1 horizontal component" for k in ("other", "fine")]


def test_second_components_of_records_that_have_one_are_not_dropped_unseen(folder, tmp_path):
    ground = {"folder": str(folder / "records"), "components": "second"}
    isolated = iso.reference_building().on(iso.reference_isolators())
    said = r"2 of 3 records cannot be used: record b, record c: given 1 horizontal component; "
    with pytest.raises(InputError, match=said):
        prepare(Scenario.model_validate({"ground": ground}).ground[0], isolated, tmp_path / "out")
    ground["leave_out_unreadable"] = True
    section = Scenario.model_validate({"ground": ground}).ground[0]
    index = prepare(section, isolated, tmp_path / "out")
    assert (index["n_records"], [each["name"] for each in index["motions"]]) == (1, ["a y"])


@pytest.mark.parametrize("scaling", ["none", "matched"])
def test_the_vertical_component_goes_along(tmp_path, scaling):
    """Three files a record: the third is the vertical one, at the samples of the other two."""
    ground = el_centro_1940().cut(0.0, 8.0)
    components = ground, ground.scaled(0.9), ground.scaled(0.5).cut(0.0, 7.9)
    files = [str(write_csv(each, tmp_path / f"{k}.csv")) for k, each in enumerate(components)]
    plan = plan_building([1e5], [1e8], [1e8], base_mass=1e5, plan=(9.0, 9.0), heights=[3.0])
    structure = with_vertical_motion(plan, 0.1)
    isolated = structure.on(iso.law("linear", {"k": 4e6}))
    target = {"kind": "en1998_1_2004", "a_g_m_s2": 3.0, "ground": "B"}
    settings = {
        "files": [files], "scaling": scaling, "isolated_period_s": 0.5, "target": target,
        "rule": "asce7_22_17", "match_tolerance": 0.1,
    }  # fmt: skip
    section = Scenario.model_validate({"ground": settings}).ground[0]
    (motion,) = prepare(section, isolated, tmp_path / "out")["motions"]
    x, y, up = (read_csv(tmp_path / "out" / file) for file in motion["files"])
    assert len(x) == len(y) == len(up)
    assert x.dt == y.dt == up.dt
    # at the same instants as before, after the quiet ground that matching needs
    first, later = (np.flatnonzero(each.acceleration)[0] * each.dt for each in (ground, up))
    shift = later - first
    expected = 0.0 if scaling == "none" else (x.duration - ground.duration) / 2
    assert shift == pytest.approx(expected, abs=ground.dt)
    factor = motion["scale_factor"]
    assert up.pga == pytest.approx(0.5 * ground.pga * factor, rel=0.1)
    with pytest.raises(InputError, match="0: given no vertical component"):
        settings = settings | {"files": [files[:2]]}
        section = Scenario.model_validate({"ground": settings}).ground[0]
        prepare(section, isolated, tmp_path / "two")


@pytest.mark.slow
def test_all_records_that_cannot_be_matched_are_named(tmp_path, monkeypatch):
    """Too small a tolerance for both. They are matched in a process of its own."""
    monkeypatch.setattr("isolation_sim.sweeps.suites.prepare.match_spectrum", None)
    for name, start in (("a", 0.0), ("b", 2.0)):
        write_csv(el_centro_1940().cut(start, start + 3.0), tmp_path / f"{name}.csv")
    settings = {
        "folder": str(tmp_path), "scaling": "matched", "isolated_period_s": 0.5,
        "target": {"kind": "en1998_1_2004", "a_g_m_s2": 3.0, "ground": "B"},
        "rule": "asce7_22_17", "match_tolerance": 0.001,
    }  # fmt: skip
    section = Scenario.model_validate({"ground": settings}).ground[0]
    plant, steps = iso.reference_building().on(iso.reference_isolators()), []
    said = r"2 of 2 components: given a .*% from the target .*, b .*; expected: 0\.1%"
    with pytest.raises(InputError, match=said):
        prepare(section, plant, tmp_path / "out", steps.append, workers=1)
    assert steps[-1] == "matching: 2 of 2 components"


def test_the_isolated_period_of_a_linear_isolator():
    mass, stiffness = 1e5, 4e6
    alone = iso.from_matrices(np.diag([mass]), np.zeros((1, 1)), np.zeros((1, 1)))
    expected = 2 * np.pi * np.sqrt(mass / stiffness)
    assert translational_period(alone.on(iso.law("linear", {"k": stiffness}))) == pytest.approx(
        expected
    )


def run(capsys, *words):
    code = 0
    try:
        main([str(word) for word in words])
    except SystemExit as stop:
        code = int(stop.code or 0)
    return code, *capsys.readouterr()


def test_the_command_prints_tables_and_json(folder, suite, capsys):
    command = ("suite", folder / "three.toml", "--out", suite.folder, "--resume")
    code, out, _ = run(capsys, *command)
    assert code == 0
    for text in ("passive off: 4 motions of 3 records", "governs", "a y", "84 %",
                 "the maximum is the response to design for"):  # fmt: skip
        assert text in " ".join(out.split())
    code, out, _ = run(capsys, *command, "--json")
    content = json.loads(out)
    assert (code, content["design_statistic"], len(content["runs"])) == (0, "maximum", 8)
    assert content["warnings"] == suite.warnings()


def test_progress_counts_the_runs_of_the_suite(folder, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(progress_lines, "BETWEEN_LINES", 0.0)
    command = ("suite", folder / "three.toml", "--out", tmp_path / "out", "--workers", "1")
    lines = [line for line in run(capsys, *command)[2].splitlines() if line.startswith("running")]
    assert lines[-1].startswith("running: 8 of 8, ")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('folder = "records"', 'folder = "three.toml"', "given a file; expected: a folder"),
        ('folder = "records"', "", "expected: one of folder, files, peer"),
        ('"records"', '"missing"', "given a folder that does not exist"),
        ('rule = "en1998_1_2004"', 'rule = "en1998"', "unknown rule 'en1998'"),
        ('ground = "B"', 'ground = "F"', "ground"),
        ("a_g_m_s2 = 1.0", "a_g_m_s2 = 50.0", "expected: a higher limit"),
    ],
)
def test_bad_input_is_one_line(folder, tmp_path, capsys, old, new, said):
    path = folder / "bad.toml"
    path.write_text(SCENARIO.replace(old, new))
    code, _, error = run(capsys, "suite", path, "--out", tmp_path / "out")
    assert code == 2
    assert said in error
    assert len(error.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_run_refuses_a_suite_and_suite_refuses_one_motion(folder, tmp_path, capsys):
    code, _, error = run(capsys, "run", folder / "three.toml")
    assert code == 2 and "isolation-sim suite" in error
    (tmp_path / "one.toml").write_text('name = "one"\n')
    code, _, error = run(capsys, "suite", tmp_path / "one.toml")
    assert code == 2 and "[ground] is no suite of records" in error
