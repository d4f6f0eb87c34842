"""The recorded current between its samples: held or linear, and how it follows a supply's slew."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import butter, sosfiltfilt

import isolation_sim as iso
from ground_motions import Record
from isolation_sim.discrepancy.adapters.building import BuildingRecords
from isolation_sim.discrepancy.building.comparison import compare_building
from isolation_sim.discrepancy.building.goodness_of_fit import is_quiet
from isolation_sim.discrepancy.building.model import RecordedCurrent, building_model
from isolation_sim.discrepancy.building.noise import _current_noise, highest_frequency
from isolation_sim.discrepancy.building.record import BuildingRecord
from isolation_sim.discrepancy.building.search.cause_exchange import between_samples
from isolation_sim.discrepancy.building.search.cause_search import CauseSearch, candidates
from isolation_sim.discrepancy.building.switching import switching_error
from isolation_sim.discrepancy.diagnose import diagnose_building

MASSES, STIFFNESS, DAMPING = (2.0e5, 1.5e5), 6.0e7, 3.0e5
RUBBER, RUBBER_DAMPING, PER_AMPERE = 3.0e6, 1.5e5, 2.0e6
DT, FINE = 0.01, 10
N = 2000


def _smooth(isolated, error, noise=2e-3):
    """A record whose slow current was measured with an error, in A."""
    rng = np.random.default_rng(3)
    sos = butter(4, [0.3, 6.0], btype="band", fs=1 / DT, output="sos")
    t = np.arange(N) * DT
    shaking = sosfiltfilt(sos, rng.standard_normal(N)) * np.minimum(t / 2, 1) * np.exp(-t / 8)
    ground = Record(3.0 * shaking / np.abs(shaking).max(), DT, "quake")
    names = ("base_acceleration_m_s2", "floor1_acceleration_m_s2", "isolator_displacement_m")
    current = 1.5 + 1.5 * np.sin(t)
    blank = BuildingRecord("quake", (ground,), {c: np.arange(N) % 3 - 1.0 for c in names}, current)
    values = building_model(isolated, [blank]).predict(blank)
    values += noise * values.std(axis=0) * rng.standard_normal(values.shape)
    shown = current + error * rng.standard_normal(N)
    return replace(blank, response=dict(zip(names, values.T, strict=True)), current=shown)


@pytest.mark.parametrize("error", [0.0, 8e-3])
def test_noise_of_the_current_is_noise(isolated, error):
    record = _smooth(isolated, error)
    comparison = compare_building(building_model(isolated, [record]), [record])
    assert is_quiet(comparison, comparison.evaluate(()))


def test_ramps_of_a_supply_are_no_noise_of_the_current(isolated):
    record = _smooth(isolated, 8e-3)
    band = highest_frequency(isolated, record.dt)
    assert _current_noise(record, band) == pytest.approx(8e-3, rel=0.1)
    wanted = np.repeat(np.random.default_rng(4).uniform(0.0, 3.0, N // 100), 100)
    ramps = np.zeros(N)
    for k in range(1, N):
        ramps[k] = ramps[k - 1] + np.clip(wanted[k] - ramps[k - 1], -0.03, 0.03)
    assert _current_noise(replace(record, current=ramps), band) < 1e-9


@pytest.mark.parametrize("period", [2, 20])
def test_changes_of_a_controller_are_no_noise_of_the_current(isolated, period):
    record = _held(period, "before")
    band = highest_frequency(isolated, record.dt)
    assert _current_noise(record, band) < 1e-3 * np.ptp(record.current)


@pytest.fixture(scope="module")
def isolated():
    """A base and one floor on rubber that a current stiffens."""
    structure = iso.shear_building(MASSES[1:], [STIFFNESS], base_mass=MASSES[0])
    damping = DAMPING * np.array([[1.0, -1.0], [-1.0, 1.0]])
    structure = replace(structure, damping=damping)
    law = iso.law("kelvin_voigt", {"k": [RUBBER, PER_AMPERE], "c": RUBBER_DAMPING})
    return structure.on(law)


def _held(period, shown, seed=0, noise=0.01):
    """A record, exact at every step, whose current jumps every ``period`` samples."""
    rng = np.random.default_rng(seed)
    t = np.arange(N * FINE) * DT / FINE
    sos = butter(4, [0.3, 6.0], btype="band", fs=FINE / DT, output="sos")
    ground = sosfiltfilt(sos, rng.standard_normal(t.size)) * np.minimum(t / 2, 1) * np.exp(-t / 8)
    ground *= 3.0 / np.abs(ground).max()
    levels = rng.uniform(0.0, 3.0, N // period + 1)
    k = np.array([[STIFFNESS, -STIFFNESS], [-STIFFNESS, STIFFNESS]])

    def rows(current):
        """Absolute accelerations over displacements and velocities."""
        rubber = np.diag([1.0, 0.0])
        stiffness = k + (RUBBER + PER_AMPERE * current) * rubber
        damping = DAMPING / STIFFNESS * k + RUBBER_DAMPING * rubber
        return -np.hstack([stiffness, damping]) / np.array(MASSES)[:, np.newaxis]

    def step(current):
        """Exact step of states, ground motion and its change within the step."""
        h, rates = DT / FINE, np.zeros((6, 6))
        rates[:2, 2:4], rates[2:4, :4], rates[2:4, 4] = np.eye(2), rows(current), -1.0
        rates[4, 5] = 1 / h
        return expm(h * rates)

    current = np.repeat(levels, period)[:N]
    steps = {level: step(level) for level in levels}
    y, x = np.zeros(4), np.zeros((N, 4))
    for i in range(N):
        x[i] = y
        matrix = steps[current[i]]
        for j in range(i * FINE, min((i + 1) * FINE, t.size - 1)):
            y = (matrix @ [*y, ground[j], ground[j + 1] - ground[j]])[:4]
    seen = current if shown == "after" else np.append(current[0], current[:-1])
    shaking = ground[::FINE]
    absolute = np.array([rows(one) @ state for one, state in zip(seen, x, strict=True)])
    signals = np.column_stack([absolute, x[:, 0]])
    signals += noise * signals.std(axis=0) * rng.standard_normal(signals.shape)
    shaking = shaking + noise * shaking.std() * rng.standard_normal(N)
    names = "base_acceleration_m_s2", "floor1_acceleration_m_s2", "isolator_displacement_m"
    response = dict(zip(names, signals.T, strict=True))
    return BuildingRecord("held", (Record(shaking, DT, "held"),), response, current)


@pytest.mark.parametrize(
    ("period", "shown"),
    [
        pytest.param(2, "after", marks=pytest.mark.slow),
        (5, "after"),
        pytest.param(5, "before", marks=pytest.mark.slow),
    ],
)
def test_a_clean_record_with_a_held_current_is_adequate(isolated, period, shown):
    diagnosis = diagnose_building(_held(period, shown), isolated)
    assert diagnosis.verdict == "adequate", [cause.label for cause in diagnosis.causes]
    assert diagnosis.error_before.held_out < 1.5 * diagnosis.held_out_noise_floor


def _with_current(current):
    n = len(current)
    wave = np.sin(np.arange(n) / 7)
    names = "base_acceleration_m_s2", "isolator_displacement_m"
    motion = Record(wave, DT, "any")
    return BuildingRecord("any", (motion,), dict.fromkeys(names, wave), current)


RNG = np.random.default_rng(3)
LEVELS = np.repeat(RNG.uniform(0, 3, 50), 4)


@pytest.mark.parametrize(
    ("current", "steps"),
    [
        (LEVELS, True),
        (np.repeat(RNG.uniform(0, 3, 100), 2), True),
        (LEVELS + 1e-3 * RNG.standard_normal(200), True),
        (np.repeat([0.0, 2.0, 0.0], [80, 40, 80]), True),
        (3.0 * RNG.integers(0, 2, 200), True),
        (np.full(200, 1.0), False),
        (1 + np.sin(np.arange(200) / 9), False),
        # a supply that ramps between two levels
        (np.interp(np.arange(200), [50, 60, 120, 130], [0.0, 3.0, 3.0, 0.0]), False),
        (RNG.uniform(0, 3, 200), False),
    ],
)
def test_a_current_that_jumps_and_rests_is_distinguished_from_one_that_moves(current, steps):
    assert _with_current(current).current_steps is steps


def test_a_ramp_behind_a_slew_rate_is_followed_without_delay():
    time = np.arange(300) * DT
    ramp = np.interp(time, [0.5, 0.75], [0.0, 3.0])
    table = RecordedCurrent(time, ramp, 0.0, None, slew=8.0).table
    fine = np.arange(0, 2.9, 1e-5)
    inputs = table[1][np.searchsorted(table[0], fine, side="right") - 1]
    exact = np.clip((fine - 0.5) * 8.0, 0.0, 3.0)
    # the area between them over the height is the mean delay
    assert abs(np.sum(exact - inputs) * 1e-5 / 3.0) < 0.02 * DT


def test_a_delay_between_the_samples_is_named_only_alone(isolated):
    """Held and linear currents differ by more than a small delay."""
    record = _held(5, "after")
    model = building_model(isolated, [record])
    listed = {(c.name, c.form): c for c in candidates(model, [record])}
    delay = listed["actuation_delay", "dead_time"]
    other = listed["base_mass_error", ""], (0.1,)
    space = CauseSearch(compare_building(model, [record]))
    evaluate = space.comparison.evaluate

    def unresolved(both, without):
        return between_samples(space, evaluate(both), [evaluate((one,)) for one in without])

    for late, place in ((0.2 * DT, 1), (3.0 * DT, None)):
        own = delay, (late,)
        assert unresolved((other, own), (own, other)) == place
    # of two causes in the current, that which changes it less
    lag = listed["actuation_delay", "first_order"]
    first, second = (delay, (0.4 * DT,)), (lag, (0.05 * DT,))
    assert unresolved((first, second), (second, first)) == 1


def test_a_ramp_within_a_sample_is_not_named_beside_a_delay(isolated):
    """The delay that is fitted without the ramp has its middle, so that little of it is left."""
    record = replace(_held(5, "after"), current=np.tile(np.repeat([0.0, 3.0], 5), N // 10))
    model = replace(building_model(isolated, [record]), jump=0.0)
    listed = {(c.name, c.form): c for c in candidates(model, [record])}
    delay = listed["actuation_delay", "dead_time"]
    ramp = listed["current_supply_limit", "slew"], (3.0 / DT,)
    space = CauseSearch(compare_building(model, [record]))
    evaluate = space.comparison.evaluate
    both = evaluate(((delay, (2.7 * DT,)), ramp))
    for alone, place in ((3.2 * DT, 1), (2.7 * DT, None)):
        without = [evaluate((ramp,)), evaluate(((delay, (alone,)),))]
        assert between_samples(space, both, without) == place


def _with_force(model, error):
    """Isolators whose force is larger by a share."""
    force = next(
        c for c in candidates(model, [_held(5, "after")]) if c.name.endswith("force_error")
    )
    return force.apply(model, (error,))


def test_a_delay_does_not_keep_a_held_current_linear(isolated):
    """A linear current is half a sample early, which a delay makes up for."""
    record = _held(5, "after")
    record = replace(record, current=np.tile(np.repeat([0.0, 3.0], 5), N // 10))
    model = building_model(isolated, [record])
    late = replace(model, jump=0.0, delay=0.06).predict(record)
    record = replace(record, response=dict(zip(record.channels, late.T, strict=True)))
    space = compare_building(model, [record])
    delay = next(c for c in candidates(model, [record]) if c.form == "dead_time")
    fitted = space.fit((), ((delay, (0.05,)),))
    assert fitted.cause_values[0][1] == pytest.approx((0.065,), abs=0.001)
    again, causes = space.with_best_sampling(fitted.cause_values)
    assert again.model.jump is not None
    # the base moves at once: only a delay of whole samples jumps at the sample of its record
    held = again.fit((), causes)
    assert held.cause_values[0][1] == pytest.approx((0.06,), abs=1e-9)
    assert held.variance < 1.0


def test_a_late_current_is_not_assumed_to_be_held(isolated):
    """Held, it is half a sample late; the rest of a delay would be left to other causes."""
    record = replace(_smooth(isolated, 0.0), current=1.5 + 1.5 * np.sin(9 * np.arange(N) * DT))
    late = replace(building_model(isolated, [record]), delay=0.7 * DT).predict(record)
    noise = 1e-4 * late.std(axis=0) * np.random.default_rng(1).standard_normal(late.shape)
    record = replace(record, response=dict(zip(record.channels, (late + noise).T, strict=True)))
    problem = BuildingRecords([record], isolated, 1, lambda text: None)
    problem.nominal()
    assert problem.first.model.jump is None


def test_half_a_sample_of_delay_is_a_held_current_at_the_end(isolated):
    """It is found by the last form of the causes, and none remains of the delay."""
    record = _held(5, "after")
    record = replace(record, current=np.tile(np.repeat([0.0, 3.0], 5), N // 10))
    model = building_model(isolated, [record])
    true = replace(_with_force(model, 0.3), jump=0.0).predict(record)
    record = replace(record, response=dict(zip(record.channels, true.T, strict=True)))
    listed = {(c.name, c.form): c for c in candidates(model, [record])}
    delay, force = listed["actuation_delay", "dead_time"], listed["isolator_force_error", ""]
    space = CauseSearch(compare_building(model, [record]))
    found = space.finish(space.comparison.fit((), ((force, (0.2,)), (delay, (0.004,)))))
    assert found.causes == ("isolator_force_error",)
    assert found.cause_values[0][1] == pytest.approx((0.3,), abs=0.001)
    assert space.comparison.model.jump is not None


def test_a_dead_time_and_a_lag_are_one_delay(isolated):
    """A sampled controller and a coil; neither number alone follows both."""
    record = _held(20, "after", noise=0.0)
    model = building_model(isolated, [record])
    late = replace(model, jump=0.0, delay=0.03, lag=0.05)
    response = dict(zip(record.channels, late.predict(record).T, strict=True))
    record = replace(record, response=response)
    space = compare_building(replace(model, jump=0.0), [record])
    listed = [c for c in candidates(model, [record]) if c.name == "actuation_delay"]
    fits = {
        c.form: min((space.fit((), ((c, start),)) for start in c.starts), key=lambda one: one.cost)
        for c in listed
    }
    both = fits.pop("dead_time_and_lag")
    assert both.cause_values[0][1] == pytest.approx((0.03, 0.05), rel=0.05)
    assert all(both.cost < 0.1 * one.cost for one in fits.values())


def test_the_moments_of_jumps_within_a_sample_make_errors(isolated):
    """A constant current makes none."""
    model, errors = building_model(isolated, [_held(5, "after")]), []
    for record in (_held(5, "after"), replace(_held(5, "after"), current=np.full(N, 1.0))):
        comparison = compare_building(model, [record])
        errors.append([switching_error(comparison, held_out) for held_out in (False, True)])
    assert min(errors[0]) > 0.002 and errors[1] == [0.0, 0.0]
