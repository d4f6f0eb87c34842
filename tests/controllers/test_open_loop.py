"""Commands known before the run."""

from dataclasses import replace

import numpy as np
import pytest

from controllers import controller
from controllers.clairvoyant import Plant, _coils
from isolation_sim.errors import InputError
from isolation_sim.laws import LAWS, available_sets, law
from isolation_sim.simulation.control import CoilDriver
from isolation_sim.simulation.run import simulate
from isolation_sim.structures import reference_building

STATES = {"y_m": 0, "z_m": 1}


def check_against(reference, run):
    """Every state within 1e-6 of its peak."""
    for k, dof in enumerate(run.isolated.structure.names):
        for key, name in (("displacement_m", "displacement_m"), ("velocity_m_s", "velocity_m_s")):
            expected = reference[key][:, k]
            error = np.abs(run.output(f"{dof}_{name}") - expected).max()
            assert error <= 1e-6 * np.abs(expected).max()
    for key, k in STATES.items():
        error = np.abs(run.states[:, 0, k] - reference[key]).max()
        assert error <= 1e-6 * np.abs(reference[key]).max()


@pytest.mark.parametrize("which", ["switching_0.1s", "random_0.02s"])
def test_prescribed_reproduces_the_reference(shared_data, isolated, el_centro, tmp_path, which):
    path = shared_data / "engine_reference" / f"strain_stiffening_{which}.npz"
    reference = np.load(path)
    table = np.column_stack([el_centro.time, reference["current_A"]])
    file = tmp_path / "current.csv"
    np.savetxt(file, table, delimiter=",", header="time_s,current_A", comments="")
    run = simulate(isolated, el_centro, controller("prescribed", file=str(file)))
    check_against(reference, run)
    arrays = controller("prescribed", time=table[:, 0], amperes=table[:, 1])
    assert np.array_equal(simulate(isolated, el_centro, arrays).values, run.values)


def test_passive_currents(isolated, record):
    def held(one, **options):
        return set(simulate(isolated, record, one, **options).current.ravel().tolist())

    assert held(controller("passive_off")) == {0.0}
    assert held(controller("passive_off"), driver=CoilDriver(low=0.5, initial=0.5)) == {0.5}
    assert held(controller("passive_on")) == {3.0}
    assert held(controller("passive_on"), driver=CoilDriver(high=2.0)) == {2.0}
    assert held(controller("passive_on", amperes=4)) == {4.0}
    assert held(controller("constant")) == {1.5}


def spring(current_range=(-np.inf, np.inf), tested=np.inf, stiffness=(1.5e7, 1e6)):
    device = law("linear", {"k": stiffness})
    return replace(device, current_range=current_range, tested_current=tested)


def springs(*arguments, **options):
    return reference_building().on(spring(*arguments, **options))


@pytest.mark.parametrize(
    ("plant", "driver", "expected"),
    [
        (springs(tested=1.25), None, 1.25),
        (springs((0.0, 5.0), tested=2.0), None, 2.0),
        (springs((0.0, 5.0)), None, 5.0),
        (springs(tested=2.0), CoilDriver(high=0.5), 0.5),
        (springs(tested=2.0), CoilDriver(low=2.5, high=4.0), 2.5),
        (springs(), CoilDriver(high=4.0), 4.0),
        # the least of two devices on a coil; what the current does not change has no say
        (springs(tested=2.0).with_element(spring(tested=1.5), "storey1", 0), None, 1.5),
        (
            springs(tested=1.5).with_element(spring(tested=0.5, stiffness=1e6), "storey2", 0),
            None,
            1.5,
        ),
    ],
)
def test_the_highest_tested_current_is_the_devices(plant, driver, expected, record):
    run = simulate(plant, record.cut(0.0, 0.5), controller("passive_on"), driver=driver)
    assert set(run.current.ravel().tolist()) == {expected}
    driver = driver or CoilDriver()
    assert _coils(Plant(plant, (record,), driver))[:, 3].tolist() == [expected]


def test_a_nominal_model_does_not_change_what_was_tested(record):
    """How far the devices were tested is a fact of theirs, whatever law is believed of them."""
    run = simulate(
        springs(tested=1.25), record.cut(0.0, 0.5), controller("passive_on"), nominal=springs()
    )
    assert set(run.current.ravel().tolist()) == {1.25}


@pytest.mark.parametrize("name", ["passive_on", "best_constant", "on_off", "clipped_lqr", "mpc"])
def test_a_device_that_was_never_tested_has_no_highest_current(name, record):
    with pytest.raises(InputError, match="nothing says how high the current of coil 0 may be"):
        simulate(springs(), record, controller(name))


def test_published_sets_know_their_tested_currents():
    tested = {
        (name, one): device.tested_current
        for name in LAWS
        for one in available_sets(name)
        if (device := law(name, one)).depends_on_current
    }
    assert tested.pop(("improved_bouc_wen", "table_4")) == 2.5
    # the paper gives the field, not the current: 0.4 T at 0.588 T/A
    for one in available_sets("dynamic_stiffness"):
        assert tested.pop(("dynamic_stiffness", one)) == pytest.approx(0.4 / 0.588, rel=1e-3)
    assert len(tested) >= 5 and set(tested.values()) == {3.0}


def test_a_current_that_is_asked_for_is_not_quietly_changed(isolated, record):
    with pytest.raises(InputError, match="current 4 A at t = 0 s is outside 0 to 3 A"):
        simulate(isolated, record, controller("constant", amperes=4), driver=CoilDriver(high=3.0))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({}, "time and amperes together, or a file"),
        ({"time": [0, 1]}, "time and amperes together, or a file"),
        ({"time": [0, 1], "amperes": [1]}, "2 instants for 1 commands"),
        ({"time": [0.5, 1], "amperes": [1, 2]}, "first instant: given 0.5 s; expected: 0"),
        ({"time": [0, 1, 1], "amperes": [1, 2, 3]}, "instant 1 s follows 1 s"),
        ({"time": [0, np.nan], "amperes": [1, 2]}, "time: given .*; expected: finite numbers"),
        ({"file": "nowhere.csv"}, "file: given 'nowhere.csv'; expected: the path of an existing"),
    ],
)
def test_bad_tables_are_refused(settings, message):
    with pytest.raises(InputError, match=message):
        controller("prescribed", **settings)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "current.csv: given an empty file"),
        ("time_s,current_mA\n0,1\n", "columns: given time_s, current_mA; expected: time_s and"),
        ("time_s,current_A\n", "no rows"),
        (
            "time_s,current_A\n0,1\n1,x\n",
            "line 3, column current_A: given 'x'; expected: a finite number",
        ),
        ("time_s,current_A\n0,1\n1\n", "line 3: 1 cells; expected: 2"),
        ("time_s,current_A\n1,1\n", "first instant: given 1 s"),
    ],
)
def test_bad_files_are_refused(tmp_path, text, message):
    file = tmp_path / "current.csv"
    file.write_text(text)
    with pytest.raises(InputError, match=message):
        controller("prescribed", file=str(file))


def test_one_column_a_coil(tmp_path, isolated, record):
    file = tmp_path / "current.csv"
    file.write_text("\ufefftime_s,coil0_current_A,coil1_current_A\n0,1,2\n", encoding="utf-8")
    with pytest.raises(InputError, match="commands for 2 coils; the structure has 1"):
        simulate(isolated, record, controller("prescribed", file=str(file)))
