"""Stored tunings: defaults and presets are what was found, the study says what they are worth."""

from __future__ import annotations

import numpy as np
import pytest

from controllers import CONTROLLERS, controller
from isolation_sim.scenario import Scenario
from isolation_sim.tuning.candidate_runs import Candidate
from isolation_sim.tuning.motions import motion_set
from isolation_sim.written_names import as_written
from studies.study import perform
from studies.tuned_controllers import TUNED, scores, tuned_settings

TUNED_SETTINGS = tuned_settings()


def test_every_controller_with_a_search_range_has_been_tuned():
    ranged = {
        name for name, kind in CONTROLLERS.items()
        if any(one.search for one in kind.settings.values()) and name != "constant"
    }  # fmt: skip
    assert set(TUNED_SETTINGS) >= ranged - {"mpc"}


@pytest.mark.parametrize("name", TUNED_SETTINGS)
def test_tuned_settings_are_the_default_or_a_preset(name):
    """A default where it is surely no worse on unseen motions; on_off would not switch at all."""
    presets = CONTROLLERS[name].presets
    text = (TUNED / f"{name}.toml").read_text()
    assert "isolation-sim tune" in text and "--seed" in text
    if name == "on_off":
        assert TUNED_SETTINGS[name]["on"] == TUNED_SETTINGS[name]["off"]
        return
    one = controller(name, **({"preset": "tuned"} if "tuned" in presets else {}))
    settings = {key: value for key, value in TUNED_SETTINGS[name].items() if key != "preset"}
    assert {key: getattr(one, key) for key in settings} == settings
    # one of the two is named beside the default, with the same settings
    assert len(presets) == 1 and set(next(iter(presets.values()))) == set(settings)
    for each in presets:
        assert controller(name, preset=each).to_dict() != controller(name).to_dict()


def test_the_study_says_what_its_table_says(tmp_path):
    outcome, path = perform("tuned_controllers", tmp_path / "out", short=True)
    assert len(outcome.table) == 2 and (path / "report.html").is_file()
    for row in outcome.table:
        for what in ("published", "tuned"):
            assert row[f"{what}_from"] <= row[what] <= row[f"{what}_to"]
        assert row["tuned"] < row["published"]
        # named where the interval excludes zero, and the one of the least score
        least = min(each["tuned"] for each in outcome.table)
        if row["tuned_from"] > 0 or row["tuned_to"] < 0 or row["tuned"] == least:
            assert as_written(row["controller"]) in outcome.finding
    assert "Tuned worse than published: none" in outcome.finding


def test_scores_are_those_of_the_controllers_that_are_named():
    job = Scenario.read(TUNED / "reference.toml").build()
    group = motion_set("mixture:2", job, 3)
    settings = {"old": Candidate("fuzzy", {"preset": "published"}),
             "off": Candidate("passive_off", {})}  # fmt: skip
    first = scores(group, settings)
    assert first == scores(group, settings) and set(first) == {"old", "off"}
    assert np.all(np.array(first["off"]) >= 0), "no current is one of the constant currents"
