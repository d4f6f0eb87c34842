"""The next tests: missing conditions of a grid, their limits, and the plan of a saved diagnosis."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import isolation_sim as iso
from isolation_sim.cli import main
from isolation_sim.discrepancy.planned_tests import PlannedTest, TestPlan, missing_conditions
from isolation_sim.identification.campaign import Campaign, write_campaign
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.identification.measured.velocity import smooth

pytestmark = pytest.mark.usefixtures("no_drawing")


def sinusoid(amplitude, frequency, current, cycles=5, noise=0.0):
    time = np.arange(0.0, cycles / frequency, 1 / 200)
    rng = np.random.default_rng(1)
    soft = np.minimum(1.0, time * frequency)  # the first cycle begins softly
    x = soft * np.sin(2 * np.pi * frequency * time) + noise * rng.standard_normal(len(time))
    x = amplitude * x
    return TestRun(
        f"{1e3 * amplitude:g}mm_{frequency:g}Hz_{current:g}A", time, x, smooth(x, 1 / 200)[1],
        1e5 * x, np.full(len(time), float(current)),
    )  # fmt: skip


GRID = [(a, f, i) for a in (2e-3, 8e-3) for f in (0.5, 2.0) for i in (0.0, 1.0, 2.0)]


def test_a_whole_grid_lacks_nothing_and_a_hole_in_it_is_named():
    runs = [sinusoid(*one, noise=0.01) for one in GRID]
    assert missing_conditions(runs) == ((), ())
    hole = GRID.index((2e-3, 2.0, 1.0))
    (test,), notes = missing_conditions([*runs[:hole], *runs[hole + 1 :]])
    assert notes == ()
    row = test.to_dict()
    assert row["amplitude_mm"] == pytest.approx(2.0, rel=0.003)
    assert row["frequency_Hz"] == pytest.approx(2.0, rel=0.01)
    assert (row["current_A"], row["cycles"], row["sample_rate_Hz"]) == (1.0, 5, 200.0)
    assert row["why"] == "this combination was not tested"
    # the mean of a noisy current is no current
    runs = [replace(run, current=run.current - 1.2e-6) for run in runs]
    hole = GRID.index((2e-3, 2.0, 0.0))
    (test,), _ = missing_conditions([*runs[:hole], *runs[hole + 1 :]])
    assert test.currents == (0.0,)


def test_nothing_faster_than_the_tests_is_proposed():
    """Large and fast together would be four times as fast as any test."""
    runs = [sinusoid(2e-3, 2.0, 0.0), sinusoid(8e-3, 0.5, 0.0), sinusoid(2e-3, 0.5, 0.0)]
    assert missing_conditions(runs)[0] == ()
    runs.append(sinusoid(9e-3, 2.0, 2.0))
    result, _ = missing_conditions(runs)
    assert len(result) == 4 and all(one.amplitude * one.frequency <= 0.019 for one in result)


def test_the_condition_farthest_from_the_tests_comes_first():
    amplitudes, frequencies = 2e-3 * 1.5 ** np.arange(5), 0.2 * 1.2 ** np.arange(5)
    lacks = {(0, 2), (3, 0), (4, 0), (4, 1)}
    runs = [
        sinusoid(a, f, 0.0)
        for k, a in enumerate(amplitudes) for n, f in enumerate(frequencies) if (k, n) not in lacks
    ]  # fmt: skip
    tests, _ = missing_conditions(runs)
    assert len(tests) == 4
    assert tests[0].amplitude == pytest.approx(amplitudes[4], rel=0.02)
    assert tests[0].frequency == pytest.approx(frequencies[0], rel=0.02)


def test_what_is_no_grid_is_said():
    one = [sinusoid(a, 1.0, i) for a in (2e-3, 4e-3) for i in (0.0, 1.0)]
    assert missing_conditions(one)[1] == (
        "All sinusoids have one frequency: they cannot show the dependence on it.",
    )
    scattered = [sinusoid(2e-3 * 1.3**k, 0.5 * 1.3**k, 0.3 * k) for k in range(6)]
    assert (
        "no grid of amplitudes, frequencies, currents (6 x 6 x 6)"
        in missing_conditions(scattered)[1][-1]
    )
    rng = np.random.default_rng(0)
    walk = np.cumsum(rng.standard_normal(800)) * 1e-4
    other = replace(one[0], name="walk", time=np.arange(800) / 200, displacement=walk,
                    velocity=walk, force=walk, current=np.zeros(800))  # fmt: skip
    assert "Fewer than two tests are sinusoids" in missing_conditions([one[0], other])[1][0]


def test_the_command_writes_the_matrix_of_a_campaign(tmp_path, capsys):
    runs = [sinusoid(*one) for one in GRID[:-1]]
    write_campaign(Campaign("grid", "made", tuple(runs)), tmp_path / "grid")
    for expected in (0, 2):  # the file exists
        with pytest.raises(SystemExit) as stop:
            main(["plan-tests", str(tmp_path / "grid"), "--out", str(tmp_path / "next.csv")])
        assert stop.value.code == expected
    out = capsys.readouterr().out
    assert "this combination was not tested" in out and "test matrix:" in out
    table = pd.read_csv(tmp_path / "next.csv")
    assert table.loc[0, ["test", "waveform", "current_A"]].tolist() == [1, "sine", 2.0]
    assert table["amplitude_mm"][0] == pytest.approx(8.0, rel=0.05)


def test_a_plan_prints_rivals_first_with_steps_and_rests():
    tests = (
        PlannedTest(8e-3, 1.0, (0.0, 2.0), 12.0, 500.0, "tells a from b", step=2.0,
                    tells=("a", "b"), difference=12.3, words="a sinusoid"),
        PlannedTest(8e-3, 1.0, (2.0,), 24.0, 500.0, "tells a from c", rest=60.0, tells=("a", "c")),
    )  # fmt: skip
    plan = TestPlan("rig", tests, ("Only this.",))
    text = " ".join(str(plan).split())
    assert "0 / 2 every 2 s" in text and "in two equal parts with 60 s of rest between" in text
    assert str(plan).endswith("Only this.")
    first, second = plan.to_records()
    assert first["second_current_A"] == 2.0 and second["second_current_A"] is None
    assert second["rest_in_the_middle_s"] == 60.0 and second["difference_over_noise"] is None
    assert "differ there by 12.3 times" in tests[0].sentence


def test_a_test_that_tells_two_pairs_apart_is_made_once():
    one = PlannedTest(8e-3, 1.0, (2.0,), 12.0, 500.0, "tells a from b", tells=("a", "b"),
                      difference=12.0, words="a sinusoid")  # fmt: skip
    other = replace(one, why="tells a from c", tells=("a", "c"), difference=5.0)
    third = PlannedTest(4e-3, 1.0, (2.0,), 12.0, 500.0, "this combination was not tested")
    plan = TestPlan("rig", (one, other, third, replace(third, amplitude=6e-3)))
    first, *rest = plan.to_records()
    assert first["why"] == "tells a from b, a from c" and first["difference_over_noise"] == 5.0
    assert [row["amplitude_mm"] for row in rest] == [4.0, 6.0]
    assert "tells a from b, a from c" in " ".join(str(plan).split())


def test_what_has_no_plan_is_refused(tmp_path):
    with pytest.raises(iso.InputError, match="neither a saved diagnosis nor a campaign"):
        iso.plan_tests(tmp_path / "missing")
    with pytest.raises(
        iso.InputError, match="source: given 3; expected: a Diagnosis or a Campaign"
    ):
        iso.plan_tests(3)
