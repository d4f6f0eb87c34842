"""Honest sensing and actuation and the switching rule, from the scenario file to the run."""

import numpy as np
import pytest

import isolation_sim as iso
from isolation_sim.errors import InputError
from isolation_sim.laws import instantaneous
from isolation_sim.scenario import Scenario

TEXT = """
[isolator]
switching = "passive"
[[controller]]
name = "on_off"
[driver]
lag_s = 0.02
slew_A_per_s = 100.0
high_A = 3.0
step_A = 0.25
[sensors]
delay_s = 0.01
dropout = 0.1
compensation_s = 0.02
seed = 5
noise = { displacement_m = 1e-4 }
[simulation]
computation_delay_s = 0.025
"""


def test_every_key_reaches_the_run_and_comes_back_as_text():
    scenario = Scenario.from_toml(TEXT)
    job = scenario.build()
    driver, sensors = job.options["driver"], job.options["sensors"]
    assert (driver.lag, driver.slew, driver.high, driver.step) == (0.02, 100.0, 3.0, 0.25)
    assert (sensors.delay, sensors.dropout, sensors.compensation) == (0.01, 0.1, 0.02)
    assert (sensors.seed, sensors.noise) == (5, {"displacement_m": 1e-4})
    assert job.options["computation_delay"] == 0.025
    device = job.isolated.elements[0].device
    assert instantaneous(device).law is iso.reference_isolators().law is not device.law
    for comments in (False, True):
        assert Scenario.from_toml(scenario.to_toml(comments)) == scenario


def test_scenario_is_the_same_run_in_python():
    run = iso.run_scenario(Scenario.from_toml(TEXT)).runs["on_off"]
    job = Scenario.from_toml(TEXT).build()
    plant = iso.reference_building().on(iso.passive(iso.reference_isolators()))
    same = iso.simulate(plant, job.records, "on_off", **job.options)
    np.testing.assert_array_equal(run.values, same.values)
    np.testing.assert_allclose(run.command / 0.25, np.round(run.command / 0.25), atol=1e-12)


def test_nominal_isolators_switch_instantaneously_by_default():
    for text, passive in (("", False), ('switching = "passive"\n', True)):
        job = Scenario.from_toml(f"{TEXT}[nominal]\nforce_factor = 1.2\n{text}").build()
        nominal = job.options["nominal"].elements[0].device
        assert nominal.force_scale == pytest.approx(1.2 * iso.reference_isolators().force_scale)
        assert (instantaneous(nominal) is not nominal) == passive


MISTAKES = {
    '[isolator]\nswitching = "pasive"': "isolator.switching: given 'pasive'; did you mean 'passi",
    '[isolator]\nlaw = "hybrid"\nswitching = "passive"': "isolator: hybrid.*declares no springs",
    "[sensors]\ndropout = 1.0": "sensors.dropout: given 1.0; expected: .*below 1",
    "[sensors]\ncompensation_s = -0.1": "sensors.compensation_s: given -0.1; expected: 0 or more",
    "[driver]\nstep_A = -1.0": "driver.step_A: given -1.0; expected: 0 or more",
    '[isolator]\nswitching = "passive"\n[[isolator.effect]]\nname = "coulomb_friction"\n'
    "level = 1.0\nvelocity = 0.01": "isolator: switching is 'passive', with effects",
}


@pytest.mark.parametrize("text", MISTAKES)
def test_mistakes_are_answered_with_what_is_accepted(text):
    with pytest.raises(InputError, match=MISTAKES[text]):
        Scenario.from_toml(text).build()


def test_coils_begin_at_the_current_nearest_to_none():
    """Devices that were tested with current alone run as well."""
    job = Scenario.from_toml(
        '[isolator]\nlaw = "strain_stiffening"\ncurrent_range_A = [0.5, 3.0]\n'
    ).build()
    run = iso.simulate(job.isolated, job.records, "passive_off", **job.options)
    assert np.all(run.current == 0.5)
