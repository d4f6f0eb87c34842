"""Plant and isolators as functional mock-up units, against `simulate` and `DeviceSimulator`."""

import shutil
import subprocess
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import isolation_sim as iso
from ground_motions import el_centro_1940
from isolation_sim.cli import main
from isolation_sim.export.device import device_part
from isolation_sim.export.fmu import controller_part, write_fmu
from isolation_sim.export.plant import plant_part
from isolation_sim.laws import LAWS
from isolation_sim.scenario.job import Job

fmpy = pytest.importorskip("fmpy")
pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")

VERSIONS = (pytest.param("2.0", marks=pytest.mark.slow), "3.0")
OPTIONS = {"driver": iso.CoilDriver(lag=0.02, slew=100.0), "tolerance": 1e-10}


@pytest.fixture(scope="module")
def job():
    isolated = iso.reference_building().on(iso.reference_isolators())
    record = el_centro_1940().cut(1.0, 4.0)
    return Job("", isolated, (record,), {"clipped_lqg": iso.controller("clipped_lqg")}, OPTIONS)


@pytest.fixture(scope="module")
def parts(job):
    return {
        "plant": plant_part(job),
        "device": device_part(job),
        "clipped_lqg": controller_part(job, "clipped_lqg"),
    }


class Unit:
    """A unit that is set and read by names."""

    def __init__(self, path, folder):
        described = fmpy.read_model_description(path)
        self.version = described.fmiVersion
        self.names = {v.name: v.valueReference for v in described.modelVariables}
        self.outputs = [v.name for v in described.modelVariables if v.causality == "output"]
        kind = fmpy.fmi2.FMU2Slave if self.version == "2.0" else fmpy.fmi3.FMU3Slave
        self.unit = kind(
            guid=described.guid,
            unzipDirectory=fmpy.extract(path, unzipdir=folder),
            instanceName="unit",
            modelIdentifier=described.coSimulation.modelIdentifier,
        )
        self.unit.instantiate()
        if self.version == "2.0":
            self.unit.setupExperiment(startTime=0.0)
        self.unit.enterInitializationMode()
        self.unit.exitInitializationMode()
        self.time = 0.0

    def put(self, **values):
        place = self.unit.setReal if self.version == "2.0" else self.unit.setFloat64
        place([self.names[name] for name in values], list(values.values()))

    def get(self):
        read = self.unit.getReal if self.version == "2.0" else self.unit.getFloat64
        return dict(zip(self.outputs, read([self.names[n] for n in self.outputs]), strict=True))

    def step(self, length, **inputs):
        self.put(**inputs)
        self.unit.doStep(currentCommunicationPoint=self.time, communicationStepSize=length)
        self.time += length
        return self.get()


@pytest.fixture
def made(parts, tmp_path):
    units = []

    def make(name, version):
        path = write_fmu(parts[name], tmp_path / f"{name}{version}.fmu", version)
        units.append(Unit(path, tmp_path / f"{name}{version}"))
        return units[-1]

    yield make
    for each in units:
        each.unit.terminate()
        each.unit.freeInstance()


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("name", ["plant", "device"])
def test_validation_has_no_remarks(name, version, parts, tmp_path):
    from fmpy.validation import validate_fmu

    path = write_fmu(parts[name], tmp_path / "unit.fmu", version)
    assert validate_fmu(str(path)) == []
    variables = fmpy.read_model_description(path).modelVariables
    assert None not in {v.unit for v in variables}


def compiled_strictly(part, folder):
    for file, text in part.files.items():
        (folder / file).write_text(text)
    strict = ["-std=c99", "-Wall", "-Werror", "-pedantic", "-fsyntax-only", f"{part.name}.c"]
    done = subprocess.run(["cc", *strict], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", [name for name in LAWS if LAWS[name].sets])
def test_every_law_has_sources_that_compile_without_a_warning(name, job, tmp_path):
    device = iso.law(name).scaled(length=10, force=3000)
    own = replace(job, isolated=iso.reference_building().on(device))
    compiled_strictly(plant_part(own), tmp_path)
    compiled_strictly(device_part(own), tmp_path)


def test_two_elements_and_one_step_after_another(job, made, parts):
    """A second element on a storey: the plant's measurements against those of `Simulator`."""
    storey = iso.law("strain_stiffening").scaled(length=10, force=300)
    isolated = job.isolated.with_element(storey, "storey1", 0, "damper")
    record = job.records[0]
    parts["two"] = plant_part(replace(job, isolated=isolated))
    simulator = iso.Simulator(isolated, record, tolerance=1e-10, driver=OPTIONS["driver"])
    plant, measured = made("two", "2.0"), simulator.reset()
    results, expected = [], []
    for k, (now, then) in enumerate(pairwise(record.acceleration)):
        rate = (then - now) / record.dt
        row = plant.step(
            record.dt, ground_acceleration_m_s2=now, ground_acceleration_rate_m_s3=rate,
            coil0_command_A=k % 3,
        )  # fmt: skip
        measured = simulator.step(k % 3)
        results.append(list(row.values()))
        expected.append([getattr(measured, name) for name in row])
    peak = np.abs(expected).max(axis=0)
    assert (np.abs(np.subtract(results, expected)).max(axis=0) <= 1e-9 * peak).all()


@pytest.mark.parametrize("version", VERSIONS)
def test_plant_and_controller_make_the_run_that_simulate_makes(version, job, made):
    run = iso.simulate(job.isolated, job.records, job.controllers["clipped_lqg"], **OPTIONS)
    plant, controller = made("plant", version), made("clipped_lqg", version)
    record = job.records[0]
    a, dt = record.acceleration, record.dt
    inputs = [name for name in controller.names if name in plant.outputs]
    seen, commands = [plant.get()], []
    for k in range(len(a) - 1):
        measured = {name: seen[-1][name] for name in inputs}
        commands.append(controller.step(dt, **measured)["coil0_command_A"])
        settings = {"ground_acceleration_m_s2": a[k], "coil0_command_A": commands[-1],
                 "ground_acceleration_rate_m_s3": (a[k + 1] - a[k]) / dt}  # fmt: skip
        seen.append(plant.step(dt, **settings))
    np.testing.assert_allclose(commands, run.command[:-1, 0], rtol=0, atol=1e-9 * 3)
    history = run.history
    for quantity, unit in (("displacement", "m"), ("velocity", "m_s"), ("acceleration", "m_s2")):
        for dof in history.dof.values:
            own = history[quantity].sel(dof=dof).values
            computed = np.array([row[f"{dof}_{quantity}_{unit}"] for row in seen])
            np.testing.assert_allclose(computed, own, rtol=0, atol=1e-9 * np.abs(own).max())
    force = np.array([row["isolator_force_N"] for row in seen])
    own = history.force.values[:, 0]
    np.testing.assert_allclose(force, own, rtol=0, atol=1e-9 * np.abs(own).max())
    current = [row["coil0_current_A"] for row in seen]
    np.testing.assert_allclose(current, history.current.values[:, 0], rtol=0, atol=1e-9 * 3)


def test_the_plant_takes_steps_of_any_length(made):
    """Halves, thirds and whole steps of a ramp under held commands end at the same place."""
    plant = made("plant", "2.0")

    def end(parts):
        plant.unit.reset()
        plant.unit.setupExperiment(startTime=0.0)
        plant.time = 0.0
        for k in range(8):
            for part in range(parts):
                begun = 0.16 * (k + part / parts)
                row = plant.step(
                    0.16 / parts, ground_acceleration_m_s2=2.0 * begun,
                    ground_acceleration_rate_m_s3=2.0, coil0_command_A=1.0 + k % 2,
                )  # fmt: skip
        return np.array(list(row.values()))

    whole = end(1)
    assert np.abs(whole).min() > 0
    for parts in (2, 3, 16):
        np.testing.assert_allclose(end(parts), whole, rtol=1e-7)


@pytest.mark.parametrize("version", VERSIONS)
def test_the_plants_state_is_saved_and_serialised(version, made):
    plant = made("plant", version)
    suffix = "FMUstate" if version == "2.0" else "FMUState"

    def on(n):
        return [
            plant.step(0.02, ground_acceleration_m_s2=np.sin(0.5 * k), coil0_command_A=k % 3)
            for k in range(n)
        ]

    on(20)
    state, before = getattr(plant.unit, f"get{suffix}")(), plant.get()
    after = on(20)
    getattr(plant.unit, f"set{suffix}")(state)
    assert plant.get() == before
    assert on(20) == after
    stored = getattr(plant.unit, f"serialize{suffix}")(state)
    de = "deSerialize" if version == "2.0" else "deserialize"
    other = getattr(plant.unit, f"{de}{suffix}")(stored)
    getattr(plant.unit, f"set{suffix}")(other)
    assert on(20) == after
    for one in (state, other):
        getattr(plant.unit, f"free{suffix}")(one)


@pytest.mark.parametrize("version", VERSIONS)
def test_the_device_follows_as_the_device_simulator_does(version, job, made):
    device, unit = job.isolated.elements[0].device, made("device", version)
    simulator = iso.DeviceSimulator(device, 0.02, 1e-10)
    t = 0.02 * np.arange(1, 120)
    motion = list(zip(0.05 * np.sin(5 * t), 0.25 * np.cos(5 * t), 1.5 + np.sin(t), strict=True))
    results = [
        unit.step(0.02, displacement_m=x, velocity_m_s=v, current_A=i)["force_N"]
        for x, v, i in motion
    ]
    force = [simulator.step(x, i, v) for x, v, i in motion]
    np.testing.assert_allclose(results, force, rtol=0, atol=1e-9 * np.abs(force).max())


def test_the_devices_energy_is_the_work_done_on_it(job, made):
    """The trapezoidal rule on forces in small steps; the unit takes steps ten times as long."""
    unit, h = made("device", "2.0"), 2e-4
    t = h * np.arange(5001)
    x, v = 0.05 * np.sin(5 * t) ** 2, 0.25 * np.sin(10 * t)
    simulator = iso.DeviceSimulator(job.isolated.elements[0].device, h, 1e-10)
    force = np.array([simulator.step(a, 1.5, b) for a, b in zip(x, v, strict=True)])
    for k in range(10, 5001, 10):
        row = unit.step(10 * h, displacement_m=x[k], velocity_m_s=v[k], current_A=1.5)
    assert row["absorbed_energy_J"] == pytest.approx(np.trapezoid(force * v, dx=h), rel=1e-5)


def test_the_command_writes_one_part(tmp_path, capsys):
    path = tmp_path / "isolators.fmu"
    with pytest.raises(SystemExit) as stop:
        main(["export", "fmu", "--device", "--out", str(path)])
    assert stop.value.code == 0
    assert {v.name for v in fmpy.read_model_description(path).modelVariables} == {
        "displacement_m", "velocity_m_s", "current_A", "force_N", "absorbed_energy_J",
    }  # fmt: skip
    for words in ([], ["--plant", "--device"]):
        with pytest.raises(SystemExit) as stop:
            main(["export", "fmu", *words, "--out", str(tmp_path / "x.fmu")])
        assert stop.value.code == 2
        assert "expected: --controller NAME, --plant or --device" in capsys.readouterr().err
    with pytest.raises(SystemExit) as stop:
        main(["export", "fmu", "--plant", "--out", str(tmp_path / "x.zip")])
    assert stop.value.code == 2 and "ending in .fmu" in capsys.readouterr().err
