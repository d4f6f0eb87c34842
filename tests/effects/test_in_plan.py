"""Effects around a biaxial device: the same along every line as along one, walls along the axes."""

from __future__ import annotations

import numpy as np
import pytest

from isolation_sim.discrepancy.building.isolator_effects import DAMPER, ISOLATOR_EFFECTS
from isolation_sim.effects import device_section, extend
from isolation_sim.errors import InputError
from isolation_sim.laws import LAWS, law
from isolation_sim.scenario import Scenario

from .conftest import FORMS, numbers

PLAN = {name: form for name, form in FORMS.items() if form.plan} | {DAMPER.name: DAMPER}
WALLS = {"end_stop.power"}


def extended(*forms):
    device = law("bouc_wen", LAWS["bouc_wen"].example)
    return extend(device, [(form, numbers(form)) for form in forms])


@pytest.mark.parametrize("angle", [0.0, np.pi / 2, 0.7, -2.0])
@pytest.mark.parametrize("name", PLAN)
def test_along_a_line_it_is_the_effect_itself(name, angle, draw):
    if name in WALLS and abs(np.sin(2 * angle)) > 1e-9:
        pytest.skip("walls stand along x and along y")
    device = extended(PLAN[name])
    x, v, states, current = draw(device)
    n = len(device.law.base.states)
    parameters = device.parameters_at(current)
    unit = np.cos(angle), np.sin(angle)
    own = tuple(np.abs(state) for state in states[n:])
    along = (*(s * u for u in unit for s in states[:n]), *own)
    motion = tuple(x * u for u in unit), tuple(v * u for u in unit)
    forces, rates = device.law.in_plan.respond(*motion, along, parameters)
    line = (*states[:n], *own)
    expected = device.law.force(x, v, line, parameters)
    for force, u in zip(forces, unit, strict=True):
        np.testing.assert_allclose(force, expected * u, atol=1e-9 * np.abs(expected).max())
    for rate, target in zip(
        rates[2 * n :], device.law.rates(x, v, line, parameters)[n:], strict=True
    ):
        np.testing.assert_allclose(rate, target, atol=1e-9 * np.abs(target).max())


def test_all_effects_of_a_building_stand_around_a_law_in_plan(draw):
    device = extended(*ISOLATOR_EFFECTS.values())
    planar = device.law.in_plan
    assert planar.directions == 2 and len(planar.states) == 2 + 2
    assert planar.parameter_names == device.law.parameter_names


def test_effects_of_a_building_are_restored_in_a_scenario():
    device = extended(*ISOLATOR_EFFECTS.values())
    text = f'{device_section(device)}\n[[controller]]\nname = "passive_off"\n'
    again = Scenario.from_toml(text).isolator.device()
    assert again.law.effects == device.law.effects


def test_an_effect_without_such_a_form_is_refused():
    with pytest.raises(InputError, match=r"along one direction \(inertia_force\)"):
        _ = extended(FORMS["inertia_force.mass"], FORMS["coulomb_friction.smooth"]).law.in_plan
    with pytest.raises(InputError, match="no change of their vertical load"):
        _ = extended(FORMS["coulomb_friction.smooth"]).law.under_axial_load
