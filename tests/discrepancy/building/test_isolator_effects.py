"""Effects of the isolators in a building: which stand around the law, and which are proposed."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import isolation_sim as iso
from ground_motions import el_centro_1940
from isolation_sim.discrepancy.building.causes.isolator_causes import effect_in_plan, layer_effect
from isolation_sim.discrepancy.building.comparison import compare_building, with_causes
from isolation_sim.discrepancy.building.isolator_effects import (
    DAMPER,
    ISOLATOR_EFFECTS,
    LAYER_CAUSES,
    around_the_law,
)
from isolation_sim.discrepancy.building.model import BuildingModel, building_model
from isolation_sim.discrepancy.building.record import BuildingRecord
from isolation_sim.discrepancy.building.search.cause_exchange import exchange_for_one
from isolation_sim.discrepancy.building.search.cause_search import CauseSearch, candidates
from isolation_sim.discrepancy.building.search.layer_effects import proposed_effects
from isolation_sim.discrepancy.diagnose import diagnose_building
from isolation_sim.effects import EFFECTS, Signals, effect
from isolation_sim.laws import LAWS
from isolation_sim.structures import load_change_rows, plan_building

CHANNELS = (
    "base_acceleration_m_s2",
    *(f"floor{k}_acceleration_m_s2" for k in range(1, 6)),
    "isolator_displacement_m",
)
SMOOTH, DAHL = ISOLATOR_EFFECTS["coulomb_friction"], effect("coulomb_friction", "dahl")
HEATING = effect("self_heating", "exponential")
RUBBER = effect("stress_softening", "rubber")


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


def _recorded(isolated, one, numbers, seed=2, current=False):
    """A record of a building whose isolators have one more effect, with noise."""
    record, random = _blank(current), np.random.default_rng(seed)
    model = building_model(isolated, [record])
    values = with_causes(model, ((layer_effect(model, [record], one, numbers), numbers),)).predict(
        record
    )
    values += 0.003 * np.sqrt(np.mean(values**2, axis=0)) * random.standard_normal(values.shape)
    return replace(record, response=dict(zip(CHANNELS, values.T, strict=True)))


def test_a_law_has_one_form_of_each_effect():
    assert around_the_law([SMOOTH]) == tuple(ISOLATOR_EFFECTS.values())
    for present in ([DAHL], [HEATING, SMOOTH], [RUBBER]):
        around = around_the_law(present)
        causes = [one.cause for one in around]
        assert len(set(causes)) == len(causes) == len({*causes, *(e.cause for e in present)})
        assert set(present) <= set(around)


def test_an_effect_that_is_tried_last_stands_around_the_law_with_those_beside_it_alone():
    assert around_the_law([HEATING]) == (HEATING,)
    # in the order in which they act with the others
    assert around_the_law([HEATING, DAHL]) == (DAHL, HEATING)
    assert around_the_law([HEATING, SMOOTH]) == (SMOOTH, HEATING)
    assert around_the_law([]) == ()


def test_causes_that_are_proposed_are_of_the_catalogue():
    assert set(LAYER_CAUSES) <= set(EFFECTS)


@pytest.mark.parametrize(
    ("one", "numbers"),
    [(effect("weak_rate_dependence", "logarithmic"), (0.05, 0.01)), (RUBBER, (5e6, 0.04))],
    ids=["whole force", "rubber"],
)
def test_the_motion_of_the_isolators_proposes_what_they_lack(one, numbers):
    isolated = _isolated()
    record = _recorded(isolated, one, numbers)
    comparison = compare_building(building_model(isolated, [record]), [record])
    (first, *_), *_ = proposed_effects(comparison, ())
    assert (first.name, first.form, first.last) == (one.cause, one.form, True)
    assert first.starts[0] == pytest.approx(numbers, rel=0.3)


def test_a_form_of_fewer_numbers_is_proposed_beside_the_nearest():
    isolated = _isolated()
    record = _recorded(isolated, effect("coulomb_friction", "lugre"), (3e5, 4e-3, 0.8, 0.05))
    comparison = compare_building(building_model(isolated, [record]), [record])
    forms = proposed_effects(comparison, ())[0]
    assert [one.form for one in forms] == ["lugre", "dahl"]


def test_a_number_at_the_end_of_its_range_is_fitted_from_inside_as_well():
    isolated, record = _isolated(), _blank()
    model = building_model(isolated, [record])
    starts = layer_effect(model, [record], HEATING, (1e-7, 1e5)).starts
    assert starts == ((1e-7, 1e5), (1e-7, 100.0))
    assert layer_effect(model, [record], HEATING, (1e-7, 9.0)).starts == ((1e-7, 9.0),)


def test_effects_of_a_part_of_the_force_are_proposed_beside_those_of_the_whole():
    isolated = _isolated()
    record = _recorded(isolated, effect("self_heating", "core"), (2e-6, 20.0, 1e7))
    comparison = compare_building(building_model(isolated, [record]), [record])
    names = "self_heating", "cyclic_degradation"
    proposed = proposed_effects(comparison, (), names, 0.0, of_parts=True)
    of_parts = [any(p.unit in ("N/m", "N s/m") for p in one.parameters) for one, *_ in proposed]
    found = sorted(zip((one.name for one, *_ in proposed), of_parts, strict=True))
    assert found == [(name, part) for name in sorted(names) for part in (False, True)]


def test_biaxial_isolators_that_heat_are_proposed_to():
    plan = plan_building([2e5], [2e8], [1.5e8], base_mass=2.5e5, plan=(20.0, 12.0))
    core = iso.law("park_wen_ang", {
        "k": 1.2e6, "c": 2e4, "Q": 6e4, "u_y": 0.01, "beta": 0.5, "gamma": 0.5,
    })  # fmt: skip
    ground = el_centro_1940()
    ground = (replace(ground, name="x"), replace(ground, name="y"))
    names = (
        *(f"{place}_{axis}_acceleration_m_s2" for place in ("base", "floor1") for axis in "xy"),
        *(f"isolator_{axis}_displacement_m" for axis in "xy"),
    )
    n = len(ground[0])
    blank = BuildingRecord("quake", ground, {c: np.arange(n) % 3 - 1.0 for c in names})
    model = building_model(plan.on(core, biaxial=True), [blank])
    heat = effect_in_plan(model, [blank], effect("self_heating", "core"))
    numbers = (2e-6, 50.0, 1.2e6)
    values = with_causes(model, ((heat, numbers),)).predict(blank)
    values += 0.003 * np.std(values) * np.random.default_rng(1).standard_normal(values.shape)
    record = replace(blank, response=dict(zip(names, values.T, strict=True)))
    comparison = compare_building(model, [record])
    ((found,),) = proposed_effects(comparison, (), ["self_heating"])
    assert (found.form, found.last) == ("core", True)
    fit = comparison.fit((), ((found, found.starts[0]),))
    left, misfit = (comparison.above_noise(one)[0] for one in (fit, comparison.evaluate(())))
    assert left < 0.1 * misfit


def test_nothing_is_proposed_to_isolators_whose_load_changes():
    plan = plan_building(
        [2e5], [2e8], [1.5e8], base_mass=2.5e5, plan=(20.0, 12.0), heights=[3.0]
    )  # fmt: skip
    pendulum = iso.law("friction_pendulum", LAWS["friction_pendulum"].example)
    rows = load_change_rows(plan, overturning=True)
    isolated = plan.on(pendulum, biaxial=True, load_changes=rows)
    assert {law.directions for law in isolated.group_laws} == {3}
    comparison = SimpleNamespace(model=BuildingModel(isolated, plan))
    assert proposed_effects(comparison, ()) == []


def test_nothing_is_proposed_for_what_other_numbers_of_an_effect_explain():
    isolated = _isolated()
    record = _recorded(isolated, DAHL, (3e5, 4e-3))
    model = building_model(isolated, [record])
    comparison = compare_building(model, [record])
    numbers = (2e5, 8e-3)
    friction = layer_effect(model, [record], DAHL, numbers)
    assert proposed_effects(comparison, ((friction, numbers),)) == []


@pytest.mark.parametrize("worse_where_held_out", [False, True])
def test_one_effect_takes_the_place_of_two_numbers_of_the_law(worse_where_held_out):
    """Another force and another stiffness imitate friction beside a building's other causes."""
    isolated = _isolated()
    record = _recorded(isolated, DAHL, (3e5, 4e-3))
    model = building_model(isolated, [record])
    space = CauseSearch(compare_building(model, [record]))
    named = {c.name: c for c in candidates(model, [record])}
    two = [named["isolator_force_error"], named["isolator_stiffness_error"]]
    both = space.comparison.fit((), tuple((one, one.starts[0]) for one in two))
    if worse_where_held_out:
        both.__dict__["held_out_cost"] = 0.0
    found = exchange_for_one(space, both)
    assert (found is both) == worse_where_held_out
    if not worse_where_held_out:
        ((cause, _),) = found.cause_values
        assert cause.name == "coulomb_friction"
    alone = space.comparison.fit((), both.cause_values[:1], 1)
    assert exchange_for_one(space, alone) is alone


@pytest.mark.parametrize(("second", "tried"), [((2e5, 0.6), True), (None, False)])
def test_effects_beside_one_that_is_tried_last_have_to_help_along_the_motion(second, tried):
    """Each law of several effects is compiled for longer than it is simulated."""
    isolated = _isolated()
    record = _recorded(isolated, DAHL, (3e5, 4e-3))
    model = building_model(isolated, [record])
    friction = layer_effect(model, [record], DAHL, (3e5, 4e-3)), (3e5, 4e-3)
    dampers = [c for c in candidates(model, [record]) if c.form == DAMPER.form]
    if second:
        true = with_causes(model, (friction, (dampers[0], second)))
        values = dict(zip(CHANNELS, true.predict(record).T, strict=True))
        record = replace(record, response=values)
    comparison = compare_building(model, [record])
    space = CauseSearch(comparison)
    others = [c for c in candidates(model, [record]) if c.name == "base_mass_error"]
    current = comparison.evaluate((friction,))
    assert space.fits.helpful(current, [*dampers, *others]) == [*dampers * tried, *others]
    # without such an effect all stand around one law
    assert space.fits.helpful(space.before, dampers) == dampers


def test_a_low_power_of_the_velocity_does_not_jump():
    """The simulation of a jump takes 50 times as long."""
    signals = Signals(0.0, 1e-6, 0.0, 0.0, 0.0, 20.0)
    assert DAMPER.force(signals, (), (1.0, 0.2)) < 0.02
    at_once = DAMPER.force(signals._replace(v=0.01), (), (1.0, 0.2))
    assert at_once == pytest.approx(0.1**0.2, rel=1e-3)


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


@pytest.mark.parametrize("current", [False, True])
def test_remanence_needs_a_current(current):
    one, isolated = effect("magnetic_remanence", "play"), _isolated(4e6)
    record = _recorded(isolated, one, (0.6, 0.5), current=True)
    if not current:
        record = replace(record, current=None)
    comparison = compare_building(building_model(isolated, [record]), [record])
    names = [forms[0].name for forms in proposed_effects(comparison, ())]
    assert ("magnetic_remanence" in names) == current


def test_none_is_proposed_where_the_layer_is_no_device_test():
    record, isolated = _blank(), _isolated()
    device = isolated.elements[0].device
    several = isolated.structure.with_element(device, "base", name="isolator")
    several = several.with_element(device, -several.elements[0].direction, name="other")
    comparison = compare_building(building_model(several, [record]), [record])
    assert proposed_effects(comparison, ()) == []


def test_numbers_are_of_all_isolators_together():
    device = iso.law("kelvin_voigt", {"k": 1.2e6, "c": 1.0e5}).scaled(length=2.0, force=10.0)
    model = building_model(iso.reference_building().on(device), [_blank()])
    heating = layer_effect(model, [_blank()], HEATING, (1e-8, 20.0))
    factors = {p.name: p.factor for p in heating.parameters}
    # a joule in the device is 20 in the building
    assert factors == pytest.approx({"gain": 1 / 20, "cooling": 1.0})


@pytest.mark.parametrize("form", [SMOOTH, DAHL])
def test_friction_is_no_sharper_than_a_record_shows(form):
    """Sharper friction is simulated for minutes. At its bound it is Coulomb's, and no imitation."""
    record = _blank()
    model = building_model(_isolated(), [record])
    friction = layer_effect(model, [record], form, (1e4, 1e-6))
    least = friction.parameters[1].lower
    peak = np.abs(record.displacement("")).max()
    assert 1e-4 * peak < least < 5e-3 * peak
    assert friction.starts == ((1e4, least),)
    comparison = compare_building(model, [record])
    assert not comparison.evaluate(((friction, (1e4, least)),)).at_bound


def test_a_number_at_its_bound_is_reported():
    record = _blank()
    model = building_model(_isolated(), [record])
    heating = layer_effect(model, [record], HEATING, (1e-8, 20.0))
    comparison = compare_building(model, [record])
    ends = [comparison.evaluate(((heating, (1e-8, cooling)),)).at_bound for cooling in (20.0, 1e5)]
    assert ends == [False, True]
    assert not comparison.evaluate(()).at_bound


@pytest.mark.slow
def test_friction_with_presliding_is_named_with_its_length():
    """Without a velocity scale: the smooth form does not follow it down to the noise."""
    isolated = _isolated()
    record = _recorded(isolated, DAHL, (3e5, 4e-3))
    diagnosis = diagnose_building(record, isolated, tiers="causes")
    (cause,) = diagnosis.causes
    assert cause.name == "coulomb_friction"
    assert cause.parameters["length"].value == pytest.approx(4e-3, rel=0.2)
    assert diagnosis.verdict == "explained"


@pytest.mark.slow
def test_rubber_that_softens_beside_a_damper_is_named_with_its_length():
    """A softening of the whole force would take a share of the damper's, too."""
    isolated = _isolated()
    record = _recorded(isolated, RUBBER, (5e6, 0.04))
    diagnosis = diagnose_building(record, isolated, tiers="causes")
    (cause,) = diagnosis.causes
    assert (cause.name, cause.form) == ("stress_softening", "rubber")
    assert cause.parameters["length"].value == pytest.approx(0.04, rel=0.2)
    assert diagnosis.verdict == "explained"
