"""A functional mock-up unit as a controller of a scenario."""

import shutil
from hashlib import sha256

import numpy as np
import pytest

import isolation_sim as iso
from ground_motions import el_centro_1940
from isolation_sim.cli import main
from isolation_sim.effects import effect
from isolation_sim.export.fmu import controller_part, write_fmu
from isolation_sim.export.part import Part
from isolation_sim.scenario import Scenario
from isolation_sim.scenario.job import Job

pytest.importorskip("fmpy")
pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")

SCENARIO = """
[ground]
name = "el_centro_1940_ns"
{controllers}
"""
GAIN = {
    "gain.h": """
#define gain_N_MEASURED 1
#define gain_N_COMMANDS 1
#define gain_PERIOD 0.02
typedef struct { double gain; } gain_state;
void gain_init(gain_state *it);
void gain_step(gain_state *it, double t, const double *measured, double *command);
""",
    "gain.c": """
#include "gain.h"
void gain_init(gain_state *it) { it->gain = 10.0; }
void gain_step(gain_state *it, double t, const double *measured, double *command)
{
    (void)t;
    command[0] = it->gain * measured[0] * measured[0];
}
""",
}
"""Another tool's controller, with names of its own."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    result = tmp_path_factory.mktemp("units")
    isolated = iso.reference_building().on(iso.reference_isolators())
    job = Job("", isolated, (el_centro_1940(),), {"on_off": iso.controller("on_off")}, {})
    for version in ("2.0", "3.0"):
        write_fmu(controller_part(job, "on_off"), result / f"own{version[0]}.fmu", version)
    gain = Part("gain", "a gain", GAIN, ("v",), ("u",), 0.02, sampled=True)
    write_fmu(gain, result / "gain.fmu")
    (result / "broken.fmu").write_text("no archive")
    return result


def job_of(folder, controllers):
    return Scenario.from_toml(SCENARIO.format(controllers=controllers), folder).build()


def test_a_unit_makes_the_run_of_the_controller_that_it_was_written_from(folder):
    names = ("on_off", "own2.fmu", "own3.fmu")
    job = job_of(folder, "".join(f'[[controller]]\nname = "{name}"\n' for name in names))
    assert list(job.controllers) == ["on_off", "own2", "own3"]
    own, *units = (job.run(label) for label in job.controllers)
    assert len(np.unique(own.command)) > 1
    for unit in units:
        np.testing.assert_allclose(unit.command, own.command, rtol=0, atol=1e-9)
        for name, value in own.criteria.items():
            assert unit.criteria[name] == pytest.approx(value, rel=1e-9, abs=1e-12)


def test_names_of_the_unit_are_mapped_and_commands_limited(folder):
    variables = '{ v = "base_velocity_m_s", u = "coil0_command_A" }'
    job = job_of(folder, f'[[controller]]\nname = "gain.fmu"\nvariables = {variables}\n')
    run = job.run("gain")
    velocity = run.history.velocity.sel(dof="base").values
    expected = np.minimum(10 * velocity[:-1] ** 2, job.isolated.current_range(0)[1])
    assert 0 < np.count_nonzero(expected == expected.max()) < len(expected)
    np.testing.assert_allclose(run.command[:-1, 0], expected, rtol=1e-9)


def test_the_result_records_the_units_hash(folder, tmp_path, monkeypatch):
    monkeypatch.chdir(folder)
    text = SCENARIO.format(controllers='[[controller]]\nname = "own2.fmu"\n')
    (folder / "scenario.toml").write_text(text)
    with pytest.raises(SystemExit) as stop:
        main(["run", "scenario.toml", "--out", str(tmp_path / "out"), "--no-figures", "--quiet"])
    assert stop.value.code == 0
    digest = sha256((folder / "own2.fmu").read_bytes()).hexdigest()
    texts = [p.read_text() for p in (tmp_path / "out").glob("*") if p.suffix in (".toml", ".json")]
    assert any(digest in text for text in texts)


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ('name = "nowhere.fmu"', "nowhere.fmu: no such file"),
        ('name = "broken.fmu"', "broken.fmu: is no functional mock-up unit"),
        ('name = "gain.fmu"', "input 'v' is given 'v', which is no output; expected: variables"),
        ('name = "gain.fmu"\nvariables = { w = "x" }', "unknown variable of .*gain.fmu 'w'"),
        ('name = "gain.fmu"\nvariables = 3', "variables: given 3; expected: a table of names"),
        (
            'name = "gain.fmu"\nvariables = { v = "base_velocity_m_s" }',
            r"no output is coil0_command_A; expected: variables = \{ u = ",
        ),
    ],
)
def test_what_cannot_be_used_is_said_in_a_line(entry, message, folder):
    with pytest.raises(iso.InputError, match=message) as error:
        job = job_of(folder, f"[[controller]]\n{entry}\n")
        job.run(next(iter(job.controllers)))
    assert "\n" not in str(error.value)


def test_a_unit_is_no_effect(folder):
    with pytest.raises(iso.InputError, match=r"gain\.fmu.* is a functional mock-up unit; expected"):
        effect(str(folder / "gain.fmu"))
