"""A fast part of the blind study of building records, ``python -m studies.blind_buildings``."""

from __future__ import annotations

import pickle

import pytest

from studies.blind.building_cases import BuildingCase, all_forms, clean, pairs, singles
from studies.blind.building_score import (
    BuildingScored,
    answer,
    confusion_table,
    rates,
    storey_right,
)
from studies.blind.score import NOTHING
from studies.blind_buildings import score


@pytest.mark.usefixtures("short_motion", "few_causes")
def test_the_storey_that_lost_stiffness_is_named_first():
    case = next(singles())
    # the study asks other processes
    result = pickle.loads(pickle.dumps(score(case)))
    assert answer(result.diagnosis) == case.forms[0][0] == "storey_stiffness_loss"
    assert storey_right(result)
    loss = result.diagnosis["causes"][0]["parameters"]["loss"]
    assert loss["value"] == pytest.approx(case.record.severities[0], rel=0.1)


@pytest.mark.usefixtures("short_motion")
def test_nothing_is_named_where_nothing_is_hidden():
    result = score(next(clean(1)))
    assert answer(result.diagnosis) == NOTHING and not result.diagnosis["causes"]


def test_lists_hold_every_form_and_pairs_of_two_names():
    assert [form for case in singles((0.1,)) for form in case.forms] == all_forms()
    assert len({case.label for case in [*singles(), *pairs(9), *clean(9)]}) == 36 + 9 + 9
    for case in pairs(9):
        assert len({name for name, _ in case.forms}) == 2
        assert [(fault.name, fault.form) for fault in case.faults] == list(case.forms)


@pytest.mark.slow
@pytest.mark.usefixtures("short_motion")
def test_a_pair_is_more_than_either_alone():
    case = next(pairs(1))
    alone = [BuildingCase("single", case.seed, (form,), case.size) for form in case.forms]
    assert case.record.size > max(one.record.size for one in alone) > 0.5 * case.size
    assert case.record.severities == tuple(one.record.severities[0] for one in alone)


def diagnosis(*causes, verdict="explained", storey=None):
    at = {} if storey is None else {"storey": {"value": storey}}
    return {"verdict": verdict, "causes": [{"name": name, "parameters": at} for name in causes]}


def ladder_at(after, offered):
    errors = {"error_before": {"held_out": 0.1}, "error_after": {"held_out": after}}
    return errors | {"ladder": {"offered": offered}}


def test_rates_of_diagnoses_written_by_hand():
    lost = BuildingCase("single", 5, (("storey_stiffness_loss", "weak_from_the_start"),), 0.1)
    storey = lost.faults[0].storey
    other = storey % 5 + 1
    heavy = BuildingCase("single", 5, (("base_mass_error", "heavier"),), 0.1)
    pair = BuildingCase("pair", 5, lost.forms + heavy.forms, 0.1)
    nothing = BuildingCase("clean", 5)
    outside = BuildingCase("outside", 5, (("outside", "squeeze_film"),), 0.1)
    results = [
        BuildingScored(lost, diagnosis("storey_stiffness_loss", storey=storey)),
        BuildingScored(lost, diagnosis("storey_stiffness_loss", "moat_impact", storey=other)),
        BuildingScored(heavy, diagnosis("soil_flexibility", "base_mass_error")),
        BuildingScored(pair, diagnosis("base_mass_error")),
        BuildingScored(pair, diagnosis("base_mass_error", "storey_stiffness_loss", storey=storey)),
        BuildingScored(outside, diagnosis() | ladder_at(0.02, "equation")),
        BuildingScored(outside, diagnosis("coulomb_friction") | ladder_at(0.06, "causes")),
        BuildingScored(nothing, diagnosis(verdict="adequate")),
        BuildingScored(nothing, diagnosis(verdict="unexplained")),
        BuildingScored(nothing, diagnosis("sensor_bias")),
    ]  # fmt: skip
    values = {name: (rate.hits, rate.cases) for name, rate in rates(results).items()}
    assert values == {
        "single named first": (2, 3),
        "single named with nothing beside it": (1, 3),
        "storey right where one lost stiffness": (2, 3),
        "pair both named": (1, 2),
        "outside: an equation or a learned term offered": (1, 2),
        "outside: held-out error halved": (1, 2),
        "cause named on clean records": (1, 3),
        "clean records called inadequate": (2, 3),
    }
    assert confusion_table(results).splitlines()[2:] == [
        "| base_mass_error.heavier | 0.1 | 1 | 0 | soil_flexibility 1 |",
        "| clean | 0 | 3 | 1 | unexplained 1, sensor_bias 1 |",
        "| storey_stiffness_loss.weak_from_the_start | 0.1 | 2 | 2 |  |",
    ]
