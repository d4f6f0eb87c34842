"""Bouc-Wen, LuGre and Dahl: limits, invariants, energy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from isolation_sim.laws import law
from isolation_sim.laws.emit import symbols
from isolation_sim.laws.registry import LAWS
from studies.benchmarks.peers import load_opensees

BOUC_WEN = {
    "k": 2e4, "c": 300.0, "alpha": 4e4, "A": 1.0, "beta": 4e4, "gamma": 2e4, "n": 2.0, "F0": 5.0,
}  # fmt: skip
LUGRE = {"k0": 2e4, "c0": 300.0, "alpha": 800.0, "beta": 5e4, "epsilon": 40.0, "F0": 5.0}


def drive(device, amplitude, frequency=1.0, current=0.0, cycles=2, points=400):
    omega = 2 * np.pi * frequency
    t = np.linspace(0, cycles / frequency, cycles * points + 1)

    def rates(t, states):
        x, v = amplitude * np.sin(omega * t), amplitude * omega * np.cos(omega * t)
        return device.rates(x, v, states, current)

    solution = solve_ivp(rates, (0, t[-1]), device.initial_states(), t_eval=t, rtol=1e-9,
                         atol=1e-12, max_step=0.01 / frequency)  # fmt: skip
    x, v = amplitude * np.sin(omega * t), amplitude * omega * np.cos(omega * t)
    return t, x, v, solution.y


def test_bouc_wen_yields_at_its_closed_form():
    device = law("bouc_wen", BOUC_WEN)
    *_, (z,) = drive(device, 50e-3)
    limit = (BOUC_WEN["A"] / (BOUC_WEN["beta"] + BOUC_WEN["gamma"])) ** (1 / BOUC_WEN["n"])
    assert np.max(np.abs(z)) == pytest.approx(limit, rel=1e-3)
    assert np.max(np.abs(z)) <= limit * (1 + 1e-7)


def test_bouc_wen_does_not_know_the_rate():
    device = law("bouc_wen", BOUC_WEN)
    slow, fast = (drive(device, 10e-3, f)[3] for f in (0.1, 10.0))
    # the corner of |v| at reversal limits the integrator
    np.testing.assert_allclose(slow, fast, atol=3e-4 * np.max(np.abs(slow)))


def test_bouc_wen_linearises_to_its_springs_for_every_n():
    for n in (1.0, 1.3, 2.0, 3.5):
        linear = law("bouc_wen", BOUC_WEN | {"n": n}).linearised(0.0, 2.0)
        assert linear == pytest.approx(6e4 + 2j * np.pi * 2 * 300, rel=1e-12)


@pytest.mark.parametrize("current", [0.0, 0.7, 2.0, 2.5])
def test_improved_bouc_wen_energy_is_what_unloading_returns(current):
    """Unload from a yielded state at x < 0, with v so slow that the dashpot does not matter."""
    device = law("improved_bouc_wen").with_parameters(k=0.0, c=0.0)
    w0 = 0.97
    stored = device.stored_energy(0.0, (w0,), current)

    def rates(s, y):  # over the length of unloading
        force = device.force(-1e-3, -1.0, (y[0],), current)
        return device.rates(-1e-3, -1.0, (y[0],), current)[0], force

    def unloaded(s, y):
        return y[0]

    unloaded.terminal = True
    end = solve_ivp(rates, (0, 1), (w0, 0.0), events=unloaded, rtol=1e-10, atol=1e-14)
    assert end.y_events[0][0, 1] == pytest.approx(stored, rel=1e-7)


@pytest.mark.parametrize("current", [0.0, 0.5, 1.0, 1.7, 2.0, 2.5])
def test_improved_bouc_wen_dissipates_with_any_state_within_one(current):
    device = law("improved_bouc_wen").with_parameters(k=0.0, c=0.0)
    rng = np.random.default_rng(6)
    v, w = rng.uniform(-1, 1, (2, 2000))
    beta, gamma = device.parameters_at(current)[1:3]
    # slope of the stored energy: theta z / (alpha + (beta - gamma) z^2), by w
    step = 1e-6
    slope = (device.stored_energy(0.0, (w + step,), current)
             - device.stored_energy(0.0, (w - step,), current)) / (2 * step)  # fmt: skip
    power = device.force(0.0, v, (w,), current) * v
    lost = power - slope * device.rates(0.0, v, (w,), current)[0]
    size = np.max(np.abs(power))
    assert np.min(lost) >= -1e-6 * size
    unloading, share = v * w < 0, 2 * beta * w**2 / (beta + gamma + (beta - gamma) * w**2)
    np.testing.assert_allclose(lost[unloading], 0.0, atol=1e-6 * size)
    np.testing.assert_allclose(lost[~unloading], (share * power)[~unloading], atol=1e-6 * size)


def test_improved_bouc_wen_energy_where_beta_is_gamma():
    same = law("improved_bouc_wen", {"alpha": 6.0, "beta": 3.0, "gamma": 3.0, "theta": 8.0})
    near = same.with_parameters(gamma=3.0 * (1 + 1e-9))
    energy = same.stored_energy(0.0, (0.5,), 0.0)
    assert energy == pytest.approx(8.0 * 0.5**2 / (6.0) / 2)  # theta z^2 / (2 alpha)
    assert near.stored_energy(0.0, (0.5,), 0.0) == pytest.approx(energy, rel=1e-8)


def test_usual_energy_fails_for_table_4():
    # theta z^2 / (2 alpha) as an energy: unloading would dissipate at the rate of beta - gamma < 0
    _, beta, gamma, *_ = law("improved_bouc_wen").parameters_at(0.0)
    assert gamma > beta


def test_improved_bouc_wen_survives_a_switch_that_the_printed_state_does_not():
    device = law("improved_bouc_wen")

    def printed(current):
        alpha, beta, gamma, *_ = device.parameters_at(current)
        return lambda s, z: -alpha - beta * abs(z) * z + gamma * z**2  # v = -1

    # yielded at 0 A, switched to 0.5 A and unloaded over 20 mm: the printed z runs away
    alpha, beta, gamma, *_ = device.parameters_at(0.0)
    z0 = np.sqrt(alpha / (beta + gamma))

    def gone(s, z):
        return z[0] - 1e3

    gone.terminal = True
    assert solve_ivp(printed(0.5), (0, 0.02), [z0], events=gone, method="LSODA").t_events[0].size
    end = solve_ivp(
        lambda s, w: device.rates(0.0, -1.0, tuple(w), 0.5), (0, 0.02), [1.0], rtol=1e-8
    )
    assert np.max(np.abs(end.y)) <= 1.0 + 1e-9


def test_improved_bouc_wen_stiffness_on_both_sides():
    device = law("improved_bouc_wen")
    _, _, _, _, k, _, d, W, _ = device.parameters_at(1.0)
    assert device.force(1e-3, 0.0, (0.0,), 1.0) == pytest.approx((1 - d) * k * 1e-3)
    assert device.force(-1e-3, 0.0, (0.0,), 1.0) == pytest.approx(-k * 1e-3)
    # returning from beyond W: no damping; towards it: all of it
    c = device.parameters_at(1.0)[5]
    there, back = (
        device.force(1.01 * W, v, (0.0,), 1.0) - device.force(1.01 * W, 0.0, (0.0,), 1.0)
        for v in (1e-3, -1e-3)
    )
    assert (there, back) == (pytest.approx(1e-3 * c), pytest.approx(0.0, abs=1e-9))


def test_lugre_without_bristle_damping_is_dahl():
    lugre = law("lugre", LUGRE | {"epsilon": 0.0, "F0": 0.0})
    dahl = law("dahl", {
        "k": LUGRE["k0"], "c": LUGRE["c0"], "sigma": LUGRE["beta"],
        "F_c": LUGRE["beta"] / LUGRE["alpha"],
    })  # fmt: skip
    _, x, v, y = drive(lugre, 10e-3)
    _, _, _, z = drive(dahl, 10e-3)
    np.testing.assert_allclose(
        lugre.force(x, v, y, 0.0), dahl.force(x, v, z, 0.0), rtol=1e-6, atol=1e-4
    )


def test_lugre_state_stays_within_one():
    *_, (y,) = drive(law("lugre", LUGRE), 50e-3)
    assert 0.999 < np.max(np.abs(y)) <= 1 + 1e-7


def test_lugre_dissipates_with_any_state_within_one():
    device = law("lugre", LUGRE)
    rng = np.random.default_rng(5)
    v, y = rng.uniform(-1, 1, (2, 2000))
    _, _, alpha, beta, epsilon, _ = device.parameters_at(0.0)
    bristles = (beta / alpha * y + epsilon * (v - np.abs(v) * y)) * v
    growth = beta / alpha**2 * y * device.rates(0.0, v, (y,), 0.0)[0]
    assert np.min(bristles - growth) >= -1e-9


def test_dahl_slips_at_its_friction_force():
    device = law("dahl", {"k": 0.0, "c": 0.0, "sigma": 4e4, "F_c": 150.0})
    _, x, v, z = drive(device, 50e-3)
    assert np.max(device.force(x, v, z, 0.0)) == pytest.approx(150.0, rel=1e-4)


def test_derivatives_by_parameters_exist_at_rest_and_in_motion(device):
    """What fitting needs: no 0^(n - 1) or log 0 where the states start."""
    import casadi

    law_ = device.law
    motion = symbols(["x", "v", *law_.state_names])
    parameters = symbols([f"p{k}" for k in range(len(law_.parameters))])
    x, v, *states = motion
    outputs = casadi.vertcat(
        law_.force(x, v, tuple(states), tuple(parameters)),
        *law_.rates(x, v, tuple(states), tuple(parameters)),
    )
    every = casadi.vertcat(*motion, *parameters)
    jacobian = casadi.Function("jacobian", [every], [casadi.jacobian(outputs, every)])
    numbers = device.parameters_at(1.0)
    for size in (0.0, 1e-160, 1e-9, 1e-3, -1e-3):
        computed = jacobian(casadi.DM([size] * len(motion) + list(numbers)))
        assert np.all(np.isfinite(np.array(computed)))


HIGH_DAMPING_RUBBER = {
    "a1": 2e4, "a2": -1e7, "a3": 1e11, "c": 300.0, "b1": 100.0, "b2": 5e5, "b3": 400.0,
}  # fmt: skip


def test_hysteresis_of_high_damping_rubber_grows_with_the_deformation():
    """Pulled out from rest, the distance to the limit falls with the deformation."""
    device = law("high_damping_rubber", HIGH_DAMPING_RUBBER)
    x = np.linspace(0.0, 20e-3, 50)
    out = solve_ivp(lambda x, h: device.rates(x, 1.0, h, 0.0), (0, x[-1]), (0.0,), t_eval=x,
                    rtol=1e-9, atol=1e-12)  # fmt: skip
    b1, b2, b3 = (HIGH_DAMPING_RUBBER[name] for name in ("b1", "b2", "b3"))
    np.testing.assert_allclose(out.y[0], b1 + b2 * x**2 - b1 * np.exp(-b3 * x), atol=1e-6 * b1)


def test_high_damping_rubber_in_a_circle_leads_the_deformation():
    """At the radius R, |h| = (b1 + b2 R^2) sin(phi), by the angle phi with tan(phi) = b3 R."""
    biaxial = LAWS["high_damping_rubber"].in_plan
    radius, omega = 10e-3, 2.0
    end = 5 * 2 * np.pi / omega

    def moving(t):
        x = radius * np.cos(omega * t), radius * np.sin(omega * t)
        return x, (-omega * x[1], omega * x[0])

    def rates(t, h):
        return biaxial.rates(*moving(t), tuple(h), tuple(HIGH_DAMPING_RUBBER.values()))

    h = solve_ivp(rates, (0, end), (0.0, 0.0), rtol=1e-9, atol=1e-9).y[:, -1]
    b1, b2, b3 = (HIGH_DAMPING_RUBBER[name] for name in ("b1", "b2", "b3"))
    limit, phi = b1 + b2 * radius**2, np.arctan(b3 * radius)
    expected = limit * np.sin(phi) * np.array([np.cos(phi), np.sin(phi)])
    np.testing.assert_allclose(h, expected, rtol=1e-5)


SLIDING_BEARING = {"k": 2e4, "F_max": 800.0, "F_min": 400.0, "a": 30.0, "u_y": 0.002}


@pytest.mark.parametrize("speed", [1e-6, 0.02, 1.0])
def test_sliding_bearing_slips_along_a_hyperbolic_tangent_and_unloads_along_a_line(speed):
    device = law("sliding_bearing", SLIDING_BEARING)
    x = np.linspace(0.0, 6e-3, 50)

    def force(velocity, z, begin):
        moved = np.sign(velocity) * x
        out = solve_ivp(lambda x, z: device.rates(x, velocity, z, 0.0)[0] / abs(velocity),
                        (0, x[-1]), (z,), t_eval=x, rtol=1e-10, atol=1e-12).y  # fmt: skip
        return device.force(begin + moved, velocity, tuple(out), 0.0), out[0]

    friction = 800.0 - 400.0 * np.exp(-30.0 * speed)
    loading, z = force(speed, 0.0, 0.0)
    expected = 2e4 * x + friction * np.tanh(x / 0.002)
    np.testing.assert_allclose(loading, expected, atol=1e-6 * friction)
    back, _ = force(-speed, z[-1], x[-1])
    sticks = x < 0.002 * z[-1]
    expected = 2e4 * (x[-1] - x) + friction * (z[-1] - x / 0.002)
    np.testing.assert_allclose(back[sticks], expected[sticks], atol=1e-6 * friction)


def test_sliding_bearing_in_a_circle_has_friction_against_the_velocity():
    """At the radius R, |z| = 1 at the angle phi behind the velocity, with sin(phi) = u_y / R."""
    biaxial = LAWS["sliding_bearing"].in_plan
    radius, omega = 10e-3, 2.0
    numbers = tuple(SLIDING_BEARING.values())
    end = 5 * 2 * np.pi / omega

    def moving(t):
        x = radius * np.cos(omega * t), radius * np.sin(omega * t)
        return x, (-omega * x[1], omega * x[0])

    z = solve_ivp(lambda t, z: biaxial.rates(*moving(t), tuple(z), numbers), (0, end), (0.0, 0.0),
                  rtol=1e-9, atol=1e-9).y[:, -1]  # fmt: skip
    # at the end the deformation is along x, and the velocity along y
    sine = SLIDING_BEARING["u_y"] / radius
    np.testing.assert_allclose(z, (sine, np.sqrt(1 - sine**2)), rtol=1e-5)
    force = biaxial.force(*moving(end), tuple(z), numbers)
    friction = 800.0 - 400.0 * np.exp(-30.0 * omega * radius)
    np.testing.assert_allclose(force, (2e4 * radius + friction * z[0], friction * z[1]), rtol=1e-6)


@pytest.mark.skipif(load_opensees() is None, reason="OpenSeesPy does not load here")
def test_high_damping_rubber_is_that_of_opensees():
    """Along a line its element HDR, without softening, converges to our force at first order."""
    device = law("high_damping_rubber", HIGH_DAMPING_RUBBER | {"c": 0.0})

    omega, growth = 2 * np.pi, 3.0

    def x(t):
        return 10e-3 * np.sin(omega * t) * (1 - np.exp(-growth * t))

    def v(t):
        grown = np.exp(-growth * t)
        return 10e-3 * (
            omega * np.cos(omega * t) * (1 - grown) + growth * np.sin(omega * t) * grown
        )

    def error(n):
        t = np.linspace(0.0, 2.0, n + 1)
        h = solve_ivp(lambda t, h: device.rates(x(t), v(t), h, 0.0), (0, 2), (0.0,), t_eval=t,
                      rtol=1e-8, atol=1e-8, max_step=2e-3).y  # fmt: skip
        ours = device.force(x(t), v(t), tuple(h), 0.0)
        return float(np.abs(opensees_hdr(x(t)) - ours[1:]).max() / np.abs(ours).max())

    coarse, fine = error(800), error(3200)
    assert fine < 1.5e-3
    assert coarse / fine == pytest.approx(4, rel=0.2)


def opensees_hdr(x):
    """Forces of the element HDR at its upper node, which moves through the given displacements."""
    ops = load_opensees()
    rubber = [HIGH_DAMPING_RUBBER[name] for name in ("a1", "a2", "a3", "b1", "b2", "b3")]
    ops.wipe()
    ops.model("basic", "-ndm", 3, "-ndf", 6)
    ops.node(1, 0.0, 0.0, 0.0)
    ops.node(2, 0.0, 0.0, 0.1)
    ops.fix(1, *[1] * 6)
    ops.fix(2, 0, *[1] * 5)
    shape, none, upright = (1e6, 2e9, 0.05, 0.5, 0.003, 0.01, 10), (0, 0, 0, 1), (0, 0, 1, 1, 0, 0)
    ops.element("HDR", 1, 1, 2, *shape, *rubber, *map(float, none), *upright)
    step = 1.0 / (len(x) - 1)
    ops.timeSeries("Path", 1, "-dt", step, "-values", *x.tolist())
    ops.pattern("Plain", 1, 1)
    ops.sp(2, 1, 1.0)
    ops.constraints("Penalty", 1e14, 1e14)
    ops.numberer("Plain")
    ops.system("FullGeneral")
    ops.test("NormDispIncr", 1e-10, 50)
    ops.algorithm("Newton")
    ops.integrator("LoadControl", step)
    ops.analysis("Static")
    forces = []
    for _ in x[1:]:
        assert ops.analyze(1) == 0
        forces.append(ops.eleForce(1)[6])
    ops.wipe()
    return np.array(forces)
