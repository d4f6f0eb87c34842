"""Laws by name, and devices as plain dictionaries."""

import tomllib

import numpy as np
import pytest

from isolation_sim.errors import InputError
from isolation_sim.laws import available_laws, available_sets, from_dict, law, to_dict
from isolation_sim.laws.hybrid import condition


def test_names_of_the_package():
    assert law("strain_stiffening") == law("strain_stiffening", "generalised")
    assert law("hybrid", "generalised_refitted").law.name == "hybrid"
    assert law("linear", {"k": (1e6, 1e5)}).force(0.1, 0.0, (), 2.0) == pytest.approx(1.2e5)
    assert set(available_laws()) >= {"strain_stiffening", "hybrid", "linear", "kelvin_voigt"}
    assert available_sets("linear") == ()


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


def toml_text(data):
    """The few kinds of value that a device holds, as TOML."""

    def value(v):
        if isinstance(v, str):
            return '"' + v.replace('"', '\\"') + '"'
        return str(v)

    top = [f"{k} = {value(v)}" for k, v in data.items() if k != "parameters"]
    inner = [f"{k} = {value(v)}" for k, v in data["parameters"].items()]
    return "\n".join([*top, "[parameters]", *inner])


def test_round_trip_through_toml(device):
    again = from_dict(tomllib.loads(toml_text(to_dict(device))))
    assert again == device and again.source == device.source


def test_round_trip_of_scaled_and_piecewise():
    device = condition(2, 4).scaled(10, 77.0).with_parameters(F0=(1.0, 2.0, 3.0))
    assert from_dict(to_dict(device)) == device


def test_only_law_and_parameters_are_needed():
    device = from_dict({"law": "linear", "parameters": {"k": 3.0}})
    assert device == law("linear", {"k": 3.0}) and device.length == 1.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"lenght": 1.0}, "did you mean 'length'"),
        ({"law": "liner"}, "did you mean 'linear'"),
        ({"parameters": 3.0}, "table of name"),
        ({"parameters": {"k": [np.nan]}}, "'k'"),
        ({"parameters": {"k": "stiff"}}, "'k'"),
        ({"current_breaks": [1.0]}, "list of lists"),
        ({"current_breaks": [1.0], "parameters": {"k": [[1.0], [1.0, 2.0]]}}, "one length"),
        ({"current_range": [1.0]}, "current_range"),
        ({"length": "ten"}, "length"),
    ],
)
def test_bad_dictionaries(changes, message):
    expected = {"law": "linear", "parameters": {"k": [1.0]}}
    with pytest.raises(InputError, match=message) as refused:
        from_dict(expected | changes)
    assert "\n" not in str(refused.value)


def test_missing_key():
    with pytest.raises(InputError, match="'parameters'"):
        from_dict({"law": "linear"})
