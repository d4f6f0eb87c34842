"""The damper's diagnosis in the study's short form, judged by a frequency that it has not seen."""

from __future__ import annotations

from functools import partial
from statistics import mean

import pytest

from isolation_sim.discrepancy import diagnose
from isolation_sim.discrepancy.device import observable_effects
from isolation_sim.effects import EFFECTS
from isolation_sim.identification.law_choice import choose_law
from isolation_sim.laws import LAWS
from studies.study import perform

pytestmark = pytest.mark.usefixtures("no_drawing")

RIVALS = (
    ("bouc_wen", "rate_dependent_bouc_wen"),
    ("inertia_force", "weak_rate_dependence"),
)
ALL = tuple(LAWS), tuple(EFFECTS)


@pytest.mark.slow
@pytest.mark.usefixtures("shared_data")
@pytest.mark.parametrize(("laws", "causes"), [RIVALS, ALL], ids=["rivals", "all"])
def test_short_form(tmp_path, monkeypatch, laws, causes):
    monkeypatch.setattr(diagnose, "choose_law", partial(choose_law, laws=laws))
    monkeypatch.setattr(observable_effects, "EFFECTS", {name: EFFECTS[name] for name in causes})
    outcome, path = perform("damper_diagnosis", tmp_path / "study", True)
    assert len(outcome.table) == 18
    left_out = [row for row in outcome.table if row["used"] == "left out"]
    assert [row["run"].startswith("10mm_1Hz") for row in left_out] == [True] * 3
    # a dashpot in the law, a thinning fluid in the damper
    assert f"Of {len(laws)} laws rate_dependent_bouc_wen fits best" in outcome.finding
    means = (mean(row[key] for row in left_out) for key in ("Bouc-Wen, RMS error %", "extended, %"))
    before, after = means
    assert after < 0.85 * before
    assert (path / "figures" / "loops.svg").is_file()
