"""The measured building in the study's short form, judged by a record that it has not seen."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from isolation_sim.discrepancy.adapters import device_tests
from isolation_sim.discrepancy.device import observable_effects
from isolation_sim.effects import EFFECTS
from isolation_sim.identification.law_choice import choose_law
from isolation_sim.laws import LAWS
from studies import building_record as study
from studies.study import perform

pytestmark = pytest.mark.usefixtures("no_drawing")


@pytest.fixture(scope="module")
def first(shared_data):
    return study.read_resampled(shared_data / "bncs", study.FIRST)


def test_stiff_storeys_move_with_the_base():
    time = 0.02 * np.arange(500)
    base = np.sin(2 * np.pi * time) * np.minimum(time, 1)
    stiff = study.superstructure(study.FLOOR_MASS * (2 * np.pi / 0.01) ** 2, 0.05)
    floors = study.floor_accelerations(stiff, base, 0.02)
    assert floors == pytest.approx(np.repeat(base[:, np.newaxis], 5, axis=1), abs=0.03)


def test_storeys_above_the_base_follow_the_floors(first):
    building = study.identify_superstructure(first)
    base, floors = first.values[:, 0], first.values[:, 1:-1]
    missed = study.floor_accelerations(building, base, first.dt) - floors
    rigid = base[:, np.newaxis] - floors
    size = np.linalg.norm(floors)
    assert np.linalg.norm(missed) < 0.1 * size < 0.4 * np.linalg.norm(rigid)


RIVALS = (
    ("kelvin_voigt", "dahl"),
    ("amplitude_softening", "coulomb_friction", "stress_softening"),
)
ALL = tuple(LAWS), tuple(EFFECTS)


@pytest.mark.slow
@pytest.mark.parametrize(("laws", "causes"), [RIVALS, ALL], ids=["rivals", "all"])
def test_short_form(tmp_path, shared_data, monkeypatch, laws, causes):
    monkeypatch.setattr(study, "SHORT_EVERY", 5)
    monkeypatch.setattr(device_tests, "choose_law", partial(choose_law, laws=laws))
    monkeypatch.setattr(observable_effects, "EFFECTS", {name: EFFECTS[name] for name in causes})
    outcome, path = perform("building_record", tmp_path / "study", True)
    linear, extended = (
        {row["record"]: row for row in outcome.table if row["isolation layer"].startswith(name)}
        for name in ("linear", "extended")
    )
    assert ": amplitude_softening" in outcome.finding and "stress_softening" in outcome.finding
    unseen = "Canoga Park 100 %"
    assert extended[unseen]["used"] == "not seen"
    for key in ("isolator displacement, RMS error %", "accelerations, %"):
        assert all(extended[name][key] < linear[name][key] for name in linear)
    peaks = [layer[unseen]["peak displacement over measured"] for layer in (linear, extended)]
    assert abs(peaks[1] - 1) < 0.5 * abs(peaks[0] - 1)
    assert (path / "figures" / "loops.svg").is_file()
