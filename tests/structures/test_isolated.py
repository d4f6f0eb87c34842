"""Elements on structures."""

import numpy as np
import pytest

from isolation_sim.errors import InputError
from isolation_sim.laws import law
from isolation_sim.laws.strain_stiffening import LAW
from isolation_sim.structures import (
    Element,
    IsolatedStructure,
    reference_building,
    reference_isolators,
    shear_building,
)

SPRING = law("linear", {"k": 2e6})


def test_isolators_sit_between_ground_and_base():
    isolated = reference_building().on(law("strain_stiffening").scaled(length=10), count=40)
    (element,) = isolated.elements
    assert element.name == "isolator" and element.channel == 0
    assert element.device.force_scale == 40.0 and element.device.length == 10.0
    np.testing.assert_array_equal(element.direction, [1, 0, 0, 0, 0, 0])
    assert isolated.current_range() == (0.0, 5.203125)
    assert reference_building().on(SPRING).n_channels == 0
    (one,) = reference_building().on(SPRING, count=np.float64(0.5)).elements
    assert one.device.force_scale == 0.5


def test_further_elements():
    isolated = (
        reference_building()
        .on(reference_isolators())
        .with_element(SPRING, "storey3", name="brace")
        .with_element(SPRING, "floor5")
        .with_element(law("hybrid"), [0, 0, 0, 0, -1, 1], channel=1)
    )
    assert isolated.element_names == ("isolator", "brace", "linear_3", "hybrid_4")
    assert isolated.element_rows.shape == (4, 6) and isolated.n_channels == 2
    np.testing.assert_array_equal(isolated.element("brace").direction, [0, 0, -1, 1, 0, 0])
    np.testing.assert_array_equal(isolated.element("linear_3").direction, [0, 0, 0, 0, 0, 1])
    assert isolated.current_range(1) == (0.0, 3.0)
    # the first structure is as it was
    assert reference_building().with_element(SPRING, "base").element_names == ("linear_1",)


def test_linearised_springs_are_assembled():
    building = reference_building()
    device = law("kelvin_voigt", {"k": 2e6, "c": 3e4})
    linear = building.on(device, count=2).with_element(SPRING, "storey1").linearised()
    stiffness = building.stiffness.copy()
    stiffness[0, 0] += 4e6
    stiffness[:2, :2] += 2e6 * np.array([[1, -1], [-1, 1]])
    damping = building.damping.copy()
    damping[0, 0] += 6e4
    np.testing.assert_allclose(linear.stiffness, stiffness, rtol=1e-14)
    np.testing.assert_allclose(linear.damping, damping, rtol=1e-14)


def test_a_current_for_each_channel():
    isolated = (
        reference_building()
        .on(reference_isolators())
        .with_element(reference_isolators(), "storey1", channel=1)
    )
    device = reference_isolators()
    change = isolated.linearised([1.0, 3.0]).stiffness - isolated.structure.stiffness
    assert change[1, 1] == pytest.approx(device.linearised(3.0).real, rel=1e-6)
    assert change.sum() == pytest.approx(device.linearised(1.0).real, rel=1e-6)
    with pytest.raises(InputError, match="currents"):
        isolated.linearised([1.0, 2.0, 3.0])
    with pytest.raises(InputError, match="outside"):
        isolated.linearised(6.0)


def test_base_shear_is_the_sum_of_inertia_forces():
    building = shear_building([1.0, 2.0], [10.0, 20.0], base_mass=4.0, damping_ratio=0.0)
    np.testing.assert_array_equal(building.base_shear_rows(), [[0, 1, 2]])
    np.testing.assert_array_equal(building.base_shear_rows(above_base=False), [[4, 1, 2]])
    # free vibration: the shear on the base is the first storey's spring force
    q = np.array([0.0, 0.3, -0.2])
    acceleration = np.linalg.solve(building.mass, -building.stiffness @ q)
    drift = building.drift_rows @ q
    assert -building.base_shear_rows() @ acceleration == pytest.approx([10 * drift[0]])


def test_fixed_base():
    building = reference_building()
    held = building.fixed_base()
    assert held.names == building.names[1:] and held.base == ()
    assert held.total_mass == 1.25e6 and held.storeys == building.storeys
    np.testing.assert_array_equal(held.drift_rows[0], [1, 0, 0, 0, 0])
    np.testing.assert_allclose(held.fixed_base_periods(), building.fixed_base_periods())
    with pytest.raises(InputError, match="no base"):
        held.on(SPRING)


def test_modes_are_mass_normalised():
    building = reference_building()
    frequencies, shapes = building.fixed_base_modes()
    assert np.all(shapes[0] == 0)
    np.testing.assert_allclose(shapes.T @ building.mass @ shapes, np.eye(5), atol=1e-12)
    np.testing.assert_allclose(
        shapes.T @ building.stiffness @ shapes, np.diag(frequencies**2), atol=1e-8
    )


def test_an_unheld_superstructure_has_no_fixed_base_modes():
    from isolation_sim.structures import from_matrices

    loose = from_matrices(np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)))
    with pytest.raises(InputError, match="a mode has no stiffness"):
        loose.fixed_base_modes()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda b: b.with_element(SPRING, "story3"), "did you mean 'storey3'"),
        (lambda b: b.with_element(SPRING, [1, 0]), "direction of an element has shape"),
        (lambda b: b.with_element(SPRING, np.zeros(6)), "is zero"),
        (lambda b: b.with_element(SPRING, [np.nan] * 6), "given nan"),
        (lambda b: b.with_element(law("hybrid"), "base"), "no channel"),
        (lambda b: b.with_element(SPRING, "base", channel=-1), "channel -1"),
        (lambda b: b.with_element(law("hybrid"), "base", channel=1), "without gaps"),
        (lambda b: b.with_element(SPRING, "base", channel="a"), "channel: given 'a'"),
        (lambda b: b.on(SPRING).with_element(SPRING, "base", name="isolator"), "share a name"),
        (lambda b: b.on(SPRING, count=0), "force"),
        (lambda b: b.on(SPRING).element("isolater"), "did you mean 'isolator'"),
        (lambda b: b.on(SPRING).current_range(), "channel 0 has no element"),
        (
            lambda b: IsolatedStructure(b, (Element(LAW, np.ones(6)),)),
            "a Device, such as law",
        ),
        (lambda b: Element(SPRING, "base"), "expected: an array of numbers"),
        (lambda b: b.on(LAW), "a Device, such as law"),
    ],
)
def test_refuses(make, message):
    with pytest.raises(InputError, match=message) as refused:
        make(reference_building())
    assert "\n" not in str(refused.value)


def test_channels_without_a_common_current():
    low, high = (
        law("strain_stiffening").__class__(
            law=LAW, current=law("strain_stiffening").current, current_range=r
        )
        for r in ((0.0, 1.0), (2.0, 3.0))
    )
    isolated = reference_building().on(low).with_element(high, "storey1", channel=0)
    with pytest.raises(InputError, match="no current in common"):
        isolated.current_range(0)
