"""Extended laws where laws are used: scenarios, nominal models, elements, runs and their ledger."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import isolation_sim as iso
from controllers import CurrentMap
from ground_motions import Record, el_centro_1940
from isolation_sim.effects import device_section, effect, extend, separate
from isolation_sim.errors import InputError
from isolation_sim.laws import law
from isolation_sim.scenario import Scenario

from .conftest import FORMS, numbers, size

TEXT = """
[isolator]
law = "strain_stiffening"
[[isolator.effect]]
name = "current_lag"
lag = 0.05
[[isolator.effect]]
name = "end_stop"
form = "exponential"
stiffness = 1e4
gap = 0.01
depth = 0.002

[[element]]
law = "linear"
parameters = { k = 1e6 }
direction = "base"
[[element.effect]]
name = "coulomb_friction"
level = 10
velocity = 0.01
"""


@pytest.fixture(scope="module")
def short():
    """Five seconds of El Centro."""
    whole = el_centro_1940()
    return Record(whole.acceleration[: int(5 / whole.dt)], whole.dt, name="five seconds")


def causes(isolated):
    return [[e.name for e, _ in separate(e.device)[1]] for e in isolated.elements]


@pytest.mark.parametrize("comments", [False, True])
def test_scenario_keeps_its_effects(comments):
    scenario = Scenario.from_toml(TEXT)
    assert Scenario.from_toml(scenario.to_toml(comments)) == scenario
    expected = [["current_lag.first_order", "end_stop.exponential"], ["coulomb_friction.smooth"]]
    assert causes(scenario.build().isolated) == expected


@pytest.mark.parametrize(
    "nominal, expected",
    [
        ("length_factor = 1.1", ["current_lag.first_order", "end_stop.exponential"]),
        ("effect = []", []),
        ('[[nominal.effect]]\nname = "force_offset"\nlevel = 3.0', ["force_offset.constant"]),
        ('law = "hybrid"', []),
    ],
)
def test_controllers_believe_in_effects_or_not(nominal, expected):
    scenario = Scenario.from_toml(f"{TEXT}\n[nominal]\n{nominal}\n")
    assert Scenario.from_toml(scenario.to_toml()) == scenario
    job = scenario.build()
    assert causes(job.options["nominal"])[0] == expected
    assert len(causes(job.isolated)[0]) == 2


@pytest.mark.parametrize(
    "wrong, right, message",
    [
        ("end_stop", "endstop", "isolator: unknown effect 'endstop'; did you mean 'end_stop'"),
        ("gap =", "gapp =", "did you mean 'gap'"),
        ("exponential", "exponental", "did you mean 'exponential'"),
        ("lag = 0.05", 'lag = "short"', r"isolator.effect\[0\].lag: given 'short'"),
        ("lag = 0.05", "lag = -1", "expected: 0 to 5"),
        ("level = 10\n", "", "'level' is missing"),
    ],
)
def test_what_a_scenario_refuses(wrong, right, message):
    with pytest.raises(InputError, match=message):
        Scenario.from_toml(TEXT.replace(wrong, right), source="mine.toml").build()


def test_a_device_is_written_as_a_section(form, isolator):
    device = extend(isolator, [(form, numbers(form))])
    text = device_section(device, "found by a test")
    assert "# found by a test" in text
    read = Scenario.from_toml(text).isolator.scaled()
    if form.of_device:
        assert read.law is device.law
        assert read.current == device.current
        assert read.current_range == device.current_range
        assert read.tested_current == device.tested_current == 3.0
    else:
        assert "[[isolator.instrument]]" in text
        assert read.law is isolator.law


def test_any_numbers_survive_the_section(isolator):
    quantities = {name: form.parameters for name, form in FORMS.items() if form.of_device}

    @settings(max_examples=30, deadline=None, derandomize=True, database=None)
    @given(st.data())
    def survive(data):
        name = data.draw(st.sampled_from(sorted(quantities)))
        values = {
            q.name: data.draw(st.floats(max(q.lower, 0.1 * abs(q.starts[0]) * size(q)),
                                        min(q.upper, 10 * abs(q.starts[-1]) * size(q))))
            for q in quantities[name]
        }  # fmt: skip
        device = extend(isolator, [(FORMS[name], values)])
        read = Scenario.from_toml(device_section(device)).isolator.scaled()
        assert separate(read)[1] == [(FORMS[name], values)]

    survive()


def test_piecewise_parameters_are_those_published_or_refused_as_a_section():
    device = law("improved_bouc_wen")
    extended = extend(device, [(effect("coulomb_friction"), {"level": 5.0, "velocity": 0.01})])
    read = Scenario.from_toml(device_section(extended)).isolator.scaled()
    for current in (0.0, 0.7, 3.0):
        assert read.parameters_at(current) == extended.parameters_at(current)
    with pytest.raises(InputError, match="one polynomial"):
        device_section(device.with_parameters(k=2e4))


def test_parameters_that_are_all_prescribed_are_no_longer_piecewise():
    device = law("improved_bouc_wen")
    numbers = dict(zip(device.law.parameter_names, device.parameters_at(1.0), strict=True))
    numbers["k"] = (numbers["k"], 0.1 * numbers["k"])
    all_prescribed = law("improved_bouc_wen", numbers)
    read = Scenario.from_toml(device_section(all_prescribed)).isolator.scaled()
    for current in (0.0, 0.7, 2.0):
        assert read.parameters_at(current) == all_prescribed.parameters_at(current)


def test_energy_closes_with_effects_that_store_it(short):
    """Stop, arms, spring-pot, bristles: each as an element of its own, in one kernel."""
    isolated = iso.reference_building().on(iso.reference_isolators())
    stiffness = 0.1 * abs(iso.reference_isolators().linearised(1.5, 0.5))
    for cause, values in (
        ("end_stop.exponential", {"stiffness": stiffness, "gap": 0.02, "depth": 0.02}),
        ("extra_relaxation.two_arms",
         {"stiffness": stiffness, "share": 0.4, "time": 0.2, "second_time": 2.0}),
        ("weak_rate_dependence.spring_pot", {"stiffness": stiffness, "exponent": 0.2}),
        ("coulomb_friction.dahl", {"level": 0.01 * stiffness, "length": 0.005}),
    ):  # fmt: skip
        extended = extend(law("linear", {"k": stiffness}), [(effect(*cause.split(".")), values)])
        assert extended.stores_energy
        isolated = isolated.with_element(extended, "base", None, cause)
    energy = iso.simulate(isolated, short, "passive_on").energy
    assert energy.closure_error < 1e-6
    dissipated = energy.device_dissipation_J
    assert dissipated[-1] > 0
    assert np.min(np.diff(dissipated)) > -1e-6 * np.max(energy.input_J)


def test_a_controlled_building_on_an_extended_law(short):
    """Softened, with a lag: it runs, moves further, and an extended nominal model is followed."""
    plain = iso.law("strain_stiffening")
    softened = extend(
        plain,
        [
            (effect("current_lag"), {"lag": 0.05}),
            (effect("stress_softening"), {"loss": 0.4, "length": 4e-3}),
        ],
    )
    building = iso.reference_building()
    regulator = iso.controller("clipped_lqr", preset="published")
    runs = [
        iso.simulate(building.on(iso.reference_isolators(device)), short, regulator)
        for device in (plain, softened)
    ]
    for run in runs:
        assert run.energy.closure_error < 1e-6
    peaks = [run.criteria["peak_base_displacement_m"] for run in runs]
    assert abs(peaks[1] / peaks[0] - 1) > 0.02


def test_the_map_sees_the_kink_that_remanence_makes(isolator):
    """Above the largest current the field follows it at once; below, in part."""
    device = extend(isolator, [(effect("magnetic_remanence", "largest"), {"share": 0.4})])
    for current in (0.5, 1.0, 1.5, 2.5):
        target = device.force(4e-3, 0.02, (1e-3, 1e-3, 1.2), current)
        result = CurrentMap(device, 0.0, 3.0)(target, 4e-3, 0.02, (1e-3, 1e-3, 1.2))
        assert result.current == pytest.approx(current, abs=1e-9)
