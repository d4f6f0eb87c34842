"""Effects one by one, against closed forms."""

import numpy as np
import pytest
from scipy.special import jn_zeros

from isolation_sim.effects import effect, extend
from isolation_sim.effects.effect import Past, Signals
from isolation_sim.laws import law

from .conftest import respond

REST = Signals(0.0, 0.0, 0.0, 0.0, 0.0, 20.0)
NEW = Past(*[0.0] * 6)  # of a device that nobody has tested


def spring(*applied, k=1e4):
    """A spring, or one that follows the current, with effects."""
    return extend(law("linear", {"k": k}), [(effect(*n.split(".")), p) for n, p in applied])


def still(duration, n=201):
    """Time, and no motion."""
    return np.linspace(0, duration, n), np.zeros(n), np.zeros(n)


def sine(amplitude, frequency, cycles, points=200):
    t = np.linspace(0, cycles / frequency, cycles * points + 1)
    w = 2 * np.pi * frequency
    return t, amplitude * np.sin(w * t), amplitude * w * np.cos(w * t)


@pytest.mark.parametrize("lag", [0.08, 0.001])
@pytest.mark.parametrize("form", ["first_order", "second_order"])
def test_field_after_a_step_of_the_current(form, lag):
    held = 0.005
    device = spring((f"current_lag.{form}", {"lag": lag}), k=(0.0, 1e4))
    t, x, v = still(0.5)
    n = len(device.law.states)
    force, _ = respond(device, t, x + held, v, np.full(t.size, 2.0), np.zeros(n), 1e-9)
    u = t / lag if form == "first_order" else t / (lag / 2)
    left = np.exp(-u) if form == "first_order" else (1 + u) * np.exp(-u)
    np.testing.assert_allclose(force, 2e4 * held * (1 - left), atol=1e-4)


@pytest.mark.parametrize("form", ["filter", "butterworth", "dead_time"])
def test_a_recorded_force_has_the_whole_delay(form):
    late, delay, motion = effect("sensor_delay", form), 3e-3, REST._replace(force=5.0)
    first = late.rates(motion, (2.0, 0.0), (delay,))
    expected = {"filter": 3 / delay, "butterworth": 3 * 2**0.5 / delay, "dead_time": 36 / delay}
    assert first[-1] == pytest.approx(expected[form], rel=1e-12)
    assert late.force(motion, (2.0, 1.5), (delay,)) == (-1.5 if form == "dead_time" else -3.0)
    # without one the force is as it is, with a finite derivative by the delay
    none, little = (late.force(motion, (2.0, 1.5), (t,)) for t in (0.0, 1e-9))
    assert none == 0 and little / 1e-9 == pytest.approx(
        -3000.0 if form == "dead_time" else -6000.0, rel=1e-5
    )


def test_a_part_of_the_field_follows_slowly():
    quick, part, slower = 0.05, 0.3, 0.4
    numbers = {"lag": quick, "slow_part": part, "slower_by": slower}
    device = spring(("current_lag.two_stages", numbers), k=(0.0, 1e4))
    t, x, v = still(0.5)
    force, _ = respond(device, t, x + 0.005, v, np.full(t.size, 2.0), np.zeros(2), 1e-9)
    left = (1 - part) * np.exp(-t / quick) + part * np.exp(-t / (quick + slower))
    np.testing.assert_allclose(force, 100 * (1 - left), atol=1e-4)


def test_the_flux_diffuses_into_a_massive_core():
    lag = 0.2
    device = spring(("current_lag.diffusion", {"lag": lag}), k=(0.0, 1e4))
    t, x, v = still(0.5)
    force, _ = respond(device, t, x + 0.005, v, np.full(t.size, 2.0), np.zeros(3), 1e-9)
    zeros = jn_zeros(0, 500)[:, None]
    left = np.sum(4 / zeros**2 * np.exp(-t / lag * (zeros / zeros[0]) ** 2), axis=0)
    # the quickest parts stand for all that are quicker
    np.testing.assert_allclose(force[4:], 100 * (1 - left[4:]), atol=1.0)
    assert np.std(force[4:] - 100 * (1 - left[4:])) < 0.2


def test_the_field_falls_with_a_lag_of_its_own():
    device = spring(("current_lag.rise_and_fall", {"lag": 0.05, "fall_ratio": 3.0}), k=(0.0, 1e4))
    t, x, v = still(0.5)
    for first, then, lag in ((0.0, 2.0, 0.05), (2.0, 0.0, 0.15)):
        force, _ = respond(device, t, x + 0.005, v, np.full(t.size, then), np.array([first]), 1e-9)
        field = then + (first - then) * np.exp(-t / lag)
        np.testing.assert_allclose(force, 50 * field, atol=1e-3)


def test_a_saturating_coil_is_quick_at_a_large_current():
    lag, saturation = 0.1, 0.5
    device = spring(
        ("current_lag.saturating", {"lag": lag, "saturation": saturation}), k=(0.0, 1e4)
    )
    t, x, v = still(0.5)
    force, _ = respond(device, t, x + 0.005, v, np.zeros(t.size), np.array([2.0]), 1e-9)
    # of j' = -j (1 + (s j)^2) / lag
    square = 4 * np.exp(-2 * t / lag)
    falling = np.sqrt(square / (1 + saturation**2 * (4 - square)))
    np.testing.assert_allclose(force, 50 * falling, atol=1e-3)


def test_a_field_that_is_all_slow_has_one_lag():
    of_two = {"lag": 0.02, "slow_part": 1.0, "slower_by": 0.1}
    t, x, v = still(0.5)
    both = [
        respond(
            spring((f"current_lag.{form}", numbers), k=(0.0, 1e4)),
            t, x + 0.005, v, np.full(t.size, 2.0), np.zeros(n), 1e-9,
        )[0]
        for form, numbers, n in (("two_stages", of_two, 2), ("first_order", {"lag": 0.12}, 1))
    ]  # fmt: skip
    np.testing.assert_allclose(*both, atol=1e-6)


def test_a_regulated_current_overshoots():
    lag, damping = 0.06, 0.4
    device = spring(("current_lag.overshooting", {"lag": lag, "damping": damping}), k=(0.0, 1e4))
    t, x, v = still(0.6)
    force, _ = respond(device, t, x + 0.005, v, np.full(t.size, 2.0), np.zeros(2), 1e-9)
    pole, w = 2 * damping**2 / lag, 2 * damping * np.sqrt(1 - damping**2) / lag
    left = np.exp(-pole * t) * (np.cos(w * t) + pole / w * np.sin(w * t))
    np.testing.assert_allclose(force, 100 * (1 - left), atol=1e-3)
    assert force.max() > 120


def test_two_lags_in_a_loop_without_overshoot_are_two_in_series():
    t, x, v = still(0.5)
    both = [
        respond(
            spring((f"current_lag.{form}", numbers), k=(0.0, 1e4)),
            t, x + 0.005, v, np.full(t.size, 2.0), np.zeros(2), 1e-9,
        )[0]
        for form, numbers in (
            ("overshooting", {"lag": 0.1, "damping": 1.0}), ("second_order", {"lag": 0.1})
        )
    ]  # fmt: skip
    np.testing.assert_allclose(*both, atol=1e-4)


def test_an_arm_relaxes_quickly_from_a_large_force():
    k, time, length = 1e4, 0.4, 0.002
    numbers = {"stiffness": k, "time": time, "length": length}
    device = spring(("extra_relaxation.eyring", numbers), k=0.0)
    t, x, v = still(1.0)
    first = 0.008
    force, _ = respond(device, t, x, v, 0 * t, np.array([first]), 1e-9)
    # of q' = -(s / time) sinh(q / s)
    left = 2 * length * np.arctanh(np.tanh(first / length / 2) * np.exp(-t / time))
    np.testing.assert_allclose(force, k * left, atol=1e-4)


def test_an_orifice_holds_a_spring_by_a_power_of_the_velocity():
    k, length, first = 1e4, 0.02, 0.008
    t, x, v = still(1.0)
    left = {
        # of q' = -0.1 m/s (q / length)^n, n = 2 and 1
        0.5: first / (1 + first * 0.1 * t / length**2),
        1.0: first * np.exp(-0.1 * t / length),
    }
    for exponent, expected in left.items():
        numbers = {"stiffness": k, "length": length, "exponent": exponent}
        device = spring(("extra_relaxation.power", numbers), k=0.0)
        force, _ = respond(device, t, x, v, 0 * t, np.array([first]), 1e-9)
        np.testing.assert_allclose(force, k * expected, atol=0.2)


def test_a_supply_ramps_to_the_commanded_current():
    device = spring(("current_lag.slew", {"per_ampere": 0.2}), k=(0.0, 1e4))
    t, x, v = still(0.8)
    force, _ = respond(device, t, x + 0.005, v, np.full(t.size, 2.0), np.zeros(1), 1e-8)
    np.testing.assert_allclose(force, 50 * np.minimum(t / 0.2, 2.0), atol=0.6)
    quick = effect("current_lag", "slew").rates(REST._replace(current=2.0), (1.9,), (0.0,))
    assert quick[0] == pytest.approx(0.1 / 1e-4)


def test_a_device_at_rest_has_its_field():
    device = spring(("current_lag.second_order", {"lag": 1.0}), k=(0.0, 1e4))
    assert device.law.rest(device.parameters_at(1.7)) == (1.7, 1.7)


def test_saturation_at_its_ends():
    knee, tanh = effect("field_saturation"), effect("field_saturation", "tanh")
    far, near = REST._replace(current=1e6), REST._replace(current=1e-4)
    for n in (1.0, 3.0, 6.0):
        assert knee.current(far, (), (0.5, n)) == pytest.approx(2.0, rel=1e-5)
    assert tanh.current(far, (), (0.5,)) == pytest.approx(2.0, rel=1e-5)
    assert tanh.current(near, (), (0.5,)) == pytest.approx(1e-4, rel=1e-6)
    # n = 1 is Froelich's curve
    assert knee.current(REST._replace(current=3.0), (), (0.5, 1.0)) == pytest.approx(3 / 2.5)


def test_play_of_the_field():
    device = spring(("magnetic_remanence.play", {"share": 0.5, "coercive": 0.2}), k=(0.0, 1e4))
    t = np.linspace(0, 4, 801)
    current = 1 + np.sin(2 * np.pi * 0.5 * t - np.pi / 2)
    held = 0.001
    force, _ = respond(device, t, held + 0 * t, 0 * t, current)
    offset = force / (1e4 * held) - current
    second = t > 2
    rising = second & (np.gradient(current) > 0) & (current > 0.6) & (current < 1.9)
    falling = second & (np.gradient(current) < 0) & (current > 0.1) & (current < 1.4)
    # dragged a little later than the ends of the play: 2 ms times the current's rate, 3.1 A/s
    np.testing.assert_allclose(offset[rising], -0.1, atol=0.5 * 3.2 * 2e-3)
    np.testing.assert_allclose(offset[falling], 0.1, atol=0.5 * 3.2 * 2e-3)


def test_a_play_starts_where_a_current_from_zero_has_dragged_it():
    t = np.linspace(0, 1, 101)
    for form, selected in (("play", 0.8), ("settled", 1.0)):
        numbers = {"share": 0.5, "coercive": 0.2}
        device = spring((f"magnetic_remanence.{form}", numbers), k=(0.0, 1e4))
        force, _ = respond(device, t, 0.001 + 0 * t, 0 * t, 1.0 + 0 * t)
        np.testing.assert_allclose(force, 10 * (1.0 + selected) / 2)


def test_relays_of_all_widths_make_rayleigh_loops():
    """Parabolas of the current since it turned; all relays fall where it returns to zero."""
    one, widest = effect("magnetic_remanence", "preisach"), 1.0
    numbers = (1.0, widest)

    def field(current, states):
        return one.current(REST._replace(current=current), states, numbers)

    states = one.start(REST._replace(current=0.0), numbers)
    for current in np.linspace(0.0, 2 * widest, 41):  # the first rise, up to saturation
        at = REST._replace(current=current)
        # four widths for all: a chain of chords
        assert field(current, states) == pytest.approx(current**2 / (2 * widest), abs=0.035)
        states = one.start(at, numbers)
    for current in np.linspace(2 * widest, 0.0, 41):
        fallen = (2 * widest - current) ** 2 / (2 * widest)
        assert field(current, states) == pytest.approx(2 * widest - fallen, abs=0.035)
    assert field(0.0, states) == 0.0
    rates = one.rates(REST._replace(current=0.0), states, numbers)
    assert all(rate < 0 for rate in rates)


def test_plays_of_all_widths_leave_a_part_of_the_field():
    """Parabolas of the current since it turned, which do not end at zero current."""
    one, widest = effect("magnetic_remanence", "plays"), 1.0
    numbers = (1.0, widest)
    states = one.start(REST._replace(current=2.0), numbers)
    fallen = [one.current(REST._replace(current=c), states, numbers) for c in (2.0, 1.5, 1.0, 0.0)]
    # by 2 - c a share (2 - c) / (2 widest) of the plays is dragged back
    expected = [1.5, 1.5 - 0.5**2 / 4, 1.25, 0.5]
    assert fallen == pytest.approx(expected, abs=0.02)
    # the same is left for the next test
    device = NEW._replace(current=2.0)
    assert np.mean(one.carried(device, numbers)) == pytest.approx(fallen[-1])


def test_remanence_along_the_path_of_the_current():
    path, largest, held = 0.8, 2.0, 0.001
    device = spring(("magnetic_remanence.hodgdon", {"share": 1.0, "path": path}), k=(0.0, 1e4))
    t = np.linspace(0, 4, 801)
    current = largest * np.where(t < 2, t, 4 - t) / 2
    force, (_, kept) = respond(device, t, held + 0 * t, 0 * t, current, np.zeros(2), 1e-9)
    late = current - 2e-3 * np.where(t < 2, 1, -1)  # a ramp of 1 A/s, 2 ms late
    risen = late - path * (1 - np.exp(-late / path))
    np.testing.assert_allclose(kept[20:380], risen[20:380], atol=1e-3)
    np.testing.assert_allclose(force, 10 * kept, atol=1e-9)
    # the same is left for the next test, and a run that begins with a current has risen to it
    one, numbers = effect("magnetic_remanence", "hodgdon"), (1.0, path)
    left = one.carried(NEW._replace(current=largest), numbers)[1]
    assert kept[-1] == pytest.approx(left, abs=3e-3)
    begun = one.start(REST._replace(current=1.0), numbers)
    assert begun[1] == pytest.approx(kept[200], abs=3e-3)
    backwards = one.start(REST._replace(current=-1.0), numbers)
    assert backwards == tuple(-each for each in begun)


def test_remanence_after_the_largest_current():
    device = spring(("magnetic_remanence.largest", {"share": 0.3}), k=(0.0, 1e4))
    t = np.linspace(0, 1, 401)
    current = np.where(t < 0.5, 2.0, 0.5)
    force, _ = respond(device, t, 0.001 + 0 * t, 0 * t, current)
    assert force[100] == pytest.approx(20.0)
    assert force[-1] == pytest.approx(10 * (0.5 + 0.3 * 1.5), rel=1e-6)


def test_largest_deformation_never_falls():
    numbers = {"loss": 0.4, "length": 2e-3, "sharpness": 2.0}
    device = spring(("stress_softening.exponential", numbers))
    t, x, v = sine(5e-3, 1.0, 3)
    x, v = x * (1 - t / 6), np.gradient(x * (1 - t / 6), t)
    force, (largest,) = respond(device, t, x, v, 0.0)
    assert np.min(np.diff(largest)) > -1e-9
    follower = np.maximum.accumulate(np.abs(x))
    np.testing.assert_allclose(largest, follower, atol=2.5e-3 * np.max(np.abs(v)))
    assert largest[-1] == pytest.approx(np.max(np.abs(x)), rel=2e-3)
    left = 1 - 0.4 * (1 - np.exp(-((largest / 2e-3) ** 2)))
    np.testing.assert_allclose(force, 1e4 * x * left, atol=1e-6)


def test_ogden_roxburgh_returns_to_the_virgin_path():
    form = effect("stress_softening")
    at = REST._replace(x=3e-3)
    assert form.factor(at, (3e-3,), (0.4, 1e-3)) == 1.0
    assert form.factor(at, (9e-3,), (0.4, 1e-3)) == pytest.approx(0.6, abs=1e-4)


def test_rubber_beside_a_friction_softens_alone():
    damaged, below = (effect("stress_softening", form) for form in ("rubber", "rubber_below"))
    at = REST._replace(x=3e-3, v=0.1)
    # whatever the force of the law
    for force in (0.0, 500.0):
        now = at._replace(force=force)
        assert damaged.force(now, (9e-3,), (2e4, 1e-3)) == pytest.approx(-2e4 * 3e-3 * 0.9)
        assert below.force(now, (9e-3,), (2e4, 1e-3)) == pytest.approx(-2e4 * 3e-3 * np.tanh(6))
    assert below.force(at, (3e-3,), (2e4, 1e-3)) == 0.0  # on the virgin path
    assert damaged.force(at, (3e-3,), (2e4, 1e-3)) == pytest.approx(-2e4 * 3e-3 * 0.75)


def test_a_storage_modulus_falls_with_the_amplitude_and_the_loss_does_not():
    form = effect("amplitude_softening", "storage")
    numbers = (2e4, 4e-3, 1.2, 5.0)
    slow, fast = (form.force(REST._replace(x=2e-3, v=v), (4e-3,), numbers) for v in (0.0, 0.3))
    assert slow == fast == pytest.approx(-2e4 / 2 * 2e-3)
    assert form.force(REST._replace(v=0.3), (4e-3,), numbers) == 0.0


@pytest.mark.parametrize("form", ["kraus", "mean_square"])
def test_half_of_the_loss_at_the_half_amplitude(form):
    half = 4e-3
    numbers = {"loss": 0.6, "half": half, "exponent": 1.2, "memory": 5.0}
    device = spring((f"amplitude_softening.{form}", numbers))
    t, x, v = sine(half, 2.0, 50, 60)
    force, _ = respond(device, t, x, v, 0.0, tolerance=1e-5)
    last = t > t[-1] - 0.5
    factor = np.dot(force[last], x[last]) / np.dot(x[last], x[last]) / 1e4
    # a peak that fades between the peaks is a little low
    assert factor == pytest.approx(0.7, abs=0.01)


def test_a_network_breaks_to_its_equilibrium_and_recovers():
    numbers = {"loss": 0.5, "length": 4e-3, "memory": 0.8}
    device = spring(("amplitude_softening.network", numbers))
    t = np.linspace(0, 6, 6001)
    x = 0.01 * np.minimum(t, 4.0)  # at a constant speed, then held
    v = np.where(t < 4.0, 0.01, 0.0)
    force, (whole,) = respond(device, t, x, v, 0.0, tolerance=1e-6)
    moving = 1 / (1 + 0.8 * 0.01 / 4e-3)
    at = np.searchsorted(t, [3.99, 5.0])
    np.testing.assert_allclose(whole[at], [moving, 1 - (1 - moving) * np.exp(-1 / 0.8)], rtol=5e-3)
    np.testing.assert_allclose(force[at], 1e4 * x[at] * (1 - 0.5 * (1 - whole[at])), rtol=1e-5)


def test_amplitude_is_forgotten():
    numbers = {"exponent": 0.5, "half": 1e-3, "memory": 0.5}
    device = spring(("amplitude_softening.power", numbers))
    t, x, v = still(1.0)
    _, (peak,) = respond(device, t, x, v, 0.0, (8e-3,))
    np.testing.assert_allclose(peak, 8e-3 * np.exp(-t / 0.5), rtol=1e-5)


def test_heat_comes_to_an_equilibrium():
    """In steady sliding, h = gain F(h) v cooling, with F falling as exp(-h) or 1 / (1 + h)."""
    for form, solved in (("exponential", 0.5671432904), ("hyperbolic", (5**0.5 - 1) / 2)):
        one = effect("self_heating", form)
        signals = REST._replace(force=200.0, v=0.05)
        # h exp(h) = 1, h (1 + h) = 1
        (rate,) = one.rates(signals, (solved,), (1 / (200 * 0.05 * 30), 30.0))
        assert abs(rate) < 1e-10


def test_wear_of_a_core_leaves_the_rubber_alone():
    one = effect("cyclic_degradation", "core")
    signals = REST._replace(x=0.01, v=0.05, force=300.0)
    # a work of 1 / c halves the yield force, and a half of it does work
    assert one.force(signals, (50.0,), (0.02, 1e4)) == pytest.approx(-100.0)
    assert one.rates(signals, (50.0,), (0.02, 1e4)) == pytest.approx((100.0 * 0.05,))
    # three quarters of a loss of 0.4 after two half lives
    limited, numbers = effect("cyclic_degradation", "core_limited"), (0.4, 50 / np.log(2), 1e4)
    assert limited.force(signals, (100.0,), numbers) == pytest.approx(-0.3 * 200)
    assert limited.rates(signals, (100.0,), numbers) == pytest.approx((0.7 * 200 * 0.05,))


def test_heat_of_a_core_leaves_the_rubber_alone():
    one = effect("self_heating", "core")
    signals = REST._replace(x=0.01, v=0.05, force=300.0)
    numbers = (1 / (200 * 0.05 * 30), 30.0, 1e4)
    assert one.force(signals, (np.log(2.0),), numbers) == pytest.approx(-100.0)
    (rate,) = one.rates(signals, (0.5671432904,), numbers)
    assert abs(rate) < 1e-10


def test_warmth_of_a_fluid_leaves_a_yield_force_alone():
    heating, warm = effect("self_heating", "fluid"), effect("ambient_temperature", "fluid")
    signals = REST._replace(v=0.05, force=300.0, temperature=20 + np.log(2.0) / 0.02)
    # at a warmth of log 2 a half is left of the viscous 1000 * 0.05 N
    assert heating.force(signals, (np.log(2.0),), (1e-3, 30.0, 1e3)) == pytest.approx(-25.0)
    (rate,) = heating.rates(signals, (np.log(2.0),), (1e-3, 30.0, 1e3))
    assert rate == pytest.approx(1e-3 * 275.0 * 0.05 - np.log(2.0) / 30)
    assert warm.force(signals, (), (0.02, 1e3)) == pytest.approx(-25.0)


def test_cold_of_a_core_leaves_the_rubber_alone():
    one = effect("ambient_temperature", "core")
    signals = REST._replace(x=0.01, force=300.0, temperature=20 - np.log(2.0) / 0.02)
    assert one.force(signals, (), (0.02, 1e4)) == pytest.approx(200.0)


def test_valves_leave_the_spring_beside_them_alone():
    one = effect("tension_compression_asymmetry", "direction")
    for v in (-0.5, 0.5):
        signals = REST._replace(x=0.01, v=v, force=300.0)
        assert one.force(signals, (), (0.1, 1e-3, 1e4)) == pytest.approx(20.0 * np.sign(v))


@pytest.mark.parametrize(
    ("cause", "forms", "numbers", "gain"),
    [
        ("self_heating", ("dissipation", "exponential"), {"gain": 1e-5, "cooling": 1e5}, 1e-5),
        ("cyclic_degradation", ("inelastic_unlimited", "unlimited"), {"loss": 1e-5}, 1.0),
        ("cyclic_degradation", ("inelastic", "dissipation"), {"loss": 0.1, "scale": 1e4}, 1.0),
    ],
)
def test_elastic_work_neither_heats_nor_wears(cause, forms, numbers, gain):
    """Beside a stiff spring the dashpot's work alone counts, from the second cycle on."""
    k, c = 2e5, 500.0
    t, x, v = sine(8e-3, 1.0, 8)
    of_dashpot = gain * c * np.concatenate([[0], np.cumsum((v[1:] ** 2 + v[:-1] ** 2) / 2)]) * t[1]
    signals, parameters = REST._replace(x=x, v=v, force=k * x + c * v), tuple(numbers.values())
    expected = effect(cause, forms[1]).factor(signals, (of_dashpot,), parameters)
    swings = []
    for form in forms:
        one = effect(cause, form)
        device = extend(law("kelvin_voigt", {"k": k, "c": c}), [(one, numbers)])
        _, states = respond(device, t, x, v, 0.0, tolerance=1e-8)
        error = one.factor(signals, tuple(states), parameters) - expected
        swings.append(np.ptp(error[t > 1]) / (1 - expected[-1]))
    assert swings[0] < 0.01 and swings[1] > 0.05


def test_temperature_leaves_the_reference_alone():
    for form in ("exponential", "linear", "arrhenius"):
        one = effect("ambient_temperature", form)
        parameter = (600.0,) if form == "arrhenius" else (600.0 / 293.15**2,)
        assert one.factor(REST, (), parameter) == 1.0
        # the same to first order: E / T^2 is Arrhenius' coefficient
        warm = one.factor(REST._replace(temperature=21.0), (), parameter)
        assert warm == pytest.approx(1 - 600 / 293.15**2, abs=1e-4)


def test_vogels_temperature_of_zero_kelvin_is_arrhenius():
    of_vogel, of_arrhenius = (
        effect("ambient_temperature", form) for form in ("vogel", "arrhenius")
    )
    for temperature in (-30.0, 20.0, 60.0):
        signals = REST._replace(temperature=temperature)
        near = of_vogel.factor(signals, (), (0.004, 293.15))
        assert near == pytest.approx(of_arrhenius.factor(signals, (), (0.004 * 293.15**2,)))
    # beside one of the same slope at 20 deg C it is stiffer in the cold, and finite at any
    cold = [of_vogel.factor(REST._replace(temperature=t), (), (0.004, 60.0)) for t in (-20, -90)]
    assert cold[0] == pytest.approx(np.exp(0.004 * 40 * 60 / 20)) and np.isfinite(cold[1])


@pytest.mark.parametrize("temperature", [-10.0, 20.0, 50.0])
def test_by_superposition_only_relaxation_takes_another_time(temperature):
    """At rest after a step a standard solid relaxes exponentially, in the scaled time."""
    c, k0, k1, b, distance = 5e3, 1e4, 2e4, 0.03, 100.0
    shift = np.exp(-b * (temperature - 20) * distance / (distance + temperature - 20))
    numbers = {"softening": b, "distance": distance}
    solid = law("standard_solid", {"c0": c, "k0": k0, "k1": k1})
    warm = extend(solid, [(effect("ambient_temperature", "superposition"), numbers)])
    device = warm.with_parameters(temperature=temperature)
    t = np.linspace(0.0, 1.0, 201)
    force, _ = respond(device, t, 0.01 + 0 * t, 0 * t, 0.0, first=[0.01], tolerance=1e-9)
    at_last, time = 0.01 * k0 / (k0 + k1), shift * c / (k0 + k1)
    expected = k1 * (at_last + (0.01 - at_last) * np.exp(-t / time))
    np.testing.assert_allclose(force, expected, rtol=1e-6)
    # a dashpot's force follows the velocity of the law's own time
    dashpot = law("kelvin_voigt", {"k": k1, "c": c})
    warm = extend(dashpot, [(effect("ambient_temperature", "superposition"), numbers)])
    device = warm.with_parameters(temperature=temperature)
    assert device.force(0.01, 0.2, (), 0.0) == pytest.approx(k1 * 0.01 + shift * c * 0.2)


def test_friction_at_speed():
    fast = REST._replace(v=10.0)
    assert effect("coulomb_friction").force(fast, (), (50.0, 1e-3)) == 50.0
    assert effect("coulomb_friction", "stribeck").force(fast, (), (50.0, 0.5, 0.01)) == 50.0
    device = spring(("coulomb_friction.dahl", {"level": 50.0, "length": 1e-4}), k=0.0)
    t = np.linspace(0, 1, 201)
    force, (bent,) = respond(device, t, 0.01 * t, 0.01 + 0 * t, 0.0, tolerance=1e-9)
    np.testing.assert_allclose(bent, 1 - np.exp(-0.01 * t / 1e-4), atol=1e-7)
    np.testing.assert_allclose(force, 50 * bent, rtol=1e-12)


def test_bristles_bend_up_to_a_friction_that_falls_with_the_speed():
    length, rise, stribeck = 1e-4, 0.4, 0.02
    numbers = {"level": 50.0, "length": length, "rise": rise, "velocity": stribeck}
    device = spring(("coulomb_friction.lugre", numbers), k=0.0)
    t = np.linspace(0, 1, 201)
    for speed in (0.002, 0.02, 0.2):
        most = 1 + rise * np.exp(-((speed / stribeck) ** 2))
        force, _ = respond(device, t, speed * t, speed + 0 * t, 0.0, tolerance=1e-9)
        expected = 50 * most * (1 - np.exp(-speed * t / (length * most)))
        np.testing.assert_allclose(force, expected, atol=1e-4)


def test_inertia_of_a_harmonic_motion():
    """With the law's filter of 2 ms, the force is m a to 3 % at 2 Hz."""
    device = spring(("inertia_force", {"mass": 12.0}), k=0.0)
    t, x, v = sine(5e-3, 2.0, 4)
    force, _ = respond(device, t, x, v, 0.0)
    expected = -12.0 * (4 * np.pi) ** 2 * x
    last = t > 0.5
    assert np.max(np.abs(force - expected)[last]) < 0.03 * np.max(np.abs(expected))


def test_delay_is_that_of_a_harmonic_motion():
    w, delay, t = 2 * np.pi, 0.01, np.linspace(0, 1, 50)
    signals = REST._replace(x=np.sin(w * t), v=w * np.cos(w * t), a=-(w**2) * np.sin(w * t))
    x, v = effect("sensor_delay").motion(signals, (), (delay,))
    np.testing.assert_allclose(x, np.sin(w * (t - delay)), atol=(w * delay) ** 3)
    np.testing.assert_allclose(v, w * np.cos(w * (t - delay)), atol=w * (w * delay) ** 2)


def test_backlash_is_the_play_of_the_motion():
    gap = 1e-3
    device = spring(("linkage_backlash.play", {"gap": gap}))
    t, x, v = sine(5e-3, 1.0, 3)
    force, _ = respond(device, t, x, v, 0.0, (0.0,), 1e-9)
    keep, expected = 0.0, np.zeros(t.size)
    for k, one in enumerate(x):
        keep = min(max(keep, one - gap), one + gap)
        expected[k] = 1e4 * keep
    np.testing.assert_allclose(force, expected, atol=0.03 * np.max(expected))
    beside = effect("linkage_backlash").motion(REST._replace(x=4e-3, v=0.1), (3.5e-3,), (gap,))
    assert beside == (3.5e-3, 0.0)
    assert effect("linkage_backlash").motion(REST._replace(x=4e-3, v=0.1), (1e-3,), (0.0,)) == (
        4e-3, 0.1
    )  # fmt: skip


def test_an_open_linkage_passes_no_force():
    # a slider of 100 N on a link of 1e7 N/m with a free play of 2 mm
    gap, friction, stiffness = 1e-3, 100.0, 1e7
    slider = law("dahl", {"k": 0.0, "c": 0.0, "F_c": friction, "sigma": stiffness})
    device = extend(slider, [(effect("linkage_backlash", "open"), {"gap": gap})])
    t, x, v = sine(5e-3, 0.5, 3, 400)
    force, _ = respond(device, t, x, v, 0.0, None, 1e-9)
    place, expected = 0.0, np.zeros(t.size)
    for k, one in enumerate(x):
        away = one - place
        link = stiffness * np.sign(away) * max(abs(away) - gap, 0.0)
        expected[k] = np.clip(link, -friction, friction)
        place += (link - expected[k]) / stiffness
    steady = np.abs(expected) == friction
    np.testing.assert_allclose(force[steady], expected[steady], rtol=0.1)
    turning = np.abs(expected) == 0.0
    assert np.median(np.abs(force[turning])) < 0.01 * friction
    # at rest at the end of its gap it holds, and without a gap it is not there
    open_linkage_force = effect("linkage_backlash", "open").force
    pressed = REST._replace(x=9e-4, force=50.0)
    assert open_linkage_force(pressed, (0.0,), (gap,)) == pytest.approx(0.0, abs=1e-3)
    reverse = pressed._replace(force=-50.0)
    assert open_linkage_force(reverse, (0.0,), (gap,)) == pytest.approx(50, rel=2e-3)
    assert open_linkage_force(pressed, (0.0,), (0.0,)) == 0.0


def test_an_open_linkage_releases_a_device_with_a_spring():
    # spring and dashpot behind a clearance that only pushes, at a step far below the lag of 2 ms
    k, c, gap = 1e4, 2e3, 1e-3
    damper = law("kelvin_voigt", {"k": k, "c": c})
    numbers = {"gap": gap, "time": c / k}
    device = extend(damper, [(effect("linkage_backlash", "released"), numbers)])
    t, x, v = sine(5e-3, 0.5, 3, 2000)
    force, _ = respond(device, t, x, v, 0.0, None, 1e-9)
    place, expected = 0.0, np.zeros(t.size)
    for n in range(1, t.size):
        free = place * np.exp(-(t[n] - t[n - 1]) * k / c)
        place = min(max(free, x[n] - gap), x[n] + gap)
        # a linkage that is closed moves the device with the rig
        expected[n] = 0.0 if place == free else k * place + c * v[n]
    steady = t > 2.0
    missed = (force - expected)[steady]
    # it closes within the lag
    assert np.std(missed) < 0.04 * np.std(expected)
    is_open = steady & (expected == 0.0)
    assert np.mean(is_open[steady]) > 0.1
    assert np.median(np.abs(force[is_open])) < 0.01 * np.max(expected)
    # without a gap it is not there
    released = effect("linkage_backlash", "released").motion
    moving = REST._replace(x=4e-3, v=0.1)
    assert released(moving, (1e-3,), (0.0, 0.2)) == pytest.approx((4e-3, 0.1), rel=1e-12)


@pytest.mark.parametrize("backlash", ["play", "dead_zone"])
def test_a_damper_behind_a_gap_rests_while_the_rig_crosses_it(backlash):
    numbers = {"level": 50.0, "velocity": 1e-3}
    device = spring(
        ("coulomb_friction.smooth", numbers), (f"linkage_backlash.{backlash}", {"gap": 1e-3})
    )
    t, x, v = sine(5e-3, 0.5, 2)
    force, states = respond(device, t, x, v, 0.0, None, 1e-9)
    behind = states[0] if backlash == "play" else 0.0
    crossing = (np.abs(x - behind) < 0.85e-3) & (np.abs(v) > 5e-3)
    assert np.sum(crossing) > 10
    place = behind[crossing] if backlash == "play" else 0.0
    np.testing.assert_allclose(force[crossing], 1e4 * place, atol=1e-6)
    closed = (np.abs(x - behind) > 1.2e-3) & (np.abs(v) > 5e-3)
    assert np.all(np.abs(force - 1e4 * (x - 1e-3 * np.sign(x)))[closed & (x * v > 0)] > 49.0)


def test_a_recorder_filters_the_force_of_the_whole_device():
    delay = 0.02
    friction = "coulomb_friction.smooth", {"level": 50.0, "velocity": 5e-3}
    device = spring(friction, ("sensor_delay.filter", {"delay": delay}))
    t, x, v = sine(5e-3, 1.0, 4)
    recorded, _ = respond(device, t, x, v, 0.0, None, 1e-9)
    whole, _ = respond(spring(friction), t, x, v, 0.0, None, 1e-9)
    expected = whole.copy()
    for n in range(1, t.size):
        kept = np.exp(-(t[n] - t[n - 1]) / delay)
        expected[n] = kept * expected[n - 1] + (1 - kept) * (whole[n] + whole[n - 1]) / 2
    np.testing.assert_allclose(recorded[400:], expected[400:], atol=0.5)


def test_a_linear_stop_is_a_spring_beyond_the_gap():
    device = spring(("end_stop.linear", {"stiffness": 3e4, "gap": 2e-3}))
    x = np.array([1e-3, 3e-3, -3e-3])
    force, _ = respond(device, np.arange(3.0), x, np.zeros(3), 0.0, (), 1e-9)
    np.testing.assert_allclose(force, [10.0, 60.0, -60.0])


def test_maxwell_arm_relaxes():
    numbers = {"stiffness": 5e3, "share": 0.25, "time": 0.2, "second_time": 1.0}
    device = spring(("extra_relaxation.two_arms", numbers), k=0.0)
    t, x, v = still(2.0)
    force, _ = respond(device, t, x, v, 0.0, (2e-3, 2e-3), 1e-9)
    np.testing.assert_allclose(force, 10 * (0.75 * np.exp(-t / 0.2) + 0.25 * np.exp(-t)), atol=1e-6)


def test_a_mean_speed_stiffens_by_its_power():
    numbers = {"exponent": 0.2, "velocity": 1e-3, "window": 2.0}
    device = spring(("weak_rate_dependence.mean_speed", numbers))
    t, x, v = sine(5e-3, 2.0, 40)
    force, (square,) = respond(device, t, x, v, 0.0, tolerance=1e-5)
    last = t > t[-1] - 0.5
    rms = 5e-3 * 2 * np.pi * 2.0 / 2**0.5
    assert np.mean(square[last]) == pytest.approx(rms**2, rel=1e-2)
    factor = np.dot(force[last], x[last]) / np.dot(x[last], x[last]) / 1e4
    assert factor == pytest.approx((1 + (rms / 1e-3) ** 2) ** 0.1, rel=5e-3)


def test_frequency_raises_the_stiffness_by_its_power():
    device = spring(("weak_rate_dependence.frequency", {"exponent": 0.2, "window": 2.0}))
    for frequency in (0.5, 3.0):
        t, x, v = sine(4e-3, frequency, int(20 * frequency), 60)
        force, _ = respond(device, t, x, v, 0.0, tolerance=1e-5)
        last = t > t[-1] - 2 / frequency
        factor = np.dot(force[last], x[last]) / np.dot(x[last], x[last]) / 1e4
        assert factor == pytest.approx(frequency**0.2, rel=0.01)


@pytest.mark.parametrize(
    "form, numbers", [("power", (2e5, 6e-3, 1.5)), ("exponential", (2e5, 6e-3, 5e-4))]
)
def test_stop_is_the_slope_of_its_energy(form, numbers):
    one = effect("end_stop", form)
    for x in (-25e-3, -8e-3, 4e-3, 7e-3, 20e-3):
        step = 1e-8
        energies = [one.stored_energy(x + s, (), numbers) for s in (-step, step)]
        force = one.force(REST._replace(x=x), (), numbers)
        assert force == pytest.approx((energies[1] - energies[0]) / (2 * step), rel=1e-5)
    assert one.force(REST._replace(x=5.9e-3), (), numbers) == 0


@pytest.mark.parametrize(
    ("form", "numbers", "gain"),
    [
        ("exponential", {"loss": 0.3, "scale": 0.1}, -0.3),
        ("hardening", {"gain": 0.3, "scale": 0.1}, 0.3),
    ],
)
def test_force_changes_with_the_way_travelled(form, numbers, gain):
    t, x, v = sine(5e-3, 1.0, 3)
    device = spring((f"cyclic_degradation.{form}", numbers))
    force, (travel,) = respond(device, t, x, v, 0.0, tolerance=1e-8)
    assert travel[-1] == pytest.approx(3 * 4 * 5e-3, rel=1e-6)
    assert force[-51] / x[-51] == pytest.approx(
        1e4 * (1 + gain * (1 - np.exp(-travel[-51] / 0.1))), rel=1e-9
    )


@pytest.mark.parametrize("amplitude", [2e-3, 2e-2])
@pytest.mark.parametrize("form", ["cycles", "cycles_logarithmic"])
def test_cycles_are_counted_whatever_their_amplitude(form, amplitude):
    t, x, v = sine(amplitude, 1.0, 3, 2000)
    device = spring((f"cyclic_degradation.{form}", {"loss": 0.3, "scale": 2.0, "width": 1e-4}))
    # a passage through the width takes 0.8 ms, which long steps miss
    force, (cycles,) = respond(device, t, x, v, 0.0, tolerance=1e-8, longest_step=5e-4)
    # the first half of a passage at the beginning, five whole ones since
    assert cycles[-501] == pytest.approx(2.75, rel=1e-3)
    n = cycles[-501] / 2
    left = 1 - 0.3 * (1 - np.exp(-n)) if form == "cycles" else 1 / (1 + 0.3 * np.log(1 + n))
    assert force[-501] / x[-501] == pytest.approx(1e4 * left, rel=1e-9)
    # of cycles far below the width the path counts
    one = effect("cyclic_degradation", form)
    (rate,) = one.rates(REST._replace(x=1e-3, v=-0.2), (0.0,), (0.3, 2.0, 1.0))
    assert rate == pytest.approx(0.2 / 4, rel=1e-5)
    # and earlier tests as in one of the same amplitude
    past = NEW._replace(deformation=amplitude, travel=12 * amplitude, cycles=3.0)
    assert one.carried(past, (0.3, 2.0, 1e-4)) == (pytest.approx(3.0),)
    assert one.carried(past, (0.3, 2.0, 10.0))[0] == pytest.approx(0.3 * amplitude, rel=1e-3)
    assert one.carried(NEW, (0.3, 2.0, 1e-4)) == (0.0,)


def test_stress_softening_has_the_shapes_of_amplitude_softening():
    """The memory alone tells these two causes apart."""
    for x in (1e-3, 4e-3, 20e-3):
        at, states = REST._replace(x=0.0), (x,)
        past = effect("stress_softening", "hill").factor(at, states, (0.6, 4e-3, 1.2))
        now = effect("amplitude_softening", "kraus").factor(at, states, (0.6, 4e-3, 1.2, 5.0))
        assert past == pytest.approx(now, rel=1e-12)
        past = effect("stress_softening", "power").factor(at, states, (0.3, 4e-3))
        now = effect("amplitude_softening", "power").factor(at, states, (0.3, 4e-3, 5.0))
        assert past == pytest.approx(now, rel=1e-12)


@pytest.mark.parametrize(
    ("wears", "heats", "means"),
    [
        ("unlimited", "exponential", ()),
        ("inelastic_unlimited", "dissipation", (0.4, 5e-6)),
    ],
)
def test_degradation_without_an_end_is_self_heating_without_cooling(wears, heats, means):
    at = REST._replace(force=200.0, x=1e-3, v=0.05)
    wear, heat = effect("cyclic_degradation", wears), effect("self_heating", heats)
    for dissipated in (-5.0, 0.0, 50.0):
        worn, warm = (dissipated, *means), (4e-3 * dissipated, *means)
        assert wear.factor(at, worn, (4e-3,)) == pytest.approx(heat.factor(at, warm, (4e-3, 1e9)))
        assert 4e-3 * wear.rates(at, worn, (4e-3,))[0] == pytest.approx(
            heat.rates(at, warm, (4e-3, 1e9))[0], rel=1e-6
        )


def test_damage_counts_the_dissipated_work():
    t, x, v = sine(5e-3, 1.0, 3)
    for form, numbers in (("dissipation", {"loss": 0.3, "scale": 0.1}), ("unlimited", {"loss": 5})):
        device = spring((f"cyclic_degradation.{form}", numbers))
        _, (work,) = respond(device, t, x, v, 0.0, tolerance=1e-8)
        # a spring gives back all of its work
        assert abs(work[-1]) < 0.05 * np.max(work)


@pytest.mark.parametrize("a", [40.0, -40.0])
def test_one_side_softens_and_the_other_is_left_alone(a):
    one = effect("tension_compression_asymmetry", "one_sided")
    factors = [one.factor(REST._replace(x=x), (), (a,)) for x in (-5e-3, 5e-3)]
    assert sorted(factors) == pytest.approx([1 / 1.2, 1.0])
    assert (factors[0] < 1) == (a > 0)


def test_spring_of_two_stiffnesses():
    one, numbers = effect("tension_compression_asymmetry", "spring"), (2e4, 1e-3)
    for x in (-20e-3, -3e-3, 1e-4, 5e-3):
        step = 1e-7
        energies = [one.stored_energy(x + s, (), numbers) for s in (-step, step)]
        force = one.force(REST._replace(x=x), (), numbers)
        assert force == pytest.approx((energies[1] - energies[0]) / (2 * step), rel=1e-5)
    assert one.force(REST._replace(x=1e-5), (), numbers) == pytest.approx(1e4 * 1e-7, rel=1e-3)
    rise = one.force(REST._replace(x=1.0), (), numbers) - one.force(
        REST._replace(x=0.9), (), numbers
    )
    assert rise == pytest.approx(2e3, rel=1e-3)


@pytest.mark.parametrize("direction", [1, -1])
def test_gas_of_an_accumulator(direction):
    one, area, pressure, length = effect("tension_compression_asymmetry", "gas"), 1e-3, 2e6, 0.05
    numbers = direction * area * pressure / length, length
    x = direction * np.array([-0.04, -0.01, 1e-5, 0.02, 0.045])
    volume = area * (length - direction * x)
    # Boyle: pressure times volume stays; less the force at rest and the stiffness there
    beyond = area * pressure * (area * length / volume - 1 - direction * x / length)
    force = one.force(REST._replace(x=x), (), numbers)
    np.testing.assert_allclose(force, direction * beyond, rtol=1e-9, atol=1e-6)
    # compressed to nothing and beyond: finite, and the force is still that of its potential
    for far in np.concatenate([x, direction * np.array([0.0475, 0.05, 0.2])]):
        energies = [one.stored_energy(far + s, (), numbers) for s in (-1e-7, 1e-7)]
        slope = (energies[1] - energies[0]) / 2e-7
        assert one.force(REST._replace(x=far), (), numbers) == pytest.approx(slope, rel=1e-3)


@pytest.mark.parametrize(
    ("form", "size", "further"),
    [("spring_by_current", {"stiffness": 2e3}, {"width": 1e-6}),
     ("dashpot_by_current", {"damping": 300.0}, {})],
)  # fmt: skip
def test_an_asymmetry_follows_the_current(form, size, further):
    numbers = size | {"by_current": 0.5} | further
    device = spring((f"tension_compression_asymmetry.{form}", numbers))
    t, x, v = sine(0.004, 1.0, 1)
    motion = x if "stiffness" in size else v
    for current in (0.0, 2.0, -2.0):
        force, _ = respond(device, t, x, v, np.full(t.size, current), np.zeros(0), 1e-9)
        difference = sum(size.values()) * (1 + 0.5 * abs(current))
        np.testing.assert_allclose(force, 1e4 * x + difference * np.abs(motion), atol=0.01)


def test_the_coil_warms_the_device_without_motion():
    numbers = {"gain": 1e-3, "cooling": 8.0, "resistance": 10.0}
    current, held = 2.0, 0.005
    device = spring(("self_heating.coil", numbers))
    t, x, v = still(20.0)
    force, _ = respond(device, t, x + held, v, np.full(t.size, current), np.zeros(1), 1e-9)
    heat = 1e-3 * 10.0 * current**2 * 8.0 * (1 - np.exp(-t / 8.0))
    np.testing.assert_allclose(force, 1e4 * held * np.exp(-heat), rtol=1e-6)
    # and by its motion as without the coil
    coil, work = effect("self_heating", "coil"), effect("self_heating", "exponential")
    moving = REST._replace(v=0.3, force=50.0)
    assert coil.rates(moving, (0.1,), (1e-3, 8.0, 10.0)) == work.rates(moving, (0.1,), (1e-3, 8.0))


def test_a_field_of_which_a_part_finds_another_way():
    hill = effect("field_gap_coupling", "hill").current
    at = REST._replace(current=2.0, x=np.array([-0.02, 0.0, 0.02, 1e3]))
    np.testing.assert_allclose(hill(at, (), (0.6, 0.02, 3.0)), [1.4, 2.0, 1.4, 0.8], rtol=1e-6)
    # above a loss of 1 the field vanishes, and comes back nowhere
    at = at._replace(x=np.array([0.02, 0.021, 1.0]))
    np.testing.assert_allclose(hill(at, (), (2.0, 0.02, 1.0)), 0.0, atol=1e-6)


def test_an_arm_is_stiffer_in_the_field():
    arm = effect("extra_relaxation", "by_current")
    force = arm.force(REST._replace(current=2.0), (0.01,), (1e4, 0.3, 0.5))
    assert force == pytest.approx(200.0, rel=1e-12)
    assert arm.rates(REST._replace(v=0.1), (0.03,), (1e4, 0.3, 0.5)) == (pytest.approx(0.0),)


def test_a_thinning_viscosity_grows_with_the_current():
    plain, field = (effect("weak_rate_dependence", f) for f in ("thinning", "thinning_by_current"))
    at, numbers = REST._replace(v=0.3, current=-2.0), (500.0, 0.1, 0.4)
    assert plain.force(at, (), numbers) == pytest.approx(500 * 0.3 * 10**-0.3, rel=1e-12)
    assert field.force(at, (), (*numbers, 0.5)) == 2 * plain.force(at, (), numbers)


def test_friction_grows_with_the_stroke():
    one = effect("coulomb_friction", "stroke")
    at = REST._replace(x=np.array([-0.02, 0.0, 0.02]), v=1.0)
    np.testing.assert_allclose(one.force(at, (), (100.0, 50.0, 0.01)), [200.0, 100.0, 200.0])


def test_a_stop_gives_back_less_than_it_took():
    numbers = {"stiffness": 1e5, "gap": 0.01, "exponent": 1.5, "damping": 2.0}
    device = spring(("end_stop.dissipating", numbers))
    t, x, v = sine(0.015, 1.0, 1)
    force, _ = respond(device, t, x, v, 0 * t, np.zeros(0), 1e-9)
    u = np.maximum(np.abs(x) - 0.01, 0)
    elastic = 1e4 * x + 1e5 * 1e-3 * (u / 1e-3) ** 1.5 * np.sign(x)
    np.testing.assert_allclose(force, 1e4 * x + (elastic - 1e4 * x) * (1 + 2 * v * np.sign(x)))
    stop = effect("end_stop", "dissipating")
    # it may not pull, and leaves the fast way back without force
    assert stop.force(REST._replace(x=0.02, v=-0.6), (), (1e5, 0.01, 1.5, 2.0)) == 0
