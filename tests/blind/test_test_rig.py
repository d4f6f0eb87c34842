"""Faults of a test rig and of a device, made by SciPy and NumPy, and what a diagnosis names."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, lfilter, sosfilt

from isolation_sim.discrepancy.diagnose import diagnose
from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.identification.measured.velocity import smooth

DT = 0.004
TESTS = ((0.004, 3.0), (0.008, 1.5), (0.012, 1.0), (0.02, 0.5), (0.015, 0.8), (0.006, 2.2))
HELD_OUT = (2, 5)


def rig(recorded, behind, friction=120.0, zero=0.0, growth=0.0, corner=np.inf):
    """Friction and viscosity behind a linkage; the force channel has 0.5 % of noise.

    ``zero`` is the displacement shown without deformation, m; ``growth`` that of the stiffness
    with the current, 1/A; ``corner`` that of the displacement's filter of first order, Hz.
    """
    random = np.random.default_rng(8)
    runs = []
    for k, (size, frequency) in enumerate(TESTS):
        time = np.arange(0, 3 / frequency, DT)
        fine = np.linspace(0, time[-1], 20 * (len(time) - 1) + 1)
        # from rest to full size within half a cycle
        x = size * np.minimum(2 * frequency * fine, 1) * np.sin(2 * np.pi * frequency * fine)
        y = behind(x)
        v = np.gradient(y, fine)
        current = float(k % 2) if growth else 0.0
        spring = 9e3 * (1 + growth * current)
        force = recorded(spring * y + 700 * v + friction * np.tanh(v / 0.01), fine[1])[::20]
        force = force + 0.005 * np.std(force) * random.standard_normal(len(force))
        if corner < np.inf:
            part = np.exp(-2 * np.pi * corner * fine[1])
            x = lfilter([1 - part], [1, -part], x)
        seen, velocity = zero + x[::20], np.gradient(x, fine)[::20]
        held = k in HELD_OUT
        runs.append(
            TestRun(f"run{k}", time, seen, velocity, force, current + 0 * time, hold_out=held)
        )
    return Campaign("rig", "SciPy", tuple(runs))


def as_it_is(values, step=0.0):
    return values


def filtered(force, step):
    b, a = butter(2, 10.0 * 2 * step)
    return lfilter(b, a, force)


def loose(x):
    y = np.zeros(len(x))
    for k in range(1, len(x)):
        y[k] = min(max(y[k - 1], x[k] - 5e-4), x[k] + 5e-4)
    return y


def test_a_butterworth_filter_is_named_with_its_delay():
    diagnosis = diagnose(rig(filtered, as_it_is), "hyperbolic_tangent", threads=1)
    assert [(cause.name, cause.form) for cause in diagnosis.causes] == [
        ("sensor_delay", "butterworth")
    ]
    # the effect's shortest time is part of the delay
    delay = diagnosis.causes[0].parameters["delay"].value + 5e-4
    assert delay == pytest.approx(np.sqrt(2) / (2 * np.pi * 10.0), rel=0.03)
    assert diagnosis.error_after.held_out < 0.02 < diagnosis.error_before.held_out


def test_a_filter_of_the_displacement_is_named_with_its_time_constant():
    tests = rig(as_it_is, as_it_is, corner=8.0)
    diagnosis = diagnose(tests, "hyperbolic_tangent", tiers="causes", threads=1)
    (cause,) = diagnosis.causes
    assert (cause.name, cause.form) == ("sensor_delay", "displacement_filter")
    assert cause.parameters["delay"].value == pytest.approx(1 / (2 * np.pi * 8.0), rel=0.03)
    assert diagnosis.error_after.held_out < 0.01 < diagnosis.error_before.held_out


def test_backlash_is_named_first_with_its_gap():
    diagnosis = diagnose(rig(as_it_is, loose), "hyperbolic_tangent", tiers="causes", threads=1)
    assert diagnosis.causes[0].name == "linkage_backlash"
    assert diagnosis.causes[0].parameters["gap"].value == pytest.approx(5e-4, rel=0.15)
    assert diagnosis.error_after.held_out < 0.5 * diagnosis.error_before.held_out


def test_a_displacement_off_zero_is_distinguished_from_a_force_off_zero():
    tests = rig(as_it_is, as_it_is, friction=0.0, zero=8e-4, growth=0.5)
    diagnosis = diagnose(tests, "kelvin_voigt", threads=1)
    (cause,) = diagnosis.causes
    assert (cause.name, cause.form) == ("force_offset", "displacement")
    assert cause.parameters["offset"].value == pytest.approx(8e-4, rel=0.05)
    assert diagnosis.error_after.held_out < 0.01 < diagnosis.error_before.held_out


def test_nothing_is_named_where_the_rig_is_right():
    diagnosis = diagnose(rig(as_it_is, as_it_is), "hyperbolic_tangent", threads=1)
    assert diagnosis.verdict == "adequate" and not diagnosis.causes


def warming(behind, velocity, step):
    """A spring beside friction, which falls as its own work warms it; 40 s of cooling."""
    force, heat = np.empty(len(behind)), 0.0
    for k, (y, v) in enumerate(zip(behind, velocity, strict=True)):
        friction = 250 * np.exp(-heat) * np.tanh(v / 0.01)
        force[k] = 9e3 * y + friction
        heat += step * (2e-2 * friction * v - heat / 40)
    return force


@pytest.mark.slow
def test_heat_of_the_core_is_named_with_its_gain_and_the_stiffness_around_it():
    random = np.random.default_rng(3)
    runs = []
    for k, (size, frequency) in enumerate(TESTS):
        fine = np.arange(0, 12 / frequency, DT / 10)
        x = size * np.sin(2 * np.pi * frequency * fine)
        v = 2 * np.pi * frequency * size * np.cos(2 * np.pi * frequency * fine)
        force = warming(x, v, fine[1])[::10]
        force = force + 0.01 * np.std(force) * random.standard_normal(len(force))
        held = k in HELD_OUT
        time, x, v = fine[::10], x[::10], v[::10]
        runs.append(TestRun(f"run{k}", time, x, v, force, 0 * time, hold_out=held))
    campaign = Campaign("bearing", "NumPy", tuple(runs))
    diagnosis = diagnose(campaign, "hyperbolic_tangent", threads=1)
    assert [(cause.name, cause.form) for cause in diagnosis.causes] == [("self_heating", "core")]
    numbers = diagnosis.causes[0].parameters
    assert numbers["gain"].low < 2e-2 < numbers["gain"].high
    assert numbers["stiffness"].low < 9e3 < numbers["stiffness"].high
    assert diagnosis.verdict == "explained"


def test_heat_by_the_magnitude_of_the_power_is_named_with_its_cooling():
    random = np.random.default_rng(3)
    runs = []
    for k, (size, frequency) in enumerate(TESTS):
        time, omega = np.arange(0, 12 / frequency, DT), 2 * np.pi * frequency
        x, v = size * np.sin(omega * time), size * omega * np.cos(omega * time)
        force, heat = 9e3 * x + 700 * v + 120 * np.tanh(v / 0.01), 0.0
        for i in range(len(time)):
            force[i] *= np.exp(-heat)
            heat += DT * (6e-3 * abs(force[i] * v[i]) - heat / 8)
        force += 0.005 * np.std(force) * random.standard_normal(len(time))
        held = k in HELD_OUT
        runs.append(TestRun(f"run{k}", time, x, v, force, 0 * time, hold_out=held))
    campaign = Campaign("bearing", "NumPy", tuple(runs))
    diagnosis = diagnose(campaign, "hyperbolic_tangent", tiers="causes", threads=1)
    (cause,) = diagnosis.causes
    assert (cause.name, cause.form) == ("self_heating", "absolute_power")
    assert cause.parameters["cooling"].value == pytest.approx(8, rel=0.03)
    assert cause.parameters["gain"].value == pytest.approx(6e-3, rel=0.03)


def bench(law, currents=(0.0,), noise=0.005, displacement=None, seed=11, tests=TESTS):
    """Runs of a device whose force is a function of motion and current, at every current."""
    random = np.random.default_rng(seed)
    runs = []
    for current in currents:
        for k, (size, frequency) in enumerate(tests):
            time = np.arange(0, 6 / frequency, DT)
            omega = 2 * np.pi * frequency
            x, v = size * np.sin(omega * time), size * omega * np.cos(omega * time)
            force = law(x, v, -(omega**2) * x, current)
            force = force + noise * np.std(force) * random.standard_normal(len(time))
            seen = x if displacement is None else x + displacement(random, len(time))
            runs.append(TestRun(
                f"run{k}_{current:g}", time, seen, smooth(seen, DT)[1], force,
                np.full(len(time), current), hold_out=k in HELD_OUT,
            ))  # fmt: skip
    return Campaign("bench", "NumPy", tuple(runs))


def named(campaign, **options):
    diagnosis = diagnose(campaign, "kelvin_voigt", tiers="causes", threads=1, **options)
    return diagnosis, [cause.name for cause in diagnosis.causes]


@pytest.mark.slow
def test_a_mass_is_measured_behind_an_amplifier_that_filters_the_displacement():
    # 10 um of noise up to 15 Hz, whose acceleration is as large as that of the slow tests
    sections = butter(4, 15.0 * 2 * DT, output="sos")

    def noise(random, n):
        return 3e-5 * sosfilt(sections, random.standard_normal(n))

    campaign = bench(lambda x, v, a, i: 2e4 * x + 300 * v + 8 * a, displacement=noise)
    diagnosis, names = named(campaign)
    assert names == ["inertia_force"]
    assert diagnosis.causes[0].parameters["mass"].value == pytest.approx(8, rel=0.02)
    assert diagnosis.error_after.held_out < 1.5 * diagnosis.noise_floor


@pytest.mark.parametrize(
    ("spring", "form"),
    [
        (lambda s: s**3, "x^3"),
        pytest.param(lambda s: s * np.abs(s), "x |x|", marks=pytest.mark.slow),
    ],
)
def test_a_spring_that_stiffens_from_the_middle_is_no_end_stop(spring, form):
    campaign = bench(lambda x, v, a, i: 2e4 * x + 300 * v + 300 * spring(x / 0.02))
    diagnosis, names = named(campaign)
    assert names == ["outside_catalogue"] and diagnosis.causes[0].form == form
    assert diagnosis.error_after.held_out < 1.5 * diagnosis.noise_floor


def test_a_stop_on_one_side_is_a_stop():
    campaign = bench(lambda x, v, a, i: 2e4 * x + 300 * v + 1e5 * np.maximum(x - 0.013, 0))
    diagnosis, names = named(campaign)
    assert names == ["end_stop"] and diagnosis.causes[0].form == "two_gaps"
    assert diagnosis.causes[0].parameters["ahead"].value == pytest.approx(0.013, rel=0.02)


@pytest.mark.slow
def test_the_slope_beyond_a_knee_of_the_coil_is_measured():
    def field(current):
        return min(current, 0.6 + 0.4 * (current - 0.6))

    currents = (0.0, 0.3, 0.6, 0.9, 1.2, 1.5)
    campaign = bench(lambda x, v, a, i: (2e4 + 2e4 * field(i)) * x + 300 * v, currents, 0.002,
                     tests=TESTS[:3])  # fmt: skip
    diagnosis, names = named(campaign, current_degree=1)
    assert names == ["field_saturation"] and diagnosis.causes[0].form == "slope"
    assert diagnosis.causes[0].parameters["current"].value == pytest.approx(0.6, rel=0.1)
    assert diagnosis.causes[0].parameters["decrease"].value == pytest.approx(0.6, abs=0.1)


def test_nothing_is_missing_where_the_force_channel_filters_its_noise():
    sections = butter(4, 20.0 * 2 * DT, output="sos")
    clean = bench(lambda x, v, a, i: 2e4 * x + 300 * v, noise=0.0)
    random = np.random.default_rng(4)
    runs = []
    for run in clean.runs:
        noise = sosfilt(sections, random.standard_normal(len(run.time)))
        runs.append(replace(run, force=run.force + 1.5 * noise / np.std(noise)))
    diagnosis, names = named(replace(clean, runs=tuple(runs)))
    assert diagnosis.verdict == "adequate" and not names
    size = np.sqrt(np.mean(np.concatenate([run.force for run in clean.runs]) ** 2))
    assert diagnosis.noise_floor == pytest.approx(1.5 / size, rel=0.3)


@pytest.mark.slow
def test_a_small_cause_is_named_beside_one_that_fills_the_weak_runs():
    campaign = bench(lambda x, v, a, i: 2e4 * x + 300 * v + 6 * a + 40)
    diagnosis, names = named(campaign)
    assert sorted(names) == ["force_offset", "inertia_force"]
    assert diagnosis.error_after.held_out < 1.5 * diagnosis.noise_floor


def hysteretic(x, step):
    """Bouc-Wen model by Heun's rule, whose state is a share of a yield deformation."""
    v, z = np.gradient(x, step), np.zeros(len(x))

    def rate(z, v):
        return (v - 0.6 * abs(v) * z - 0.4 * v * abs(z)) / 2e-3

    for k in range(len(x) - 1):
        first = rate(z[k], v[k])
        z[k + 1] = z[k] + 0.5 * step * (first + rate(z[k] + step * first, v[k + 1]))
    return 2e4 * x + 300 * v + 150 * z, v


@pytest.mark.slow
def test_noise_of_a_device_that_is_held_does_not_let_it_relax():
    random = np.random.default_rng(2)
    motions = [
        (lambda t, size=size, f=f: size * np.sin(2 * np.pi * f * t), 6 / f) for size, f in TESTS
    ]
    motions += [
        (lambda t, to=to: np.interp(t, [1, 1.4, 8, 8.8, 9.2], [0, to, to, 0, -to / 2]), 16.0)
        for to in (0.008, 0.015, -0.01)
    ]
    runs = []
    for k, (motion, duration) in enumerate(motions):
        fine = np.arange(0, duration, DT / 20)
        force, v = hysteretic(motion(fine), fine[1])
        time, x, force, v = fine[::20], motion(fine[::20]), force[::20], v[::20]
        # a tenth of a percent of the stroke, half a percent of the largest speed
        runs.append(TestRun(
            f"run{k}", time, x + 1.5e-5 * random.standard_normal(len(x)),
            v + 5e-4 * random.standard_normal(len(x)),
            force + 1.5 * random.standard_normal(len(x)), 0 * x,
            hold_out=k in (2, 7), velocity_measured=True,
        ))  # fmt: skip
    diagnosis = diagnose(
        Campaign("held", "NumPy", tuple(runs)), "bouc_wen", tiers="causes", threads=1
    )
    assert diagnosis.verdict == "adequate" and not diagnosis.causes
    assert diagnosis.error_before.held_out < 0.015
