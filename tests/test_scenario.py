"""Scenarios: defaults, round trips, what they build, and what they refuse."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ground_motions import STANDARD_GRAVITY, load_record
from isolation_sim.errors import InputError
from isolation_sim.laws import law
from isolation_sim.scenario import Scenario, main_job, writer
from isolation_sim.scenario.devices import Isolator
from isolation_sim.structures import reference_building, reference_isolators

positive = st.floats(1e-6, 1e9)
names = st.text(min_size=1, max_size=12)
whole = st.integers(0, 10**9)
rows = st.lists(positive, min_size=1, max_size=3)

grounds = st.one_of(
    st.fixed_dictionaries(
        {"name": names},
        optional={"scale_factor": st.floats(-5, 5), "start_s": positive, "quiet_after_s": positive},
    ),
    st.fixed_dictionaries({"file": st.just("motion.txt"), "unit": names, "dt_s": positive}),
    st.fixed_dictionaries(
        {
            "kind": st.just("band_limited_noise"),
            "low_Hz": positive,
            "high_Hz": positive,
            "duration_s": positive,
            "seed": whole,
            "scale_to_pga_g": positive,
        }
    ),
    st.fixed_dictionaries(
        {
            "kind": st.sampled_from(["kanai_tajimi", "clough_penzien"]),
            "soil": st.sampled_from(["firm", "soft"]),
            "scale_to_sa_g": positive,
            "sa_period_s": positive,
        }
    ),
    st.fixed_dictionaries(
        {
            "kind": st.just("makris_pulse"),
            "pulse": st.sampled_from(["A", "C1"]),
            "peak_velocity_m_s": positive,
            "pulse_period_s": positive,
        }
    ),
)
structures = st.one_of(
    st.just({"kind": "reference"}),
    st.fixed_dictionaries(
        {
            "floor_masses_kg": rows,
            "storey_stiffnesses_N_per_m": rows,
            "base_mass_kg": positive,
            "damping_ratio": st.one_of(st.floats(0, 0.9), st.lists(st.floats(0, 0.9))),
        }
    ),
    st.fixed_dictionaries({"file": st.just("m.npz"), "dof_names": st.lists(names)}),
)
parameters = st.one_of(names, st.dictionaries(names, st.one_of(positive, rows), min_size=1))
devices = st.fixed_dictionaries(
    {"law": names}, optional={"parameters": parameters, "length_scale": positive}
)
controllers = st.lists(
    st.builds(
        lambda name, rest: {"name": name} | rest,
        names,
        st.dictionaries(st.sampled_from(["period", "rule", "weights"]), positive),
    ),
    min_size=1,
    max_size=3,
    unique_by=lambda entry: entry["name"],
)
scenarios = st.fixed_dictionaries(
    {},
    optional={
        "name": names,
        "ground": st.one_of(grounds, st.lists(grounds, min_size=1, max_size=3)),
        "structure": structures,
        "isolator": devices,
        "element": st.lists(
            st.builds(
                lambda device, direction: device | {"direction": direction},
                devices,
                st.one_of(names, rows),
            ),
            max_size=2,
        ),
        "controller": controllers,
        "driver": st.fixed_dictionaries({"lag_s": positive}, optional={"slew_A_per_s": positive}),
        "sensors": st.fixed_dictionaries(
            {"noise": st.dictionaries(names, positive), "seed": whole}
        ),
        "simulation": st.fixed_dictionaries({"tolerance": st.floats(1e-12, 1e-2)}),
        "nominal": st.fixed_dictionaries({"force_factor": positive, "parameters": parameters}),
    },
)


@given(scenarios, st.booleans())
@settings(max_examples=40, deadline=None)
def test_toml_gives_the_same_scenario_back(data, comments):
    scenario = Scenario.model_validate(data)
    text = scenario.to_toml(comments)
    assert Scenario.from_toml(text) == scenario
    assert Scenario.from_toml(text).to_toml(comments) == text


def test_left_out_sections_are_the_main_job():
    assert Scenario.from_toml("") == Scenario()
    job = Scenario().build()
    assert list(job.controllers) == [
        "passive_off", "passive_on", "best_constant", "on_off", "clipped_lqr",
    ]  # fmt: skip
    expected = reference_building().on(reference_isolators())
    assert job.isolated.elements[0].device == expected.elements[0].device
    np.testing.assert_array_equal(job.isolated.structure.mass, expected.structure.mass)
    assert job.records == (load_record("el_centro_1940_ns"),)


def test_the_main_job_adds_predictive_control_to_the_default():
    ours, default = main_job(), Scenario()
    assert ours.controller[:-2] == default.controller
    assert [one.shown for one in ours.controller[-2:]] == ["mpc", "mpc, 0.8 s preview"]
    predictive = list(ours.build().controllers.values())[-2:]
    assert [one.preview for one in predictive] == [0.0, 0.8]
    assert ours.model_copy(update={"controller": default.controller}) == default


def test_comments_name_every_key_of_every_section():
    text = Scenario().to_toml(comments=True)
    assert tomllib.loads(text)["name"] == "main_job"
    for field in Scenario.model_fields.values():
        for section in writer._section_types(field):
            keys = [key for key in section.model_fields if key != "settings"]
            assert all(key in text for key in keys), section


def test_no_kind_is_called_like_a_key():
    # an error's place is told apart from the kind by this
    for field in Scenario.model_fields.values():
        kinds = list(writer._section_types(field))
        keys = {key for kind in kinds for key in kind.model_fields}
        for kind in kinds:
            if "kind" in kind.model_fields:
                assert not keys & set(get_args(kind.model_fields["kind"].annotation))


def test_ground_is_processed_in_the_order_of_its_keys():
    text = """
    [ground]
    start_s = 1.0
    stop_s = 11.0
    resample_to_s = 0.01
    scale_to_pga_g = 0.5
    quiet_after_s = 2.0
    """
    (record,) = Scenario.from_toml(text).build().records
    assert record.dt == 0.01
    assert record.pga == pytest.approx(0.5 * STANDARD_GRAVITY)
    assert record.duration == pytest.approx(12.0)


def test_a_motion_with_quiet_ground_has_the_spectral_acceleration_that_is_asked_for():
    """The cut begins and ends in strong motion."""
    text = """
    [ground]
    start_s = 2.0
    stop_s = 5.0
    quiet_before_s = 1.0
    quiet_after_s = 2.0
    scale_to_sa_g = 0.4
    sa_period_s = 0.3
    """
    (record,) = Scenario.from_toml(text).build().records
    assert record.spectrum([0.3]).psa[0] == pytest.approx(0.4 * STANDARD_GRAVITY, rel=1e-12)


@pytest.mark.parametrize(
    "ground",
    [
        'kind = "band_limited_noise"\nlow_Hz = 0\nhigh_Hz = 20.0\nduration_s = 5.0\npga_m_s2 = 1.0',
        'kind = "kanai_tajimi"\nsoil = "soft"\nduration_s = 5.0\npga_m_s2 = 2.0',
        'kind = "clough_penzien"\nduration_s = 5.0\npga_m_s2 = 2.0\nenvelope = "stationary"',
        'kind = "ricker_pulse"\npeak_velocity_m_s = 0.5\npulse_period_s = 1.0',
        'kind = "makris_pulse"\npulse = "B"\npeak_velocity_m_s = 0.5\npulse_period_s = 1.0',
        'kind = "mavroeidis_papageorgiou_pulse"\npeak_velocity_m_s = 0.5\npulse_period_s = 1.0',
    ],
)
def test_every_kind_of_motion_builds(ground):
    (record,) = Scenario.from_toml(f"[ground]\n{ground}").build().records
    assert record.pga > 0


@pytest.mark.parametrize(
    ("name", "chosen"),
    [("hybrid", "4mm_2Hz"), ("hybrid", "2mm_4Hz_3A"), ("linearised_bouc_wen", "0.4T_0.2mm_14Hz")],
)
def test_a_set_of_a_single_condition(name, chosen):
    scenario = Scenario.from_toml(f'[isolator]\nlaw = "{name}"\nparameters = "{chosen}"')
    reference = reference_isolators()
    device = scenario.build().isolated.elements[0].device
    assert device == law(name, chosen).scaled(reference.length, reference.force_scale)
    assert chosen.split("_")[0].removesuffix("mm").removesuffix("T") in device.source
    assert Scenario.from_toml(scenario.to_toml()) == scenario


def test_a_shear_building_with_elements():
    text = """
    [structure]
    floor_masses_kg = [1e5, 1e5]
    storey_stiffnesses_N_per_m = [1e8, 1e8]
    base_mass_kg = 1e5
    damping = "modal"
    damping_ratio = [0.02, 0.03]

    [isolator]
    law = "kelvin_voigt"
    parameters = { k = 2e6, c = 1e5 }
    length_scale = 1.0
    force_scale = 1.0
    count = 2.0

    [[element]]
    name = "brace"
    law = "linear"
    parameters = { k = 1e6 }
    direction = "storey1"
    """
    isolated = Scenario.from_toml(text).build().isolated
    assert isolated.element_names == ("isolator", "brace")
    assert isolated.elements[0].device.force_scale == 2.0
    np.testing.assert_array_equal(isolated.elements[1].direction, [-1, 1, 0])


def test_scales_of_the_reference_building_are_said_beside_own_parameters(recwarn):
    own = Isolator.model_validate({"law": "linear", "parameters": {"k": 2e4}})
    with pytest.warns(UserWarning, match="lengths are multiplied by 10 and its forces by 3014.69"):
        own.on_reference()
    own.model_copy(update={"length_scale": 1.0, "force_scale": 1.0}).on_reference()
    Isolator().on_reference()
    Isolator(law="hybrid", parameters="generalised_refitted").on_reference()
    assert len(recwarn) == 0


def test_other_buildings_must_give_their_scales():
    text = """
    [structure]
    floor_masses_kg = [1e5]
    storey_stiffnesses_N_per_m = [1e8]
    base_mass_kg = 1e5
    """
    with pytest.raises(InputError, match=r"^isolator: length_scale is missing; expected: a number"):
        Scenario.from_toml(text).build()


def test_nominal_model_differs_from_the_truth_only_where_it_says():
    text = """
    [nominal]
    force_factor = 1.5
    [nominal.parameters]
    alpha = 1e8
    """
    job = Scenario.from_toml(text).build()
    true = job.isolated.elements[0].device
    nominal = job.options["nominal"].elements[0].device
    assert nominal.force_scale == 1.5 * true.force_scale
    assert nominal.length == true.length
    ours, theirs = (
        dict(zip(d.law.parameter_names, d.parameters_at(1.0), strict=True)) for d in (true, nominal)
    )
    assert theirs.pop("alpha") == 1e8 != ours.pop("alpha")
    assert theirs == ours
    other = Scenario.from_toml('[nominal]\nlaw = "hybrid"').build().options["nominal"]
    assert other.elements[0].device.law.name == "hybrid"
    assert "nominal" not in Scenario().build().options


def test_driver_sensors_and_options_reach_the_run():
    text = """
    [driver]
    lag_s = 0.02
    high_A = 2.0
    [sensors]
    delay_s = 0.01
    noise = { acceleration_m_s2 = 0.01 }
    [simulation]
    tolerance = 1e-5
    current_outside = "clamp"
    computation_delay_s = 0.001
    """
    options = Scenario.from_toml(text).build().options
    driver = options["driver"]
    assert (driver.lag, driver.slew, driver.low, driver.high) == (0.02, np.inf, None, 2.0)
    assert options["sensors"].noise == {"acceleration_m_s2": 0.01}
    assert options["current_outside"] == "clamp"
    assert options["computation_delay"] == 0.001


def test_paths_are_relative_to_the_file(tmp_path):
    (tmp_path / "motion.txt").write_text("0.1\n-0.2\n0.1\n")
    path = tmp_path / "my_job.toml"
    path.write_text('[ground]\nfile = "motion.txt"\nunit = "g"\ndt_s = 0.02\n')
    scenario = Scenario.read(path)
    assert scenario.name == "my_job"
    assert scenario.ground[0].file == tmp_path / "motion.txt"
    # what is written can be read from anywhere
    assert Scenario.from_toml(scenario.to_toml(), "/") == scenario
    assert len(scenario.build().records[0]) == 3


def test_a_controller_file_is_relative_to_the_scenario(tmp_path):
    (tmp_path / "command.csv").write_text("time_s,current_A\n0,1\n1,2\n")
    path = tmp_path / "job.toml"
    path.write_text('[[controller]]\nname = "prescribed"\nfile = "command.csv"\n')
    prescribed = Scenario.read(path).build().controllers["prescribed"]
    assert Path(prescribed.file) == tmp_path / "command.csv"


def test_labels_tell_controllers_apart():
    text = """
    [[controller]]
    name = "constant"
    label = "1 A"
    amperes = 1.0
    [[controller]]
    name = "constant"
    label = "2 A"
    amperes = 2.0
    """
    assert list(Scenario.from_toml(text).build().controllers) == ["1 A", "2 A"]
    with pytest.raises(InputError, match="the label 'constant'; expected: a key label"):
        Scenario.from_toml(text.replace("label", "# label"))


def test_a_tested_current_of_the_isolator_is_the_highest_that_controllers_use():
    text = """
[isolator]
tested_current_A = 1.5
[ground]
stop_s = 1.0
[[controller]]
name = "passive_on"
"""
    job = Scenario.from_toml(text).build()
    assert job.isolated.tested_current() == 1.5
    assert set(job.run("passive_on").current.ravel().tolist()) == {1.5}
    published = Scenario.from_toml(text.replace("tested_current_A = 1.5", ""))
    assert published.build().isolated.tested_current() == 3.0
