"""What holds for every registered controller."""

import subprocess
import sys
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from controllers import CONTROLLERS, available_controllers, controller
from isolation_sim.errors import InputError
from isolation_sim.laws import law
from isolation_sim.simulation.control import CoilDriver
from isolation_sim.simulation.run import simulate
from isolation_sim.structures import reference_building, reference_isolators

from .conftest import build, noisy_sensors, twice

# controllers whose nominal model shows in these commands; that of frequency_tracking moves the
# frequency at which it switches, which this motion's leaps over
REASONING = {
    "clipped_lqr", "clipped_lqg", "h2", "lyapunov", "sliding_mode", "mpc",
    "clairvoyant", "trained_policy",
}  # fmt: skip


# controllers that command every coil the same without asking what it drives
COMMANDING = {"passive_off", "passive_on", "constant", "prescribed"}


@pytest.fixture(scope="module")
def usual_run(isolated, record):
    """Function: run of a controller with its published settings."""
    return cache(lambda name: simulate(isolated, record, build(name)))


def test_runs_within_the_limits_and_repeats_itself(name, isolated, record):
    driver = CoilDriver(high=2.5)
    one = build(name)
    run, again = (simulate(isolated, record, one, driver=driver) for _ in range(2))
    assert run.command.min() >= 0 and run.command.max() <= 2.5
    assert np.all(np.isfinite(run.values)) and run.clamped == 0
    assert np.array_equal(again.command, run.command)
    assert np.array_equal(again.values, run.values)


def test_plain_python_decides_the_same(name, isolated, record, usual_run):
    run = usual_run(name)
    twin = build(name).in_python()
    plain = simulate(isolated, record, twin)
    assert run.command.shape == (len(run.time), 1)
    assert np.abs(plain.command - run.command).max() <= 1e-9


def test_nominal_model_is_apart_from_the_plant(name, isolated, record, usual_run):
    nominal = reference_building().on(reference_isolators().scaled(force=1.3))
    run = simulate(isolated, record, build(name), nominal=nominal)
    assert run.isolated is isolated
    changes = np.abs(run.command - usual_run(name).command).max() > 1e-3
    assert changes == (name in REASONING)


def test_noise_of_its_sensors_reaches_it_and_costs_little(name, isolated, record):
    """Beside lag and delay, which both runs have; how little is told by what they reach."""
    sensors = noisy_sensors(build(name), isolated)
    quiet, noisy = (
        simulate(
            isolated, record, build(name, period=0.04), driver=CoilDriver(lag=0.05),
            sensors=inputs, computation_delay=0.005,
        )
        for inputs in (replace(sensors, noise={}), sensors)
    )  # fmt: skip
    assert np.all(np.isfinite(noisy.values))
    differs = np.abs(noisy.command - quiet.command).max() > 1e-3
    assert differs == bool(build(name).measures(isolated))
    for output, most in (("base_displacement_m", 1.05), ("floor5_acceleration_m_s2", 1.6)):
        peaks = [np.abs(run.output(output)).max() for run in (quiet, noisy)]
        assert peaks[1] <= most * peaks[0]


def test_without_a_coil_it_runs_or_says_so_in_one_line(name, record):
    nominal = reference_building().on(law("linear", {"k": 1.5e7}))
    if name in COMMANDING:
        assert simulate(nominal, record.cut(0.0, 1.0), build(name)).command.shape[1] == 0
    else:
        message = (
            rf"{name}: no element of the (nominal model|structure) is driven by a coil; expected: "
            "isolators whose law has a current, or the controller passive_off"
        )
        with pytest.raises(InputError, match=f"^{message}$"):
            simulate(nominal, record.cut(0.0, 1.0), build(name))


def test_a_current_without_effect_changes_nothing(name, record):
    idle = reference_isolators(law("strain_stiffening", "base_model"))
    plant, short = reference_building().with_element(idle, "base", 0), record.cut(0.0, 3.0)
    driver = CoilDriver(high=3.0)
    off, run = (simulate(plant, short, build(one), driver=driver) for one in ("passive_off", name))
    for output in ("base_displacement_m", "floor5_acceleration_m_s2"):
        expected = off.output(output)
        assert np.abs(run.output(output) - expected).max() <= 1e-5 * np.abs(expected).max()


@pytest.mark.parametrize("direction", [pytest.param(0, marks=pytest.mark.slow), 1])
def test_a_direction_without_motion_changes_nothing(name, direction, isolated, record):
    plan, short = twice(isolated.structure), record.cut(0.0, 4.0)
    records = tuple(short if d == direction else short.scaled(0.0) for d in range(2))
    if name == "trained_policy":
        with pytest.raises(InputError, match="structure moves in 2 directions; expected: one"):
            simulate(plan, records, build(name))
        return
    if name == "clairvoyant":
        pytest.skip("needs all of its iterations: see test_clairvoyant.py")
    alone = simulate(isolated, short, build(name))
    run = simulate(plan, records, build(name))
    assert run.command == pytest.approx(alone.command, abs=1e-4)
    for criterion in ("peak_base_displacement_m", "peak_floor_acceleration_m_s2"):
        # the solver of `mpc` ends elsewhere in its tolerance
        assert run.criteria[criterion] == pytest.approx(alone.criteria[criterion], rel=1e-5)


def test_unknown_setting_is_refused_with_the_nearest(name):
    with pytest.raises(InputError, match=rf"setting of {name} 'perod'; did you mean 'period'"):
        controller(name, perod=0.1)


def test_unusable_setting_is_refused_in_one_line(name):
    with pytest.raises(InputError) as refused:
        controller(name, period=-1)
    assert str(refused.value) == (
        f"{name}: period: given -1; expected: a number above 0 or None, in s"
    )


def test_settings_are_described_and_come_back(name):
    one = build(name, period=0.1)
    described = one.to_dict()
    assert described["name"] == name and described["period"] == 0.1
    assert controller(**described).to_dict() == described
    assert "period=0.1" in repr(one)
    assert CONTROLLERS[name].title and CONTROLLERS[name].__doc__
    for setting in CONTROLLERS[name].settings.values():
        assert setting.meaning and str(setting.accepts)


def test_unknown_controller_is_refused_with_the_nearest():
    assert set(available_controllers()) == set(CONTROLLERS)
    with pytest.raises(InputError, match="unknown controller 'clipped_lpr'; did you mean 'clipp"):
        controller("clipped_lpr")


def test_import_is_light():
    code = (
        "import sys, controllers; heavy = {'numba', 'casadi', 'scipy', 'control', 'xarray'};"
        "sys.exit(bool(heavy & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
