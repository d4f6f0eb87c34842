"""Isolators that are a functional mock-up unit, in a run and in a scenario."""

import shutil
from dataclasses import replace
from hashlib import sha256

import numpy as np
import pytest

import isolation_sim as iso
from ground_motions import el_centro_1940
from isolation_sim.cli import main
from isolation_sim.export.device import device_part
from isolation_sim.export.fmu import write_fmu
from isolation_sim.scenario import Scenario
from isolation_sim.scenario.job import Job

pytest.importorskip("fmpy")
pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")

SCENARIO = """
[ground]
name = "el_centro_1940_ns"
[isolator]
law = "theirs.fmu"
current_range_A = [0.0, 3.0]
variables = {{ x = "displacement_m", v = "velocity_m_s", i = "current_A", F = "force_N" }}
{more}
[[controller]]
name = "on_off"
"""
NOMINAL = '[nominal]\nlaw = "strain_stiffening"\n'
BUILDING = iso.reference_building()
TRUTH = BUILDING.on(iso.reference_isolators())
RECORD = el_centro_1940().cut(1.0, 5.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    result = tmp_path_factory.mktemp("device")
    part = device_part(Job("", TRUTH, (RECORD,), {}, {"tolerance": 1e-8}))
    write_fmu(part, result / "own2.fmu", "2.0")
    write_fmu(part, result / "own3.fmu", "3.0")
    write_fmu(replace(part, inputs=("x", "v", "i"), outputs=("F", "E")), result / "theirs.fmu")
    return result


def plant_of(file, limits=(0.0, 3.0)):
    return BUILDING.on(iso.law(str(file), current_range=limits))


def error_of(plant, dt):
    """Largest errors of a displacement, a force and an acceleration over their peaks."""
    record = RECORD if dt == RECORD.dt else RECORD.resampled(dt)
    driver = iso.CoilDriver(high=3.0, lag=0.05)
    controller = iso.controller("prescribed", time=[0, 1.0, 1.5, 2.5], amperes=[0, 3, 0.5, 2])
    own = iso.simulate(TRUTH, record, controller, driver=driver)
    run = iso.simulate(plant, record, controller, nominal=TRUTH, driver=driver)
    np.testing.assert_array_equal(run.command, own.command)
    names = ("base_displacement_m", "isolator_force_N", "floor5_acceleration_m_s2")
    pairs = [(run.output(name), own.output(name)) for name in names]
    # what a run books as lost is the work of the unit's force
    assert run.energy.closure_error < 1e-6
    return np.array([np.abs(a - b).max() / np.abs(b).max() for a, b in pairs])


@pytest.mark.parametrize("file", ["own2.fmu", "own3.fmu"])
def test_the_coupling_is_of_second_order(file, folder):
    """A unit of the reference isolators against their law."""
    plant = plant_of(folder / file)
    coarse, fine = (error_of(plant, dt) for dt in (0.02, 0.005))
    assert (coarse < 0.05).all()
    assert (fine < coarse / 8).all()


def test_a_jump_of_the_current_is_followed(folder):
    run = iso.simulate(plant_of(folder / "own2.fmu"), RECORD, "on_off", nominal=TRUTH)
    own = iso.simulate(TRUTH, RECORD, "on_off", driver=iso.CoilDriver(high=3.0), nominal=TRUTH)
    force, expected = run.output("isolator_force_N"), own.output("isolator_force_N")
    assert np.abs(force - expected).max() < 0.05 * np.abs(expected).max()


def test_a_scenario_runs_and_records_the_hash(folder, tmp_path):
    (folder / "scenario.toml").write_text(SCENARIO.format(more=NOMINAL))
    out = tmp_path / "out"
    words = ["run", str(folder / "scenario.toml"), "--out", str(out), "--no-figures", "--quiet"]
    with pytest.raises(SystemExit) as stop:
        main(words)
    assert stop.value.code == 0
    digest = sha256((folder / "theirs.fmu").read_bytes()).hexdigest()
    assert digest in (out / "scenario.toml").read_text()
    job = Scenario.read(folder / "scenario.toml").build()
    run = iso.load(out).runs["on_off"]
    assert run.isolated.elements[0].device.law.unit == str(folder / "theirs.fmu")
    np.testing.assert_array_equal(run.values, job.run("on_off").values)


def test_many_runs_with_a_unit_are_made_one_by_one(folder):
    plant, controller = plant_of(folder / "own2.fmu"), iso.controller("constant", amperes=2.0)
    record = RECORD.cut(0.0, 1.0)
    batch = iso.simulate_many([iso.Case(plant, record, controller, nominal=TRUTH)] * 9)
    run = iso.simulate(plant, record, controller, nominal=TRUTH)
    name = "peak_base_displacement_m"
    assert set(batch.criteria[name]) == {run.criteria[name]}


def test_what_cannot_be_used_is_said_in_a_line(folder):
    def scenario(text):
        job = Scenario.from_toml(text, folder).build()
        return job.run("on_off")

    with pytest.raises(iso.InputError, match=r"expected: nominal, a plant with a law, or \[nomi"):
        scenario(SCENARIO.format(more=""))
    with pytest.raises(iso.InputError, match="no input is displacement_m; expected: variables in"):
        text = SCENARIO.format(more=NOMINAL).replace('x = "displacement_m", ', "")
        scenario(text)
    with pytest.raises(iso.InputError, match="limits of the current are missing"):
        text = SCENARIO.format(more=NOMINAL).replace("current_range_A = [0.0, 3.0]", "")
        scenario(text)
    with pytest.raises(iso.InputError, match="variables is set, but law is no FMU"):
        scenario(SCENARIO.format(more=NOMINAL).replace("theirs.fmu", "strain_stiffening"))
    with pytest.raises(iso.InputError, match="no delays"):
        scenario(SCENARIO.format(more=NOMINAL + "[sensors]\ndelay_s = 0.005\n"))
    plant = plant_of(folder / "own2.fmu")
    with pytest.raises(iso.InputError, match=r"period: given 0\.03 s, where the isolators"):
        iso.simulate(plant, RECORD, iso.controller("on_off", period=0.03), nominal=TRUTH)
    with pytest.raises(iso.InputError, match="run one at a time; expected: simulate"):
        iso.Simulator(plant, RECORD)
    with pytest.raises(iso.InputError, match="is no arithmetic; expected here: a law"):
        iso.DeviceSimulator(plant.elements[0].device, 0.01)
