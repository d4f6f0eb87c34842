"""Records of two directions against structures: what fits, what is refused, which causes."""

from __future__ import annotations

import numpy as np
import pytest

import isolation_sim as iso
from ground_motions import Record
from isolation_sim.discrepancy.building.comparison import with_causes
from isolation_sim.discrepancy.building.model import (
    building_model,
    dofs_by_level,
    shear_stiffness,
    total_force_scale,
)
from isolation_sim.discrepancy.building.record import BuildingRecord
from isolation_sim.discrepancy.building.search.cause_search import candidates
from isolation_sim.discrepancy.diagnosis import Trace, groups_in_turn
from isolation_sim.errors import InputError
from isolation_sim.structures import plan_building

pytestmark = pytest.mark.usefixtures("no_drawing")

N = 100


def record(*names, rotation=True, floors=2):
    """Signals of no meaning in the right columns."""
    if not names:
        places = ("base", *(f"floor{k}" for k in range(1, floors + 1)))
        names = [f"{p}_{a}_acceleration_m_s2" for p in places for a in "xy"]
        names += [f"isolator_{a}_displacement_m" for a in "xy"]
        names += ["floor1_rotation_acceleration_rad_s2"] * rotation
    wave = np.sin(np.arange(N))
    ground = tuple(Record(wave, 0.02, name) for name in ("x", "y"))
    return BuildingRecord("quake", ground, dict.fromkeys(names, wave))


@pytest.fixture
def isolated():
    structure = plan_building(
        [2e5, 3e5], [2e8, 1.5e8], [1.2e8, 1e8], base_mass=2.5e5, plan=(20.0, 12.0),
        eccentricity=(1.0, 0.5),
    )  # fmt: skip
    return structure.on(iso.law("kelvin_voigt", {"k": 1e7, "c": 1e6}), biaxial=True)


def test_dofs_by_direction_and_level(isolated):
    names = isolated.structure.names
    for axis in ("x", "y", "rotation"):
        results = [names[dof] for dof in dofs_by_level(isolated.structure, axis)]
        assert results == [f"{level}_{axis}" for level in ("base", "floor1", "floor2")]


def test_causes_are_asked_in_each_direction_and_in_both(isolated):
    model = building_model(isolated, [record()])
    listed = {(one.name, one.place, one.form) for one in candidates(model, [record()])}
    for storey in ("storey1", "storey2"):
        assert ("storey_stiffness_loss", storey, "") in listed
        assert ("storey_stiffness_gain", storey, "") in listed
        for axis in "xy":
            for form in ("", "one_side"):
                assert ("storey_stiffness_loss", f"{storey}_{axis}", form) in listed
    assert {form for name, _, form in listed if name == "base_mass_error"} == {"", "eccentric"}
    assert ("sensor_bias", "ground_y_acceleration_m_s2", "constant") in listed
    # nothing of a rotation is asked of a record that does not show it
    flat = record(rotation=False)
    forms = {one.form for one in candidates(building_model(isolated, [flat]), [flat])}
    assert not forms & {"one_side", "eccentric"}


def changed(isolated, name, place, form, values):
    model = building_model(isolated, [record()])
    cause = next(
        one for one in candidates(model, [record()])
        if (one.name, one.place, one.form) == (name, place, form)
    )  # fmt: skip
    return with_causes(model, ((cause, values),)).structure


def test_a_storey_loses_the_stiffness_of_its_frames(isolated):
    weaker = (
        plan_building(
            [2e5, 3e5], [2e8, 1.5e8], [1.2e8, y], base_mass=2.5e5, plan=(20.0, 12.0),
            eccentricity=(1.0, 0.5),
        )
        for y in (0.9e8, 1e8)
    )  # fmt: skip
    expected = next(weaker).stiffness
    result = changed(isolated, "storey_stiffness_loss", "storey2_y", "", (0.1,)).stiffness
    np.testing.assert_allclose(result, expected, atol=1e-9 * expected.max())
    both = changed(isolated, "storey_stiffness_loss", "storey2", "", (0.1,))
    own = shear_stiffness(isolated.structure)
    np.testing.assert_allclose(shear_stiffness(both) / own, [1, 1, 1, 0.9, 0.9, 0.9], rtol=1e-9)


def test_frames_on_both_sides_together_are_the_storey(isolated):
    lost = isolated.structure.stiffness
    frames = np.zeros_like(lost)
    for position in (-6.0, 6.0):
        values = (0.05, position)
        frames += (
            lost
            - changed(isolated, "storey_stiffness_loss", "storey1_x", "one_side", values).stiffness
        )
    whole = lost - changed(isolated, "storey_stiffness_loss", "storey1_x", "", (0.1,)).stiffness
    np.testing.assert_allclose(frames, whole, atol=1e-9 * whole.max())


def test_an_eccentric_mass_is_that_of_two_bodies(isolated):
    mass = isolated.structure.mass[:3, :3]
    added, at = 5e4, np.array([6.0, -4.0])
    row = np.array([[1, 0, -at[1]], [0, 1, at[0]]])
    expected = mass + added * row.T @ row
    centre = np.array([1.0, 0.5])
    shift = added * (at - centre) / (2.5e5 + added)
    inertia = 2.5e5 * (20**2 + 12**2) / 12
    distance = (at - centre) @ (at - centre)
    turning = 2.5e5 * added / (2.5e5 + added) * distance / inertia
    values = (added / 2.5e5, *shift, turning)
    result = changed(isolated, "base_mass_error", "", "eccentric", values).mass
    np.testing.assert_allclose(result[:3, :3], expected, rtol=1e-9, atol=1e-3)
    np.testing.assert_array_equal(result[3:], isolated.structure.mass[3:])


def uniaxial(isolated):
    """Eight isolators, along x and along y under each corner, and one damper of another kind."""
    share, structure = isolated.elements[0].device, isolated.structure
    apart = structure.with_element(share, structure.isolator_rows[0, 0], name="isolator0")
    for k, row in enumerate(structure.isolator_rows.reshape(-1, structure.n_dofs)[1:], start=1):
        apart = apart.with_element(share, row, name=f"isolator{k}")
    return apart.with_element(iso.law("linear", {"k": 1.0}), "base_x", name="cable")


@pytest.mark.parametrize("form", [lambda isolated: isolated, uniaxial])
def test_effects_go_around_all_isolators_whose_forces_are_one(isolated, form):
    model = building_model(form(isolated), [record()])
    assert len(model.isolators) == 8
    assert total_force_scale(model) == pytest.approx(1.0)
    friction = next(
        one for one in candidates(model, [record()]) if one.name == "coulomb_friction"
    )  # fmt: skip
    # the level is reported of all isolators together
    assert friction.parameters[0].factor == pytest.approx(1.0)
    elements = with_causes(model, ((friction, (1e4, 0.05)),)).assembled.elements
    assert ["friction" in element.device.name for element in elements[:8]] == [True] * 8
    assert not any("friction" in element.device.name for element in elements[8:])


def test_what_does_not_fit_is_refused(isolated):
    device = isolated.elements[0].device
    line = iso.shear_building([2e5] * 2, [2e8] * 2, base_mass=2e5).on(device)
    with pytest.raises(InputError, match=r"two directions .*; shear building moves along x"):
        building_model(line, [record()])
    wave = np.sin(np.arange(N))
    names = ("base_acceleration_m_s2", "floor1_acceleration_m_s2", "isolator_displacement_m")
    alone = BuildingRecord("quake", (Record(wave, 0.02, "x"),), dict.fromkeys(names, wave))
    with pytest.raises(InputError, match=r"one direction .*; plan building moves along x, y"):
        building_model(isolated, [alone])
    with pytest.raises(InputError, match="floor3; plan building has 2 floors"):
        building_model(isolated, [record(floors=3)])
    first, *_ = isolated.elements
    with pytest.raises(InputError, match="does not act along y"):
        building_model(isolated.structure.with_element(device, first.direction), [record()])
    with pytest.raises(InputError, match=r"'base_y_acceleration_m_s2' is missing"):
        record("base_x_acceleration_m_s2", "isolator_x_displacement_m")


def test_the_command_ends_with_one_line(tmp_path, capsys):
    from isolation_sim.cli import main

    columns = {"time_s": 0.02 * np.arange(N)}
    columns |= {f"ground_{axis}_acceleration_m_s2": np.sin(np.arange(N)) for axis in "xy"}
    columns |= record().response
    rows = "\n".join(",".join(map(str, row)) for row in np.column_stack(list(columns.values())))
    (tmp_path / "quake.csv").write_text(",".join(columns) + "\n" + rows)
    (tmp_path / "line.toml").write_text('[[controller]]\nname = "passive_off"\n')
    arguments = ["diagnose", str(tmp_path / "quake.csv"), "--out", str(tmp_path / "out")]
    with pytest.raises(SystemExit) as stop:
        main([*arguments, "--scenario", str(tmp_path / "line.toml"), "--quiet"])
    assert stop.value.code == 2
    text = capsys.readouterr().err.strip()
    assert "two directions" in text and "Traceback" not in text


def test_runs_of_every_group_come_first():
    t = np.linspace(0, 1, 9)
    size = {"a": ("x", 3.0), "b": ("x", 2.5), "c": ("y", 1.5), "d": ("y", 1.2)}
    traces = [
        Trace(name, False, t, t, "x, mm", "F, N", t, t * factor, t, group)
        for name, (group, factor) in size.items()
    ]
    assert [one.name for one in groups_in_turn(traces)] == ["a", "c", "b", "d"]
