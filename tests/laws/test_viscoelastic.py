"""Laws of springs and dashpots, in closed form."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import gamma

from isolation_sim.errors import InputError
from isolation_sim.laws import law
from isolation_sim.laws.spring_pot import BAND_HZ, WORST_ERROR
from isolation_sim.laws.strain_stiffening_power import base_model, power


@pytest.mark.parametrize("frequency", [0.01, 1.0, 30.0])
def test_maxwell(frequency):
    k, c = 3e4, 700.0
    dashpot = 2j * np.pi * frequency * c
    linear = law("maxwell", {"k": k, "c": c}).linearised(0.0, frequency)
    assert linear == pytest.approx(k * dashpot / (k + dashpot), rel=1e-13)


@pytest.mark.parametrize("speed", [0.003, 0.2])
def test_viscous_damper_reaches_the_force_of_its_dashpot(speed):
    """At a constant velocity V and alpha = 1/2 the force is c V^(1/2) tanh(k V^(1/2) t / c)."""
    k, c = 2e7, 3e5
    device = law("viscous_damper", {"k": k, "c": c, "alpha": 0.5})
    t = np.linspace(0.0, 2.0 * c / k / np.sqrt(speed), 30)
    y = solve_ivp(lambda t, y: device.rates(0.0, -speed, tuple(y), 0.0), (0, t[-1]), (0.0,),
                  t_eval=t, rtol=1e-9, atol=1e-12).y  # fmt: skip
    most = c * np.sqrt(speed)
    expected = -most * np.tanh(k * np.sqrt(speed) * t / c)
    np.testing.assert_allclose(device.force(0.0, -speed, tuple(y), 0.0), expected, atol=1e-6 * most)


@pytest.mark.parametrize("alpha", [0.3, 0.5, 1.0, 2.0])
def test_viscous_damper_on_a_stiff_brace_dissipates_as_in_textbooks(alpha):
    """Per cycle lambda c omega^alpha u^(1 + alpha), as in ASCE 7, chapter 18."""
    c, omega, amplitude = 1e5, 2 * np.pi, 0.05
    largest = c * (amplitude * omega) ** alpha
    device = law("viscous_damper", {"k": 1e3 * largest / amplitude, "c": c, "alpha": alpha})

    def moving(t, z):
        v = amplitude * omega * np.cos(omega * t)
        return *device.rates(0.0, v, (z[0],), 0.0), v * device.force(0.0, v, (z[0],), 0.0)

    out = solve_ivp(moving, (0, 2), (0.0, 0.0), t_eval=(1, 2), method="LSODA", rtol=1e-7,
                    atol=(1e-9 * amplitude, 1e-7 * largest * amplitude)).y  # fmt: skip
    factor = 4 * 2**alpha * gamma(1 + alpha / 2) ** 2 / gamma(2 + alpha)
    expected = factor * c * omega**alpha * amplitude ** (1 + alpha)
    assert out[1, 1] - out[1, 0] == pytest.approx(expected, rel=5e-3)


def test_viscous_damper_of_exponent_one_is_maxwells():
    one = law("viscous_damper", {"k": 3e4, "c": 700.0, "alpha": 1.0})
    assert one.linearised(0.0, 2.0) == pytest.approx(
        law("maxwell", {"k": 3e4, "c": 700.0}).linearised(0.0, 2.0), rel=1e-12
    )


@pytest.mark.parametrize("frequency", [0.01, 1.0, 30.0])
def test_four_parameter_linearises_to_the_standard_solid(frequency):
    # the cubic spring has no stiffness at rest
    one, two = law("four_parameter"), law("standard_solid")
    assert one.linearised(0.0, frequency) == pytest.approx(two.linearised(0.0, frequency))


def test_spring_pot_in_its_band():
    worst = 0.0
    for a in (0.01, 0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.95, 0.99):
        device = law("spring_pot", {"k": 2e4, "a": a})
        for f in np.geomspace(*BAND_HZ, 60):
            worst = max(worst, abs(device.linearised(0.0, float(f)) / (2e4 * (1j * f) ** a) - 1))
    assert 0.9 * WORST_ERROR < worst <= WORST_ERROR


@pytest.mark.parametrize("a", [0.1, 0.3, 0.6])
def test_spring_pot_relaxes_with_a_power_of_time(a):
    # step of 1 m: k (2 pi t)^-a / Gamma(1 - a); every branch decays on its own
    device = law("spring_pot", {"k": 2e4, "a": a})
    n = len(device.law.states)
    decays = -np.diag([device.rates(0.0, 0.0, tuple(row), 0.0) for row in np.eye(n)])
    for t in (0.01, 0.1, 1.0, 5.0):
        computed = device.force(1.0, 0.0, tuple(np.exp(-decays * t)), 0.0)
        assert computed == pytest.approx(2e4 * (2 * np.pi * t) ** -a / gamma(1 - a), rel=0.02)


def test_spring_pot_is_passive_at_every_frequency():
    for a in (0.01, 0.3, 0.7, 0.99):
        device = law("spring_pot", {"k": 1.0, "a": a})
        assert min(device.linearised(0.0, f).imag for f in (1e-4, 1e-2, 1.0, 1e2, 1e4)) > 0


@pytest.mark.parametrize(("n", "m"), [(3, 1), (5, 3), (7, 5), (4, 3), (2, 1), (1, 1)])
def test_powers_of_eq_7(n, m):
    """Both cases of Eq 7, with odd roots of negative numbers taken as such."""
    device = base_model(n, m)
    alpha = device.parameters_at(0.0)[4]

    def root(z, whole):
        return np.sign(z) ** whole * np.abs(z) ** (whole / m)

    for z in (-7.0, -1.0, -0.2, 0.3, 2.0):
        expected = alpha * (root(z, n) if n % 2 else abs(z) * root(z, n - m))
        assert device.force(0.0, 0.0, (0.0, 1e-3 * z), 0.0) == pytest.approx(expected, rel=1e-13)


def test_power_of_three_is_the_published_law(draw):
    for chosen in ("generalised", "base_model"):
        one, two = law("strain_stiffening", chosen), law("strain_stiffening_power", chosen)
        x, v, states, current = draw(one, 100)
        for call in ("force", "rates"):
            result, expected = (getattr(d, call)(x, v, states, current) for d in (two, one))
            np.testing.assert_allclose(result, expected, rtol=1e-12)
        result, expected = (d.stored_energy(x, states, current) for d in (two, one))
        np.testing.assert_allclose(result, expected, rtol=1e-12)


@pytest.mark.parametrize(("n", "m"), [(3, 2), (1, 3), (3, 0), (3.0, 1), (-3, 1)])
def test_powers_that_eq_7_refuses(n, m):
    with pytest.raises(InputError, match="Eq 7"):
        power(n, m)
