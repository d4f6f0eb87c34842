"""Shear buildings."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from isolation_sim.errors import InputError
from isolation_sim.structures import shear_building


def test_two_storeys_in_closed_form():
    building = shear_building([1.0, 1.0], [1.0, 1.0], base_mass=2.0, damping_ratio=0.0)
    expected = [[1, -1, 0], [-1, 2, -1], [0, -1, 1]]
    np.testing.assert_array_equal(building.stiffness, expected)
    np.testing.assert_array_equal(building.mass, np.diag([2.0, 1.0, 1.0]))
    golden = (1 + np.sqrt(5)) / 2
    frequencies, _ = building.fixed_base_modes()
    np.testing.assert_allclose(frequencies, [1 / golden, golden], rtol=1e-13)
    assert building.names == ("base", "floor1", "floor2")
    assert building.storeys == ("storey1", "storey2")


@settings(max_examples=30, deadline=None, derandomize=True, database=None)
@given(
    st.lists(st.tuples(st.floats(1e4, 1e6), st.floats(1e7, 1e9)), min_size=1, max_size=40),
    st.sampled_from(["rayleigh", "modal"]),
)
def test_any_number_of_storeys(floors, damping):
    masses, stiffnesses = zip(*floors, strict=True)
    building = shear_building(masses, stiffnesses, base_mass=1e5, damping=damping)
    rigid = np.ones(building.n_dofs)
    size = np.abs(building.stiffness).max()
    # moving as a whole is neither stiff nor damped
    assert np.abs(building.stiffness @ rigid).max() < 1e-12 * size
    assert np.abs(building.damping @ rigid).max() < 1e-9 * np.abs(building.damping).max()
    assert building.total_mass == pytest.approx(1e5 + sum(masses))
    frequencies, shapes = building.fixed_base_modes()
    modal = shapes.T @ building.damping @ shapes / (2 * frequencies)
    # the damping decouples the modes, with the ratio at the first one
    assert modal[0, 0] == pytest.approx(0.02, rel=1e-8)
    if damping == "modal":
        np.testing.assert_allclose(np.diag(modal), 0.02, rtol=1e-7)


def test_a_ratio_for_each_mode():
    ratios = [0.01, 0.03, 0.05]
    building = shear_building(
        [2e5] * 3, [3e8] * 3, base_mass=2e5, damping="modal", damping_ratio=ratios
    )
    frequencies, shapes = building.fixed_base_modes()
    modal = shapes.T @ building.damping @ shapes
    np.testing.assert_allclose(modal, np.diag(2 * np.array(ratios) * frequencies), atol=1e-10)


def test_rayleigh_modes():
    building = shear_building([2e5] * 5, [3e8] * 5, base_mass=2e5, rayleigh_modes=(2, 4))
    frequencies, shapes = building.fixed_base_modes()
    ratios = np.diag(shapes.T @ building.damping @ shapes) / (2 * frequencies)
    np.testing.assert_allclose(ratios[[1, 3]], 0.02, rtol=1e-12)


ACCEPTED = {"masses": [1.0, 2.0], "stiffnesses": [3.0, 4.0], "base_mass": 1.0}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"masses": [1.0, -2.0]}, r"masses\[1\]: given -2 kg"),
        ({"masses": [1.0, np.nan]}, r"masses\[1\]: given nan"),
        ({"masses": [1.0, "heavy"]}, r"masses\[1\]: given .heavy.; expected: a number"),
        ({"masses": []}, "masses has shape"),
        ({"stiffnesses": [0.0, 4.0]}, r"stiffnesses\[0\]: given 0 N/m"),
        ({"stiffnesses": [3.0]}, "2 masses, 1 stiffnesses"),
        ({"base_mass": 0.0}, "base_mass"),
        ({"base_mass": [1.0, 2.0]}, "base_mass: given .*; expected: a number"),
        ({"damping": "reyleigh"}, "did you mean 'rayleigh'"),
        ({"damping_ratio": -0.1}, "damping_ratio"),
        ({"damping_ratio": [0.02, 0.02]}, "modal"),
        ({"damping_ratio": "low"}, "damping_ratio"),
        ({"rayleigh_modes": (1, 3)}, "two different modes, 1 to 2"),
        ({"rayleigh_modes": (1, 1)}, "two different modes"),
        ({"rayleigh_modes": 1}, "rayleigh_modes: given 1; expected: a list"),
        ({"heights": [3.0]}, "heights has 1 numbers; expected: 2"),
    ],
)
def test_refuses(changes, message):
    assert shear_building(**ACCEPTED).n_dofs == 3
    with pytest.raises(InputError, match=message) as refused:
        shear_building(**(ACCEPTED | changes))
    assert "\n" not in str(refused.value)
