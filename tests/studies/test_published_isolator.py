"""The published isolator in the study's short form: what is missing, named and put in."""

from __future__ import annotations

import numpy as np
import pytest

import isolation_sim as iso
from isolation_sim.discrepancy.adapters import loop_table
from isolation_sim.discrepancy.loops import effect_search
from isolation_sim.effects import EFFECTS
from studies import published_isolator as study
from studies.study import perform

pytestmark = pytest.mark.usefixtures("no_drawing")


@pytest.mark.slow
def test_the_loops_of_the_second_paper_hardly_depend_on_frequency():
    table = study.yu()
    strong = table.current == 3.0
    for amplitude in (2e-3, 4e-3, 8e-3):
        rows = np.flatnonzero(strong & (table.amplitude == amplitude))
        slow, fast = table.stiffness[rows[[0, -1]]]
        assert 0.94 < fast / slow < 1.03
    law = iso.law("strain_stiffening")
    stiffness, _ = study.loops(law, table)
    rows = np.flatnonzero(strong & (table.amplitude == 4e-3))
    assert stiffness[rows[-1]] / stiffness[rows[0]] == pytest.approx(1.52, abs=0.01)


RIVALS = {
    "amplitude_softening": ("power",),
    "weak_rate_dependence": ("spring_pot",),
}
"""Forms of two causes that the table can hardly tell apart."""


@pytest.mark.slow
@pytest.mark.parametrize("names", [RIVALS, None], ids=["rivals", "all"])
def test_short_form(tmp_path, monkeypatch, names):
    if names:
        monkeypatch.setattr(study, "CYCLES", 6)
        monkeypatch.setattr(effect_search, "CYCLES", 6)
        monkeypatch.setattr(effect_search, "LOOP_FOLDS", 6)
        compared = {
            cause: tuple(each for each in EFFECTS[cause] if each.form in forms)
            for cause, forms in names.items()
        }
        monkeypatch.setattr(effect_search, "EFFECTS", compared)
        monkeypatch.setattr(loop_table, "EFFECTS", compared)
    outcome, path = perform("published_isolator", tmp_path / "study", True)
    published, fitted, extended = outcome.table
    # the errors of the paper's own numbers are known apart from this project
    assert published["stiffness, RMS error %"] == pytest.approx(299, abs=1)
    assert fitted["both, %"] > 10
    assert extended["stiffness, RMS error %"] < 5 and extended["damping, %"] < 5
    assert extended["rows left out, %"] < fitted["rows left out, %"] / 2
    assert extended["causes"].startswith("amplitude_softening")
    assert "amplitude_softening" in outcome.finding.lower()
    assert (path / "figures" / "loops.svg").is_file()
    assert (path / "diagnosis_Li" / "extended_law.toml").is_file()


def test_a_stiff_law_is_integrated():
    # a spring so stiff that its dashpot follows the motion: a standard solid beside the dashpot
    solid, dashpot = {"c0": 4e4, "k0": 2e5, "k1": 5e4}, 300.0
    stiff = iso.law("strain_stiffening", solid | {"c1": dashpot, "alpha": 2e15})
    table = study._table("one", [(8.0, 1.0, 0.0, 1.0, 1.0)])
    stiffness, damping = study.loops(iso.law("standard_solid", solid), table)
    expected = stiffness, damping + dashpot * 2 * np.pi / (2 * stiffness)
    np.testing.assert_allclose(study.loops(stiff, table), expected, rtol=2e-3)
