"""Laws by name."""

from pathlib import Path

import numpy as np
import pytest

from isolation_sim.effects import device_section
from isolation_sim.errors import InputError
from isolation_sim.laws import LAWS, available_laws, available_sets, law
from isolation_sim.scenario import Scenario


def test_names_of_the_package():
    assert law("strain_stiffening") == law("strain_stiffening", "generalised")
    assert law("hybrid", "generalised_refitted").law.name == "hybrid"
    assert law("linear", {"k": (1e6, 1e5)}).force(0.1, 0.0, (), 2.0) == pytest.approx(1.2e5)
    assert set(available_laws()) >= {"strain_stiffening", "hybrid", "linear", "kelvin_voigt"}
    assert available_sets("linear") == ()


def test_every_law_has_numbers_for_the_tests_of_all_laws():
    guide = Path(__file__).parents[2] / "docs" / "examples" / "cubic.py"
    for one in (*LAWS.values(), LAWS[f"{guide}:LAW"]):
        assert one.sets or law(one, one.example).law is one


def test_numbers_replace_those_of_the_published_set():
    device = law("hybrid", {"v_s": 2e-3})
    assert device.parameters_at(1.0)[:5] == law("hybrid").parameters_at(1.0)[:5]
    assert device.parameters_at(1.0)[5] == 2e-3
    assert device.current_range == (0.0, 3.0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: law("strain_stifening"), "did you mean 'strain_stiffening'"),
        (lambda: available_sets("hybryd"), "did you mean 'hybrid'"),
        (lambda: law("hybrid", "generalised_print"), "did you mean 'generalised_printed'"),
        (lambda: law("linear"), "needed: k"),
        (lambda: law("linear", "soft"), "needed: k"),
        (lambda: law("kelvin_voigt", {"k": 1.0}), "'c' is missing"),
        (lambda: law("kelvin_voigt", {"k": 1.0, "c": 1.0, "cc": 1.0}), "unknown parameter 'cc'"),
        (lambda: law("hybrid", {"sigma_square": 1.0}), "did you mean 'sigma_squared'"),
        (lambda: law("linear", {"k": None}), "'k'"),
    ],
)
def test_refuses(call, message):
    with pytest.raises(InputError, match=message) as refused:
        call()
    assert "\n" not in str(refused.value)


def test_round_trip_through_a_section(device):
    if len(device.current.coefficients) > 1 and device != law(device.law.name):
        with pytest.raises(InputError, match="one polynomial for all currents"):
            device_section(device)
        return
    again = Scenario.from_toml(device_section(device)).isolator.scaled()
    limited = np.isfinite(device.current_range).all()
    assert again.current_range == device.current_range or not limited
    for current in np.linspace(*device.current_range, 3) if limited else (0.0, 1.0):
        assert again.parameters_at(current) == device.parameters_at(current)
    kept = ("law", "tested_deformation", "tested_current", "length", "force_scale")
    for key in kept:
        given = getattr(device, key)
        assert getattr(again, key) == given or given == np.inf, key
