"""Kinds of ground motion: the motions, what is made of the scores, and the study's short form."""

from __future__ import annotations

import numpy as np
import pytest

from studies import ground_motion_types as study
from studies.study import perform


def test_pulses_are_of_both_signs_and_fill_the_range_of_periods():
    some = study.pulses(3, 12)
    periods = [float(name.split()[-2][1:]) for name in some]
    assert periods == sorted(periods)
    assert periods[0] < 0.8 and periods[-1] > 4.5
    assert [name.split()[-2][0] for name in some] == ["+", "-"] * 6
    for pulse in some.values():
        assert pulse.pgv <= 0.7 and pulse.pga <= 0.5 * 9.81
    again = study.pulses(3, 12)
    assert all(np.array_equal(again[name].acceleration, some[name].acceleration) for name in some)


def test_far_field_motions_are_of_two_processes_on_three_soils():
    some = study.far_field(5, 6)
    assert {name.split()[0] for name in some} == {"clough-penzien", "kanai-tajimi"}
    assert {name.split()[1] for name in some} == {"firm", "medium", "soft"}
    assert all(record.pga == pytest.approx(study.PGA) for record in some.values())


def test_the_table_tells_mean_worst_and_harm():
    results = [
        {"kind": "a", "motion": str(k), "controller": "c", "J": 2.0 + over, "constant": 2.0}
        for k, over in enumerate((-0.3, 0.01, 0.5))
    ]
    (row,) = study.table(results)
    assert row["motions"] == 3 and row["harmed"] == 1
    assert row["over_constant"] == pytest.approx(0.07)
    assert row["worst"] == pytest.approx(0.5) and row["worst_motion"] == "2"
    assert row["from"] <= row["over_constant"] <= row["to"]
    assert "1 of 3, worst 2 +0.50" in study.finding([row])


def test_the_short_study(tmp_path):
    outcome, path = perform("ground_motion_types", tmp_path / "study", True)
    assert (path / "figures" / "ground_motion_types.png").stat().st_size > 10_000
    assert [(row["kind"], row["motions"]) for row in outcome.table] == [
        (study.NEAR_FAULT, 2), (study.FAR_FIELD, 2),
    ]  # fmt: skip
