"""Honest actuators and sensors: steps of the current, lost samples, compensation of delay."""

import numpy as np
import pytest

from controllers import controller
from isolation_sim.errors import InputError
from isolation_sim.simulation.batch import Case, simulate_many
from isolation_sim.simulation.control import CoilDriver, Sensors
from isolation_sim.simulation.run import simulate

MOTION = ("base_displacement_m", "base_velocity_m_s", "storey2_drift_m",
          "isolator_deformation_m", "isolator_velocity_m_s", "floor5_acceleration_m_s2",
          "isolator_force_N")  # fmt: skip


def law_of_motion(t, m):
    return 1.5 + np.tanh(20 * m.base_displacement_m) + 0.4 * np.tanh(4 * m.base_velocity_m_s)


@pytest.mark.parametrize("step", [0.5, 0.07, 2.0])
def test_commands_are_the_nearest_steps(step, stiffening, strong_motion, scheduled):
    expected = np.random.default_rng(2).uniform(0.0, 2.9, 40)
    time = 0.1 * np.arange(40)
    driver = CoilDriver(step=step, low=0.3, high=2.9)
    run = simulate(
        stiffening, strong_motion, scheduled(np.clip(expected, 0.3, 2.9), time), driver=driver
    )
    levels = np.arange(100) * step
    levels = levels[(levels >= 0.3) & (levels <= 2.9)]
    nearest = levels[np.argmin(np.abs(np.clip(expected, 0.3, 2.9)[:, None] - levels), axis=1)]
    at = np.searchsorted(time, run.time + 1e-9, side="right") - 1
    np.testing.assert_allclose(run.command[:, 0], nearest[at], rtol=1e-14)


def test_limits_that_are_steps_can_be_attained(stiffening, strong_motion, scheduled):
    driver = CoilDriver(step=0.1, low=0.3, high=0.7)  # neither is 0.1's multiple in binary
    run = simulate(stiffening, strong_motion, scheduled([0.3, 0.7], [0.0, 1.0]), driver=driver)
    assert run.command.min() == pytest.approx(0.3, abs=1e-15)
    assert run.command.max() == pytest.approx(0.7, abs=1e-15)
    assert run.clamped == 0


def test_coil_follows_the_rounded_command(stiffening, strong_motion, rule, scheduled, worst):
    options = {"lag": 0.05, "slew": 30.0}
    one = simulate(
        stiffening, strong_motion, rule(law_of_motion, 0.05), driver=CoilDriver(step=0.2, **options)
    )
    rounded = rule(lambda t, m: 0.2 * np.floor(law_of_motion(t, m) / 0.2 + 0.5), 0.05)
    same = simulate(stiffening, strong_motion, rounded, driver=CoilDriver(**options))
    np.testing.assert_allclose(one.current, same.current, rtol=1e-12, atol=1e-12)
    assert worst(one.values, same.values) < 1e-9


@pytest.mark.parametrize(
    ("options", "part"),
    [({"step": -0.1}, "step: given -0.1"), ({"step": np.nan}, "step"), ({"step": np.inf}, "step")],
)
def test_steps_that_cannot_be_are_refused(options, part):
    with pytest.raises(InputError, match=part):
        CoilDriver(**options)


def test_a_step_without_a_multiple_within_the_limits_is_refused(stiffening, strong_motion, held):
    with pytest.raises(InputError, match=r"step 2\.0 A has no multiple within its limits"):
        driver = CoilDriver(step=2.0, low=0.5, high=1.5)
        simulate(stiffening, strong_motion, held(1.0), driver=driver)


@pytest.mark.parametrize("sensors", [{}, {"sampling": 0.03}, {"delay": 0.05}])
def test_a_lost_sample_is_replaced_by_the_last_that_arrived(
    sensors, stiffening, strong_motion, rule
):
    """Against the run without losses: what was seen is one of its samples, held while lost."""

    def seen(**more):
        watcher = rule(lambda t, m: 1.5, 0.01, MOTION)
        simulate(stiffening, strong_motion, watcher, sensors=Sensors(**sensors, **more))
        return np.array(watcher.seen)[:, :-1]

    whole, lossy = seen(), seen(dropout=0.3, seed=8)
    np.testing.assert_array_equal(lossy, seen(dropout=0.3, seed=8))
    assert not np.array_equal(lossy, seen(dropout=0.3, seed=9))
    # sample by sample, not decision by decision
    new = np.append(True, np.any(whole[1:] != whole[:-1], axis=1))
    held, lost, latest = [], 0, whole[0]
    for k, row in enumerate(lossy):
        if new[k]:
            arrives = np.array_equal(row, whole[k])
            lost += not arrives
            latest = whole[k] if arrives else latest
        held.append(latest)
    np.testing.assert_array_equal(lossy, held)
    n = new.sum()
    assert abs(lost / n - 0.3) < 4 * np.sqrt(0.21 / n)


def test_losing_samples_does_not_change_the_noise_on_the_others(stiffening, strong_motion, rule):
    def seen(**options):
        watcher = rule(lambda t, m: 1.5, 0.01)
        noise = {"displacement_m": 1e-3}
        simulate(stiffening, strong_motion, watcher, sensors=Sensors(noise=noise, **options))
        return np.array(watcher.seen)[:, 0]

    whole, lossy, ahead = seen(), seen(dropout=0.2), seen(compensation=1e-9)
    assert 0.7 < np.mean(lossy == whole) < 0.9
    np.testing.assert_allclose(ahead, whole, atol=1e-7)


def test_compensation_extrapolates_at_constant_acceleration(stiffening, strong_motion, rule):
    """Each kind of measurement, against finite differences of a fine run."""
    tau = 0.02
    watcher = rule(lambda t, m: 1.5, 0.01, MOTION)
    simulate(stiffening, strong_motion, watcher, sensors=Sensors(compensation=tau))
    plain = rule(lambda t, m: 1.5, 0.001, MOTION)
    simulate(stiffening, strong_motion, plain)
    fine = np.array(plain.seen)[:, :-1]
    first = np.gradient(fine, 0.001, axis=0)
    second = np.gradient(first, 0.001, axis=0)
    ahead = np.array(watcher.seen)[:, :-1]
    inner = slice(3, -3)  # differences are one-sided at the ends
    for column, name in enumerate(MOTION):
        now, rate, bend = fine[::10, column], first[::10, column], second[::10, column]
        if name.endswith(("displacement_m", "drift_m", "deformation_m")):
            exact = now + tau * rate + tau**2 / 2 * bend
        elif "velocity" in name:
            exact = now + tau * rate
        else:
            exact = now
        error = np.abs(ahead[inner, column] - exact[inner]).max()
        assert error < 5e-3 * np.abs(exact).max(), name
        if exact is not now:
            assert np.abs(now[inner] - exact[inner]).max() > 20 * error, name


def test_compensation_brings_the_noise_of_the_sensors_that_it_uses(stiffening, strong_motion, rule):
    tau, noise = 0.03, {"displacement_m": 1e-4, "velocity_m_s": 0.02, "acceleration_m_s2": 0.5}

    def seen(**options):
        watcher = rule(lambda t, m: 1.5, 0.005)
        simulate(stiffening, strong_motion, watcher, sensors=Sensors(compensation=tau, **options))
        return np.array(watcher.seen)

    error = seen(noise=noise, seed=3) - seen()
    acceleration = np.sqrt(2) * 0.5  # of the base and of the ground
    expected = [
        np.sqrt(1e-4**2 + (tau * 0.02) ** 2 + (tau**2 / 2 * acceleration) ** 2),
        np.hypot(0.02, tau * acceleration),
    ]
    n = len(error)
    assert np.all(np.abs(error[:, :2].std(0) / expected - 1) < 4 / np.sqrt(2 * n))
    assert np.corrcoef(error[:, :2].T)[0, 1] > 0.5  # they share the accelerometers


def test_compensation_undoes_most_of_a_delay_of_20_ms(stiffening, el_centro, rule, motion):
    """In the commands and in the response, for controllers of displacement and of velocity."""

    def run(follow, delay, computing=0.0, **options):
        return simulate(
            stiffening, el_centro, rule(follow, 0.01),
            sensors=Sensors(delay=delay, **options), computation_delay=computing,
        )  # fmt: skip

    laws = {
        0.02: lambda t, m: 1.5 + np.tanh(20 * m.base_displacement_m),
        0.25: law_of_motion,
    }
    for share, follow in laws.items():
        ideal = run(follow, 0.0)
        late, mended = (run(follow, 0.01, 0.01, compensation=tau) for tau in (0.0, 0.02))
        for quantity in (lambda r: r.current, motion):
            before, after = (
                # the first command is late in any case
                np.sqrt(np.mean((quantity(r) - quantity(ideal))[1:] ** 2, axis=0))
                for r in (late, mended)
            )
            assert np.max(after / before) < share


def test_compensation_mends_the_decisions_of_on_off(stiffening, el_centro):
    """Share of instants at which the current is not what the motion at that instant asks for."""

    def wrong(**options):
        run = simulate(
            stiffening, el_centro, controller("on_off"), sensors=Sensors(delay=0.02, **options)
        )
        product = run.output("isolator_deformation_m") * run.output("isolator_velocity_m_s")
        return np.mean((run.current[:, 0] > 1.5) != (product > 0))

    late, mended = wrong(), wrong(compensation=0.02)
    # not all: the base's acceleration jumps with the current that it helps to decide on
    assert late > 0.09
    assert mended < 0.6 * late


EVERYTHING = {
    "driver": CoilDriver(lag=0.02, slew=60.0, high=3.0, step=0.1),
    "sensors": Sensors(
        noise={"displacement_m": 1e-3, "acceleration_m_s2": 0.05}, delay=0.007, seed=4,
        dropout=0.4, compensation=0.02,
    ),
    "computation_delay": 0.033,  # longer than a period
}  # fmt: skip


@pytest.fixture(scope="module")
def together(stiffening, strong_motion):
    return simulate(stiffening, strong_motion, controller("on_off"), **EVERYTHING)


def test_compiled_and_plain_python_are_the_same(together, stiffening, strong_motion):
    plain = simulate(stiffening, strong_motion, controller("on_off").in_python(), **EVERYTHING)
    np.testing.assert_array_equal(plain.command, together.command)
    np.testing.assert_array_equal(plain.values, together.values)


def test_batch_and_single_runs_are_the_same(together, stiffening, strong_motion):
    cases = [Case(stiffening, strong_motion, controller("on_off"))] * 3
    batch = simulate_many(cases, **EVERYTHING)
    for key, value in batch.criteria.items():
        np.testing.assert_allclose(value, together.criteria[key], rtol=1e-6)


def test_all_effects_together_have_an_effect(together, stiffening, strong_motion):
    """Each by itself changes the run: none is lost on the way."""

    def without(**changes):
        options = {**EVERYTHING, **changes}
        return simulate(stiffening, strong_motion, controller("on_off"), **options).current

    sensors = EVERYTHING["sensors"].__dict__
    for name in ("noise", "delay", "dropout", "compensation"):
        changed = Sensors(**{**sensors, name: {} if name == "noise" else 0.0})
        assert not np.array_equal(without(sensors=changed), together.current), name
    assert not np.array_equal(without(computation_delay=0.0), together.current)
    driver = EVERYTHING["driver"].__dict__
    for name, ideal in {"lag": 0.0, "slew": np.inf, "high": None}.items():
        changed = CoilDriver(**{**driver, name: ideal})
        assert (name == "high") == np.array_equal(without(driver=changed), together.current), name


@pytest.mark.parametrize(
    ("options", "part"),
    [({"dropout": -0.1}, "dropout"), ({"dropout": 1.0}, "below 1"), ({"dropout": np.nan}, "drop"),
     ({"compensation": -1.0}, "compensation"), ({"compensation": np.inf}, "compensation")],
)  # fmt: skip
def test_sensors_that_cannot_be_are_refused(options, part):
    with pytest.raises(InputError, match=part):
        Sensors(**options)
