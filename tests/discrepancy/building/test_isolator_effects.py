"""Effects of the isolators in a building: which stand around the law, and which are tried late."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import isolation_sim as iso
from ground_motions import el_centro_1940
from isolation_sim.discrepancy.building.cause_search import candidates
from isolation_sim.discrepancy.building.comparison import compare_records, with_causes
from isolation_sim.discrepancy.building.isolator_effects import (
    ISOLATOR_EFFECTS,
    LAST_EFFECTS,
    around_the_law,
)
from isolation_sim.discrepancy.building.model import building_model
from isolation_sim.discrepancy.building.record import BuildingRecord
from isolation_sim.discrepancy.diagnose import diagnose_building

CHANNELS = (
    "base_acceleration_m_s2",
    *(f"floor{k}_acceleration_m_s2" for k in range(1, 6)),
    "isolator_displacement_m",
)
LATE = {(one.cause, one.form): one for one in LAST_EFFECTS}
SMOOTH, DAHL = ISOLATOR_EFFECTS["coulomb_friction"], LATE["coulomb_friction", "dahl"]


def _isolated(by_current=0.0):
    stiffness = [1.2e7, by_current] if by_current else 1.2e7
    return iso.reference_building().on(iso.law("kelvin_voigt", {"k": stiffness, "c": 1.0e6}))


def _blank(current=False):
    ground = replace(el_centro_1940(), name="quake")
    n = len(ground)
    wave = 1.5 + np.sin(np.arange(n) * ground.dt)
    return BuildingRecord(
        "quake",
        ground,
        {c: np.arange(n) % 3 - 1.0 for c in CHANNELS},
        current=wave if current else None,
    )


def _late(isolated, record):
    model = building_model(isolated, [record])
    listed = [one for one in candidates(model, [record]) if one.last]
    return model, {(one.name, one.form): one for one in listed}


def test_a_law_has_one_form_of_each_effect():
    every = (*ISOLATOR_EFFECTS.values(), *LAST_EFFECTS)
    assert around_the_law([]) == tuple(ISOLATOR_EFFECTS.values())
    assert around_the_law([SMOOTH]) == tuple(ISOLATOR_EFFECTS.values())
    heating, rubber = LATE["self_heating", "exponential"], LATE["stress_softening", "rubber"]
    for present in ([DAHL], [heating, SMOOTH], [rubber]):
        around = around_the_law(present)
        causes = [one.cause for one in around]
        assert len(set(causes)) == len(causes) == len({one.cause for one in every})
        assert set(present) <= set(around)


def test_a_wall_is_beyond_most_of_the_motion():
    """A gap of less than the RMS displacement would imitate rubber that stiffens."""
    record = _blank()
    wave = 0.1 * np.sin(np.arange(len(record)) / 9)
    record = replace(record, response={**record.response, CHANNELS[-1]: wave})
    model = building_model(_isolated(), [record])
    walls = [c for c in candidates(model, [record]) if c.name == "moat_impact"]
    rms = float(np.sqrt(np.mean(wave**2)))
    assert len(walls) > 4
    for wall in walls:
        gap = wall.parameters[1]
        if not wall.form.startswith("one_side"):  # there the sign of the gap is the side
            assert gap.lower == pytest.approx(rms)
        assert all(gap.lower < start[1] < gap.upper for start in wall.starts)
        # on one side, too, a smaller gap acts as one of the RMS displacement
        for values in wall.starts:
            changed = wall.apply(model, (values[0], 0.1 * rms, *values[2:]))
            (numbers,) = changed.effects.values()
            if wall.form.startswith("one_side"):
                assert numbers["gap"] == pytest.approx(rms)


def test_remanence_needs_a_current():
    assert ("magnetic_remanence", "play") not in _late(_isolated(), _blank())[1]
    assert ("magnetic_remanence", "play") not in _late(_isolated(4e6), _blank())[1]
    assert ("magnetic_remanence", "play") in _late(_isolated(4e6), _blank(current=True))[1]


def test_numbers_are_of_all_isolators_together():
    device = iso.law("kelvin_voigt", {"k": 1.2e6, "c": 1.0e5}).scaled(length=2.0, force=10.0)
    _, late = _late(iso.reference_building().on(device), _blank())
    factors = {p.name: p.factor for p in late["self_heating", "exponential"].parameters}
    # a joule in the device is 20 in the building
    assert factors == pytest.approx({"gain": 1 / 20, "cooling": 1.0})


def test_a_number_at_its_bound_is_reported():
    record = _blank()
    model, late = _late(_isolated(), record)
    heating = late["self_heating", "exponential"]
    comparison = compare_records(model, [record])
    ends = [comparison.evaluate(((heating, (1e-8, cooling)),)).at_bound for cooling in (20.0, 1e5)]
    assert ends == [False, True]
    assert not comparison.evaluate(()).at_bound


@pytest.mark.slow
def test_friction_with_presliding_is_named_with_its_length():
    """Without a velocity scale: the smooth form does not follow it down to the noise."""
    isolated, random = _isolated(), np.random.default_rng(2)
    model, late = _late(isolated, _blank())
    true = with_causes(model, ((late["coulomb_friction", "dahl"], (3e5, 4e-3)),))
    values = true.predict(_blank())
    values += 0.003 * np.sqrt(np.mean(values**2, axis=0)) * random.standard_normal(values.shape)
    record = replace(_blank(), response=dict(zip(CHANNELS, values.T, strict=True)))
    diagnosis = diagnose_building(record, isolated, tiers="causes")
    (cause,) = diagnosis.causes
    assert (cause.name, cause.form) == ("coulomb_friction", "dahl")
    assert cause.parameters["length"].value == pytest.approx(4e-3, rel=0.2)
    assert diagnosis.verdict == "explained"


@pytest.mark.slow
def test_rubber_that_softens_beside_a_damper_is_named_with_its_length():
    """A softening of the whole force would take a share of the damper's, too."""
    isolated, random = _isolated(), np.random.default_rng(2)
    model, late = _late(isolated, _blank())
    true = with_causes(model, ((late["stress_softening", "rubber"], (5e6, 0.04)),))
    values = true.predict(_blank())
    values += 0.003 * np.sqrt(np.mean(values**2, axis=0)) * random.standard_normal(values.shape)
    record = replace(_blank(), response=dict(zip(CHANNELS, values.T, strict=True)))
    diagnosis = diagnose_building(record, isolated, tiers="causes")
    (cause,) = diagnosis.causes
    assert (cause.name, cause.form) == ("stress_softening", "rubber")
    assert cause.parameters["length"].value == pytest.approx(0.04, rel=0.2)
    assert diagnosis.verdict == "explained"
