"""What each lever of the predictive controller contributes, in the study's short form."""

from __future__ import annotations

import numpy as np
import pytest

from controllers import controller
from studies import controller_runs as runs
from studies import mpc_levers as study
from studies.controllers import PREVIEW, interval, motions
from studies.study import perform


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    return perform("mpc_levers", tmp_path_factory.mktemp("study") / "levers", True)


def test_each_candidate_is_one_change_of_settings_that_changes_something():
    standard = controller("mpc")
    for preview in (0.0, PREVIEW):
        for changes in study.ABLATIONS.values():
            one = controller("mpc", preview=preview, **changes)
            assert all(getattr(one, key) != getattr(standard, key) for key in changes)
    inputs = study.candidates(False)
    assert len(inputs) == 2 * len(study.ABLATIONS) + len(study.PREVIEWS)
    assert inputs[study.label(study.WHOLE, PREVIEW)].preview == PREVIEW


@pytest.mark.slow
def test_losses_are_paired_and_the_whole_loses_nothing(short):
    result, path = short
    assert (path / "figures" / "levers.png").stat().st_size > 20_000
    assert len(result.table) == 2 * (1 + len(study.SHORT))
    for row in result.table:
        assert row["lost_from"] <= row["lost"] <= row["lost_to"]
        (whole,) = [
            other for other in result.table
            if other["without"] == study.WHOLE and other["preview_s"] == row["preview_s"]
        ]  # fmt: skip
        assert row["lost"] == pytest.approx(row["J"] - whole["J"], abs=2e-3)
        if row is whole:
            assert row["lost"] == row["lost_from"] == row["lost_to"] == 0.0
        else:
            assert row["lost"] != 0.0


@pytest.mark.slow
def test_scores_are_those_of_the_controller_study(short):
    result, _ = short
    records = [record for name, record in motions(True).items() if name != "El Centro"]
    one = {"mpc": controller("mpc", preview=PREVIEW, **study.ABLATIONS[study.SHORT[0]])}
    rows = [runs.run_candidates(one, record, runs.Case())[0] for record in records]
    (row,) = [
        row for row in result.table
        if row["without"] == study.SHORT[0] and row["preview_s"] == PREVIEW
    ]  # fmt: skip
    assert row["J"] == pytest.approx(np.mean([each["J"] for each in rows]), abs=6e-4)
    over = np.array([each["J"] - each["constant"] for each in rows])
    assert (row["over_constant_from"], row["over_constant_to"]) == pytest.approx(
        interval(over), abs=6e-4
    )


def test_the_finding_names_what_helps_and_what_harms():
    rng = np.random.default_rng(0)
    base = 1.5 + 0.1 * rng.random(20)
    shifts = ((study.WHOLE, 0.0), ("brake", 0.2), ("spoke", -0.1))
    shifted = {
        study.label(name, preview): base + shift
        for preview in (0.0, PREVIEW)
        for name, shift in shifts
    }
    text = study.finding(study.table(shifted, base + 0.3), 20)
    assert text.count("helps: brake (+0.200)") == 2
    assert text.count("harms: spoke (-0.100)") == 2
    assert text.count("not significant: nothing") == 2
    assert "J is -0.300 (-0.300 to -0.300) from the best constant" in text
