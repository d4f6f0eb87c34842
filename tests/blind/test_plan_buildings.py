"""Buildings in plan whose records come from an integrator and a model of their own."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import isolation_sim as iso
from isolation_sim.discrepancy.building.comparison import compare_building
from isolation_sim.discrepancy.building.model import Soil, building_model
from isolation_sim.discrepancy.building.record import read_building_record
from isolation_sim.discrepancy.building.search.cause_search import candidates
from isolation_sim.scenario import Scenario
from studies.blind import plan_buildings as blind

SEED = 3
DURATION = 8.0
"""s: shorter than in the study, to save time."""


@cache
def nominal():
    return blind.nominal_building(SEED)


def diagnosed(building, folder, bias=0.0):
    folder = blind.write(nominal(), blind.record(building, SEED, bias, DURATION), folder)
    return iso.diagnose(folder / "record.csv", scenario=folder / "building.toml", consequence=False)


def read(building, folder):
    """The record of a building, and the model of the nominal one."""
    folder = blind.write(nominal(), blind.record(building, SEED, duration=DURATION), folder)
    record = read_building_record(folder / "record.csv")
    return record, building_model(
        Scenario.read(folder / "building.toml").build().isolated, [record]
    )


def test_nothing_is_named_where_nothing_is_hidden(tmp_path):
    diagnosis = diagnosed(nominal(), tmp_path)
    assert diagnosis.verdict == "adequate" and not diagnosis.causes
    assert diagnosis.error_before.held_out < 1.5 * diagnosis.held_out_noise_floor
    # every channel in both parts of the record
    assert len(diagnosis.traces) == 2 * 11


def only_cause(form, severity, folder):
    """The only cause named, its numbers, and its sentence."""
    diagnosis = diagnosed(blind.faulty(nominal(), form, severity, SEED), folder)
    assert diagnosis.verdict == "explained" and len(diagnosis.causes) == 1
    cause = diagnosis.causes[0]
    return cause, {name: one.value for name, one in cause.parameters.items()}


def test_the_storey_and_the_direction_that_lost_stiffness_are_named(tmp_path):
    cause, numbers = only_cause("along_y", 0.1, tmp_path)
    storey = blind.storey_of(SEED)
    assert cause.name == "storey_stiffness_loss" and numbers["storey"] == storey
    assert f"storey{storey}_y has lost" in cause.reason
    assert numbers["loss"] == pytest.approx(0.1, abs=0.01)


@pytest.mark.slow
def test_friction_of_all_bearings_is_named(tmp_path):
    cause, numbers = only_cause("smooth", 0.1, tmp_path)
    assert cause.name == "coulomb_friction"
    assert numbers["level"] == pytest.approx(0.1 * nominal().bearing["q"], rel=0.1)


@pytest.mark.slow
def test_a_mass_beside_the_centre_of_the_base_is_named(tmp_path):
    cause, numbers = only_cause("eccentric", 0.15, tmp_path)
    assert cause.name == "base_mass_error" and cause.form == "eccentric"
    assert numbers["relative_error"] == pytest.approx(0.15, abs=0.01)
    # the centre of both masses
    moved = (0.3 * np.array(nominal().sides) - nominal().eccentricity) * 0.15 / 1.15
    np.testing.assert_allclose([numbers["shift_x"], numbers["shift_y"]], moved, rtol=0.1)


@pytest.mark.slow
def test_a_biased_sensor_is_named_with_its_direction(tmp_path):
    diagnosis = diagnosed(nominal(), tmp_path, bias=0.05)
    assert [cause.name for cause in diagnosis.causes] == ["sensor_bias"]
    assert f"{blind.BIASED} is off by" in diagnosis.causes[0].reason


@pytest.mark.parametrize("rocking", [False, True])
def test_a_very_stiff_soil_changes_nothing_in_either_direction(rocking, tmp_path):
    record, model = read(nominal(), tmp_path)
    rigid = model.predict(record)
    size = np.sqrt(np.mean(rigid**2, axis=0))
    stiff = replace(model, soil=(Soil(1e14, 1e10, 3e5, rocking),)).predict(record)
    np.testing.assert_allclose(stiff / size, rigid / size, atol=1e-3)


def test_a_frame_that_lost_stiffness_is_detected_beside_the_centre(tmp_path):
    """One fit, without a search."""
    record, model = read(blind.faulty(nominal(), "one_frame", 0.1, SEED), tmp_path)
    comparison = compare_building(model, [record])
    place = f"storey{blind.storey_of(SEED)}_x"
    fits = {
        one.form: comparison.fit((), ((one, one.starts[0]),))
        for one in candidates(comparison.model, [record])
        if one.place == place
    }
    loss, position = fits["one_side"].cause_values[0][1]
    assert loss == pytest.approx(0.1, abs=0.01)
    assert position == pytest.approx(nominal().sides[1] / 2, rel=0.1)
    assert fits["one_side"].variance < 1.2 < fits[""].variance
