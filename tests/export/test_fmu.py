"""Controllers as functional mock-up units: valid, and with the plant the run that Python makes."""

import shutil
from functools import cache
from itertools import product

import numpy as np
import pytest

import isolation_sim as iso
from ground_motions import el_centro_1940
from isolation_sim.cli import main
from isolation_sim.export.fmu import controller_part, write_fmu
from isolation_sim.scenario.job import Job

fmpy = pytest.importorskip("fmpy")
pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")

VERSIONS = ("2.0", "3.0")
LABELS = ("on_off", "clipped_lqg", "mpc")
# to compile predictive control takes 4 s
CASES = [
    pytest.param(*case, marks=[pytest.mark.slow] if case == ("mpc", "3.0") else [])
    for case in product(LABELS, VERSIONS)
]


@pytest.fixture(scope="module")
def job():
    isolated = iso.reference_building().on(iso.reference_isolators())
    record = el_centro_1940().cut(1.0, 4.0)
    return Job("", isolated, (record,), {name: iso.controller(name) for name in LABELS}, {})


@pytest.fixture(scope="module")
def fmus(job, tmp_path_factory):
    """Units of a controller and a version, which are made when they are needed."""
    folder = tmp_path_factory.mktemp("fmus")

    @cache
    def made(label, version):
        return write_fmu(controller_part(job, label), folder / f"{label}{version}.fmu", version)

    return made


@pytest.fixture
def slave(fmus, tmp_path):
    """Instantiates a unit; frees it behind the test."""
    made = []

    def instance(label, version):
        description = fmpy.read_model_description(fmus(label, version))
        unzipped = fmpy.extract(fmus(label, version), unzipdir=tmp_path / f"{label}{version}")
        arguments = {
            "guid": description.guid, "unzipDirectory": unzipped, "instanceName": "unit",
            "modelIdentifier": description.coSimulation.modelIdentifier,
        }  # fmt: skip
        kind = fmpy.fmi2.FMU2Slave if version == "2.0" else fmpy.fmi3.FMU3Slave
        unit = kind(**arguments)
        unit.instantiate()
        if version == "2.0":
            unit.setupExperiment(startTime=0.0)
            unit.enterInitializationMode()
        else:
            unit.enterInitializationMode(startTime=0.0)
        unit.exitInitializationMode()
        made.append(unit)
        names = {v.name: v.valueReference for v in description.modelVariables}
        return unit, names

    yield instance
    for unit in made:
        unit.terminate()
        unit.freeInstance()


def access(unit):
    """Set and get, which the versions call differently."""
    if hasattr(unit, "setReal"):
        return unit.setReal, unit.getReal
    return unit.setFloat64, unit.getFloat64


@pytest.mark.parametrize(("label", "version"), CASES)
def test_validation_has_no_remarks(label, version, fmus):
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(fmus(label, version))) == []
    description = fmpy.read_model_description(fmus(label, version), validate=True)
    units = {v.name: v.unit for v in description.modelVariables if v.name != "time"}
    assert units["coil0_command_A"] == "A"
    assert None not in units.values()


@pytest.mark.parametrize(("label", "version"), CASES)
def test_unit_and_plant_make_the_run_that_simulate_makes(label, version, job, slave):
    """The plant steps in Python, the controller is the unit."""
    run = iso.simulate(job.isolated, job.records, job.controllers[label])
    unit, names = slave(label, version)
    put, get = access(unit)
    inputs = [name for name in names if name not in ("coil0_command_A", "time")]
    plant = iso.Simulator(job.isolated, job.records[0], measures=inputs[:-1])
    measured, path = plant.reset(), []
    while not plant.done:
        put([names[name] for name in inputs], [getattr(measured, name) for name in inputs])
        unit.doStep(currentCommunicationPoint=plant.time, communicationStepSize=plant.period)
        (current,) = get([names["coil0_command_A"]])
        path.append(current)
        measured = plant.step(current)
    np.testing.assert_allclose(path, run.command[:-1, 0], rtol=0, atol=1e-9)


@pytest.mark.parametrize("version", VERSIONS)
def test_steps_of_any_length_and_states(version, slave):
    unit, names = slave("clipped_lqg", version)
    put, get = access(unit)
    command = [names["coil0_command_A"]]
    inputs = [r for name, r in names.items() if name not in ("coil0_command_A", "time")]
    # a strong and changing measurement for each period
    rows = np.random.default_rng(3).normal(0, 0.1, (20, len(inputs)))

    def commands(parts):
        """Commands at the ends of communication steps, so many a period."""
        unit.reset()
        results = []
        for k, row in enumerate(rows):
            for part in range(parts):
                # inputs that come between decisions are not looked at
                put(inputs, (row if part == 0 else 9 * row).tolist())
                step(0.02 * (k + part / parts), 0.02 / parts)
                results += get(command)
        return results

    def step(time, length):
        unit.doStep(currentCommunicationPoint=time, communicationStepSize=length)

    whole, quarters = commands(1), commands(4)
    assert len(set(whole)) > 3
    assert [c for c in whole for _ in range(4)] == quarters
    # a step over five periods is five decisions on the same inputs
    unit.reset()
    put(inputs, rows[0].tolist())
    step(0.0, 0.1)
    once = get(command)
    unit.reset()
    put(inputs, rows[0].tolist())
    for k in range(5):
        step(0.02 * k, 0.02)
    assert get(command) == once
    state = getattr(unit, "getFMUState" if version == "3.0" else "getFMUstate")()

    def go_on():
        results = []
        for k, row in enumerate(rows[:10]):
            put(inputs, row.tolist())
            step(0.1 + 0.02 * k, 0.02)
            results += get(command)
        return results

    after = go_on()
    assert len(set(after)) > 2
    getattr(unit, "setFMUState" if version == "3.0" else "setFMUstate")(state)
    assert get(command) == once
    assert go_on() == after
    getattr(unit, "freeFMUState" if version == "3.0" else "freeFMUstate")(state)


def test_the_command_writes_the_unit(tmp_path, capsys):
    path = tmp_path / "on_off.fmu"
    words = ["export", "fmu", "--controller", "on_off", "--out", str(path), "--fmi", "3.0"]
    with pytest.raises(SystemExit) as stop:
        main(words)
    assert stop.value.code == 0
    assert fmpy.read_model_description(path).fmiVersion == "3.0"
    with pytest.raises(SystemExit) as stop:
        main(words)
    assert stop.value.code == 2
    assert "exists; expected: a new name" in capsys.readouterr().err


def test_what_is_refused(job, tmp_path):
    with pytest.raises(iso.InputError, match=r"FMI version: given '1\.0'; expected"):
        write_fmu(controller_part(job, "on_off"), tmp_path / "x.fmu", "1.0")
