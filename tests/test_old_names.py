"""Old names of arguments, keys and settings."""

from __future__ import annotations

import pytest

import isolation_sim as iso
from ground_motions import Record
from ground_motions.old_names import renamed_arguments
from isolation_sim.archive import _object
from isolation_sim.discrepancy.diagnosis import Cause
from isolation_sim.effects import effect
from isolation_sim.effects.effect import EffectParameter
from isolation_sim.errors import InputError
from isolation_sim.identification.campaign import TestRun
from isolation_sim.scenario import Scenario
from isolation_sim.sweeps.fields import steps_of


def test_a_scenario_takes_old_keys_and_values():
    text = '[isolator]\nswitching = "papers"\n[belief]\nforce_factor = 0.8\n'
    with pytest.warns(FutureWarning, match="belief is now called nominal") as notes:
        old = Scenario.from_toml(text)
    assert any("'instantaneous'" in str(note.message) for note in notes)
    new = text.replace("papers", "instantaneous").replace("belief", "nominal")
    assert old == Scenario.from_toml(new)


def test_both_names_at_once_are_refused():
    text = "[belief]\nforce_factor = 0.8\n[nominal]\nforce_factor = 0.8\n"
    with pytest.raises(InputError, match="belief is the old name of nominal"):
        Scenario.from_toml(text)


def test_a_sweep_takes_the_old_field():
    with pytest.warns(FutureWarning, match="nominal"):
        assert steps_of("belief.force_factor") == ("nominal", "force_factor")


def test_a_function_takes_the_old_argument():
    @renamed_arguments(old="new")
    def twice(new=1):
        return 2 * new

    with pytest.warns(FutureWarning, match="old is now called new"):
        assert twice(old=3) == 6
    assert twice(new=3) == twice(3) == 6
    assert "nominal" in iso.simulate.__doc__


def test_classes_take_old_arguments_and_attributes():
    with pytest.warns(FutureWarning, match="unit_as_given is now called file_unit"):
        record = Record([0.0, 1.0], 0.01, unit_as_given="g")
    with pytest.warns(FutureWarning, match="file_unit"):
        assert record.unit_as_given == record.file_unit == "g"
    with pytest.warns(FutureWarning, match="strength is now called magnitude"):
        assert EffectParameter("mass", "kg", "moving mass", strength=True).magnitude


def test_saved_results_have_old_classes_and_fields():
    state = {"name": "end_stop", "share": 1.0, "p_value": 0.0, "parameters": {}}
    with pytest.warns(FutureWarning, match="evidence is now called reason"):
        cause = _object(
            "isolation_sim.discrepancy.diagnosis:Cause", state | {"evidence": "it hits"}
        )
    assert isinstance(cause, Cause) and cause.reason == "it hits"
    names = ("deformation", "tested_deformation", "current", "tested_current")
    peaks = _object("isolation_sim.simulation.tested_range:Reached", dict.fromkeys(names, 1.0))
    assert peaks.deformation_ratio == 1.0
    run = _object("isolation_sim.identification.run_table:TestRun", {"name": "run 1"})
    assert isinstance(run, TestRun) and run.name == "run 1"
    # saved buildings name these effects by their place
    assert effect("isolation_sim.discrepancy.building.isolator_effects:IMPACT", "dissipating")
