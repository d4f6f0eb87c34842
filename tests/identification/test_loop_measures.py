"""Loop measures against closed forms, and against what spoils measured loops."""

from __future__ import annotations

from math import erf

import numpy as np
import pytest

from isolation_sim.errors import InputError
from isolation_sim.identification.loop_measures import loop_measures
from isolation_sim.identification.sinusoidal import sinusoidal
from isolation_sim.laws import available_laws, available_sets, law

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


def test_frequency_may_be_prescribed():
    t, x, v = sinusoid()
    assert loop_measures(t, x, v, frequency=1.0).frequency == 1.0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda t, x: (t[:500], x[:500], x[:500]), "1 whole cycles of"),
        (lambda t, x: (t, x, x[1:]), "one shape"),
        (lambda t, x: (t, x, np.where(t > 5, np.nan, x)), "force: sample 1281: given nan"),
        (lambda t, x: (t[::-1], x, x), "one step throughout"),
        (lambda t, x: (t + (t > 5), x, x), "one step throughout"),
        (lambda t, x: (t[::20], x[::20], x[::20]), "12.8 samples a cycle"),
        (lambda t, x: (t, np.random.default_rng(0).standard_normal(t.size), x), "expected"),
        (lambda t, x: (t, x * np.exp(-t / 6), x), "amplitude"),
        (lambda t, x: (t[:9], x[:9], x[:9]), "at least 16"),
        (lambda t, x: (t, 0 * x, x), "expected"),
        (lambda t, x: (t, np.arcsin(0.9999 * x / X), x), "98.6 % of the displacement's power"),
    ],
)
def test_refused(make, message):
    t, x, _ = sinusoid()
    with pytest.raises(InputError, match=message) as caught:
        loop_measures(*make(t, x))
    assert "expected" in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("options", [{"frequency": -1.0}, {"skip": -1}, {"skip": 9}])
def test_options_refused(options):
    t, x, _ = sinusoid()
    with pytest.raises(InputError, match="expected"):
        loop_measures(t, x, x, **options)


def test_measured_damper(shared_data):
    from isolation_sim.identification.campaign import read_campaign

    for run in read_campaign(shared_data / "mr_damper").runs[::2]:
        nominal = float(run.name.split("_")[1][:-2])
        m = loop_measures(run.time, run.displacement, run.force)
        assert m.frequency == pytest.approx(nominal, rel=0.03)
        assert m.n_cycles >= 4
        assert m.energy_per_cycle.value > 0
        assert m.energy_per_cycle.uncertainty < 0.05 * m.energy_per_cycle.value


def closed_forms():
    """Forces over the phase of a sinusoid, and what the measures are due to be, by dense sums."""
    sine, cosine = np.sin, np.cos

    def hybrid(p):
        jump = 25 * np.exp(-2.5 * sine(p) ** 2) * np.sign(cosine(p))
        return 50 * np.sinh(3.4 * sine(p)) + jump

    def asymmetric(p):  # as the improved Bouc-Wen law, whose stiffness is lower in extension
        return 100 * sine(p) * (1 - 0.13 * (sine(p) >= 0)) + 20 * cosine(p)

    def valved(p):  # its damping vanishes while the deformation returns
        return 100 * sine(p) + 20 * cosine(p) * ((cosine(p) >= 0) | (sine(p) < 0.2))

    return {
        "seventh power": (lambda p: 100 * sine(p) ** 7 + 20 * cosine(p), 1e-6),
        "hyperbolic sine": (lambda p: 50 * np.sinh(4.2 * sine(p)) + 300 * cosine(p), 1e-6),
        "hybrid": (hybrid, 1e-6),
        # a corner or a step between two samples moves the sums over them
        "asymmetric": (asymmetric, 2e-5),
        "valved": (valved, 1e-3),
    }


def due(force, amplitude):
    """Measures of a loop by sums over two million points, and by the force's limits."""
    n = 2_000_000
    p = 2 * np.pi * (np.arange(n) + 0.5) / n
    f = force(p)
    near = 1e-9
    top, bottom = (
        (force(np.array([end - near])) + force(np.array([end + near])))[0] / 2
        for end in (np.pi / 2, 1.5 * np.pi)
    )
    middle = (force(np.array([0.0])) + force(np.array([np.pi])))[0] / 2
    return {
        "effective_stiffness": (top - bottom) / (2 * amplitude),
        "effective_stiffness_half": (top - middle) / amplitude,
        "dynamic_stiffness": (max(f.max(), force(np.array([np.pi / 2 - near]))[0]) - middle)
        / amplitude,
        "energy_per_cycle": 2 * np.pi * amplitude * np.mean(f * np.cos(p)),
        "storage_stiffness": 2 * np.mean(f * np.sin(p)) / amplitude,
    }


@pytest.mark.parametrize("loop", closed_forms())
@pytest.mark.parametrize("mean", [0.0, -3.5e-3])
def test_nonlinear_loops_without_noise(loop, mean):
    force, slack = closed_forms()[loop]
    phase = 2 * np.pi * np.arange(0, 6.3, 1 / 256.3) + 0.3
    # a preload, and what a sensor adds to the force
    m = loop_measures(phase / (2 * np.pi), mean + X * np.sin(phase), 40 + force(phase))
    for name, value in due(force, X).items():
        assert m.measures[name].value == pytest.approx(value, rel=slack), name
    assert m.displacement_offset.value == pytest.approx(mean, abs=1e-9)


@pytest.mark.parametrize("rate", [16, 40, 64])
def test_harmonics_are_exact_at_few_samples(rate):
    force = closed_forms()["seventh power"][0]
    phase = 2 * np.pi * np.arange(0, 6.3, 1 / rate) + 0.3
    m = loop_measures(phase / (2 * np.pi), X * np.sin(phase), force(phase), frequency=1.0)
    for name, value in due(force, X).items():
        assert m.measures[name].value == pytest.approx(value, rel=1e-6), name


@pytest.mark.parametrize("loop", ["linear", "seventh power", "asymmetric", "hybrid"])
def test_noise_does_not_bias(loop):
    forces = {"linear": lambda p: 120 * np.sin(p) + 25 * np.cos(p)}
    force = (forces | {name: pair[0] for name, pair in closed_forms().items()})[loop]
    phase = 2 * np.pi * np.arange(0, 8.3, 1 / 128) + 0.3
    f, rng, expected = force(phase), np.random.default_rng(11), due(force, X)
    results: dict[str, list[float]] = {name: [] for name in expected}
    for _ in range(20):
        x = X * np.sin(phase) + 0.01 * X * rng.standard_normal(phase.size)
        noisy = f + 0.03 * np.std(f) * rng.standard_normal(phase.size)
        m = loop_measures(phase / (2 * np.pi), x, noisy, frequency=1.0)
        for name, values in results.items():
            values.append(m.measures[name].value)
    for name, values in results.items():
        error = np.std(values, ddof=1) / np.sqrt(len(values))
        assert error < 2e-2 * abs(expected[name])
        # a jump of 2 N in 750 N is found in few of the records: 0.3 % of the largest force
        missed = 3e-3 if (loop, name) == ("hybrid", "dynamic_stiffness") else 0.0
        off = abs(np.mean(values) - expected[name])
        assert off < 3.2 * error + missed * expected[name], name


@pytest.mark.parametrize("name", available_laws())
@pytest.mark.parametrize("mean", [0.0, pytest.param(-1.0, marks=pytest.mark.slow)])
def test_every_law_under_a_sinusoid(name, mean, numbers):
    device = law(name, None if available_sets(name) else numbers[name])
    amplitude = min(device.deformation_scale, X)
    points, measured = 512, 5
    motion = sinusoidal(device, amplitude, 1.0, 1.0, 12, points, mean_deformation=mean * amplitude)
    last = slice(-measured * points, None)
    v, f = (a[last].reshape(measured, points) for a in motion[2:4])
    # the samples that the measures get miss the ends of the stroke
    every = slice(-measured * points + 1, None, 2)
    m = loop_measures(
        motion.time[every], motion.displacement[every], motion.force[every], frequency=1.0
    )
    ends, (up, down) = np.roll(f, 1, axis=1)[:, [128, 384]], np.roll(f, 1, axis=1)[:, [0, 256]].T
    middle = np.mean(up + down) / 2
    expected = {
        "effective_stiffness": np.mean(ends[:, 0] - ends[:, 1]) / (2 * amplitude),
        "effective_stiffness_half": (np.mean(ends[:, 0]) - middle) / amplitude,
        "dynamic_stiffness": (np.max(np.mean(f, axis=0)) - middle) / amplitude,
        "energy_per_cycle": np.mean(f * v),
    }
    modulus = np.max(np.abs(f - middle)) / amplitude
    sizes = {"energy_per_cycle": np.pi * modulus * amplitude**2}
    # corners between samples; a jump within two samples; branches that relax over 50 s
    slack = {"improved_bouc_wen": 1e-3, "hybrid": 1e-3, "spring_pot": 1e-4}
    slack["dynamic_stiffness"] = 1e-4
    slack |= {"spencer": 3e-4, "gamota_filisko": 1e-3, "rate_dependent_bouc_wen": 1e-4}
    slack |= {"park_wen_ang": 3e-4, "friction_pendulum": 3e-4, "sliding_bearing": 1e-4}
    for measure, value in expected.items():
        off = abs(m.measures[measure].value - value) / sizes.get(measure, modulus)
        assert off < slack.get(name, 2e-5), (measure, off)
