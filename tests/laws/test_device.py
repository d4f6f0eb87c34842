"""Devices: scale, checks, linearisation."""

import numpy as np
import pytest

from isolation_sim.errors import InputError
from isolation_sim.laws import CurrentDependence, Device, Law, Quantity, Scaled, law
from isolation_sim.laws.strain_stiffening import LAW


def test_scaling_follows_similarity(device, draw):
    x, v, states, current = draw(device, 50)
    big = device.scaled(length=10, force=300)
    np.testing.assert_allclose(
        big.force(10 * x, 10 * v, states, current), 300 * device.force(x, v, states, current)
    )
    for one, two in zip(
        big.rates(10 * x, 10 * v, states, current),
        device.rates(x, v, states, current),
        strict=True,
    ):
        np.testing.assert_allclose(one, two)
    if device.stores_energy:
        inner = device.stored_energy(x, states, current)
        np.testing.assert_allclose(big.stored_energy(10 * x, states, current), 3000 * inner)
    assert big.deformation_scale == 10 * device.deformation_scale
    inside = min(1.0, device.current_range[1])
    assert big.linearised(inside) == pytest.approx(30 * device.linearised(inside), rel=1e-13)


def test_scales_multiply():
    device = law("strain_stiffening").scaled(length=2).scaled(length=5, force=3)
    assert (device.length, device.force_scale) == (10.0, 3.0)
    assert Scaled(law("strain_stiffening"), length=10, force=3) == device


def test_at_rest_nothing_moves(device):
    states = device.initial_states()
    assert device.force(0.0, 0.0, states, 1.0) == 0.0
    assert device.rates(0.0, 0.0, states, 1.0) == (0.0,) * len(states)
    if device.stores_energy:
        assert device.stored_energy(0.0, states, 1.0) == 0.0


def test_kelvin_voigt_is_its_own_linearisation():
    device = law("kelvin_voigt", {"k": 2e4, "c": 300.0})
    assert device.linearised(0.0, 1.7) == pytest.approx(2e4 + 2j * np.pi * 1.7 * 300, rel=1e-14)


@pytest.mark.parametrize("current", [0.0, 1.5, 3.0])
@pytest.mark.parametrize("frequency", [0.1, 1.0, 10.0])
def test_strain_stiffening_linearises_to_the_standard_solid(current, frequency):
    # at rest the cubic branch has no stiffness; ERRATA, 000: closed form of the upper branch
    device = law("strain_stiffening")
    c0, k0, _, k1, _ = device.parameters_at(current)
    dashpot = 2j * np.pi * frequency * c0
    expected = k1 * (k0 + dashpot) / (k0 + k1 + dashpot)
    assert device.linearised(current, frequency) == pytest.approx(expected, rel=1e-13)


def test_linearisation_matches_the_law_elsewhere():
    # hybrid: alpha beta + i omega gamma / v_s
    device = law("hybrid")
    alpha, beta, gamma, _, _, v_s = device.parameters_at(2.0)
    expected = alpha * beta + 2j * np.pi * 0.5 * gamma / v_s
    assert device.linearised(2.0, 0.5) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("current", [0.0, 1.5])
def test_a_force_with_two_slopes_has_the_stiffness_of_its_first_harmonic(current):
    """Tao et al.: k (1 - d) in tension and k in compression, beside damper and hysteresis."""
    device = law("improved_bouc_wen")
    alpha, _, _, theta, k, c, d, *_ = device.parameters_at(current)
    phase = 2 * np.pi * (np.arange(1000) + 0.5) / 1000
    x = 1e-9 * np.sin(phase)
    springs = np.where(x >= 0, 1 - d, 1) * k * x
    storage = 2 * np.mean(springs * np.sin(phase)) / 1e-9 + theta * alpha
    assert device.linearised(current, 0.7) == pytest.approx(
        storage + 2j * np.pi * 0.7 * c, rel=1e-6
    )


def test_a_law_with_a_corner_at_rest_is_not_linearised():
    corner = Law(
        "corner", "Corner", (Quantity("k", "N", "force"),), lambda x, v, s, p: p[0] * x**0.5
    )
    device = Device(corner, CurrentDependence.constant({"k": 1.0}))
    with pytest.raises(InputError, match="linearised"):
        device.linearised(0.0)


def test_checked_current():
    device = law("strain_stiffening")
    assert device.checked_current(3.0) == 3.0
    currents = np.array([0.0, 5.203125])
    assert device.checked_current(currents) is currents
    with pytest.raises(InputError) as refused:
        device.checked_current(5.5)
    assert str(refused.value) == (
        "current 5.5 A is outside 0 to 5.203 A, where strain_stiffening is meaningful"
    )
    for bad in (-0.1, np.nan, np.array([1.0, np.inf])):
        with pytest.raises(InputError, match="outside"):
            device.checked_current(bad)
    with pytest.raises(InputError, match="outside"):
        device.linearised(6.0)
    with pytest.raises(InputError, match="frequency_hz"):
        device.linearised(1.0, 0.0)


def test_with_parameters():
    device = law("strain_stiffening").with_parameters(k1=5e4, alpha=(1e8, 1e7))
    assert device.parameters_at(2.0)[3:] == (5e4, 1.2e8)
    assert device.source.endswith("changed: k1, alpha")
    with pytest.raises(InputError, match="did you mean 'alpha'"):
        device.with_parameters(alpa=1.0)


def test_energy_of_a_law_without_it():
    damper = Law("damper", "Damper", (Quantity("c", "N s/m", "c"),), lambda x, v, s, p: p[0] * v)
    device = Device(damper, CurrentDependence.constant({"c": 1.0}))
    assert not device.stores_energy
    with pytest.raises(InputError, match="damper has no stored-energy"):
        device.stored_energy(1.0, (), 0.0)


NUMBERS = {"c0": 1e4, "k0": 1e4, "c1": 1e3, "k1": 1e4, "alpha": 1e8}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"length": 0.0}, "length"),
        ({"length": np.nan}, "length"),
        ({"length": "long"}, "length"),
        ({"force_scale": -1.0}, "force_scale"),
        ({"force_scale": np.inf}, "finite"),
        ({"tested_deformation": 0.0}, "tested_deformation"),
        ({"tested_current": np.nan}, "tested_current: given nan; expected: 0 A or more"),
        ({"tested_current": -1.0}, "tested_current: given -1.0; expected: 0 A or more"),
        ({"tested_current": "high"}, "tested_current"),
        ({"current_range": (3.0, 0.0)}, "current_range"),
        ({"current_range": (0.0, np.nan)}, "current_range"),
        ({"current_range": 3.0}, "current_range"),
        ({"current": CurrentDependence.constant({"c0": 1.0})}, "'k0' is missing"),
        ({"current": CurrentDependence.constant(NUMBERS | {"k2": 1.0})}, "unknown parameter 'k2'"),
        ({"current": CurrentDependence.constant(NUMBERS | {"k1": -1.0})}, "'k1': given -1 N/m;"),
        ({"current": CurrentDependence.constant(NUMBERS | {"c1": 0.0})}, "0 to inf, not 0"),
        (
            {
                "current": CurrentDependence.polynomial(NUMBERS | {"k1": (1.0, -1.0)}),
                "current_range": (0.0, 2.0),
            },
            "expected: 0 to inf",
        ),
    ],
)
def test_refuses(changes, message):
    expected = {"law": LAW, "current": CurrentDependence.constant(NUMBERS)}
    assert Device(**expected).parameters_at(0.0) == tuple(NUMBERS.values())
    with pytest.raises(InputError, match=message) as refused:
        Device(**(expected | changes))
    assert "\n" not in str(refused.value)


def test_import_is_light():
    import subprocess
    import sys

    code = (
        "import sys, isolation_sim.laws, isolation_sim.structures;"
        "print([m for m in ('casadi', 'scipy', 'numba') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
