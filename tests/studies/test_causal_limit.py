"""Limit of control without preview, in the study's short form."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from studies import causal_limit as study


def test_a_cut_pulse_equals_the_whole_one_until_it_is_cut_and_then_stops():
    (_, whole), *rest = study.motions(False).values()
    assert [apart for apart, _ in rest] == list(study.CUTS)
    for apart, record in rest:
        k = round(apart / study.STEP)
        np.testing.assert_array_equal(record.acceleration[: k + 1], whole.acceleration[: k + 1])
        assert record.acceleration[k + 1] != whole.acceleration[k + 1]
        velocity = cumulative_trapezoid(record.acceleration, dx=study.STEP, initial=0.0)
        still = velocity[k + round(study.RETURN / study.STEP) :]
        assert np.abs(still).max() < 0.05 * np.abs(velocity).max()


@pytest.mark.slow
def test_short_form_says_what_its_table_says(tmp_path):
    outcome = study.outcome(tmp_path, True, lambda what, share=0.0: None)
    assert [row["motion"] for row in outcome.table] == list(study.motions(True))
    worst = max(row["limit"] for row in outcome.table)
    assert f"is {worst:+.2f} at least" in outcome.finding
    # a controller that is not told the motion is not better on both than one that is told it later
    assert max(row["mpc"] for row in outcome.table) >= worst - 1e-3
