"""The passive switching rule: what a change of the field does, by the law itself."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from isolation_sim.errors import InputError
from isolation_sim.laws import CurrentDependence, Device, instantaneous, law, passive
from isolation_sim.laws.fingerprint import fingerprint
from isolation_sim.laws.hybrid import condition
from isolation_sim.laws.registry import LAWS

from .test_three_ways import casadi_function, numba_function, outputs

K, C = (2.0e4, 3.0e3), (800.0, 50.0)
SOLID = {"c0": C, "k0": K, "k1": (5.0e4, 9.0e3, -500.0)}
NUMBERS = {
    "linear": {"k": K},
    "kelvin_voigt": {"k": K, "c": C},
    "maxwell": {"k": K, "c": C},
    "standard_solid": SOLID,
    "four_parameter": SOLID | {"alpha": (3e8, 5e7)},
    "strain_stiffening": SOLID | {"alpha": (3e8, -5e7), "c1": C},
    "strain_stiffening_power": SOLID | {"alpha": (300.0, 40.0), "c1": C, "p": 2.5},
    "dahl": {"k": K, "c": 300.0, "sigma": (4e4, 1e4), "F_c": (150.0, 20.0)},
    "lugre": {"k0": K, "c0": C, "alpha": 800.0, "beta": (5e4, 1e4), "epsilon": 4.0, "F0": 7.0},
    "linearised_bouc_wen": {"C": C, "k1": K, "k2": (90.0, 9.0), "C_e": 300.0, "k_e": (4.0, 1.0)},
    "spring_pot": {"k": K, "a": 0.1},
}


def plain_device(name):
    numbers = CurrentDependence.polynomial(NUMBERS[name], LAWS[name].parameter_names)
    return Device(LAWS[name], numbers, (0.0, 3.0), 8e-3)


@pytest.fixture(params=NUMBERS)
def plain(request):
    return plain_device(request.param)


@pytest.fixture
def device(plain):
    return passive(plain)


def test_every_law_that_declares_springs_is_covered():
    assert set(NUMBERS) == {name for name, law in LAWS.items() if law.springs}


def at_rest_in_its_springs(device, plain, x, states, field):
    """States of the passive law whose springs are stretched as the plain law's."""
    elastic = []
    for spring in plain.law.springs:
        if "x" in spring.extensions:
            names = plain.law.state_names
            less = states[names.index(spring.less)] if spring.less else 0.0
            elastic.append(x / plain.length - less)
    return (*states, *elastic, field)


def test_at_a_constant_current_it_is_the_law(device, plain, draw):
    x, v, states, current = draw(plain, 100)
    own = at_rest_in_its_springs(device, plain, x, states, current)
    n = len(plain.law.states)

    def same(result, exact):
        np.testing.assert_allclose(result, exact, rtol=1e-9, atol=1e-12 * np.abs(exact).max())

    same(device.force(x, v, own, current), plain.force(x, v, states, current))
    same(device.stored_energy(x, own, current), plain.stored_energy(x, states, current))
    rates, exact = device.rates(x, v, own, current), plain.rates(x, v, states, current)
    for result, expected in zip(rates[:n], exact, strict=True):
        same(result, expected)
    assert not np.any(rates[-1])
    elastic = iter(rates[n:-1])
    for spring in plain.law.springs:
        if "x" in spring.extensions:
            less = exact[plain.law.state_names.index(spring.less)] if spring.less else 0.0
            same(next(elastic), v - less)


def test_no_change_of_current_adds_energy(device):
    """Whatever the state, the field's work is negative and so is what the device gives back."""
    import casadi

    from isolation_sim.laws.emit import symbols

    names = ["x", "v", *device.law.state_names, "current"]
    x, v, *states, current = inputs = symbols(names)
    states, parameters = tuple(states), device.parameters_at(current)
    energy = device.stored_energy(x, states, current)
    growth = casadi.gradient(energy, x) * v
    for state, rate in zip(states, device.rates(x, v, states, current), strict=True):
        growth += casadi.gradient(energy, state) * rate
    field = device.law.field_power(x, states, parameters)
    loss = device.force(x, v, states, current) * v - growth + field
    powers = casadi.Function("powers", inputs, [field, loss, growth])
    n = len(states) - 1
    worked = []

    @settings(max_examples=150, deadline=None, derandomize=True, database=None)
    @given(
        st.lists(st.floats(-0.01, 0.01), min_size=1 + n, max_size=1 + n),
        st.floats(-1, 1), st.floats(0, 3), st.floats(0, 3),
    )  # fmt: skip
    def holds(extensions, v, j, i):
        x, *own = extensions
        if device.law.plain.name == "lugre":
            own[0] *= 100  # the bristles' state stays within -1 to 1
        work, lost, gain = (float(a) for a in powers(x, v, *own, j, i))
        # a spring's energy is a difference of sums of up to 1 J, whose field moves at up to 600 /s
        size = 1e-9 * (abs(work) + abs(lost) + abs(gain)) + 1e-12
        assert work <= size
        assert lost >= -size
        worked.append(work)

    holds()
    assert min(worked) < 0


def follow(device, current, stretch, end):
    """Force and states while a device is stretched at its own velocity."""

    def rate(t, y):
        x, v = stretch(t)
        return device.rates(x, v, y, current(t))

    start = [0.0] * len(device.law.states)
    t = np.linspace(0, end, 401)
    solution = solve_ivp(rate, (0, end), start, t_eval=t, rtol=1e-10, atol=1e-13, max_step=2e-3)
    x, v = np.array([stretch(s) for s in t]).T
    force = device.force(x, v, tuple(solution.y), np.array([current(s) for s in t]))
    return t, x, np.broadcast_to(force, t.shape), solution.y


@pytest.mark.parametrize("power", [1, 3])
def test_stiffening_acts_on_further_deformation_and_softening_in_proportion(power):
    """A spring stretched to 10 mm, stiffened, softened below and let back, in closed form."""
    if power == 1:
        spring = Device(LAWS["linear"], CurrentDependence.polynomial({"k": K}), (0.0, 3.0))
        stiffness = lambda i: K[0] + K[1] * i  # noqa: E731
    else:
        numbers = {"c0": 1e9, "k0": 0.0, "k1": 0.0, "alpha": (3e8, 5e7)}
        spring = Device(LAWS["four_parameter"], CurrentDependence.polynomial(numbers), (0.0, 3.0))
        stiffness = lambda i: 3e8 + 5e7 * i  # noqa: E731
    device = passive(spring, field_lag=2e-3)

    def current(t):
        return 0.0 if t < 1.2 else 3.0 if t < 2.2 else 1.0

    def stretch(t):  # to 10 mm in 1 s, hold, from 1.5 s to 2 s on to 15 mm, hold, back after 2.5 s
        if t < 1:
            return 0.01 * t, 0.01
        if t < 1.5:
            return 0.01, 0.0
        if t < 2:
            return 0.01 + 0.01 * (t - 1.5), 0.01
        return (0.015, 0.0) if t < 2.5 else (0.015 - 0.01 * (t - 2.5), -0.01)

    t, x, force, _ = follow(device, current, stretch, 3.0)
    before, after = (t > 1.05) & (t < 1.19), (t > 1.25) & (t < 1.5)
    held = stiffness(0.0) * 0.01**power
    np.testing.assert_allclose(force[before], held, rtol=1e-5)
    np.testing.assert_allclose(force[after], held, rtol=1e-5)
    # stiffened, the spring is one of the new stiffness that began to stretch elsewhere
    elastic = 0.01 * (stiffness(0.0) / stiffness(3.0)) ** (1 / power)
    further = (t > 1.55) & (t < 2.15)
    np.testing.assert_allclose(
        force[further], stiffness(3.0) * (x[further] - 0.01 + elastic) ** power, rtol=1e-4
    )
    peak = stiffness(3.0) * (0.005 + elastic) ** power
    soft = (t > 2.25) & (t < 2.5)
    np.testing.assert_allclose(force[soft], peak * stiffness(1.0) / stiffness(3.0), rtol=1e-4)
    back = t > 2.55
    np.testing.assert_allclose(
        force[back], stiffness(1.0) * (x[back] - 0.01 + elastic) ** power, rtol=1e-3
    )


def test_numpy_casadi_and_numba_agree(device, draw):
    x, v, states, current = draw(device, 100)
    states = (*states[:-1], np.random.default_rng(1).uniform(0, 3, 100))
    arguments = np.array([x, v, *states, current])
    by_numpy = np.array(outputs(device, x, v, states, current))
    symbolic, written = casadi_function(device), numba_function(device)
    by_casadi = np.array(symbolic.map(100)(*(row[np.newaxis] for row in arguments)))[:, 0]
    by_numba = np.array([written(*column) for column in arguments.T]).T
    size = np.max(np.abs(by_numpy), axis=1, keepdims=True)
    assert np.all(np.isfinite(by_numpy))
    assert np.max(np.abs(by_casadi - by_numpy) / size) < 1e-12
    assert np.max(np.abs(by_numba - by_numpy) / size) < 1e-12


def test_linearised_as_the_plain_law(device, plain):
    assert device.linearised(1.5, 0.7) == pytest.approx(plain.linearised(1.5, 0.7), rel=1e-9)


def test_there_and_back(device, plain):
    back = instantaneous(device)
    assert back.law is plain.law and back.name == plain.name
    currents = np.linspace(0, 3, 7)
    np.testing.assert_array_equal(back.parameters_at(currents), plain.parameters_at(currents))
    assert instantaneous(plain) is plain and passive(device) is device


def test_same_law_for_other_numbers(plain):
    """So that nominal model and truth share compiled code, found again in a later process."""
    one, two = passive(plain), passive(plain.scaled(length=3.0, force=2.0), field_lag=0.01)
    assert one.law is two.law
    assert fingerprint(one.law) is not None and fingerprint(one.law) != fingerprint(plain.law)


def test_without_an_effect_of_the_current_nothing_changes():
    base = law("strain_stiffening", "base_model")
    assert passive(base) is base


REFUSED = {
    "bouc_wen": (
        Device(
            LAWS["bouc_wen"],
            CurrentDependence.polynomial(
                dict.fromkeys(LAWS["bouc_wen"].parameter_names, 1.0) | {"k": K}
            ),
        ),
        "bouc_wen declares no springs.*strain_stiffening",
    ),
    "hybrid": (law("hybrid"), "hybrid declares no springs"),
    "table": (condition(8, 1), "hybrid declares no springs"),
    "tabulated": (
        Device(LAWS["linear"], CurrentDependence.table([0, 1, 3], {"k": [1, 2, 3]}), (0, 3)),
        "tabulated",
    ),
    "power": (
        plain_device("strain_stiffening_power").with_parameters(p=(2.0, 0.1)),
        "changes p, which shapes the stored energy",
    ),
    "spring that vanishes": (
        Device(LAWS["linear"], CurrentDependence.polynomial({"k": (0.0, 1.0)}), (0.0, 3.0)),
        "k: given 0 at 0 A",
    ),
    "range": (
        Device(LAWS["linear"], CurrentDependence.polynomial({"k": K}), (1.0, 3.0)),
        "starts at 0 A, outside its range of 1 to 3 A",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_does_not_allow_the_rule_is_refused_with_the_reason(case):
    inputs, reason = REFUSED[case]
    with pytest.raises(InputError, match=reason):
        passive(inputs)


def test_field_lag_must_be_positive():
    with pytest.raises(InputError, match="field_lag: given 0 s; expected: above 0"):
        passive(law("strain_stiffening"), field_lag=0)
