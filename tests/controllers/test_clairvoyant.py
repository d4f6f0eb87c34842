"""The optimum over a whole ground motion, and the transcription behind it."""

import numpy as np
import pytest

from controllers import clairvoyant, controller
from controllers.clairvoyant import (
    ACCELERATION,
    DISPLACEMENT,
    EQUALLY,
    Clairvoyant,
    Plant,
    bound,
    causal_bound,
    pareto,
    share_of_gap,
)
from controllers.predictive.whole_record import WholeRecord
from ground_motions import Record
from isolation_sim.errors import InputError
from isolation_sim.simulation.control import CoilDriver
from isolation_sim.simulation.run import simulate

from .conftest import context_of, twice

LAGGING = CoilDriver(lag=0.05, high=3.0)


@pytest.fixture(scope="module")
def plant(isolated, el_centro):
    return Plant(isolated, (el_centro.cut(0.5, 2.5),), LAGGING)


@pytest.fixture(scope="module")
def coarse(isolated, el_centro):
    """A motion of fewer intervals."""
    return Plant(isolated, (el_centro.cut(1.0, 2.92).resampled(0.04),), LAGGING)


@pytest.fixture(scope="module")
def optimum(plant):
    return bound(plant)


def test_a_direction_without_motion_changes_nothing(isolated, el_centro):
    record = el_centro.cut(1.0, 2.2).resampled(0.08)
    alone = Plant(isolated, (record,), LAGGING)
    both = Plant(twice(isolated.structure), (record.scaled(0.0), record), LAGGING)
    scores = [bound(plant, starts=1).score for plant in (alone, both)]
    assert scores[1] == pytest.approx(scores[0], rel=1e-5)


def weighted(plant, run):
    off = simulate(plant.isolated, plant.records, controller("passive_off"), driver=plant.driver)
    return sum(run.criteria[f"peak_{q}"] / off.criteria[f"peak_{q}"] for q in EQUALLY)


def test_engine_certifies_the_predicted_peaks(plant, optimum):
    assert optimum.solved
    # the engine's peaks may lie between the five instants of an interval that the programme sees
    assert optimum.difference < 5e-3
    run = simulate(
        plant.isolated, plant.records,
        controller("prescribed", time=optimum.time, amperes=optimum.current), driver=plant.driver,
    )  # fmt: skip
    for quantity, peak in optimum.certified.items():
        assert run.criteria[f"peak_{quantity}"] == pytest.approx(peak, rel=1e-9)
    assert weighted(plant, run) == pytest.approx(optimum.score, rel=1e-9)
    assert optimum.current.min() >= 0 and optimum.current.max() <= 3.0


@pytest.mark.parametrize("name", ["passive_on", "best_constant", "on_off", "clipped_lqr"])
def test_no_other_controller_is_better(plant, optimum, name):
    run = simulate(plant.isolated, plant.records, controller(name), driver=plant.driver)
    assert weighted(plant, run) > optimum.score


def test_no_small_change_of_the_commands_is_better(plant, optimum):
    rng = np.random.default_rng(1)
    for size in (0.02, 0.2):
        smooth = np.convolve(rng.normal(size=len(optimum.time)), np.hanning(25) / 5, mode="same")
        changed = np.clip(optimum.current[:, 0] + size * smooth, 0, 3)
        commands = controller("prescribed", time=optimum.time, amperes=changed)
        run = simulate(plant.isolated, plant.records, commands, driver=plant.driver)
        assert weighted(plant, run) > optimum.score


@pytest.mark.slow
def test_other_starts_find_the_same_optimum(plant):
    assert bound(plant, starts=3).score == pytest.approx(bound(plant).score, rel=5e-3)


@pytest.mark.slow
def test_the_best_of_several_optima_is_the_result(isolated, el_centro):
    # from no current the search ends in a worse optimum than from half of it
    plant = Plant(isolated, (el_centro.cut(1.5, 6.0).resampled(0.04),), LAGGING)
    lowest, both = bound(plant, starts=1), bound(plant, starts=2)
    assert lowest.solved and both.solved
    assert both.score < 0.9 * lowest.score


@pytest.mark.slow
def test_a_long_motion_is_begun_with_the_optimum_of_its_first_half(coarse, monkeypatch):
    begun = []
    solve = WholeRecord.solve

    def noted(self, start, *value):
        begun.append((self.n, start.command[:-1, 0]))
        return solve(self, start, *value)

    monkeypatch.setattr(WholeRecord, "solve", noted)
    monkeypatch.setattr(clairvoyant, "LONG", 40)
    grown = bound(coarse, starts=1, period=0.08)
    (half, constant), (whole, continued) = begun
    assert (half, whole) == (24, 48) and np.all(constant == 0)
    assert np.ptp(continued[:half]) > 0.1 and np.all(continued[half:] == 0)
    monkeypatch.undo()
    alone = bound(coarse, starts=1, period=0.08, iterations=299)
    assert grown.score == pytest.approx(alone.score, rel=5e-3)


@pytest.mark.slow
def test_a_longer_interval_is_certified_under_the_motion_itself(plant):
    longer, fine = bound(plant, starts=1, interval=0.04), bound(plant, starts=1)
    assert longer.run.records == plant.records
    assert weighted(plant, longer.run) == pytest.approx(longer.score, rel=1e-9)
    assert np.diff(longer.time) == pytest.approx(0.04)
    # half as many commands, and the ground without its fastest parts
    assert fine.score * (1 - 5e-3) < longer.score < 1.1 * fine.score
    assert bound(plant, starts=1, interval=0.01).score == fine.score


@pytest.mark.slow
def test_front_is_a_front_and_not_below_the_weighted_optimum(isolated, el_centro):
    coarse = Plant(isolated, (el_centro.cut(1.5, 3.0).resampled(0.05),), LAGGING)
    front = pareto(coarse, n=3)
    assert len(front) == 3
    x, a = ([one.certified[q] for one in front] for q in (DISPLACEMENT, ACCELERATION))
    assert np.all(np.diff(x) > 0) and np.all(np.diff(a) < 0)
    assert min(one.score for one in front) > bound(coarse).score * (1 - 5e-3)
    # the engine's peaks lie between samples of the ground, which are coarse
    assert all(one.difference < 2e-2 for one in front)
    # an end is found from as many starts as a bound that hardly weighs the other peak
    stiffest = bound(coarse, {DISPLACEMENT: 1.0, ACCELERATION: 0.02})
    assert x[0] == pytest.approx(stiffest.certified[DISPLACEMENT], rel=5e-3)


@pytest.mark.slow
def test_ideal_supply_slew_and_other_periods(isolated, el_centro):
    records = (el_centro.cut(0.8, 2.0),)
    for driver in (CoilDriver(high=3.0), CoilDriver(lag=0.05, slew=8.0, high=2.0, initial=1.0)):
        result = bound(Plant(isolated, records, driver), period=0.1)
        assert np.allclose(np.diff(result.time), 0.1) and result.difference < 1e-2
        rate = np.abs(np.gradient(result.run.grid_current[:, 0], result.run.grid.time))
        if np.isfinite(driver.slew):
            assert rate.max() <= 8.0 * (1 + 1e-6) and result.current.max() <= 2.0
            assert result.run.current[0, 0] == 1.0


def test_controller_replays_the_bound_in_a_run(plant, optimum):
    one = Clairvoyant()
    run = simulate(plant.isolated, plant.records, one, driver=plant.driver)
    assert one.bound is optimum
    assert np.array_equal(run.command[:-1], optimum.current)
    assert weighted(plant, run) == pytest.approx(optimum.score, rel=1e-12)


def test_what_cannot_be_solved_is_refused(isolated, plant):
    with pytest.raises(InputError, match="every weight is 0"):
        bound(plant, {DISPLACEMENT: 0.0})
    with pytest.raises(InputError, match="n: given 1; expected: 2 or more"):
        pareto(plant, n=1)
    with pytest.raises(InputError, match="call prepare"):
        one = Clairvoyant()
        one.commands(context_of(one, isolated))


def test_share_of_the_gap():
    assert share_of_gap(2.0, 2.0, 1.0) == 0
    assert share_of_gap(1.0, 2.0, 1.0) == 1
    assert share_of_gap(2.5, 2.0, 1.0) == -0.5


def parting(plant, until):
    """The plant's motion, and one that becomes still after a time."""
    (record,) = plant.records
    k = round(until / record.dt)
    still = np.where(np.arange(len(record)) > k, 0.0, record.acceleration)
    return [plant, plant._replace(records=(Record(still, record.dt, name="still"),))]


@pytest.mark.slow
def test_motions_that_part_share_their_first_commands(coarse):
    until, period = 0.8, 0.08
    plants = parting(coarse, until)
    references = [bound(one, period=period, starts=1).score for one in plants]
    both = causal_bound(plants, [0.0, until], references, period=period, starts=1)
    n = np.sum(both[0].time <= until + 1e-9)
    np.testing.assert_allclose(both[0].current[:n], both[1].current[:n], atol=1e-6)
    assert np.abs(both[0].current[n:] - both[1].current[n:]).max() > 0.1
    excess = [one.score - r for one, r in zip(both, references, strict=True)]
    # to know which motion comes is worth something, and each is free after the parting
    assert 1e-3 < max(excess) < 0.5
    # the engine's peaks lie between samples of the ground, which are coarse
    assert max(one.difference for one in both) < 1e-2


@pytest.mark.slow
def test_motions_that_part_at_once_are_optimised_alone(coarse):
    plants = parting(coarse, 0.8)
    free = causal_bound(plants, [0.0, 0.0], [0.0, 0.0], period=0.05, starts=1)
    alone = [bound(one, period=0.05, starts=1).score for one in plants]
    # only the worse one counts
    assert max(one.score for one in free) == pytest.approx(max(alone), abs=2e-3)


def test_motions_that_part_earlier_than_said_are_refused(plant):
    with pytest.raises(InputError, match=r"still differs from .* before 0.9 s"):
        causal_bound(parting(plant, 0.8), [0.0, 0.9], [2.0, 2.0])
