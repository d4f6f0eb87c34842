"""Buildings in plan whose records come from an integrator and a model of their own."""

from __future__ import annotations

from functools import cache

import pytest

import isolation_sim as iso
from studies.blind import plan_buildings as blind

SEED = 3


@cache
def nominal():
    return blind.nominal_building(SEED)


def diagnosed(building, folder, bias=0.0):
    folder = blind.write(nominal(), blind.record(building, SEED, bias=bias), folder)
    return iso.diagnose(folder / "record.csv", scenario=folder / "building.toml", consequence=False)


def test_nothing_is_named_where_nothing_is_hidden(tmp_path):
    diagnosis = diagnosed(nominal(), tmp_path)
    assert diagnosis.verdict == "adequate" and not diagnosis.causes
    assert diagnosis.error_before.held_out < 1.5 * diagnosis.noise_floor
    # every channel in both parts of the record
    assert len(diagnosis.traces) == 2 * 11


@pytest.mark.parametrize("hidden", blind.faults(nominal(), SEED))
def test_the_fault_is_named(hidden, tmp_path):
    building = blind.faults(nominal(), SEED)[hidden]
    diagnosis = diagnosed(building, tmp_path)
    name, _, form = hidden.partition(", ")
    assert [cause.name for cause in diagnosis.causes] == [name]
    assert diagnosis.verdict == "explained"
    numbers = {key: one.value for key, one in diagnosis.causes[0].parameters.items()}
    if name == "storey_stiffness_loss":
        storey, axis, share = building.lost
        assert numbers["storey"] == storey
        assert f"storey{storey}_{axis} has lost" in diagnosis.causes[0].evidence
        assert numbers["loss"] == pytest.approx(share, abs=0.01)
        if form == "one frame":
            assert numbers["position"] == pytest.approx(building.sides[1] / 2, rel=0.1)
    elif name == "base_mass_error":
        assert numbers["relative_error"] == pytest.approx(0.15, abs=0.01)


def test_a_biased_sensor_is_named_with_its_direction(tmp_path):
    diagnosis = diagnosed(nominal(), tmp_path, bias=0.05)
    assert [cause.name for cause in diagnosis.causes] == ["sensor_bias"]
    assert f"{blind.BIASED} is off by" in diagnosis.causes[0].evidence
