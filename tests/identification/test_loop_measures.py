"""Loop measures against closed forms, and against what spoils measured loops."""

from __future__ import annotations

from math import erf

import numpy as np
import pytest

from isolation_sim.errors import InputError
from isolation_sim.identification.loop_measures import loop_measures

X = 4e-3


def sinusoid(frequency=1.0, cycles=10.3, rate=256, amplitude=X, phase=1.0):
    omega = 2 * np.pi * frequency
    t = np.arange(0, cycles / frequency, 1 / (rate * frequency))
    return t, amplitude * np.cos(omega * t + phase), -omega * amplitude * np.sin(omega * t + phase)


@pytest.mark.parametrize("frequency", [0.1, 1.0, 4.0])
@pytest.mark.parametrize("rate", [40, 256.3])
@pytest.mark.parametrize(("k", "c"), [(3e4, 1e3), (3e4, 0.0), (200.0, 2e3)])
def test_kelvin_voigt(frequency, rate, k, c):
    t, x, v = sinusoid(frequency, rate=rate)
    omega = 2 * np.pi * frequency
    m = loop_measures(t, x, k * x + c * v)
    modulus = np.hypot(k, c * omega)
    expected = {
        "amplitude": X,
        "effective_stiffness": k,
        "effective_stiffness_half": k,
        "dynamic_stiffness": modulus,
        "energy_per_cycle": np.pi * c * omega * X**2,
        "equivalent_damping": c,
        "damping_ratio": c * omega / (2 * k),
        "storage_stiffness": k,
        "loss_stiffness": c * omega,
        "loss_damping": c,
        "displacement_offset": 0.0,
        "force_offset": 0.0,
    }
    assert m.frequency == pytest.approx(frequency, rel=1e-6)
    assert m.n_cycles == 9 and m.n_left_out == 0
    assert set(m.measures) == set(expected)
    slack = {
        "effective_stiffness": 3e-5 * modulus,
        "effective_stiffness_half": 3e-5 * modulus,
        "dynamic_stiffness": 3e-4 * modulus,
        "damping_ratio": 2e-4 * expected["damping_ratio"] * modulus / k + 1e-9,
    }
    if rate < 100:  # the force is interpolated between few samples
        slack = {name: 30 * value for name, value in slack.items()}
    for name, value in expected.items():
        tolerance = slack.get(name, 1e-6 * abs(value) + 1e-11 * modulus)
        assert m.measures[name].value == pytest.approx(value, abs=tolerance), name
        assert m.measures[name].uncertainty <= tolerance


def test_standard_solid():
    k0, k1, c0 = 200.0, 7000.0, 2000.0
    omega = 2 * np.pi
    stiffness = k1 * (k0 + 1j * omega * c0) / (k0 + k1 + 1j * omega * c0)
    t = np.arange(0, 8, 1 / 200)
    x, f = X * np.sin(omega * t), X * np.imag(stiffness * np.exp(1j * omega * t))
    m = loop_measures(t, x, f)
    assert m.storage_stiffness.value == pytest.approx(stiffness.real, rel=1e-6)
    assert m.loss_stiffness.value == pytest.approx(stiffness.imag, rel=1e-6)
    assert m.effective_stiffness.value == pytest.approx(stiffness.real, rel=1e-4)
    assert m.damping_ratio.value == pytest.approx(stiffness.imag / stiffness.real / 2, rel=1e-4)
    assert m.energy_per_cycle.value == pytest.approx(np.pi * stiffness.imag * X**2, rel=1e-6)


@pytest.mark.parametrize("amplitude", [2e-3, 4e-3, 8e-3])
@pytest.mark.parametrize("smoothing", [None, 1e-3])
def test_hybrid_jumps_at_reversal(amplitude, smoothing):
    alpha, beta, gamma, sigma = 50.0, 430.0, 25.0, 12.8e-6**0.5
    t, x, v = sinusoid(amplitude=amplitude)
    sign = np.sign(v) if smoothing is None else np.tanh(v / smoothing)
    f = alpha * np.sinh(beta * x) + gamma * np.exp(-(x**2) / (2 * sigma**2)) * sign
    m = loop_measures(t, x, f)
    stiffness = alpha * np.sinh(beta * amplitude) / amplitude
    energy = 2 * gamma * sigma * np.sqrt(2 * np.pi) * erf(amplitude / (sigma * np.sqrt(2)))
    # sinh(3.4) at 8 mm turns within few samples of the end
    assert m.effective_stiffness.value == pytest.approx(stiffness, rel=3e-3)
    assert m.effective_stiffness_half.value == pytest.approx(stiffness, rel=3e-3)
    assert m.energy_per_cycle.value == pytest.approx(energy, rel=3e-3 if smoothing else 1e-4)
    ratio = energy / (2 * np.pi * stiffness * amplitude**2)
    assert m.damping_ratio.value == pytest.approx(ratio, rel=5e-3)
    if smoothing is None:
        s = np.linspace(0, amplitude, 2000)
        largest = np.max(alpha * np.sinh(beta * s) + gamma * np.exp(-(s**2) / (2 * sigma**2)))
        assert m.dynamic_stiffness.value == pytest.approx(largest / amplitude, rel=0.015)


def test_offset_and_drift_do_not_matter():
    t, x, v = sinusoid()
    f = 3e4 * x + 1e3 * v
    clean = loop_measures(t, x, f)
    spoilt = loop_measures(t, x + 0.01 + 5e-4 * t, f + 500 + 30 * t)
    for name, measure in clean.measures.items():
        if not name.endswith("offset"):
            assert spoilt.measures[name].value == pytest.approx(measure.value, rel=1e-6), name
    assert spoilt.displacement_offset.value == pytest.approx(0.01 + 5e-4 * 5.15, rel=0.05)
    assert spoilt.force_offset.value == pytest.approx(500 + 30 * 5.15, rel=0.05)


@pytest.mark.parametrize("cycles", [3.9, 4.0, 4.5, 7.77])
@pytest.mark.parametrize("phase", [0.0, 2.0, 4.0])
def test_partial_cycles_do_not_matter(cycles, phase):
    t, x, v = sinusoid(cycles=cycles, phase=phase)
    m = loop_measures(t, x, 3e4 * x + 1e3 * v)
    assert m.frequency == pytest.approx(1.0, rel=1e-5)
    assert m.n_cycles >= int(cycles) - 1
    assert m.effective_stiffness.value == pytest.approx(3e4, rel=1e-4)
    assert m.loss_damping.value == pytest.approx(1e3, rel=1e-4)


def test_uncertainty_covers_the_noise():
    rng = np.random.default_rng(3)
    t, x, v = sinusoid(cycles=12.3)
    f = 3e4 * x + 1e3 * v
    expected = {"effective_stiffness": 3e4, "energy_per_cycle": 2e3 * np.pi**2 * X**2}
    expected |= {"storage_stiffness": 3e4, "loss_damping": 1e3}
    scores: dict[str, list[float]] = {name: [] for name in expected}
    for _ in range(40):
        noisy_f = f + 0.02 * np.std(f) * rng.standard_normal(t.size)
        m = loop_measures(t, x + 0.01 * X * rng.standard_normal(t.size), noisy_f)
        for name, value in expected.items():
            measure = m.measures[name]
            assert measure.value == pytest.approx(value, rel=0.01)
            scores[name].append((measure.value - value) / measure.uncertainty)
    for name, score in scores.items():
        assert np.mean(np.abs(score) < 2.2) > 0.8, name  # 95 % by Student's t of 11 cycles


def test_ramps_are_left_out_and_cycles_skipped():
    t, x, v = sinusoid(cycles=12.5)
    ramp = np.clip(t / 2.5, 0, 1)
    m = loop_measures(t, ramp * x, ramp * (3e4 * x + 1e3 * v))
    assert m.n_left_out >= 2 and m.amplitude.value == pytest.approx(X, rel=5e-3)
    assert loop_measures(t, x, 3e4 * x, skip=5).n_cycles == 6


def test_rest_before_and_after_is_left_out():
    t = np.arange(0, 20, 1 / 200)
    x = np.where((t > 6) & (t < 14), X * (np.cos(2 * np.pi * t) - 1), 0.0)
    m = loop_measures(t, x, 3e4 * x)
    assert m.n_cycles >= 5 and m.n_cycles + m.n_left_out >= 18
    assert m.amplitude.value == pytest.approx(X, rel=5e-3)
    assert m.effective_stiffness.value == pytest.approx(3e4, rel=1e-3)


def test_fast_drift_is_not_taken_for_the_motion():
    t, x, v = sinusoid()
    m = loop_measures(t, x + 0.8 * X * t, 3e4 * x + 1e3 * v)
    assert m.frequency == pytest.approx(1.0, rel=1e-5)
    assert m.effective_stiffness.value == pytest.approx(3e4, rel=1e-4)


def test_a_pure_damper_has_no_damping_ratio():
    t, x, v = sinusoid()
    m = loop_measures(t, x, 1e3 * v - 100 * x)
    assert np.isnan(m.damping_ratio.value)
    assert m.equivalent_damping.value == pytest.approx(1e3, rel=1e-4)


def test_frequency_may_be_given():
    t, x, v = sinusoid()
    assert loop_measures(t, x, v, frequency=1.0).frequency == 1.0


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda t, x: (t[:500], x[:500], x[:500]), "1 whole cycles of"),
        (lambda t, x: (t, x, x[1:]), "one shape"),
        (lambda t, x: (t, x, np.where(t > 5, np.nan, x)), "force: sample 1281 is nan"),
        (lambda t, x: (t[::-1], x, x), "one step throughout"),
        (lambda t, x: (t + (t > 5), x, x), "one step throughout"),
        (lambda t, x: (t[::20], x[::20], x[::20]), "12.8 samples a cycle"),
        (lambda t, x: (t, np.random.default_rng(0).standard_normal(t.size), x), "accepted"),
        (lambda t, x: (t, x * np.exp(-t / 6), x), "amplitude"),
        (lambda t, x: (t[:9], x[:9], x[:9]), "at least 16"),
        (lambda t, x: (t, 0 * x, x), "accepted"),
        (lambda t, x: (t, np.arcsin(0.9999 * x / X), x), "98.6 % of the displacement's power"),
    ],
)
def test_refused(make, told):
    t, x, _ = sinusoid()
    with pytest.raises(InputError, match=told) as caught:
        loop_measures(*make(t, x))
    assert "accepted" in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("options", [{"frequency": -1.0}, {"skip": -1}, {"skip": 9}])
def test_options_refused(options):
    t, x, _ = sinusoid()
    with pytest.raises(InputError, match="accepted"):
        loop_measures(t, x, x, **options)


def test_measured_damper(shared_data):
    from isolation_sim.identification.campaign import read_campaign

    for run in read_campaign(shared_data / "mr_damper").runs:
        nominal = float(run.name.split("_")[1][:-2])
        m = loop_measures(run.time, run.displacement, run.force)
        assert m.frequency == pytest.approx(nominal, rel=0.03)
        assert m.n_cycles >= 4
        assert m.energy_per_cycle.value > 0
        assert m.energy_per_cycle.uncertainty < 0.05 * m.energy_per_cycle.value
