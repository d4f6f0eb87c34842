"""The place of what a model misses: an unknown force against causes that only imitate it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import isolation_sim as iso
from ground_motions import el_centro_1940
from isolation_sim.discrepancy.building import localisation
from isolation_sim.discrepancy.building.comparison import compare_building, with_causes
from isolation_sim.discrepancy.building.localisation import (
    ISOLATION_LAYER,
    is_elsewhere,
    unknown_force,
)
from isolation_sim.discrepancy.building.model import building_model
from isolation_sim.discrepancy.building.record import BuildingRecord
from isolation_sim.discrepancy.building.search import cause_search, searches
from isolation_sim.discrepancy.building.search.cause_fits import CauseFits
from isolation_sim.discrepancy.building.search.cause_search import CauseSearch, candidates
from isolation_sim.discrepancy.diagnose import diagnose_building
from isolation_sim.errors import InputError

NOISE = 0.01
CHANNELS = (
    "base_acceleration_m_s2",
    *(f"floor{k}_acceleration_m_s2" for k in range(1, 6)),
    "isolator_displacement_m",
)


@pytest.fixture(scope="module")
def isolated():
    return iso.reference_building().on(iso.law("kelvin_voigt", {"k": 1.2e7, "c": 1.0e6}))


def _blank(end=None):
    ground = el_centro_1940()
    ground = replace(ground, name="quake", acceleration=ground.acceleration[:end])
    return BuildingRecord("quake", ground, {c: np.arange(len(ground)) % 3 - 1.0 for c in CHANNELS})


def _record(model, end=None):
    """Noisy channels of a building's model, up to a sample."""
    blank, random = _blank(end), np.random.default_rng(1)
    values = model.predict(blank)
    values += NOISE * np.sqrt(np.mean(values**2, axis=0)) * random.standard_normal(values.shape)
    return replace(blank, response=dict(zip(CHANNELS, values.T, strict=True)))


def _cause(isolated, name, place, values):
    blank = _blank()
    listed = candidates(building_model(isolated, [blank]), [blank])
    return next(one for one in listed if (one.name, one.place) == (name, place)), values


def _with_damper(isolated):
    """The same with a tuned mass of 5 % on the fifth floor, its last degree of freedom."""
    structure = isolated.structure
    mass, n = 0.05 * structure.total_mass, structure.n_dofs
    row = np.eye(n + 1)[n] - np.eye(n + 1)[n - 1]
    stiffness = mass * (2 * np.pi * 1.2) ** 2
    damped = replace(
        structure,
        mass=np.pad(structure.mass, (0, 1)) + mass * np.diag(np.eye(n + 1)[n]),
        damping=np.pad(structure.damping, (0, 1))
        + 0.1 * np.sqrt(stiffness * mass) * np.outer(row, row),
        stiffness=np.pad(structure.stiffness, (0, 1)) + stiffness * np.outer(row, row),
        influence=np.append(structure.influence, np.ones((1, 1)), axis=0),
        names=(*structure.names, "damper"),
        drift_rows=np.pad(structure.drift_rows, ((0, 0), (0, 1))),
    )
    return damped.on(isolated.elements[0].device)


@pytest.mark.parametrize(
    ("name", "place", "values", "result"),
    [
        ("storey_stiffness_loss", "storey3", (0.2,), "storey3"),
        ("floor_mass_error", "floor2", (0.3,), "floor2"),
        ("isolator_amplitude_softening", "", (0.4, 0.03, 2.0, 1.0), ISOLATION_LAYER),
        ("storey_stiffness_loss", "storey1", (0.2,), "storey1 or floor1"),
    ],
)
@pytest.mark.parametrize("end", [None, 250])
@pytest.mark.usefixtures("all_draws")
def test_a_force_is_placed_where_the_model_is_wrong(isolated, name, place, values, result, end):
    """Also in a record that ends in strong motion."""
    true = with_causes(
        building_model(isolated, [_blank()]), (_cause(isolated, name, place, values),)
    )
    record = _record(true, end)
    comparison = compare_building(building_model(isolated, [record]), [record])
    unknown = unknown_force(comparison, comparison.evaluate(()), ())
    assert unknown is not None
    assert unknown.place == result and unknown.beside == ()
    assert unknown.left < 0.03 and unknown.left_by_causes == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("name", "place", "values", "best", "elsewhere"),
    [
        ("storey_stiffness_loss", "storey3", (0.2,), "the cause", True),
        ("storey_stiffness_loss", "storey3", (0.2,), "nothing", False),
        ("isolator_force_error", "", (-0.1,), "the cause", False),
        ("isolator_amplitude_softening", "", (0.4, 0.03, 2.0, 1.0), "nothing", False),
    ],
)
def test_effects_of_isolators_are_proposed_where_their_force_may_leave_least(
    isolated, monkeypatch, name, place, values, best, elsewhere
):
    cause = (_cause(isolated, name, place, values),)
    record = _record(with_causes(building_model(isolated, [_blank()]), cause))
    comparison = compare_building(building_model(isolated, [record]), [record])
    fitted = comparison.evaluate(cause if best == "the cause" else ())
    assert is_elsewhere(comparison, (), fitted.cause_values) is elsewhere
    proposed = []
    monkeypatch.setattr(cause_search, "proposed_effects", lambda *_: proposed.append(1) or [])
    monkeypatch.setattr(CauseSearch, "is_explained", lambda *_: False)
    space = CauseSearch(comparison, choices=[])
    monkeypatch.setattr(
        CauseFits, "refined", lambda self, current, rough: [fitted] if not proposed else []
    )
    assert space.candidates(space.before)[0] is fitted
    assert bool(proposed) is not elsewhere


@pytest.mark.parametrize(
    ("levels", "place"),
    [((0, 3), "floor3 (from outside or from the base)"), ((1, 4), "between floor1 and floor4")],
)
def test_a_damper_over_several_storeys_is_placed_between_its_ends(isolated, levels, place):
    model = building_model(isolated, [_blank()])
    row = np.eye(6)[levels[1]] - np.eye(6)[levels[0]]
    damped = model.changed(damping=model.structure.damping + 5e6 * np.outer(row, row))
    record = _record(damped)
    comparison = compare_building(model, [record])
    unknown = unknown_force(comparison, comparison.evaluate(()), ())
    assert unknown is not None and unknown.words.endswith(place) and unknown.left < 0.03


def test_places_are_told_apart_by_the_noise_where_one_leaves_noise_alone(isolated):
    """A force above others moves the channels nearly as they do."""
    model = building_model(isolated, [_blank()])
    record = _record(building_model(_with_damper(isolated), [_blank()]))
    comparison = compare_building(model, [record])
    unknown = unknown_force(comparison, comparison.evaluate(()), ())
    assert unknown is not None
    assert unknown.place == "floor5"


def test_a_signal_of_one_sensor_alone_is_distinguished_from_a_force(isolated):
    """As torsion that one sensor sees beside the centre of its floor."""
    model, name = building_model(isolated, [_blank()]), "floor3_acceleration_m_s2"
    record = _record(model)
    sound = record.response[name]
    twist = 0.2 * sound.std() * np.sqrt(2) * np.sin(2 * np.pi * 1.3 * record.time)
    record = replace(record, response={**record.response, name: sound + twist})
    comparison = compare_building(model, [record])
    unknown = unknown_force(comparison, comparison.evaluate(()), ())
    assert unknown is not None and (unknown.place, unknown.channel) == ("", name)
    assert unknown.words == f"an unknown signal in {name} alone" and unknown.left < 0.05


def test_a_cause_in_the_right_place_keeps_its_name(isolated, monkeypatch):
    """One in the same place may only have another form; one elsewhere imitates."""
    model = building_model(isolated, [_blank()])
    right = _cause(isolated, "storey_stiffness_loss", "storey3", (0.2,))
    record = _record(with_causes(model, (right,)))
    comparison = compare_building(model, [record])
    nominal = comparison.evaluate(())
    left = {(): 1.0, "far": 0.1}

    def remains(comparison, segments, causes):
        misfit = 1e6 * left["far" if causes else ()]
        return {("", ""): misfit, ("storey3", ""): 0.0, ("floor2", ""): 1e5}

    monkeypatch.setattr(localisation, "_left", remains)
    assert unknown_force(comparison, nominal, (right,)) is None
    elsewhere = _cause(isolated, "storey_stiffness_loss", "storey5", (0.2,))
    unknown = unknown_force(comparison, nominal, (elsewhere,))
    assert unknown is not None and unknown.place == "storey3"


@pytest.mark.parametrize(("without_mass", "place"), [(0.0, "storey3"), (0.05, None)])
def test_a_force_stands_for_one_cause_only_beside_the_others(
    isolated, monkeypatch, without_mass, place
):
    """If it needs no mass beside it, the mass is no cause, whatever the form of the other one."""
    model = building_model(isolated, [_blank()])
    storey = _cause(isolated, "storey_stiffness_loss", "storey3", (0.2,))
    mass = _cause(isolated, "floor_mass_error", "floor4", (0.05,))
    record = _record(with_causes(model, (storey,)))
    comparison = compare_building(model, [record])

    def remains(comparison, segments, causes):
        by_causes = {(): 1e6, (storey, mass): 2e4}.get(causes, 5e5)
        return {("", ""): by_causes, ("storey3", ""): 0.0 if mass in causes else 1e6 * without_mass}

    monkeypatch.setattr(localisation, "_left", remains)
    unknown = unknown_force(comparison, comparison.evaluate(()), (storey, mass))
    assert (unknown and unknown.place) == place
    assert unknown is None or unknown.beside == ()


def test_a_cause_that_is_needed_stays_beside_the_force(isolated):
    right = _cause(isolated, "storey_stiffness_loss", "storey3", (0.6,))
    other = _cause(isolated, "isolator_amplitude_softening", "", (0.4, 0.03, 2.0, 1.0))
    wrong = _cause(isolated, "floor_mass_error", "floor4", (0.05,))
    true = with_causes(building_model(isolated, [_blank()]), (right, other))
    record = _record(true)
    comparison = compare_building(building_model(isolated, [record]), [record])
    nominal = comparison.evaluate(())
    unknown = unknown_force(comparison, nominal, (wrong, right))
    assert unknown is not None
    assert unknown.place == ISOLATION_LAYER and unknown.beside == (right,)
    # both causes leave nothing that a force would explain
    assert unknown_force(comparison, nominal, (right, other)) is None


def test_an_element_without_stiffness_at_rest_leaves_the_causes(isolated, monkeypatch):
    def raising(*arguments):
        raise InputError("the law is not smooth at rest")

    right = _cause(isolated, "storey_stiffness_loss", "storey3", (0.6,))
    record = _record(with_causes(building_model(isolated, [_blank()]), (right,)))
    comparison = compare_building(building_model(isolated, [record]), [record])
    nominal = comparison.evaluate(())
    assert unknown_force(comparison, nominal, ()) is not None
    monkeypatch.setattr(localisation, "frequency_response", raising)
    assert unknown_force(comparison, nominal, ()) is None


def test_the_best_pair_is_the_right_one(isolated):
    """Alone, the softer storey leaves three times what the base's mass does."""
    causes = (
        _cause(isolated, "storey_stiffness_loss", "storey2", (0.4,)),
        _cause(isolated, "isolator_force_error", "", (-0.12,)),
    )
    model = building_model(isolated, [_blank()])
    comparison = compare_building(model, [record := _record(with_causes(model, causes))])
    names = (
        "base_mass_error", "floor_mass_error", "storey_stiffness_loss", "isolator_force_error",
        "extra_storey_damping",
    )  # fmt: skip
    choices = [one for one in candidates(model, [record]) if one.name in names]
    space = CauseSearch(comparison.expecting(0.05), choices=choices)
    pair = space.pairs()[0].cause_values
    assert [cause.label for cause, _ in pair] == [
        "storey_stiffness_loss (storey2)", "isolator_force_error",
    ]  # fmt: skip
    begun = space.beginning_with(pair)
    assert dict(begun.cause_values)[pair[0][0]][0] == pytest.approx(0.4, rel=0.02)


@pytest.mark.parametrize("end", [None, 250])
@pytest.mark.parametrize(
    ("of_layer", "values"),
    [("isolator_force_error", (-0.12,)), ("isolator_amplitude_softening", (0.1, 0.03, 2.0, 1.0))],
)
def test_what_is_wrong_in_the_structure_shows_beside_any_force(isolated, of_layer, values, end):
    """Whatever the isolators lack, and although the record ends in strong motion."""
    of_isolators = _cause(isolated, of_layer, "", values)
    weak = _cause(isolated, "storey_stiffness_loss", "storey2", (0.2,))
    model, found = building_model(isolated, [_blank()]), []
    for causes in ((of_isolators,), (weak, of_isolators)):
        record = _record(with_causes(model, causes), end)
        comparison = compare_building(building_model(isolated, [record]), [record])
        found.append(CauseSearch(comparison).beside_any_force()[0])
    assert found[0] == ()
    assert [cause.label for cause, _ in found[1]] == ["storey_stiffness_loss (storey2)"]
    assert found[1][0][1][0] == pytest.approx(0.2, rel=0.1)


@pytest.mark.slow
@pytest.mark.usefixtures("few_causes")
def test_a_tuned_mass_is_blamed_on_its_floor_and_on_no_cause(isolated):
    record = _record(building_model(_with_damper(isolated), [_blank()]))
    diagnosis = diagnose_building(record, isolated, tiers="causes")
    assert diagnosis.verdict == "unexplained" and diagnosis.causes == ()
    assert diagnosis.depends_on[0].startswith("an unknown force at floor5")
    # no cause is taken at first, which would be said to imitate it
    assert "With an unknown force at floor5" in diagnosis.steps[-1].text


@pytest.mark.usefixtures("few_causes")
def test_two_causes_that_a_third_imitates_are_found_beside_any_force(isolated):
    """All floors seem heavier, which keeps the softer storey and the smaller force out."""
    causes = (
        _cause(isolated, "storey_stiffness_loss", "storey2", (0.4,)),
        _cause(isolated, "isolator_force_error", "", (-0.12,)),
    )
    record = _record(with_causes(building_model(isolated, [_blank()]), causes))
    diagnosis = diagnose_building(record, isolated, tiers="causes")
    assert diagnosis.verdict == "explained"
    found = {(one.name, one.place): one.parameters for one in diagnosis.causes}
    assert found.keys() == {("storey_stiffness_loss", "storey2"), ("isolator_force_error", "")}
    loss = found["storey_stiffness_loss", "storey2"]["loss"]
    assert loss.value == pytest.approx(0.4, rel=0.02)


def test_more_than_two_causes_beside_any_force_are_not_begun_with(monkeypatch):
    """So many imitate something else, and the search beside them has no end."""
    seen = tuple((name, (0.1,)) for name in ("storey", "damping", "gain"))
    comparison = SimpleNamespace(expecting=lambda error: None)
    beside = SimpleNamespace(beside_any_force=lambda: (seen, seen))
    start = SimpleNamespace(comparison=comparison, before=None, over=lambda compared: beside)
    monkeypatch.setattr(searches, "largest_excess", lambda *arguments: 0.1)
    assert searches._search_by_structure(start) is None
