"""The damper's diagnosis in the study's short form, judged by a frequency that it has not seen."""

from __future__ import annotations

from statistics import mean

import pytest

from studies.study import perform


@pytest.mark.usefixtures("shared_data")
def test_short_form(tmp_path):
    found, path = perform("damper_diagnosis", tmp_path / "study", True)
    assert len(found.table) == 18
    left_out = [row for row in found.table if row["used"] == "left out"]
    assert [row["run"].startswith("10mm_1Hz") for row in left_out] == [True] * 3
    # a dashpot in the law, a thinning fluid in the damper
    assert "Of 22 laws rate_dependent_bouc_wen fits best" in found.finding
    means = (mean(row[key] for row in left_out) for key in ("Bouc-Wen, RMS error %", "extended, %"))
    before, after = means
    assert after < 0.85 * before
    assert (path / "figures" / "loops.svg").is_file()
