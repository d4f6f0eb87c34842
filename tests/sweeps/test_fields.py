"""Fields by name, and what a case does to them."""

import pytest

from isolation_sim.errors import InputError
from isolation_sim.scenario import Scenario
from isolation_sim.sweeps.fields import Change, apply_changes, steps_of, with_seed


def data_of(**sections):
    return Scenario.model_validate(sections).model_dump(mode="json")


SHEAR = {
    "floor_masses_kg": [2e5, 1e5], "storey_stiffnesses_N_per_m": [3e8, 2e8], "base_mass_kg": 3e5,
}  # fmt: skip
ISOLATOR = {"length_scale": 10.0, "force_scale": 2000.0}


def test_a_field_is_keys_and_places():
    assert steps_of("controller[1].amperes") == ("controller", 1, "amperes")
    assert steps_of("structure.floor_masses_kg[0]") == ("structure", "floor_masses_kg", 0)
    for wrong in ("", ".", "a..b", "a[x]", "a[1"):
        with pytest.raises(InputError, match="cannot be read"):
            steps_of(wrong)


def test_values_and_factors_reach_every_item_of_a_list():
    data = data_of(structure=SHEAR, isolator=ISOLATOR, ground=[{}, {}])
    new = apply_changes(data, [
        Change("structure.floor_masses_kg", 2.0, factor=True),
        Change("structure.storey_stiffnesses_N_per_m[1]", 7e8),
        Change("ground.scale_factor", 0.5),
        Change("isolator.force_scale", 1.5, factor=True),
    ])  # fmt: skip
    assert new["structure"]["floor_masses_kg"] == [4e5, 2e5]
    assert new["structure"]["storey_stiffnesses_N_per_m"] == [3e8, 7e8]
    assert [motion["scale_factor"] for motion in new["ground"]] == [0.5, 0.5]
    assert new["isolator"]["force_scale"] == 3000.0
    # what it was made from stays as it was
    assert data["structure"]["floor_masses_kg"] == [2e5, 1e5]
    assert data["ground"][0]["scale_factor"] is None
    Scenario.model_validate(new)


def test_whole_sections_change_before_their_keys():
    changes = [Change("structure.base_mass_kg", 9e5), Change("structure", SHEAR)]
    new = apply_changes(data_of(), changes)
    assert new["structure"]["base_mass_kg"] == 9e5


def test_settings_of_a_controller():
    data = data_of(controller=[{"name": "passive_off"}, {"name": "constant", "amperes": 1.0}])
    new = apply_changes(data, [Change("controller[1].amperes", 2.0)])
    assert new["controller"][1]["settings"] == {"amperes": 2.0}
    assert new["controller"][0] == data["controller"][0]
    # a factor on a setting that the scenario leaves out multiplies its default
    on_off = data_of(controller=[{"name": "on_off"}])
    new = apply_changes(on_off, [Change("controller.period", 0.1)])
    assert new["controller"][0]["settings"] == {"period": 0.1}


def test_one_number_of_a_published_set():
    data = data_of()
    new = apply_changes(data, [Change("isolator.parameters.alpha", 2.0, factor=True)])
    device = Scenario.model_validate(data).build().isolated.elements[0].device
    altered = Scenario.model_validate(new).build().isolated.elements[0].device
    place = device.law.parameter_names.index("alpha")
    for k, (before, after) in enumerate(
        zip(device.parameters_at(1.3), altered.parameters_at(1.3), strict=True)
    ):
        assert after == pytest.approx((2.0 if k == place else 1.0) * before, rel=1e-14)
    assert altered.current_range == device.current_range


def test_nominal_model_and_noise_that_the_scenario_leaves_out():
    new = apply_changes(data_of(), [
        Change("nominal.force_factor", 1.2), Change("sensors.noise.displacement_m", 1e-3),
    ])  # fmt: skip
    scenario = Scenario.model_validate(new)
    assert scenario.nominal.force_factor == 1.2
    assert scenario.sensors.noise == {"displacement_m": 1e-3}


@pytest.mark.parametrize(
    ("field", "nearest"),
    [
        ("isolater.count", "isolator"),
        ("isolator.force_scle", "isolator.force_scale"),
        ("controller[0].perod", "controller[0].period"),
        ("isolator.parameters.alhpa", "isolator.parameters.alpha"),
        ("ground.scale_facter", "ground.scale_factor"),
    ],
)
def test_an_unknown_field_names_the_nearest(field, nearest):
    with pytest.raises(InputError, match="unknown field") as error:
        apply_changes(data_of(controller=[{"name": "on_off"}]), [Change(field, 1.0)])
    assert f"did you mean '{nearest}'?" in str(error.value)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (Change("element.count", 2.0), "is not in the scenario"),
        (Change("controller[7].period", 1.0), "the scenario has 5"),
        (Change("isolator.count.x", 1.0), "no such part"),
        (Change("controller.settings.x", 1.0), r"controller\[0\]\.settings has no keys"),
        (Change("ground.scale_factor", 2.0, factor=True), "cannot be multiplied"),
        (Change("structure.kind", 2.0, factor=True), "cannot be multiplied"),
    ],
)
def test_what_cannot_be_changed_so_is_reported(change, said):
    with pytest.raises(InputError, match=said):
        apply_changes(data_of(), [change])


def test_every_seed_is_set():
    noise = {"kind": "kanai_tajimi", "pga_m_s2": 1.0}
    new = with_seed(data_of(ground=[noise, {}, noise]), 40)
    assert new["sensors"]["seed"] == 40
    assert [motion.get("seed") for motion in new["ground"]] == [40, None, 42]
