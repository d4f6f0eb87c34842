"""The coil driver: path of the current, limits, and what it does to the plant."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from isolation_sim.errors import InputError
from isolation_sim.simulation.control import CoilDriver
from isolation_sim.simulation.run import simulate

DRIVERS = {
    "lag": {"lag": 0.06},
    "slew": {"slew": 17.0},
    "lag_and_slew": {"lag": 0.03, "slew": 25.0},
    "slew_that_never_binds": {"lag": 0.05, "slew": 1e3},
}
TIME = np.array([0.0, 0.3, 0.333, 0.9, 1.0, 2.0, 2.5])
AMPERES = np.array([2.0, 0.2, 2.8, 2.8, 0.0, 3.0, 2.9])


def coil_path(driver, times, start=0.5):
    """Coil current from its differential equation, stopped at every command."""
    lag, slew = driver.get("lag", 0.0), driver.get("slew", np.inf)

    def path_after(command, i, t):
        if lag == 0:  # straight to the command, at the limit
            return command - np.sign(command - i) * np.maximum(np.abs(command - i) - slew * t, 0)

        def rate(t, i):
            return np.clip((command - i) / lag, -slew, slew)

        solution = solve_ivp(rate, (0, t[-1] + 1e-9), [i], rtol=1e-10, atol=1e-12, max_step=1e-3,
                          t_eval=t)  # fmt: skip
        return solution.y[0]

    current = np.empty(len(times))
    ends = np.append(TIME[1:], times[-1] + 1e-9)
    for command, begin, end in zip(AMPERES, TIME, ends, strict=True):
        inside = (times >= begin - 1e-12) & (times < end - 1e-12)
        path = path_after(command, start, np.append(times[inside], end) - begin)
        current[inside], start = path[:-1], path[-1]
    return current


@pytest.mark.parametrize("name", DRIVERS)
def test_current_follows_its_differential_equation(name, stiffening, strong_motion, scheduled):
    driver = DRIVERS[name]
    run = simulate(
        stiffening, strong_motion.resampled(0.004), scheduled(AMPERES, TIME),
        driver=CoilDriver(initial=0.5, **driver),
    )  # fmt: skip
    np.testing.assert_allclose(run.current[:, 0], coil_path(driver, run.time), atol=2e-8)
    at = np.searchsorted(TIME, run.time + 1e-9, side="right") - 1
    np.testing.assert_array_equal(run.command[:, 0], AMPERES[at])


@pytest.mark.parametrize("name", DRIVERS)
def test_plant_feels_the_moving_current(
    name, stiffening, strong_motion, scheduled, by_scipy, worst, motion
):
    driver = DRIVERS[name]
    run = simulate(
        stiffening,
        strong_motion,
        scheduled(AMPERES, TIME),
        driver=CoilDriver(initial=0.5, **driver),
    )
    fine = np.arange(0.0, strong_motion.duration + 1e-4, 2e-4)
    path = coil_path(driver, fine)
    q, v, states = by_scipy(
        stiffening, [strong_motion], lambda start, t: (np.interp(t, fine, path),), TIME, rtol=1e-8
    )
    assert worst(motion(run), np.concatenate([q, v], axis=1)) < 1e-5
    assert worst(run.states[:, 0], states) < 1e-5
    assert run.steps < 8000


def test_inputs_of_a_controller_about_its_coil(stiffening, strong_motion, rule):
    driver = CoilDriver(lag=0.06, initial=0.5)
    controller = rule(lambda t, m: 2.0, 0.013)
    simulate(stiffening, strong_motion, controller, driver=driver)
    seen = [m.coil0_current_A for m in controller.seen]
    expected = 2.0 - 1.5 * np.exp(-np.array(controller.times) / 0.06)
    np.testing.assert_allclose(seen, expected, atol=1e-9)


def test_initial_current_holds_until_the_first_command(stiffening, strong_motion, rule):
    driver = CoilDriver(initial=1.2)
    run = simulate(stiffening, strong_motion, rule(lambda t, m: 2.0, 0.5), driver=driver)
    assert run.current[0, 0] == 2.0  # an ideal coil obeys at once


@pytest.mark.parametrize("lag", [0.0, 0.05])
def test_initial_current_holds_until_a_delayed_first_command(lag, stiffening, strong_motion, rule):
    run = simulate(
        stiffening, strong_motion, rule(lambda t, m: 2.0, 0.5), computation_delay=0.1,
        driver=CoilDriver(lag=lag, initial=1.2),
    )  # fmt: skip
    np.testing.assert_allclose(run.current[:5, 0], 1.2)
    assert run.current[10, 0] > 1.2


def commands_out_of_range(t, m):
    return -1.0 if 1.0 <= t < 1.35 else 7.0 if t >= 3.0 else 2.0


def test_a_refused_current_is_named_with_its_time_and_range(stiffening, strong_motion, rule):
    with pytest.raises(InputError, match=r"current -1 A at t = 1 s is outside 0 to 5\.203 A"):
        simulate(stiffening, strong_motion, rule(commands_out_of_range, 0.1))


def test_a_schedule_is_refused_before_the_run(stiffening, strong_motion, scheduled):
    with pytest.raises(InputError, match=r"current 7 A at t = 2 s is outside 0 to 5\.203 A"):
        simulate(stiffening, strong_motion, scheduled([1.0, 7.0], [0.0, 2.0]))


def test_supply_limits_are_named(stiffening, strong_motion, rule):
    driver = CoilDriver(low=0.5, high=2.5, initial=0.5)
    with pytest.raises(
        InputError,
        match=r"current 3 A at t = 0 s is outside 0\.5 to 2\.5 A, the range of the supply",
    ):
        simulate(stiffening, strong_motion, rule(lambda t, m: 3.0, 0.1), driver=driver)


def test_clamped_commands_are_counted(stiffening, strong_motion, rule):
    controller = rule(commands_out_of_range, 0.1)
    run = simulate(stiffening, strong_motion, controller, current_outside="clamp",
                   driver=CoilDriver(high=3.0))  # fmt: skip
    outside = sum(not 0 <= c <= 3 for c in controller.commands)
    assert run.clamped == outside == 14
    assert run.current.min() == 0.0 and run.current.max() == 3.0


@pytest.mark.parametrize("outside", ["refuse", "clamp"])
def test_a_command_that_is_no_number_is_always_refused(outside, stiffening, strong_motion, rule):
    controller = rule(lambda t, m: np.nan if t > 1.15 else 1.0, 0.1)
    with pytest.raises(InputError, match=r"current nan A at t = 1\.2 s"):
        simulate(stiffening, strong_motion, controller, current_outside=outside)


@pytest.mark.parametrize("value", [{"lag": -1.0}, {"lag": np.nan}, {"slew": 0.0}, {"lag": np.inf}])
def test_a_driver_that_cannot_be_is_refused(value):
    with pytest.raises(InputError, match=f"coil driver: {next(iter(value))}"):
        CoilDriver(**value)


@pytest.mark.parametrize("value", [{"low": 2.0, "high": 1.0}, {"low": 0.5, "initial": 0.0}])
def test_limits_that_contradict_each_other_are_refused(value, stiffening, strong_motion, rule):
    with pytest.raises(InputError, match="coil driver"):
        simulate(stiffening, strong_motion, rule(lambda t, m: 1.5, 0.1),
                 driver=CoilDriver(**value), current_outside="clamp")  # fmt: skip


def test_limits_outside_the_law_are_refused(stiffening, strong_motion, held):
    with pytest.raises(InputError, match=r"high 6\.0 A is outside 0 to 5\.203 A"):
        simulate(stiffening, strong_motion, held(), driver=CoilDriver(high=6.0))
