"""Peaks are those of the continuous response: against the response on a grid of 0.1 ms.

The grid's values come from the outputs' definition with the law in NumPy, at the currents before
and after every command, so that they share nothing with how the kernel finds peaks.
"""

import numpy as np
import pytest

import isolation_sim as iso
from controllers import available_controllers, controller
from controllers.prescribed import Prescribed
from ground_motions import Record, el_centro_1940
from isolation_sim.effects.extend import extend
from isolation_sim.effects.registry import effect
from isolation_sim.scenario.building import MoatWall
from isolation_sim.simulation.batch import FEWEST, Case, simulate_many
from isolation_sim.simulation.control import CoilDriver
from isolation_sim.simulation.outputs import quantity_rows
from isolation_sim.simulation.trajectory import coil_current, device_forces

from ..sampled_criteria import response_criteria, response_of

STEP = 1e-4


def peaks_on_a_fine_grid(run, driver):
    """Peaks of a run's quantities, its commands and ground motion given on a grid of 0.1 ms."""
    dt, n = run.records[0].dt, len(run.records[0].acceleration)
    time = np.arange((n - 1) * round(dt / STEP) + 1) * STEP
    fine = [Record(np.interp(time, r.time, r.acceleration), STEP) for r in run.records]
    first, channels = run.grid.segments[:-1, 0], run.isolated.n_channels
    commands = run.work.command[first, :channels, 0]
    again = iso.simulate(
        run.isolated, fine, Prescribed(time=run.grid.time[first], amperes=commands), driver=driver
    )
    at = again.grid.samples
    ground, names = again.work.ground[at, :, 0], again.outputs.names
    results = {f"peak_{name}": 0.0 for name in quantity_rows(run.isolated, names)}
    for current in (again.current, currents_before(run, again, driver)):
        force = device_forces(again.isolated, again.modes, again.modal[at], again.states, current)
        values = np.concatenate([again.modal[at], force, ground], axis=1) @ again.outputs.rows.T
        for name, rows in quantity_rows(run.isolated, names).items():
            vectors = np.tensordot(values, rows, axes=(1, 2))
            sizes = np.sqrt((vectors**2).sum(axis=-1))
            results[f"peak_{name}"] = max(results[f"peak_{name}"], sizes.max(initial=0.0))
    return results


def currents_before(run, again, driver):
    """Coil currents at the fine samples, just before any command there, (n, n_channels)."""
    times, channels = run.grid.time[run.grid.segments[:-1, 0]], run.isolated.n_channels
    commands = run.work.command[run.grid.segments[:-1, 0], :channels, 0]
    current, before = run.work.coil_history[0, :channels, 0].copy(), again.current.copy()
    for k, time in enumerate(times[1:], start=1):
        elapsed = np.array(time - times[k - 1])
        lag, slew = np.full(channels, driver.lag), np.full(channels, driver.slew)
        start = commands[k - 1] if driver.lag == 0 and np.isinf(driver.slew) else current
        current = coil_current(start, commands[k - 1], lag, slew, elapsed)
        at = round(time / STEP)
        if abs(at * STEP - time) < 1e-9:
            before[at] = current
    return before


def assert_peaks(run, driver=None):
    for name, peak in peaks_on_a_fine_grid(run, driver or CoilDriver()).items():
        assert run.criteria[name] == pytest.approx(peak, rel=1e-4), name


@pytest.fixture(scope="module")
def isolated():
    return iso.reference_building().on(iso.reference_isolators())


@pytest.fixture(scope="module")
def record():
    return el_centro_1940().cut(0, 6)


@pytest.mark.parametrize("lag", [pytest.param(0.0, marks=pytest.mark.slow), 0.05])
@pytest.mark.parametrize("name", sorted(set(available_controllers()) - {"prescribed"}))
def test_every_controller(name, lag, isolated, record):
    driver = CoilDriver(lag=lag)
    # commands that change every sample are enough; the optimum is not needed
    settings = {"iterations": 4, "starts": 1} if name == "clairvoyant" else {}
    short = record.cut(0, 3)
    run = iso.simulate(isolated, short, controller(name, **settings), driver=driver)
    assert_peaks(run, driver)


def test_commands_between_the_samples(isolated, record):
    random = np.random.default_rng(5)
    time = np.arange(0, 5.9, 0.013)
    amperes = random.uniform(0, 3, time.size)
    driver = CoilDriver(lag=0.01, slew=200.0)
    assert_peaks(
        iso.simulate(isolated, record, Prescribed(time=time, amperes=amperes), driver=driver),
        driver,
    )


def test_modes_faster_than_the_samples():
    """A storey at 40 Hz, 50 samples a second: its peaks lie between them."""
    building = iso.shear_building(
        [1e5], [5e4 * (2 * np.pi * 40.0) ** 2], base_mass=1e5, damping_ratio=0.001
    )
    record = el_centro_1940().cut(0, 8)
    commands = Prescribed(time=np.arange(80) * 0.1, amperes=1.5 + 1.5 * (-1.0) ** np.arange(80))
    isolated = building.on(iso.law("strain_stiffening").scaled(length=10, force=300))
    run = iso.simulate(isolated, record, commands)
    assert_peaks(run)
    sampled = response_criteria(response_of(run))
    assert max(run.criteria[name] / peak for name, peak in sampled.items() if peak > 0) > 1.01


@pytest.mark.parametrize("name", ["passive_off", "on_off"])
def test_tall_buildings(name, record):
    """Half of the modes are too fast for the samples to show their peaks."""
    n = 12
    building = iso.shear_building([2.5e5] * n, [1e8 * n] * n, base_mass=3e5)
    tall = building.on(iso.reference_isolators().scaled(force=(n + 1) / 6))
    driver = CoilDriver(lag=0.05)
    run = iso.simulate(tall, record, controller(name), driver=driver)
    assert_peaks(run, driver)
    cases = [Case(tall, record, controller(name)) for _ in range(FEWEST)]
    batch = simulate_many(cases, driver=driver)
    for quantity, value in run.criteria.items():
        assert np.all(batch.criteria[quantity] == value), quantity


def test_a_moat_wall_hit_within_a_sample(isolated):
    """Steps are cut within a sample: the peaks of the impact lie in them."""
    spring = iso.law("linear", {"k": 0.0})
    wall = extend(
        spring, [(effect("end_stop", "power"), {"gap": 0.06, "stiffness": 1e9, "exponent": 1.0})]
    )
    stopped = isolated.with_element(wall, "base", name="wall")
    run = iso.simulate(stopped, el_centro_1940().cut(0, 8), controller("passive_off"))
    assert run.work.cuts.max() > 3
    assert_peaks(run)


@pytest.mark.filterwarnings("ignore::isolation_sim.PlausibilityWarning")
@pytest.mark.parametrize("share", [0.965, 0.8])
def test_contacts_that_begin_and_end_between_two_samples(share):
    """A stiff wall throws the slab back within 5 ms, a quarter of a sample."""
    stiffness, ground = 1e11, el_centro_1940().cut(0.0, 8.0)
    slab = iso.shear_building([2e5] * 3, [3e8] * 3, base_mass=3e5)
    isolated = slab.on(iso.law("kelvin_voigt", {"k": 8e6, "c": 4e5}))
    gap = share * iso.simulate(isolated, ground).criteria["peak_base_displacement_m"]
    hit = MoatWall(gap_m=gap, stiffness_N_per_m=stiffness).add_to(isolated)
    run, fine = iso.simulate(hit, ground), iso.simulate(hit, ground.resampled(0.001))
    penetration = run.criteria["peak_base_displacement_m"] - gap
    assert run.criteria["peak_wall_force_N"] == pytest.approx(stiffness * penetration, rel=1e-3)
    beyond = np.abs(fine.output("base_displacement_m")) > gap
    entries = np.count_nonzero(np.diff(beyond.astype(int)) == 1)
    assert run.contacts == fine.contacts == {"moat_wall": entries}
    case = Case(hit, ground, controller("passive_off"))
    batch = simulate_many([case] * 16)
    assert set(batch.contacts) == {entries}
    assert set(batch.criteria["peak_wall_force_N"]) == {run.criteria["peak_wall_force_N"]}


def test_two_directions():
    mass = np.diag([2e5, 2e5, 5e5])
    building = iso.from_fixed_base(
        mass, 2e2 * mass, 3e2 * mass, np.diag([3e5, 3e5, 7e5]),
        rigid_motion=np.eye(3), shaken=[0, 1],
        names=["base_x", "base_y", "base_r", "floor1_x", "floor1_y", "floor1_r"],
    )  # fmt: skip
    device = iso.law("strain_stiffening").scaled(length=10, force=600)
    both = building.on(device)
    both = both.with_element(iso.law("linear", {"k": 1e6}), "base_r")
    record = el_centro_1940().cut(0, 6)
    ground = [record, Record(record.acceleration[::-1], record.dt)]
    commands = Prescribed(time=np.arange(30) * 0.2, amperes=1.5 + 1.5 * (-1.0) ** np.arange(30))
    assert_peaks(iso.simulate(both, ground, commands))


def test_single_runs_and_batches_have_the_same_bits(isolated, record):
    amperes = 1.5 + 1.5 * (-1.0) ** np.arange(60)
    grounds = [record.scaled(0.5 + 0.1 * k) for k in range(FEWEST)]
    commands = Prescribed(time=np.arange(60) * 0.1, amperes=amperes)
    batch = simulate_many([Case(isolated, ground, commands) for ground in grounds])
    for k, ground in enumerate(grounds):
        for name, value in iso.simulate(isolated, ground, commands).criteria.items():
            assert batch.criteria[name][k] == value, name
