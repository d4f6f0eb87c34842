"""Several controllers under several records from Python objects: the suite of a loop of compare."""

import gc
import warnings

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

import isolation_sim as iso
from ground_motions import el_centro_1940, write_csv
from isolation_sim import progress_lines
from isolation_sim.errors import Diverged, InputError
from isolation_sim.reports.suite_tables import comparison_table, verdict
from isolation_sim.reports.tables import as_text

WHOLE = el_centro_1940()
RECORDS = {
    "early": WHOLE.cut(0.0, 6.0),
    "weak": WHOLE.scaled(0.3).cut(1.0, 6.0),
    "pair": (WHOLE.cut(2.0, 7.0), WHOLE.cut(3.0, 7.0)),
}
MOTIONS = {
    "early": RECORDS["early"], "weak": RECORDS["weak"],
    "pair H1": RECORDS["pair"][0], "pair H2": RECORDS["pair"][1],
}  # fmt: skip
CONTROLLERS = {
    "off": "passive_off",
    "switched": iso.controller("on_off", period=0.02),
    "held": iso.controller("constant", amperes=1.0),
}
DRIVER = iso.CoilDriver(lag=0.02)

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")


@pytest.fixture(scope="module")
def plant():
    return iso.reference_building().on(iso.reference_isolators())


@pytest.fixture(scope="module")
def suite(plant):
    finished = []
    result = iso.compare_records(
        plant, RECORDS, CONTROLLERS, driver=DRIVER, criteria=["rms_current_A"],
        progress=finished.append,
    )  # fmt: skip
    assert sum(finished) == len(result.table)
    return result


def test_a_run_is_the_one_of_compare(plant, suite):
    table = suite.table.set_index(["motion", "controller"])
    assert len(table) == 12 and set(table["status"]) == {"ok"}
    for name, record in MOTIONS.items():
        runs = iso.compare(plant, record, CONTROLLERS, driver=DRIVER, criteria=["rms_current_A"])
        for label, expected in runs.criteria.items():
            for criterion in ("peak_base_displacement_m", "rms_drift_m", "J5", "rms_current_A"):
                result = table.loc[(name, label), criterion]
                assert result == pytest.approx(expected[criterion], rel=1e-9, abs=1e-12)


def test_mean_spread_and_in_how_many_motions_it_is_better(suite):
    peak = "peak_base_displacement_m"
    values = suite.table.pivot(index="motion", columns="controller", values=peak)
    for label in CONTROLLERS:
        row = suite.statistics.loc[(label, peak)]
        assert row["mean"] == pytest.approx(values[label].mean())
        assert row["standard_deviation"] == pytest.approx(np.std(values[label], ddof=1))
        better = sum(values[label] < values["off"])
        assert row["better"] == better if label != "off" else np.isnan(row["better"])
    line = next(
        line for line in as_text(comparison_table(suite)).splitlines()
        if line.startswith("peak base displacement")
    )  # fmt: skip
    row = suite.statistics.loc[("switched", peak)]
    spread = f"± {1e3 * row['standard_deviation']:#.4g} {row['better']:.0f}/4"
    assert spread in line.replace("*", "")
    # what differs by round-off alone is not better
    assert suite.statistics.loc[("held", "J6"), "better"] == 0
    text = str(suite)
    assert "reference building, 3 records" in text and "records or more are required" not in text


def test_progress_is_told_from_time_to_time(plant, capsys, monkeypatch):
    monkeypatch.setattr(progress_lines, "BETWEEN_LINES", 0.0)
    iso.compare_records(plant, [WHOLE.cut(0.0, 2.0)], ["passive_off"])
    assert "running: 1 of 1, 0 s" in capsys.readouterr().err


def test_it_is_saved_loaded_and_drawn(suite, tmp_path):
    suite.save(tmp_path / "kept")
    loaded = iso.load(tmp_path / "kept")
    assert str(loaded) == str(suite) and isinstance(loaded.plot(), Figure)
    pd.testing.assert_frame_equal(loaded.statistics, suite.statistics)
    assert "better than off in n of N motions" in (tmp_path / "kept/report.html").read_text()
    with pytest.raises(InputError, match="contains a saved result"):
        suite.save(tmp_path / "kept")
    with pytest.raises(InputError, match="made of Python objects, without a plan"):
        _ = loaded.sweep.plan
    assert "Sensitivity" not in loaded.sweep.to_html(tmp_path / "a.html").read_text()


def test_a_suite_that_is_not_saved_leaves_no_files(plant):
    suite = iso.compare_records(plant, [RECORDS["weak"]], ["passive_off"])
    folder = suite.folder
    assert folder.is_dir()
    del suite
    gc.collect()
    assert not folder.exists()


def test_records_are_scaled_to_a_target_and_read_from_a_folder(plant, tmp_path):
    write_csv(RECORDS["early"], tmp_path / "early.csv")
    target = {"kind": "en1998_1_2004", "a_g_m_s2": 1.0, "ground": "B"}
    ground = {"rule": "en1998_1_2004", "target": target, "isolated_period_s": 1.0}
    comparison = [
        iso.compare_records(plant, records, ["passive_off", "on_off"], ground=ground)
        for records in (tmp_path, {"early": RECORDS["early"]})
    ]
    pd.testing.assert_frame_equal(comparison[0].table, comparison[1].table)
    assert comparison[0].meets_rule and "3 records or more are required" in " ".join(
        verdict(comparison[0])
    )
    factor = comparison[0].index["motions"][0]["scale_factor"]
    run = iso.simulate(plant, RECORDS["early"].scaled(factor))
    expected = run.criteria["peak_drift_m"]
    assert comparison[1].table["peak_drift_m"][0] == pytest.approx(expected, rel=1e-9)


def test_single_components_beside_pairs_are_told(plant):
    target = {"kind": "en1998_1_2004", "a_g_m_s2": 1.0, "ground": "B"}
    records = {"early": RECORDS["early"], "pair": (RECORDS["early"], RECORDS["early"])}
    ground = {"target": target, "isolated_period_s": 1.0, "rule": "en1998_2_2005"}
    with pytest.warns(UserWarning, match="1 of 2 records have one component.* SRSS.*: early;"):
        iso.compare_records(plant, records, ["passive_off"], ground=ground)
    with warnings.catch_warnings():
        warnings.filterwarnings("error", message=".*have one component")
        ground["rule"] = "en1998_1_2004"
        iso.compare_records(plant, records, ["passive_off"], ground=ground)


@pytest.mark.parametrize(
    ("records", "options", "message"),
    [
        ([WHOLE, WHOLE], {}, "two called el_centro_1940_ns; expected: a mapping"),
        ([], {}, "records: given none"),
        ([(WHOLE,) * 4], {}, "given 4; expected: 1 to 3"),
        ([WHOLE], {"ground": {"folder": "x"}}, "ground has folder, and records are given"),
        ([WHOLE], {"ground": {"scalling": "none"}}, "did you mean 'scaling'"),
        ([WHOLE], {"criteria": ["no"]}, "unknown criterion 'no'"),
        ([WHOLE], {"controllers": ["on_off", "on_off"]}, "expected: different names"),
    ],
)
def test_what_cannot_be_used_is_refused(plant, records, options, message):
    with pytest.raises(InputError) as caught:
        iso.compare_records(plant, records, **{"controllers": ["passive_off"], **options})
    assert message in str(caught.value)


def test_single_runs_may_fail_and_all_may_not(plant):
    class Failing(iso.Controller):
        name = "failing"

        def current(self, *_):
            raise ValueError("no current")

    with pytest.raises(Diverged, match="no current"):
        iso.compare_records(plant, [RECORDS["weak"]], [Failing()])
    suite = iso.compare_records(plant, [RECORDS["weak"]], ["passive_off", Failing()])
    (line,) = suite.failures()
    assert "no current" in line and line in " ".join(str(suite).split())


def test_quiet_ground_leaves_the_mean_spectrum_at_the_floor_of_the_rule(plant):
    """Cuts that end in strong motion: scaled to the spectra of what is simulated."""
    target = {"kind": "en1998_1_2004", "a_g_m_s2": 2.0, "ground": "B"}
    ground = {"rule": "asce7_22_17", "target": target, "isolated_period_s": 1.0}
    cuts = {f"until {end} s": WHOLE.cut(0.0, end) for end in (2.1, 2.22, 2.46)}
    suite = iso.compare_records(
        plant, cuts, ["passive_off"], ground=ground | {"quiet_after_s": 5.0}
    )
    assert suite.mean_ratio[0] == pytest.approx(1.0, rel=1e-8)
    assert suite.meets_rule
