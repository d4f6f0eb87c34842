"""Diagnosis of building records: named causes, their numbers, and silence where nothing is wrong.

The records are made by the project's own engine with a cause put in by hand: what is tested here is
the inference. Records from an independent generator (``studies/blind``) are in ``tests/blind``.
"""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

import isolation_sim as iso
from ground_motions import el_centro_1940
from isolation_sim.discrepancy.adapters.building import BuildingRecords, intervals
from isolation_sim.discrepancy.building import comparison as comparison_module
from isolation_sim.discrepancy.building.causes.isolator_causes import layer_effect
from isolation_sim.discrepancy.building.comparison import (
    BuildingComparison,
    FittedBuilding,
    compare_building,
    squared,
    with_causes,
)
from isolation_sim.discrepancy.building.errors import excess_error, largest_excess
from isolation_sim.discrepancy.building.filter_search import with_likeliest_filter
from isolation_sim.discrepancy.building.goodness_of_fit import adequacy, is_quiet, p_value
from isolation_sim.discrepancy.building.model import Soil, building_model, shear_stiffness
from isolation_sim.discrepancy.building.next_test import _tests
from isolation_sim.discrepancy.building.noise import noise_floor, white_noise
from isolation_sim.discrepancy.building.record import BuildingRecord
from isolation_sim.discrepancy.building.record_filter import RecordFilter
from isolation_sim.discrepancy.building.search import cause_exchange, cause_search, searches
from isolation_sim.discrepancy.building.search.cause_exchange import (
    carried_over,
    exchange_for_simpler,
    exchange_histories,
    of_one_sensor,
)
from isolation_sim.discrepancy.building.search.cause_fits import CauseFits, _freed, _left_along
from isolation_sim.discrepancy.building.search.cause_search import CauseSearch, candidates
from isolation_sim.discrepancy.building.search.ranking import (
    likelier_on_all,
    may_be_nearer,
    rivals_of,
)
from isolation_sim.discrepancy.building.segment import cell_means
from isolation_sim.discrepancy.decisions import LEAST_BUILDING_SHARE
from isolation_sim.discrepancy.diagnose import diagnose_building
from isolation_sim.discrepancy.search import Round, SearchResult
from isolation_sim.effects import effect
from isolation_sim.errors import InputError

NOISE = 0.01
GROUND = el_centro_1940()
CHANNELS = (
    "base_acceleration_m_s2",
    *(f"floor{k}_acceleration_m_s2" for k in range(1, 6)),
    "isolator_displacement_m",
)


@pytest.fixture(scope="module")
def isolated():
    device = iso.law("kelvin_voigt", {"k": 1.2e7, "c": 1.0e6})
    return iso.reference_building().on(device)


def _record(isolated, change=None, seed=0, noise=NOISE, name="quake", scale=1.0):
    """What a changed building would have shown, with noise in every channel, the ground's too."""
    rng = np.random.default_rng(seed)
    ground = replace(el_centro_1940().scaled(scale), name=name)
    blank = BuildingRecord(name, ground, {c: np.arange(len(ground)) % 3 - 1.0 for c in CHANNELS})
    model = building_model(isolated, [blank])
    values = (change(model) if change else model).predict(blank)
    values = values + noise * np.sqrt(np.mean(values**2, axis=0)) * rng.standard_normal(
        values.shape
    )
    shaking = ground.acceleration
    shaking = shaking + noise * np.sqrt(np.mean(shaking**2)) * rng.standard_normal(len(shaking))
    return BuildingRecord(
        name, replace(ground, acceleration=shaking), dict(zip(CHANNELS, values.T, strict=True))
    )


def _compared(isolated, record):
    """The nominal building beside a record, and its possible causes by their names."""
    model = building_model(isolated, [record])
    listed = {c.name: c for c in candidates(model, [record])}
    return compare_building(model, [record]), listed


def _weaker(storey, loss):
    def change(model):
        row = model.structure.drift_rows[storey - 1]
        softer = model.structure.stiffness - loss * shear_stiffness(model.structure)[
            storey - 1
        ] * np.outer(row, row)
        return replace(model, structure=replace(model.structure, stiffness=softer))

    return change


def _heavier(share):
    def change(model):
        mass = model.structure.mass.copy()
        mass[0, 0] *= 1 + share
        return replace(model, structure=replace(model.structure, mass=mass))

    return change


def _damped(coefficient):
    def change(model):
        damping = model.structure.damping.copy()
        damping[0, 0] += coefficient
        return replace(model, structure=replace(model.structure, damping=damping))

    return change


def _with(model, name, place, values):
    """A model with one of the candidate causes in it."""
    blank = {c: np.arange(len(GROUND)) % 3 - 1.0 for c in CHANNELS}
    listed = candidates(model, [BuildingRecord("blank", GROUND, blank)])
    cause = next(one for one in listed if (one.name, one.place) == (name, place))
    return with_causes(model, ((cause, values),))


def test_noise_is_detected_in_every_channel_and_in_the_ground(isolated):
    record = _record(isolated, seed=3)
    floor = noise_floor(building_model(isolated, [record]), record)
    true = NOISE * np.sqrt(np.mean(record.values**2, axis=0))
    np.testing.assert_allclose(floor.sensors, true, rtol=0.15)
    assert floor.ground == pytest.approx(NOISE * np.std(record.ground[0].acceleration), rel=0.5)
    assert np.all(floor.total > floor.sensors)


def test_white_noise_is_measured_above_what_shakes_below():
    rng = np.random.default_rng(1)
    t = np.arange(4000) * 0.01
    signal = np.sin(2 * np.pi * 1.0 * t) + 0.02 * rng.standard_normal(t.size)
    cause_values = white_noise(signal[:, np.newaxis], 0.01, 20.0, 0.5)
    assert cause_values[0] == pytest.approx(0.02, rel=0.1)


def test_residuals_of_noise_alone_are_white(isolated):
    record = _record(isolated, seed=5)
    comparison = compare_building(building_model(isolated, [record]), [record])
    nominal = comparison.evaluate(())
    # a little less than 1: no calibration is believed to be perfect
    assert 0.75 < nominal.variance < 1.1
    part, whitened = comparison.held_out[0], nominal.held_out[0]
    ratios = np.log(cell_means(whitened) / part.expected)
    assert np.all(np.abs(ratios) < 6 * np.log(part.noise_cells).std(axis=0))
    # twice the noise is no longer what was expected
    assert adequacy([part], [2 * whitened]) < 1e-3 < adequacy([part], [whitened])
    # no rounding to zero
    assert 0 < adequacy([part], [20 * whitened]) < 1e-15


def _with_colour(shape):
    """Noise of one colour in every channel, the ground's too: a factor of its amplitude in Hz."""

    def coloured(values, size, rng, dt):
        white = np.fft.rfft(rng.standard_normal(values.shape), axis=0)
        noise = np.fft.irfft(
            shape(np.fft.rfftfreq(len(values), dt))[:, np.newaxis] * white, len(values), axis=0
        )
        rms = np.sqrt(np.mean(values**2, axis=0) / np.mean(noise**2, axis=0))
        return values + size * rms * noise

    return coloured


@pytest.mark.parametrize(
    "shape",
    [
        lambda f: np.maximum(f, 0.02) ** -0.25,  # grows as the frequency falls
        lambda f: np.sqrt(np.maximum(1.0, 0.2 / np.maximum(f, 0.02))),  # flickers below 0.2 Hz
        lambda f: 1 / np.sqrt(1 + (f / 20.0) ** 8),  # has passed the filter of a logger
        lambda f: 1 / np.sqrt(1 + (f / 8.0) ** 4),  # one that ends within the building's band
    ],
)
def test_noise_of_any_colour_is_noise(isolated, shape):
    quiet, rng = _record(isolated, noise=0.0), np.random.default_rng(4)
    coloured, dt = _with_colour(shape), quiet.dt
    values = coloured(quiet.values, NOISE, rng, dt)
    shaking = coloured(quiet.ground[0].acceleration[:, np.newaxis], NOISE, rng, dt)[:, 0]
    record = BuildingRecord(
        "quake", replace(quiet.ground[0], acceleration=shaking),
        dict(zip(CHANNELS, values.T, strict=True)),
    )  # fmt: skip
    model = building_model(isolated, [record])
    floor = noise_floor(model, record)
    np.testing.assert_allclose(
        np.sqrt(np.mean(floor.sensor_noise(np.fft.rfftfreq(len(record), dt)) ** 2, axis=0)),
        NOISE * np.sqrt(np.mean(quiet.values**2, axis=0)), rtol=0.3,
    )  # fmt: skip
    shown = floor.sensor_noise(np.array([0.05, 0.5]))[:, :-1]
    expected = float(shape(0.05) / shape(0.5))
    np.testing.assert_allclose(shown[0] / shown[1], expected, rtol=0.4)
    comparison = compare_building(model, [record])
    assert is_quiet(comparison, comparison.evaluate(()))


def test_one_sensor_whose_noise_has_another_colour_is_no_fault(isolated):
    record = _record(isolated)
    name = "floor2_acceleration_m_s2"
    slow = np.fft.rfft(np.random.default_rng(5).standard_normal(len(record)))
    slow /= np.sqrt(np.maximum(np.fft.rfftfreq(len(record), record.dt), 0.5))
    own = np.fft.irfft(slow, len(record))
    own *= NOISE * record.response[name].std() / own.std()
    record = replace(record, response={**record.response, name: record.response[name] + own})
    comparison, _ = _compared(isolated, record)
    assert is_quiet(comparison, comparison.evaluate(()))


@pytest.mark.parametrize(("smooth", "faulty"), [(True, 0.004), (False, 0.0), (False, 0.1)])
def test_the_ground_is_smooth_between_samples_where_that_explains_most(isolated, smooth, faulty):
    def change(model):
        return replace(_weaker(2, faulty)(model), band_limited=smooth)

    record = _record(isolated, change, noise=1e-3)
    problem = BuildingRecords([record], isolated, 1, lambda text: None)
    problem.nominal()
    assert problem.first.model.band_limited == smooth
    assert is_quiet(problem.first, problem.engineers) == (faulty == 0.0)


def test_nothing_is_said_where_nothing_is_wrong(isolated):
    diagnosis = diagnose_building(_record(isolated, seed=11), isolated)
    assert diagnosis.verdict == "adequate"
    assert diagnosis.causes == ()
    assert diagnosis.gain is None
    assert diagnosis.unexplained_share == 0.0
    assert diagnosis.error_before.held_out < 1.5 * diagnosis.held_out_noise_floor


@pytest.mark.parametrize("storey", [2, pytest.param(5, marks=pytest.mark.slow)])
def test_the_storey_that_lost_stiffness_is_named(isolated, storey):
    record = _record(isolated, _weaker(storey, 0.1), seed=storey)
    diagnosis = diagnose_building(record, isolated)
    assert diagnosis.verdict == "explained"
    assert [cause.name for cause in diagnosis.causes] == ["storey_stiffness_loss"]
    numbers = diagnosis.causes[0].parameters
    assert numbers["storey"].value == storey
    assert numbers["loss"].value == pytest.approx(0.1, abs=0.005)
    assert numbers["loss"].low < numbers["loss"].value < numbers["loss"].high
    assert f"storey{storey} has lost" in diagnosis.causes[0].reason
    assert diagnosis.error_after.held_out < 0.6 * diagnosis.error_before.held_out
    assert 0 < diagnosis.gain[0] < diagnosis.gain[1] < 1
    assert diagnosis.building is not None
    np.testing.assert_allclose(
        shear_stiffness(diagnosis.building.structure)[storey - 1]
        / shear_stiffness(isolated.structure)[storey - 1],
        1 - numbers["loss"].value,
    )
    assert json.loads(diagnosis.to_json())["causes"][0]["parameters"]["storey"]["value"] == storey
    # every channel is drawn, where it was fitted and where it was not
    roof = [trace for trace in diagnosis.traces if trace.name.endswith("floor 5")]
    assert len(diagnosis.traces) == 2 * len(CHANNELS) and len(roof) == 2
    first, last = sorted(roof, key=lambda trace: trace.held_out)
    assert last.held_out and not first.held_out
    measured = np.concatenate([first.measured, last.measured])
    np.testing.assert_array_equal(measured, record.response["floor5_acceleration_m_s2"])
    assert np.std(last.after - last.measured) < 0.6 * np.std(last.before - last.measured)


def _swaying(record, share, seed=0):
    """Every channel moved by something that no cause explains: slow noise of its own."""
    low = butter(2, [0.3, 3.0], "bandpass", fs=1 / record.dt, output="sos")
    noise = np.random.default_rng(seed).standard_normal((len(record), len(CHANNELS)))
    moved = sosfiltfilt(low, noise, axis=0)
    moved *= share * np.sqrt(np.mean(record.values**2, axis=0) / np.mean(moved**2, axis=0))
    return replace(record, response=dict(zip(CHANNELS, (record.values + moved).T, strict=True)))


@pytest.mark.slow
def test_what_no_cause_explains_is_blamed_on_none(isolated):
    diagnosis = diagnose_building(
        _swaying(_record(isolated, seed=6), 0.1), isolated, tiers="causes"
    )
    assert diagnosis.verdict == "unexplained"
    assert diagnosis.causes == () and diagnosis.unexplained_share == 1.0
    assert diagnosis.error_before == diagnosis.error_after


@pytest.mark.slow
@pytest.mark.usefixtures("few_causes")
def test_a_cause_stands_out_from_what_no_cause_explains(isolated):
    record = _swaying(_record(isolated, _heavier(0.5), seed=7), 0.1)
    space, cause_values = searches.search_causes(
        compare_building(building_model(isolated, [record]), [record])
    )
    assert [cause.name for cause, _ in cause_values.best.cause_values] == ["base_mass_error"]
    assert cause_values.best.cause_values[0][1][0] == pytest.approx(0.5, abs=0.1)
    # the search was repeated, expecting of every model no less than the best one leaves
    left = excess_error(space.comparison, cause_values.best)
    assert 0.1 < left < 2 * space.comparison.model_error


def test_error_beyond_the_noise_is_that_which_was_put_in(isolated):
    record = _record(isolated, seed=8)
    comparison = compare_building(building_model(isolated, [record]), [record])
    assert excess_error(comparison, comparison.evaluate(())) < 0.01
    moved = replace(comparison, records=(_swaying(record, 0.1),), _cache={})
    parts = tuple(replace(part, record=moved.records[0]) for part in comparison.held_out)
    moved = replace(moved, held_out=parts)
    part = parts[0]
    added = (moved.records[0].values - record.values)[part.samples]
    # over the stronger motion of the record: it may come from there
    strong = moved.fitted[0].rms
    assert np.all(part.rms < 0.8 * strong)
    expected = np.sqrt(np.mean(np.mean(added**2, axis=0) / strong**2))
    assert excess_error(moved, moved.evaluate(())) == pytest.approx(expected, rel=0.05)


def test_halves_tell_where_a_residual_is(isolated):
    record = _record(isolated, seed=9)
    part = compare_building(building_model(isolated, [record]), [record]).fitted[0]
    residual = np.zeros_like(record.values)
    for place, first in ((20, True), (part.samples.stop - 20, False)):
        residual[:] = 0.0
        residual[place] = record.values.std(axis=0)
        early, late = part.halves(part.whiten(residual))
        assert (early > 5 * late) if first else (late > 5 * early)


def test_a_search_is_reopened_with_half_of_the_held_out_time(isolated):
    record = _record(isolated, seed=9)
    comparison = compare_building(building_model(isolated, [record]), [record])
    more = comparison.fitting_more()
    first, later = comparison.middle, (comparison.middle + len(record)) // 2
    assert (comparison.held_out[0].samples.start, more.held_out[0].samples.start) == (first, later)
    assert more.fitted[0].samples.stop == later
    other = replace(record, name="other")
    two = compare_building(comparison.model, [record, replace(other, hold_out=True)])
    assert two.fitting_more() is None
    # the last of several is divided unless records were chosen to be held out
    several = compare_building(comparison.model, [record, other])
    assert (several.middle, [s.record.name for s in several.held_out]) == (0, ["other"])
    more = several.fitting_more()
    assert [s.record.name for s in more.fitted] == ["quake", "other"]
    assert more.held_out[0].samples.start == more.fitted[1].samples.stop == first
    assert more.with_noise_beside(()).middle == first


@pytest.mark.parametrize("beside", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_wall_that_only_the_last_and_strongest_record_reaches_is_named(
    isolated, monkeypatch, beside
):
    """It stands alone, or beside a mass that all records show."""
    first = _record(isolated, _heavier(0.2) if beside else None, seed=1, name="weak", scale=0.2)
    gap = 2 * np.abs(first.displacement("")).max()

    def walled(model):
        wall = (6e7, gap, 1.5, 0.0)
        return _with(_heavier(0.2)(model) if beside else model, "moat_impact", "", wall)

    last = _record(isolated, walled, seed=2, name="strong", scale=1.0)
    names = {"base_mass_error", "moat_impact"}
    every = candidates(building_model(isolated, [first, last]), [first, last])
    few = [c for c in every if c.name in names and c.form in ("", "dissipating", "linear")]
    monkeypatch.setattr(cause_search, "candidates", lambda model, records: few)
    comparison = compare_building(building_model(isolated, [first, last]), [first, last])
    space, result = searches.search_causes(comparison)
    assert set(result.best.causes) == (names if beside else {"moat_impact"})
    assert space.comparison.middle > 0
    chosen = compare_building(comparison.model, [first, replace(last, hold_out=True)])
    assert "moat_impact" not in searches.search_causes(chosen)[1].best.causes


@pytest.mark.usefixtures("few_causes")
def test_two_causes_are_both_named_and_held_out_records_judge(isolated):
    def both(model):
        return _heavier(0.15)(_damped(2e5)(model))

    first = _record(isolated, both, seed=1, name="first")
    second = _record(isolated, both, seed=2, name="second", scale=0.5)
    diagnosis = diagnose_building([first, replace(second, hold_out=True)], isolated)
    named = {cause.name: cause for cause in diagnosis.causes}
    assert set(named) == {"base_mass_error", "extra_isolator_damping"}
    mass = named["base_mass_error"].parameters["relative_error"]
    assert mass.value == pytest.approx(0.15, abs=0.01)
    assert named["extra_isolator_damping"].parameters["coefficient"].unit == "N s/m"
    assert sum(cause.share for cause in diagnosis.causes) == pytest.approx(
        1 - diagnosis.unexplained_share
    )
    noise_step = next(step for step in diagnosis.steps if step.title == "Noise floor")
    assert "Held out: second" in noise_step.text


def test_a_cause_may_change_the_band_that_is_compared_after_it():
    """Stiffer isolators change the highest frequency, and so the number of residuals."""
    soft = iso.shear_building([2.5e5] * 5, [1.0e8] * 5, base_mass=3e5)
    isolated = soft.on(iso.law("kelvin_voigt", {"k": 6e7, "c": 2.0e6}))
    record = _record(isolated, _heavier(0.2), seed=1)
    problem = BuildingRecords([record], isolated, 2, lambda text: None)
    comparison, listed = _compared(isolated, record)
    problem.space = space = CauseSearch(comparison)
    tried = [comparison.fit((), ((listed["base_mass_error"], (0.1,)),))]
    taken = space.choose(space.before, tried)
    space.comparison = comparison.with_noise_beside(((listed["isolator_force_error"], (5.0,)),))
    assert space.comparison.fitted_noise.shape[1] != comparison.fitted_noise.shape[1]
    ((*_, chance),) = problem.trials_text(Round(space.before, tried, taken)).rows
    assert chance == f"{p_value(comparison, space.before, tried[0]):.1e}"
    # of a later round, the causes found before are said
    later = problem.trials_text(Round(tried[0], tried, None)).text
    assert later.startswith(f"Beside {tried[0].cause_values[0][0].label}: ")


@pytest.mark.slow
@pytest.mark.usefixtures("few_causes")
def test_a_drift_and_a_mass_that_it_hides_are_both_named_alone(isolated):
    record = _record(isolated, _heavier(0.1), seed=6)
    response = dict(record.response)
    shown = response["isolator_displacement_m"]
    course = np.linspace(0.0, 1.0, len(shown))
    response["isolator_displacement_m"] = shown + shown.std() * course
    diagnosis = diagnose_building(replace(record, response=response), isolated)
    named = {cause.name: cause for cause in diagnosis.causes}
    assert set(named) == {"sensor_bias", "base_mass_error"}
    drift = {name: one.value for name, one in named["sensor_bias"].parameters.items()}
    # half of it on average, and as much from there to either end
    assert drift == pytest.approx(dict.fromkeys(("mean", "slope"), shown.std() / 2), rel=0.03)
    assert named["base_mass_error"].parameters["relative_error"].value == pytest.approx(
        0.1, rel=0.1
    )


@pytest.mark.parametrize(("left", "significant"), [(2.0, True), (5.9, False)])
def test_a_cause_counts_by_its_share_of_the_held_out_misfit(isolated, left, significant):
    """A drift that grows removes less of the fitted misfit than any cause must."""
    record = _record(isolated, seed=6)
    comparison = compare_building(building_model(isolated, [record]), [record])
    space, noise = CauseSearch(comparison), comparison.evaluate(())
    listed = {(c.name, c.form): c for c in candidates(comparison.model, [record])}
    mass, bias = (
        (cause, cause.starts[0])
        for cause in (listed["base_mass_error", ""], listed["sensor_bias", "constant"])
    )

    def outcome(causes, fitted, held_out):
        parts = [tuple(factor * part for part in parts) for factor, parts in (
            (fitted, noise.fitted), (held_out, noise.held_out),
        )]  # fmt: skip
        return FittedBuilding(causes, parts[0], lambda: parts[1], None)

    space.before = outcome((), 20.0, 20.0)
    current, both = outcome((mass,), 2.0, 6.0), outcome((mass, bias), 1.8, left)
    assert current.cost - both.cost < LEAST_BUILDING_SHARE * space.before.cost
    assert space._is_significant(current, both) is significant


@pytest.mark.slow
def test_a_storey_that_yields_is_named_with_its_strength(isolated):
    blank = _record(isolated)
    peak = isolated.structure.total_mass * np.abs(blank.mean_acceleration(blank.values, "")).max()

    def yielding(model):
        return _with(model, "storey_yielding", "storey4", (0.2 * peak, 0.1, 3.0))

    diagnosis = diagnose_building(_record(isolated, yielding, seed=6), isolated)
    (cause,) = diagnosis.causes
    assert (cause.name, cause.place) == ("storey_yielding", "storey4")
    assert cause.parameters["yield_shear"].value == pytest.approx(0.2 * peak, rel=0.01)


@pytest.mark.parametrize("smoothness", [1.5, 3.0, 8.0])
def test_the_corner_of_a_storey_that_yields_is_fitted(isolated, smoothness):
    """A frame of steel has a sharp one; with that of concrete half of the misfit would remain."""
    blank = _record(isolated)
    peak = isolated.structure.total_mass * np.abs(blank.mean_acceleration(blank.values, "")).max()
    numbers = 0.2 * peak, 0.1, smoothness
    record = _record(isolated, lambda m: _with(m, "storey_yielding", "storey4", numbers), seed=6)
    model = building_model(isolated, [record])
    listed = {(c.name, c.place): c for c in candidates(model, [record])}
    storey = listed["storey_yielding", "storey4"]
    comparison = compare_building(model, [record])
    fits = [comparison.fit((), ((storey, start),)) for start in storey.starts]
    best = min(fits, key=lambda one: one.cost)
    assert best.cause_values[0][1] == pytest.approx(numbers, rel=0.15)


@pytest.mark.slow
def test_a_clock_of_another_rate_is_named(isolated):
    drifts = dict.fromkeys(CHANNELS, 1.5e-3)
    record = _record(isolated, lambda m: replace(m, drifts=drifts), seed=12)
    cause = diagnose_building(record, isolated).causes[0]
    assert (cause.name, cause.place) == ("sensor_delay", "all channels")
    assert cause.form == "clock_drift" and cause.share > 0.99
    assert cause.parameters["drift"].value == pytest.approx(1.5e-3, rel=0.05)


@pytest.mark.slow
@pytest.mark.usefixtures("few_causes")
def test_a_contact_with_a_wall_that_dissipates_is_named(isolated):
    quiet = _record(isolated, noise=0.0)
    gap = 0.9 * float(np.abs(quiet.displacement("")).max())
    model = building_model(isolated, [quiet])
    wall = next(
        c for c in candidates(model, [quiet]) if (c.name, c.form) == ("moat_impact", "linear")
    )
    record = _record(isolated, lambda m: with_causes(m, ((wall, (1e8, gap, 10.0)),)), seed=13)
    diagnosis = diagnose_building(record, isolated)
    (cause,) = diagnosis.causes
    assert cause.name == "moat_impact" and not cause.acts_like
    assert cause.parameters["gap"].value == pytest.approx(gap, rel=0.03)


@pytest.mark.usefixtures("few_causes")
@pytest.mark.parametrize("side", [1.0, pytest.param(-1.0, marks=pytest.mark.slow)])
def test_a_wall_on_one_side_is_named_with_its_side(isolated, side):
    """The other way the base moves beyond the gap, freely."""
    quiet = _record(isolated, noise=0.0)
    gap = 0.85 * side * float(np.abs(quiet.displacement("")).max())
    model = building_model(isolated, [quiet])
    wall = next(
        c for c in candidates(model, [quiet])
        if (c.name, c.form) == ("moat_impact", "one_side_linear")
    )  # fmt: skip
    record = _record(isolated, lambda m: with_causes(m, ((wall, (1e8, gap, 5.0)),)), seed=13)
    x = side * record.displacement("")
    assert x.min() < -1.05 * abs(gap)
    diagnosis = diagnose_building(record, isolated)
    (cause,) = diagnosis.causes
    assert cause.name == "moat_impact" and cause.form == wall.form and not cause.acts_like
    assert cause.parameters["gap"].value == pytest.approx(gap, rel=0.03)


def test_a_dashpot_beside_the_spring_of_a_wall_is_distinguished_from_other_contacts(isolated):
    quiet = _record(isolated, noise=0.0)
    gap = -0.85 * float(np.abs(quiet.displacement("")).max())
    model = building_model(isolated, [quiet])
    listed = {c.form: c for c in candidates(model, [quiet]) if c.name == "moat_impact"}
    wall = listed["one_side_dashpot"], (1e8, gap, 5e6)
    record = _record(isolated, lambda m: with_causes(m, (wall,)), seed=14)
    comparison = compare_building(model, [record])
    noise = sum(segment.noise_cost for segment in comparison.fitted)

    def left(form):
        cause = listed[form]
        starts = sorted(cause.starts, key=lambda s: comparison.evaluate(((cause, s),)).cost)
        return min(comparison.fit((), ((cause, start),)).cost for start in starts[:2]) / noise

    assert left("one_side_dashpot") < 1.2
    assert min(left("one_side_linear"), left("dashpot")) > 2


@pytest.mark.parametrize(("before", "after"), [(60.0, 0.0), (0.0, 90.0)])
def test_quiet_time_does_not_move_the_division_of_a_record(isolated, before, after):
    plain = _record(isolated)
    n = (round(before / GROUND.dt), round(after / GROUND.dt))
    quiet = replace(
        plain,
        ground=replace(plain.ground[0], acceleration=np.pad(plain.ground[0].acceleration, n)),
        response={name: np.pad(values, n) for name, values in plain.response.items()},
    )
    model = building_model(isolated, [plain])
    (first,), (second,) = (compare_building(model, [r]).fitted for r in (plain, quiet))
    # one period more or less
    assert abs(second.samples.stop - n[0] - first.samples.stop) * GROUND.dt < 2.0


def test_a_second_cause_is_screened_with_the_numbers_of_the_first_free(isolated):
    """With the first one's numbers as they were fitted alone, another cause would seem nearer."""
    record = _record(isolated, noise=0.0)
    model = building_model(isolated, [record])
    listed = {c.label: c for c in candidates(model, [record])}
    force, stiffness = (listed[k] for k in ("isolator_force_error", "isolator_stiffness_error"))
    true = with_causes(model, ((force, (0.1,)), (stiffness, (-8e5,))))
    record = replace(record, response=dict(zip(CHANNELS, true.predict(record).T, strict=True)))
    comparison = compare_building(model, [record])
    current = comparison.fit((), ((force, (0.05,)),))
    trial = comparison.fitted_residuals((*current.cause_values, (stiffness, stiffness.starts[0])))
    fixed, free = (
        _left_along(current.fitted, trial, freed) / current.cost
        for freed in (None, _freed(current))
    )
    assert free < 0.5 < 0.8 < fixed


def test_a_second_cause_is_screened_by_what_it_changes_alone(isolated, monkeypatch):
    """It is not simulated again beside each first one."""
    record = _record(isolated, _heavier(0.1))
    model = building_model(isolated, [record])
    listed = {c.label: c for c in candidates(model, [record])}
    mass, force = listed["base_mass_error"], listed["isolator_force_error"]
    comparison = compare_building(model, [record])
    current = comparison.fit((), ((mass, (0.05,)),))
    exact = comparison.fitted_residuals((*current.cause_values, (force, (0.01,))))
    alone = compare_building(model, [record])
    alone.fitted_residuals(((force, (0.01,)),)), alone.fitted_residuals(())
    monkeypatch.setattr(comparison_module, "_simulated", None)
    screened = comparison.beside(current, force, (0.01,), alone)
    change, right = (
        squared([a - b for a, b in zip(one, current.fitted, strict=True)])
        for one in (screened, exact)
    )
    assert change == pytest.approx(right, rel=0.1)


@pytest.mark.parametrize(("promised", "begun"), [(0.5, 2), (0.05, 1)])
def test_what_promises_next_to_nothing_beside_the_best_is_not_fitted(
    isolated, monkeypatch, promised, begun
):
    comparison, listed = _compared(isolated, _record(isolated, _heavier(0.1)))
    space = CauseSearch(comparison)
    two = [listed[name] for name in ("base_mass_error", "isolator_force_error")]
    gains = [1.0, promised * space.before.cost]
    screened = [(gain, cause, cause.starts[:1]) for gain, cause in zip(gains, two, strict=True)]
    # the first is tried whatever it promises, and brings nearly all
    screened[0] = (2 * space.before.cost, *screened[0][1:])
    monkeypatch.setattr(CauseFits, "screened", lambda *_: screened)
    fits = space.fits.rough(space.before, two, 16)
    assert [one.causes[0] for one in fits] == ["base_mass_error", "isolator_force_error"][:begun]


def test_a_relative_error_is_tried_with_either_sign(isolated):
    """A first step from the wrong side may lead away in sliding or lightly damped motion."""
    record = _record(isolated)
    signs = {}
    for cause in candidates(building_model(isolated, [record]), [record]):
        signs.setdefault(cause.name, set()).update(
            float(np.sign(one)) for start in cause.starts for one in start[:1]
        )
    for name in (
        "base_mass_error", "floor_mass_error", "isolator_force_error", "isolator_stiffness_error",
        "structure_stiffness_error",
    ):  # fmt: skip
        assert signs[name] == {-1, 1}


def test_a_single_cause_is_named_in_its_best_form(isolated):
    """Also from the numbers found for another form, which may be nearer than its own starts."""

    def change(model):
        damping = model.structure.damping + 0.01 * model.structure.stiffness
        return replace(model, structure=replace(model.structure, damping=damping))

    record = _record(isolated, change, seed=3, noise=1e-3)
    model = building_model(isolated, [record])
    forms = [c for c in candidates(model, [record]) if c.name == "structural_damping_error"]
    comparison = compare_building(model, [record])
    ((cause, _),) = CauseSearch(comparison).finish(
        comparison.fit((), ((forms[0], (1.0,)),))
    ).cause_values  # fmt: skip
    assert (forms[0].form, cause.form) == ("", "stiffness_proportional")
    assert carried_over(forms[1], forms[0], (2.0,)) == (2.0, forms[1].starts[0][1])
    assert carried_over(forms[0], forms[1], (-3.0, 0.1)) == (-0.95,)


def test_many_numbers_give_way_to_one_that_leaves_noise_alone(isolated, monkeypatch):
    record = _record(isolated, lambda m: _with(m, "isolator_force_error", "", (-0.05,)), seed=15)
    model = building_model(isolated, [record])
    comparison = compare_building(model, [record])
    many = next(c for c in candidates(model, [record]) if c.name == "isolator_amplitude_softening")
    space = CauseSearch(comparison)
    current = comparison.fit((), ((many, min(many.starts)),))
    # were it nearer to the fitted data by errors of the simulation
    monkeypatch.setattr(cause_exchange, "is_nearer", lambda *_: False)
    monkeypatch.setattr(CauseSearch, "is_calibration", lambda *_: False)
    monkeypatch.setattr(FittedBuilding, "held_out_cost", 1.0)
    simple = exchange_for_simpler(space, current)
    assert simple.n_parameters == 1 < current.n_parameters
    monkeypatch.setattr(CauseSearch, "is_explained", lambda *_: False)
    assert exchange_for_simpler(space, current).causes == current.causes


def test_a_cause_tried_last_is_only_a_rival_where_it_is_ranked_below(isolated, monkeypatch):
    record = _record(isolated, _heavier(0.15), seed=7)
    model = building_model(isolated, [record])
    listed = {c.name: c for c in candidates(model, [record])}
    listed["self_heating"] = layer_effect(model, [record], effect("self_heating"), (1e-8, 20.0))
    space = CauseSearch(compare_building(model, [record]))
    monkeypatch.setattr(space, "_is_significant", lambda current, one: True)
    simple, flexible = (
        space.comparison.evaluate(((listed[name], listed[name].starts[0]),))
        for name in ("base_mass_error", "self_heating")
    )
    assert space.choose(space.before, [flexible, simple]) is flexible
    assert space.choose(space.before, [simple, flexible]) is simple
    assert space.choose(space.before, [flexible]) is flexible
    assert space.choose(space.before, []) is None
    # kept for later, even where it was no rival
    space._last = [flexible]
    space.choose(space.before, [simple])
    assert [one.name for one, _ in space._others["base_mass_error"]] == ["self_heating"]


@pytest.mark.parametrize("stands", [True, False])
def test_a_cause_tried_last_takes_the_place_of_an_earlier_one_where_it_stands(
    isolated, monkeypatch, stands
):
    """Beside the cause found after it: the likelihood alone does not count."""
    record = _record(
        isolated, lambda m: _with(_heavier(0.3)(m), "isolator_force_error", "", (0.1,))
    )
    model = building_model(isolated, [record])
    listed = {c.name: c for c in candidates(model, [record]) if not (c.place or c.form)}
    space = CauseSearch(compare_building(model, [record]))
    last = replace(listed["base_mass_error"], last=True)
    first = listed["structural_damping_error"]
    space._others[first.label] = [(last, (0.1,))]
    current = space.comparison.fit((), ((first, (0.1,)), (listed["isolator_force_error"], (0.1,))))
    monkeypatch.setattr(space, "_stands_for", lambda one, best: stands and best is current)
    name = last.label if stands else first.label
    assert space._exchange_causes(current).causes == (name, "isolator_force_error")


@pytest.mark.parametrize(("held_out", "exchanged"), [(1.0, True), (1.5, False)])
def test_an_earlier_cause_is_exchanged_by_what_both_predict(
    isolated, monkeypatch, held_out, exchanged
):
    comparison, listed = _compared(isolated, _record(isolated))
    space = CauseSearch(comparison)
    first, other = listed["structural_damping_error"], listed["base_mass_error"]

    def outcome(cause, size, held_out):
        parts, later = ((np.full((500, 4, 2), one),) for one in (size, held_out))
        return FittedBuilding(
            ((cause, (0.1,)), (listed["sensor_gain"], (0.9,))), parts, lambda: later
        )

    space._others[first.label] = [(other, (0.1,))]
    nearer = outcome(other, 1.0, held_out)
    monkeypatch.setattr(space, "fit_instead", lambda *_: nearer)
    current = outcome(first, 1.1, 1.1)
    assert space._exchange_causes(current) is (nearer if exchanged else current)


def test_a_cause_tried_last_stands_where_it_alone_leaves_noise(isolated, monkeypatch):
    record = _record(isolated)
    model = building_model(isolated, [record])
    listed = {c.name: c for c in candidates(model, [record])}
    degradation = effect("cyclic_degradation")
    listed["cyclic_degradation"] = layer_effect(model, [record], degradation, (0.1, 1.0))
    space = CauseSearch(compare_building(model, [record]))
    # beside noise both errors are nearly zero, and their ratio says nothing
    monkeypatch.setattr(cause_search, "largest_excess", lambda *_: 0.005)
    monkeypatch.setattr(space, "is_explained", lambda outcome: outcome.variance < 1.2)

    def outcome(name, size, held_out):
        parts, later = ((np.full((500, 4, 2), one),) for one in (size, held_out))
        return FittedBuilding(((listed[name], listed[name].starts[0]),), parts, lambda: later)

    simple = outcome("isolator_force_error", 1.1, 1.1)
    assert space._stands_for(outcome("cyclic_degradation", 1.0, 1.0), simple)
    assert space._stands_for(outcome("cyclic_degradation", 1.09, 1.0), simple)
    for size, held_out in ((1.0, 1.3), (1.0999, 1.1), (1.2, 1.0)):
        assert not space._stands_for(outcome("cyclic_degradation", size, held_out), simple)
    # where neither leaves noise alone, their squares above it are compared, part by part
    monkeypatch.setattr(BuildingComparison, "above_noise", lambda self, one: above[one])
    wrong, flexible = outcome("isolator_force_error", 9, 9), outcome("cyclic_degradation", 5, 5)
    for left, stands in (((240.0, 240.0), True), ((240.0, 260.0), False), ((-9.0, 240.0), True)):
        above = {wrong: (1000.0, 1000.0), flexible: left}
        assert space._stands_for(flexible, wrong) == stands


def test_a_cause_at_the_bound_of_its_range_has_more_rivals(isolated):
    """It only acts like the right one, whose form need not be exact either."""
    record = _record(isolated)
    listed = {c.name: c for c in candidates(building_model(isolated, [record]), [record])}

    def outcome(name, value, size):
        parts = (np.full((500, 4, 2), size),)
        return FittedBuilding(((listed[name], (value,)),), parts, tuple)

    nominal = FittedBuilding((), (np.full((500, 4, 2), 10.0),), tuple)
    other = outcome("isolator_force_error", 0.1, 1.01)
    for value, rivals in ((0.1, []), (5.0, [other])):
        assert rivals_of(nominal, outcome("base_mass_error", value, 1.0), [other]) == rivals


def test_of_two_causes_the_one_that_predicts_better_is_taken(isolated):
    """Unless it has more numbers, or the data that were fitted speak for the other."""
    record = _record(isolated)
    listed = {c.name: c for c in candidates(building_model(isolated, [record]), [record])}

    def outcome(name, size, size_held_out):
        parts = [(np.full((500, 4, 2), one),) for one in (size, size_held_out)]
        values = listed[name].starts[0]
        return FittedBuilding(((listed[name], values),), parts[0], lambda: parts[1])

    best = outcome("base_mass_error", 1.0, 2.0)
    for name, size, is_taken in (
        ("isolator_force_error", 1.01, True), ("isolator_force_error", 1.1, False),
        ("isolator_amplitude_softening", 1.01, False),
    ):  # fmt: skip
        other = outcome(name, size, 1.9)
        assert likelier_on_all(best, [best, other]) is (other if is_taken else best)
        # what grows is told from what does not by the data that come later
        assert may_be_nearer(outcome(name, size, 1.0), best)
        assert not may_be_nearer(outcome(name, size, 2.0), best)


@pytest.fixture
def no_pairs(monkeypatch):
    """No pair of causes leaves less than those found."""
    monkeypatch.setattr(CauseSearch, "pairs", lambda *_: [])


@pytest.mark.parametrize(("left", "count"), [(0.09, 2), (0.11, 1)])
def test_a_pair_is_searched_from_where_it_leaves_less_than_half(isolated, monkeypatch, left, count):
    record = _record(isolated)
    comparison, listed = _compared(isolated, record)
    first, pair = (
        comparison.evaluate(tuple((listed[name], listed[name].starts[0]) for name in names))
        for names in (["base_mass_error"], ["isolator_force_error", "isolator_stiffness_error"])
    )
    begun = []

    def found(start, begin=()):
        begun.append(begin)
        return start, SearchResult(start.before, pair if begin else first, [])

    errors = {first: 0.2, pair: left}
    for name in ("excess_error", "largest_excess"):
        monkeypatch.setattr(searches, name, lambda _, one, *part: errors.get(one, 10.0))
    monkeypatch.setattr(searches, "_search_as_expected", found)
    monkeypatch.setattr(CauseSearch, "pairs", lambda *_: [pair])
    assert searches.search_causes(comparison)[1].best is (pair if count == 2 else first)
    assert begun == [(), pair.cause_values][:count]


def test_what_is_not_found_is_not_searched_again_with_a_larger_error(isolated, monkeypatch):
    comparison, _ = _compared(isolated, _record(isolated))
    errors = []

    def find_nothing(space, base):
        errors.append(space.comparison.model_error)
        return SearchResult(base, base, [])

    monkeypatch.setattr(searches, "search", find_nothing)
    monkeypatch.setattr(searches, "largest_excess", lambda *_: 0.2)
    space, result = searches._search_as_expected(CauseSearch(comparison))
    assert errors == [pytest.approx(0.02)]
    assert space.comparison.model_error == 0.2 and result.best is space.before


def test_a_search_with_a_larger_error_goes_on_from_what_was_found(isolated, monkeypatch):
    comparison, listed = _compared(isolated, _record(isolated))
    mass, begun = listed["base_mass_error"], []
    found = comparison.evaluate(((mass, (0.1,)),))
    rival = comparison.evaluate(())
    monkeypatch.setattr(CauseSearch, "beginning_with", lambda _, causes: begun.append(causes))

    def find(space, base):
        space.rivals.setdefault(mass.label, [rival] if not begun else [])
        return SearchResult(base, found, [])

    monkeypatch.setattr(searches, "search", find)
    left = iter([0.2, 0.2, 0.1])
    monkeypatch.setattr(searches, "largest_excess", lambda *_: next(left))
    space, result = searches._search_as_expected(CauseSearch(comparison))
    assert begun == [found.cause_values] and space.rivals == {mass.label: [rival]}
    assert result.best is found


def test_two_causes_of_the_isolators_are_searched_beside_those_of_the_structure(
    isolated, monkeypatch
):
    """More of them only mend the form of another."""
    comparison, listed = _compared(isolated, _record(isolated))
    seen = ((listed["structure_stiffness_error"], (0.1,)),)
    monkeypatch.setattr(CauseSearch, "beside_any_force", lambda _: (seen, seen))
    most = []

    def find_nothing(space, *_):
        most.append(space.most_causes)
        return space, SearchResult(space.before, space.before, [])

    for name in ("_search", "_search_as_expected"):
        monkeypatch.setattr(searches, name, find_nothing)
    searches._search_by_structure(CauseSearch(comparison))
    assert most == [2, 4]


def test_a_search_goes_on_from_what_shows_beside_any_force(isolated, monkeypatch):
    """It does not begin again where this does not explain the record."""
    comparison, listed = _compared(isolated, _record(isolated))
    mass = listed["base_mass_error"]
    seen = comparison.evaluate(((mass, mass.starts[0]),))
    monkeypatch.setattr(searches, "_search_by_structure", lambda start: (
        start, SearchResult(start.before, seen, [])
    ))  # fmt: skip
    monkeypatch.setattr(searches, "_explain", lambda *_: False)
    for name in ("_search_from_pair", "unknown_force", "_search_as_expected"):
        monkeypatch.setattr(searches, name, lambda *_: None)
    assert searches.search_causes(comparison)[1].best is seen


@pytest.mark.parametrize(("left_fitted", "goes_on"), [(0.05, True), (0.15, False)])
def test_a_search_goes_on_with_more_data_where_what_is_left_comes_late(
    isolated, monkeypatch, left_fitted, goes_on
):
    comparison, listed = _compared(isolated, _record(isolated))
    first, both = (
        comparison.evaluate(tuple((listed[name], listed[name].starts[0]) for name in names))
        for names in (["base_mass_error"], ["base_mass_error", "isolator_force_error"])
    )
    begun = []

    def found(start, begin=()):
        begun.append((start.comparison.middle, begin))
        return start, SearchResult(start.before, both if begin else first, [])

    left = {first: (left_fitted, 0.2), both: (0.01, 0.01)}
    monkeypatch.setattr(searches, "excess_error", lambda _, one, late=True: (
        left.get(one, (1.0, 1.0))[late]
    ))  # fmt: skip
    monkeypatch.setattr(searches, "largest_excess", lambda _, one: max(left.get(one, (1.0, 1.0))))
    monkeypatch.setattr(searches, "_search_as_expected", found)
    for name in ("_search_from_pair", "unknown_force"):
        monkeypatch.setattr(searches, name, lambda *_: None)
    assert searches.search_causes(comparison)[1].best is (both if goes_on else first)
    more = (comparison.fitting_more().middle, first.cause_values)
    assert begun == [(comparison.middle, ()), more][: 1 + goes_on]


def test_a_number_that_starts_from_zero_has_its_own_size(isolated):
    """In that of another number, of another unit, its derivative would lie beyond all bounds."""
    record = _record(isolated, _heavier(0.15), seed=7)
    model = building_model(isolated, [record])
    comparison = compare_building(model, [record])
    friction = layer_effect(
        model, [record], effect("coulomb_friction", "lugre"), (1e5, 1e-3, 0.0, 0.02)
    )
    mass = next(c for c in candidates(model, [record]) if c.name == "base_mass_error")
    fitted = comparison.fit((), ((friction, friction.starts[0]), (mass, (0.05,))))
    assert fitted.cause_values[1][1][0] == pytest.approx(0.15, abs=0.03)


def test_simulations_of_one_cause_are_kept(isolated, monkeypatch):
    """Each search begins with them."""
    record = _record(isolated)
    comparison, listed = _compared(isolated, record)
    mass, force = (listed[name] for name in ("base_mass_error", "isolator_force_error"))
    fitted = record.values[comparison.fitted[0].samples]
    monkeypatch.setattr(comparison_module, "_CACHED_BYTES", 6 * fitted.nbytes)
    comparison.evaluate(((mass, (0.1,)),))
    for k in range(8):
        comparison.evaluate(((mass, (0.1,)), (force, (0.01 * k,))))
    kept = [key[2:] for key in comparison._cache]
    assert ((mass, (0.1,)),) in kept and len(kept) < 7


@pytest.mark.parametrize(
    ("small", "beside", "share", "doubtful"),
    [
        (("isolator_force_error", ""), ("coulomb_friction", ""), 0.01, True),
        (("isolator_force_error", ""), ("coulomb_friction", ""), 0.05, False),
        (("isolator_force_error", ""), ("base_mass_error", ""), 0.01, False),
        (("isolator_force_error", ""), ("extra_isolator_damping", ""), 0.01, False),
        (("extra_storey_damping", "storey2"), ("storey_stiffness_loss", "storey2"), 0.01, True),
        (("extra_storey_damping", "storey2"), ("storey_stiffness_loss", "storey1"), 0.01, False),
    ],
)
def test_a_small_cause_beside_another_of_its_place_only_acts_like_one(
    isolated, monkeypatch, small, beside, share, doubtful
):
    """It mends the form of the other, of which what acts there is seldom exactly one."""
    record = _record(isolated)
    problem = BuildingRecords([record], isolated, 2, lambda text: None)
    model = building_model(isolated, [record])
    comparison = compare_building(model, [record])
    listed = {(c.name, c.place): c for c in candidates(model, [record])}
    causes = tuple((listed[key], listed[key].starts[0]) for key in (beside, small))
    problem.space = space = CauseSearch(comparison)
    best = comparison.fit((), causes, 1)
    space.rivals = {cause.label: [] for cause, _ in causes}
    problem.without = [space.before, space.before]
    monkeypatch.setattr("isolation_sim.discrepancy.inference.shares", lambda *_: [1 - share, share])
    found = problem.causes(SearchResult(space.before, best, []), None)
    assert [cause.doubtful for cause in found] == [False, doubtful]


@pytest.mark.parametrize("error", [0.0, 0.02])
def test_a_cause_that_corrects_next_to_nothing_is_dropped(isolated, monkeypatch, error):
    """Also where the record has it and shows noise alone with it."""
    monkeypatch.setattr(CauseSearch, "is_explained", lambda _, one: len(one.cause_values) > 1)

    def change(model):
        return _with(_heavier(0.4)(model), "floor_mass_error", "floor2", (error,))

    record = _record(isolated, change, seed=7, noise=1e-3)
    model = building_model(isolated, [record])
    listed = {(c.name, c.place): c for c in candidates(model, [record])}
    space = CauseSearch(compare_building(model, [record]))
    both = [("base_mass_error", ""), ("floor_mass_error", "floor2")]
    fitted = space.comparison.fit((), tuple((listed[key], (0.1,)) for key in both))
    assert space.finish(fitted).causes == ("base_mass_error",)


@pytest.mark.parametrize(("error", "named"), [(1e-3, ()), (-0.1, ("isolator_force_error",))])
def test_no_cause_is_named_below_the_calibration_of_sensors(isolated, error, named):
    record = _record(isolated, lambda m: _with(m, "isolator_force_error", "", (error,)), noise=3e-4)
    model = building_model(isolated, [record])
    force = next(c for c in candidates(model, [record]) if c.name == "isolator_force_error")
    space = CauseSearch(compare_building(model, [record]))
    assert space.finish(space.comparison.fit((), ((force, (0.05,)),))).causes == named


def test_a_sensor_with_an_error_of_another_form_is_blamed_alone(isolated):
    """Others follow what a polynomial leaves of its drift, unless other channels need them."""
    bias, mass = ("sensor_bias", "floor2_acceleration_m_s2"), ("base_mass_error", "")
    for change, named in ((None, 1), (_heavier(0.15), 2)):
        record = _record(isolated, change, seed=14)
        drift = 0.3 * np.exp(-(((record.time - 12.0) / 3.0) ** 2))
        response = {**record.response, bias[1]: record.response[bias[1]] + drift}
        record = replace(record, response=response)
        model = building_model(isolated, [record])
        listed = {(c.name, c.place): c for c in candidates(model, [record])}
        space = CauseSearch(compare_building(model, [record]))
        starts = (listed[bias], (0.01, 0.0, 0.0, 0.0)), (listed[mass], (0.1,))
        result = of_one_sensor(space, space.comparison.fit((), starts))
        assert len(result.causes) == named and "sensor_bias" in result.causes[0]


def test_offsets_of_all_channels_are_one_cause(isolated, monkeypatch):
    """Beside that of the ground's sensor, which moves the simulated building."""
    record = _record(isolated, seed=4)
    shifts = dict(zip(CHANNELS, (0.01, -0.02, 0.03, 0.01, -0.01, 0.02, 2e-3), strict=True))
    response = {name: values + shifts[name] for name, values in record.response.items()}
    shaking = replace(record.ground[0], acceleration=record.ground[0].acceleration + 0.02)
    record = replace(record, ground=(shaking,), response=response)
    names = {"sensor_bias", "base_mass_error"}
    every = candidates(building_model(isolated, [record]), [record])
    few = [c for c in every if c.name in names and c.form in ("", "constant")]
    monkeypatch.setattr(cause_search, "candidates", lambda model, records: few)
    comparison = compare_building(building_model(isolated, [record]), [record])
    best = searches.search_causes(comparison)[1].best
    of_ground = "sensor_bias (ground_acceleration_m_s2)"
    assert set(best.causes) == {"sensor_bias (all channels)", of_ground}
    found = dict(zip(best.causes, (values for _, values in best.cause_values), strict=True))
    assert found["sensor_bias (all channels)"] == pytest.approx(tuple(shifts.values()), abs=3e-3)
    assert found[of_ground] == pytest.approx((0.02,), abs=1e-3)


@pytest.mark.usefixtures("few_causes")
def test_a_drift_that_comes_late_is_fitted_where_it_is(isolated):
    """The time that is fitted at first shows next to none of it."""
    record = _record(isolated, seed=13)
    name, share = "isolator_displacement_m", np.linspace(0.0, 1.0, len(record))
    drift = 0.5 * record.response[name].std() * share**3
    record = replace(record, response={**record.response, name: record.response[name] + drift})
    comparison = compare_building(building_model(isolated, [record]), [record])
    space, result = searches.search_causes(comparison)
    assert result.best.causes == (f"sensor_bias ({name})",)
    assert space.comparison.middle > comparison.middle


def test_a_simple_cause_takes_the_place_of_one_of_many_numbers(isolated):
    """Softening from the smallest deformation on is a smaller force."""
    record = _record(isolated, lambda m: _with(m, "isolator_force_error", "", (-0.1,)), seed=8)
    model = building_model(isolated, [record])
    many = next(
        c for c in candidates(model, [record]) if c.name == "isolator_amplitude_softening"
    )  # fmt: skip
    space = CauseSearch(compare_building(model, [record]))
    imitated = space.comparison.fit((), ((many, (0.1, 1e-3, 4.0, 10.0)),))
    result = space.finish(imitated)
    assert result.causes == ("isolator_force_error",)
    assert result.cause_values[0][1][0] == pytest.approx(-0.1, abs=5e-3)


def test_a_wall_stands_beyond_most_of_the_motion(isolated):
    """What begins earlier is another law; a single pulse has a small RMS."""
    record = _record(isolated)
    moved = record.displacement("")
    pulse = np.where(np.arange(len(moved)) == 300, moved.max(), 0.01 * moved)
    record = replace(record, response={**record.response, "isolator_displacement_m": pulse})
    walls = [
        c for c in candidates(building_model(isolated, [record]), [record])
        if c.name == "moat_impact" and not c.form.startswith("one_side")
    ]  # fmt: skip
    for wall in walls:
        assert wall.parameters[1].lower == pytest.approx(0.3 * moved.max())
        assert all(gap > wall.parameters[1].lower for _, gap, *_ in wall.starts)


def test_what_the_fitted_part_lacks_is_not_explained(isolated):
    """The base is heavier all the time, a floor in the strong first part alone."""

    def both(model):
        return _with(_heavier(0.3)(model), "floor_mass_error", "floor3", (3.0, 0.5))

    all_along, more = _record(isolated, _heavier(0.3)), _record(isolated, both)
    n = len(all_along) // 4
    response = {
        name: np.concatenate([more.response[name][:n], values[n:]])
        for name, values in all_along.response.items()
    }
    for record, explained in ((all_along, True), (replace(all_along, response=response), False)):
        model = building_model(isolated, [record])
        space = CauseSearch(compare_building(model, [record]))
        base = next(c for c in candidates(model, [record]) if c.name == "base_mass_error")
        evaluation = space.comparison.evaluate(((base, (0.3,)),))
        assert (
            space.removed_share(evaluation) > 0.95
            and excess_error(space.comparison, evaluation) < 0.03
        )
        assert (excess_error(space.comparison, evaluation, held_out=False) < 0.03) is explained
        assert space.explains(evaluation, 0.0) is explained


def test_several_times_the_noise_are_not_explained(isolated):
    """However little of the signal they are."""
    record = _record(isolated, _heavier(0.3), noise=1e-3)
    model = building_model(isolated, [record])
    space = CauseSearch(compare_building(model, [record]))
    base = next(c for c in candidates(model, [record]) if c.name == "base_mass_error")
    space._compared_beside(((base, (0.3,)),))
    for mass, explained in ((0.295, True), (0.27, False)):
        evaluation = space.comparison.evaluate(((base, (mass,)),))
        assert space.removed_share(evaluation) > 0.95
        assert largest_excess(space.comparison, evaluation) < 0.03
        assert space.explains(evaluation, 0.0) is explained


def test_a_biased_sensor_is_named_with_its_channel(isolated):
    record = _record(isolated, seed=4)
    response = dict(record.response)
    response["floor3_acceleration_m_s2"] = response["floor3_acceleration_m_s2"] + 0.03
    diagnosis = diagnose_building(replace(record, response=response), isolated)
    assert [cause.name for cause in diagnosis.causes] == ["sensor_bias"]
    assert "floor3_acceleration_m_s2 is off by" in diagnosis.causes[0].reason
    assert diagnosis.causes[0].parameters["mean"].value == pytest.approx(0.03, abs=0.003)
    # the building itself is as it was
    np.testing.assert_allclose(diagnosis.building.structure.stiffness, isolated.structure.stiffness)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "place", "values"),
    [("floor_mass_error", "floor4", (0.3,)), ("sensor_delay", "accelerations", (0.02,))],
)
def test_a_cause_is_named_with_its_place(isolated, name, place, values):
    record = _record(isolated, lambda model: _with(model, name, place, values), seed=12)
    diagnosis = diagnose_building(record, isolated, tiers="causes")
    (cause,) = diagnosis.causes
    assert cause.name == name and place in cause.reason
    (number,) = (one for key, one in cause.parameters.items() if key != "floor")
    assert number.value == pytest.approx(values[0], rel=0.05)
    assert diagnosis.verdict == "explained"


def test_masses_stiffness_and_damping_are_changed_where_they_are_said_to_be(isolated):
    record = _record(isolated, noise=1e-9)
    model = building_model(isolated, [record])
    own = model.structure

    def changed(name, place, value):
        return _with(model, name, place, (value,)).structure

    masses = np.diag(own.mass)
    ratio = np.diag(changed("floor_mass_error", "floor2", 0.2).mass) / masses
    assert ratio == pytest.approx([1, 1, 1.2, 1, 1, 1])
    ratio = np.diag(changed("floor_mass_error", "all floors", 0.2).mass) / masses
    assert ratio == pytest.approx([1, 1.2, 1.2, 1.2, 1.2, 1.2])
    stiffer = changed("storey_stiffness_gain", "storey3", 0.5)
    ratio = shear_stiffness(stiffer) / shear_stiffness(own)
    assert ratio == pytest.approx([1, 1, 1.5, 1, 1])
    whole = changed("structure_stiffness_error", "", -0.1)
    np.testing.assert_allclose(whole.stiffness, 0.9 * own.stiffness)
    row = own.drift_rows[1]
    damper = changed("extra_storey_damping", "storey2", 1e6).damping - own.damping
    np.testing.assert_allclose(damper, 1e6 * np.outer(row, row), atol=1e-6)
    damped = changed("structural_damping_error", "", 0.5)
    np.testing.assert_allclose(damped.damping, 1.5 * own.damping)
    weaker = _with(model, "isolator_force_error", "", (-0.25,)).assembled
    scales = [one.elements[0].device.force_scale for one in (weaker, isolated)]
    assert scales[0] == pytest.approx(0.75 * scales[1])


def test_sensors_show_what_their_faults_make_of_a_motion(isolated):
    record = _record(isolated, noise=1e-9)
    model = building_model(isolated, [record])
    t = record.time
    motion = np.sin(2 * np.pi * t)[:, np.newaxis] * (1.0 + np.arange(len(CHANNELS)))
    roof, base = CHANNELS.index("floor5_acceleration_m_s2"), 0
    pair = f"{CHANNELS[base]}, {CHANNELS[roof]}"
    shown = _with(model, "sensor_exchange", pair, ()).sensed(record, motion)
    np.testing.assert_array_equal(shown[:, [base, roof]], motion[:, [roof, base]])
    turned = _with(model, "sensor_gain", CHANNELS[roof], (-1.0,)).sensed(record, motion)
    np.testing.assert_array_equal(turned[:, roof], -motion[:, roof])
    late = _with(model, "sensor_delay", "all channels", (0.033,)).sensed(record, motion)
    expected = np.sin(2 * np.pi * (t - 0.033))[:, np.newaxis] * (1.0 + np.arange(len(CHANNELS)))
    inside = (t > 0.2) & (t < t[-1] - 0.2)
    np.testing.assert_allclose(late[inside], expected[inside], atol=1e-4)


def test_two_exchanged_sensors_are_named(isolated):
    record = _record(isolated, seed=13)
    names = ("floor2_acceleration_m_s2", "floor3_acceleration_m_s2")
    response = dict(record.response)
    response[names[0]], response[names[1]] = (record.response[one] for one in reversed(names))
    diagnosis = diagnose_building(replace(record, response=response), isolated, tiers="causes")
    (cause,) = diagnosis.causes
    assert cause.name == "sensor_exchange" and cause.parameters == {}
    assert "are exchanged" in cause.reason and diagnosis.verdict == "explained"


def test_records_whose_quantities_do_not_belong_together_are_refused(isolated):
    record = _record(isolated, noise=1e-9)
    in_g = {name: values / 9.81 for name, values in record.response.items()}
    in_g["isolator_displacement_m"] = record.response["isolator_displacement_m"]
    (ground,) = record.ground
    scaled = replace(record, ground=(ground.scaled(1 / 9.81),), response=in_g)
    with pytest.raises(InputError, match=r"is 0\.102 times that of the isolators' displacement"):
        diagnose_building(scaled, isolated)
    relative = {
        name: values - ground.acceleration * name.endswith("m_s2")
        for name, values in record.response.items()
    }
    with pytest.raises(InputError, match="expected: absolute accelerations"):
        diagnose_building(replace(record, response=relative), isolated)


@pytest.mark.usefixtures("all_draws")
def test_intervals_are_those_of_a_linear_fit(isolated):
    """A constant bias is a mean: its interval is known in closed form."""
    record = _record(isolated, seed=4)
    comparison = compare_building(building_model(isolated, [record]), [record])
    bias = next(
        c for c in candidates(comparison.model, [record])
        if c.name == "sensor_bias" and c.place == CHANNELS[3] and c.form == "constant"
    )  # fmt: skip
    outcome = comparison.fit((), ((bias, (0.01,)),))
    cause_values = intervals(comparison, outcome)[0]["mean"]
    n = comparison.middle
    slow = comparison.floors[0].sensor_noise(np.zeros(1))[0, 3]
    assert slow < 1.5 * comparison.floors[0].sensors[3]
    half = 1.96 * slow / np.sqrt(n)
    assert (cause_values.high - cause_values.low) / 2 == pytest.approx(half, rel=0.25)
    # noise need not be independent from sample to sample
    spread = _with_common_noise(comparison).floors[0].examples[:, 0, 3].std(ddof=1)
    wider = intervals(_with_common_noise(comparison), outcome)[0]["mean"]
    assert wider.high - wider.low == pytest.approx(2 * 2.04 * spread, rel=0.01)


def _with_common_noise(comparison):
    """A comparison whose noise is one offset of channel 3 in the whole record."""
    (floor,) = comparison.floors
    examples = np.zeros_like(floor.examples)
    examples[..., 3] = np.linspace(-1, 1, len(examples))[:, np.newaxis]
    return replace(comparison, floors=(replace(floor, examples=examples),))


def test_an_offset_is_no_evidence_where_the_noise_is_one(isolated):
    record = _record(isolated, seed=4)
    shown = record.response[CHANNELS[3]]
    record = replace(record, response={**record.response, CHANNELS[3]: shown + 0.01 * shown.std()})
    comparison = compare_building(building_model(isolated, [record]), [record])
    bias = next(
        c for c in candidates(comparison.model, [record])
        if c.name == "sensor_bias" and c.place == CHANNELS[3] and c.form == "constant"
    )  # fmt: skip
    before, outcome = comparison.evaluate(()), comparison.fit((), ((bias, (0.01,)),))
    assert p_value(comparison, before, outcome) < 1e-9
    assert p_value(_with_common_noise(comparison), before, outcome) > 0.05


def test_no_late_cause_is_named_for_a_small_remainder(isolated):
    record = _record(isolated, _heavier(0.2))
    comparison, listed = _compared(isolated, record)
    space = CauseSearch(comparison, choices=())
    for mass, little in ((0.2, True), (0.1, False)):
        causes = ((listed["base_mass_error"], (mass,)),)
        assert space._is_little(comparison.evaluate(causes)) is little
    assert not space._is_little(space.before)


def test_a_foundation_may_sway_and_rock(isolated):
    """Each motion alone is both of them on soil that is nearly rigid against the other."""
    record = _record(isolated, noise=1e-9)
    model = building_model(isolated, [record])
    forms = {c.form: c for c in candidates(model, [record]) if c.name == "soil_flexibility"}
    sway, rocking = ((*forms[form].starts[2][:2], 3e5) for form in ("sway", "rocking"))
    stiff = (1e14, 1e10, 3e5)
    size = np.sqrt(np.mean(record.values**2, axis=0))
    for form, alone, both in (
        ("sway", sway, (*sway, *stiff)), ("rocking", rocking, (*stiff, *rocking)),
    ):  # fmt: skip
        one, together = (
            forms[name].apply(model, values).predict(record)
            for name, values in ((form, alone), ("sway_and_rocking", both))
        )
        assert np.max(np.abs(one - record.values) / size) > 0.05
        np.testing.assert_allclose(together / size, one / size, atol=2e-2)
    # a search goes on from what one motion was found to be
    start = carried_over(forms["sway_and_rocking"], forms["rocking"], rocking)
    assert start[3:] == pytest.approx(rocking) and start[0] == forms["sway"].starts[-1][0]


def test_a_very_stiff_soil_changes_nothing_and_a_soft_one_does(isolated):
    record = _record(isolated, noise=1e-9)
    model = building_model(isolated, [record])
    rigid = model.predict(record)
    size = np.sqrt(np.mean(rigid**2, axis=0))
    for rocking in (False, True):
        stiff = replace(model, soil=(Soil(1e14, 1e10, 3e5, rocking),)).predict(record)
        np.testing.assert_allclose(stiff / size, rigid / size, atol=2e-3)
        soft = replace(model, soil=(Soil(3e8, 1e6, 3e5, rocking),)).predict(record)
        assert np.max(np.abs(soft - rigid) / size) > 0.05


def test_a_biased_ground_sensor_shakes_the_model_with_its_error(isolated):
    record = _record(isolated, noise=1e-9)
    model = building_model(isolated, [record])
    biased = replace(model, biases={record.ground_channels[0]: np.array([0.1])})
    moved = (biased.predict(record) - model.predict(record))[-300:, -1].mean()
    # M a / k: the whole mass over the isolators' stiffness
    assert moved == pytest.approx(0.1 * isolated.structure.total_mass / 1.2e7, rel=0.1)


def test_records_and_structures_that_do_not_fit_are_refused(isolated):
    record = _record(isolated, noise=1e-9)
    small = iso.shear_building([2e5] * 2, [2e8] * 2, base_mass=2e5).on(
        iso.law("kelvin_voigt", {"k": 1e6, "c": 1e5})
    )
    with pytest.raises(InputError, match="floor5; shear building has 2 floors"):
        diagnose_building(record, small)
    with pytest.raises(InputError, match="not held out"):
        diagnose_building(replace(record, hold_out=True), isolated)
    with pytest.raises(InputError, match="share a name"):
        diagnose_building([record, record], isolated)


def test_a_filter_of_the_file_shapes_simulated_channels_too(isolated):
    """The ground motion is restored before the simulation, if it passed the filter as well."""
    stated = RecordFilter(high_pass_Hz=0.3, order=2, zero_phase=False)
    record = _record(isolated, seed=3)
    dt, shaking = record.dt, record.ground[0].acceleration
    response = {name: stated.apply(values, dt) for name, values in record.response.items()}
    for ground in (True, False):
        passed = stated.model_copy(update={"ground": ground})
        moved = stated.apply(shaking, dt) if ground else shaking
        filtered = replace(
            record, ground=(replace(record.ground[0], acceleration=moved),), response=response
        )
        model = building_model(isolated, [filtered])
        stating = compare_building(model, [replace(filtered, filter=passed)])
        assert is_quiet(stating, stating.evaluate(()))
        assert stating.held_out[0].samples.stop == int(0.95 * len(record))
        assert excess_error(stating, stating.evaluate(())) < 0.003
        # a linear building shows the same of a motion that passed the filter before
        found = with_likeliest_filter(compare_building(model, [filtered])).records[0]
        assert (found.filter is None) == ground
    assert not (found.filter.ground or found.filter.zero_phase)
    assert found.filter.slow == pytest.approx(0.3, rel=0.1)
    assert found.filter.line in found.notes[-1]


@pytest.mark.usefixtures("few_causes")
def test_a_filter_is_found_beside_a_cause(isolated):
    unstated = RecordFilter(high_pass_Hz=0.1, ground=False)
    record = _record(isolated, _heavier(0.5), seed=3, noise=0.003)
    response = {c: unstated.apply(v, record.dt) for c, v in record.response.items()}
    problem = BuildingRecords([replace(record, response=response)], isolated, 1, lambda text: None)
    nominal = problem.nominal()
    assert problem.records[0].filter is None
    best = problem.search(nominal).best
    assert best.causes == ("base_mass_error",)
    assert best.cause_values[0][1] == pytest.approx((0.5,), abs=0.02)
    assert problem.records[0].filter.slow == pytest.approx(0.1, rel=0.1)


def test_a_record_that_lacks_no_slow_motion_gets_no_filter(isolated):
    record = _record(isolated, _heavier(0.15), seed=3)
    comparison = compare_building(building_model(isolated, [record]), [record])
    assert with_likeliest_filter(comparison) is comparison


def test_what_softens_with_its_history_is_compared_with_its_like(isolated, monkeypatch):
    """What was taken first goes where its like is nearer, and is a rival where it is not far."""
    record = _record(isolated, _heavier(0.15), seed=3)
    comparison, listed = _compared(isolated, record)
    right, wrong = listed["base_mass_error"], listed["structure_stiffness_error"]
    monkeypatch.setattr(cause_exchange, "HISTORIES", (right.name, wrong.name))
    monkeypatch.setattr(cause_exchange, "proposed_effects", lambda *given: [
        [replace(one, starts=((0.05,),))] for one in (right, wrong) if one.name in given[2]
    ])  # fmt: skip
    space = CauseSearch(comparison)
    taken = comparison.fit((), ((wrong, (-0.05,)),))
    best = exchange_histories(space, taken)
    assert best.causes == (right.label,) and space.rivals[right.label] == []
    # half of the held-out time was fitted as well to tell them apart
    assert space.comparison.middle > comparison.middle
    # another form of what was taken
    other = replace(wrong, name=right.name, place=right.place, form="other")
    again = exchange_histories(
        CauseSearch(comparison), comparison.fit((), ((other, (-0.05,)),))
    )  # fmt: skip
    assert again.cause_values[0][0].form == right.form
    # two that follow the data alike
    alike = replace(right, place="alike")
    monkeypatch.setattr(cause_exchange, "proposed_effects", lambda *given: [[alike]])
    again = exchange_histories(space, best)
    (rival,) = space.rivals[again.causes[0]]
    assert {rival.causes[0], again.causes[0]} == {right.label, alike.label}


def test_a_rest_between_two_motions_is_a_test(isolated):
    record = _record(isolated, seed=3)
    comparison, _ = _compared(isolated, record)
    tests = dict(_tests(record, comparison))
    (after_rest,) = (one for label, one in tests.items() if "after a rest of 120 s" in label)
    assert len(after_rest) == 2 * len(record) + round(120 / record.dt)
    shaking = after_rest.ground[0].acceleration
    np.testing.assert_array_equal(shaking[-len(record) :], record.ground[0].acceleration)
