"""What is wrong in measured data is said, and nothing where nothing is wrong.

The device is a yielding spring beside a dashpot, integrated by SciPy; it starts at rest, unloaded.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import butter, lfilter, sosfiltfilt

from isolation_sim.errors import InputError
from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.error_notes import outlier_note
from isolation_sim.identification.fit import fit
from isolation_sim.identification.fitted import RunError
from isolation_sim.identification.measured.channel_checks import clipped
from isolation_sim.identification.measured.data_checks import data_notes, refuse_swapped
from isolation_sim.identification.measured.run_table import TestRun

N, DT = 1600, 0.005
TIME = DT * np.arange(N)


def made(name, size, frequency, seed, current=0.0):
    omega = 2 * np.pi * frequency

    def rate(t, z):
        v = size * omega * np.cos(omega * t)
        return v * (1 - (np.sign(v * z) * 0.5 + 0.5) * np.abs(z / 2e-3) ** 2)

    z = solve_ivp(rate, (0, TIME[-1]), [0.0], t_eval=TIME, max_step=DT).y[0]
    x, v = size * np.sin(omega * TIME), size * omega * np.cos(omega * TIME)
    force = 8e3 * x + 3e4 * (1 + current) * z + 200.0 * v
    random = np.random.default_rng(seed)

    def noisy(y):
        return y + 0.005 * np.std(y) * random.standard_normal(N)

    return TestRun(
        name, TIME, noisy(x), noisy(v), noisy(force), np.full(N, current),
        acceleration=noisy(-(omega**2) * x), velocity_measured=True,
    )  # fmt: skip


@pytest.fixture(scope="module")
def runs():
    return (
        made("first", 5e-3, 0.5, 0), made("second", 8e-3, 1.0, 1), made("third", 8e-3, 0.5, 2),
        made("fourth", 8e-3, 0.5, 3, current=1.0), made("again", 5e-3, 0.5, 4),
    )  # fmt: skip


def late(values, delay):
    return np.interp(TIME - delay, TIME, values)


def filtered(values):
    """A zero-phase filter that takes an offset and a trend away, as one does with a load cell."""
    return sosfiltfilt(butter(2, 0.15, "highpass", fs=1 / DT, output="sos"), values + 300.0)


def one(change):
    return lambda runs: (*runs[:1], replace(runs[1], **change(runs[1])), *runs[2:])


def each(change):
    return lambda runs: tuple(replace(run, **change(run)) for run in runs)


WRONG = {
    "turned sign": (
        each(lambda r: {"force": -r.force}), "all runs: the loops run the wrong way round"),
    "one turned sign": (
        one(lambda r: {"force": -r.force}), "second: the loops run the wrong way round"),
    "one turned sign without damping": (
        lambda runs: one(lambda r: {"force": -r.force})(
            each(lambda r: {"force": 5e4 * r.displacement})(runs)),
        "second: the stiffness is negative, and that of the other tests is not"),
    "filter": (each(lambda r: {"force": filtered(r.force)}), "transients of a zero-phase filter"),
    "late velocity": (
        one(lambda r: {"velocity": late(r.velocity, 0.012)}),
        "second: velocity is 12 ms behind the displacement: channels shifted in time"),
    "early acceleration": (
        one(lambda r: {"acceleration": late(r.acceleration, -0.01)}),
        "second: acceleration is 10 ms ahead of the displacement: channels shifted"),
    "clipped force": (
        one(lambda r: {"force": np.clip(r.force, -80.0, 80.0)}), "second: force stands still"),
    "few bits": (
        one(lambda r: {"force": 10.0 * np.round(r.force / 10.0)}), "second: force has steps of"),
    "offset": (
        one(lambda r: {"force": r.force + 30.0}), "second: the force's mean is up to"),
    "acceleration in g": (
        one(lambda r: {"acceleration": r.acceleration / 9.80665}),
        "second: acceleration is 1/9.81 times"),
    "force in kN": (
        one(lambda r: {"force": r.force / 1000.0}), "second: force over displacement is 0.000"),
    "milliamperes": (
        lambda runs: (*runs[:3], replace(runs[3], current=1e3 * runs[3].current), runs[4]),
        "fourth: current reaches 1e+03 A, in the other runs 0 A; is its unit right?"),
    "milliseconds": (
        each(lambda r: {"time": 1e3 * r.time, "velocity": r.velocity / 1e3,
                        "acceleration": r.acceleration / 1e6}),
        "all runs: a sample every 5 s; is the unit of the time right?"),
    "all forces too small": (each(lambda r: {"force": r.force / 1e3}), "all forces are below 1 N"),
    "kilograms": (
        lambda runs: (*runs[:4], replace(runs[4], force=runs[4].force / 9.80665)),
        "again: force is 1/9.81 times that of first under the same motion"),
    "velocity of something else": (
        one(lambda r: {"velocity": r.velocity + 0.03 * np.sin(31 * TIME)}),
        "second: velocity is not the displacement's derivative"),
    "velocity too large": (
        one(lambda r: {"velocity": 1.2 * r.velocity}), "second: velocity is 1.2 times"),
    "drift": (
        one(lambda r: {"force": r.force + 80.0 * (TIME / TIME[-1] - 0.5)}),
        "second: the force's middle moves by"),
    "repeats disagree": (
        lambda runs: (*runs[:4], replace(runs[4], force=0.9 * runs[4].force)),
        "first and again repeat one motion and current, but their forces differ by 1"),
}  # fmt: skip


def test_nothing_is_said_of_data_in_which_nothing_is_wrong(runs):
    assert data_notes(runs, np.zeros(len(runs))) == []


@pytest.mark.parametrize("seed", range(40))
def test_random_motion_has_no_steady_middle_that_could_drift(seed):
    random = np.random.default_rng(seed)
    frequencies = np.array([0.4, 0.7, 1.1, 1.6, 2.3])
    x = np.sin(2 * np.pi * np.outer(TIME, frequencies) + random.uniform(0, 6.28, 5)).sum(axis=1)
    v = np.gradient(x, DT)
    random_motion = TestRun("random", TIME, 2e-3 * x, 2e-3 * v, 16.0 * x + v, np.zeros(N))
    assert not any("middle" in note for note in data_notes([random_motion], np.zeros(1)))


def test_runs_at_other_temperatures_do_not_repeat_each_other(runs):
    cold = replace(runs[4], force=0.9 * runs[4].force, temperature=np.full(len(TIME), -10.0))
    warm = [replace(one, temperature=np.full(len(TIME), 20.0)) for one in runs[:4]]
    assert data_notes([*warm, cold], np.zeros(5)) == []


def test_pairs_of_repeated_runs_that_differ_are_one_note(runs):
    again = [replace(runs[0], name=f"again {k}", force=0.9 * runs[0].force) for k in range(6)]
    (note,) = data_notes([*runs[:4], *again], np.zeros(10))
    assert note.startswith("first and again 0; first and again 1; ")
    assert "; 2 more pairs repeat one motion and current" in note and "by up to 1" in note
    assert "without a memory of earlier tests no law" in note


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_said(name, runs):
    change, said = WRONG[name]
    changed = change(runs)
    notes = data_notes(changed, np.zeros(len(changed)))
    assert len(notes) == 1 and said in notes[0], notes


def test_a_current_that_changes_with_the_motion_is_no_offset():
    runs = [made(f"run{k}", 0.02, 0.5 + 0.1 * k, k) for k in range(4)]
    # full current in one direction of the motion alone
    force = runs[0].force + 150.0 * (runs[0].displacement > 0) * runs[0].displacement / 0.02
    one = replace(runs[0], current=1.0 * (runs[0].displacement > 0), force=force)
    assert not any("offset" in note for note in data_notes([one, *runs[1:]], np.zeros(4)))


def test_a_force_that_switches_with_the_motion_is_no_offset():
    """A yield force that follows a switched coil late, at one place of every cycle."""
    runs = [made(f"run{k}", 0.02, 0.5 + 0.1 * k, k) for k in range(4)]
    current = 1.0 * (np.sin(2 * np.pi * 0.5 * TIME + 0.6) > 0)
    field = lfilter([DT / 0.1], [1, DT / 0.1 - 1], current)
    force = runs[0].force + 150.0 * field * np.tanh(runs[0].velocity / 0.002)
    one = replace(runs[0], current=current, force=force)
    assert not any("offset" in note for note in data_notes([one, *runs[1:]], np.zeros(4)))


def test_a_motion_that_begins_and_ends_gently_has_no_transients_of_a_filter():
    """Friction of 2 mm of presliding is another one at small amplitude."""
    omega, rise = 2 * np.pi * 2.0, np.clip(np.minimum(TIME, TIME[-1] - TIME) / 0.4, 0, 1)
    x = 0.02 * rise * np.sin(omega * TIME)
    friction = np.zeros(N)
    for k in range(1, N):
        friction[k] = np.clip(friction[k - 1] + 1e5 * (x[k] - x[k - 1]), -200.0, 200.0)
    run = TestRun("gentle", TIME, x, np.gradient(x, DT), friction, np.zeros(N))
    assert not any("transients" in note for note in data_notes([run], np.zeros(1)))


def test_a_few_cycles_of_growing_amplitude_are_no_offset(runs):
    # of one and a half cycles of friction a static function follows one direction better
    omega, size = 2 * np.pi * 0.2, 8e-3 * TIME / TIME[-1]
    x = size * np.sin(omega * TIME)
    v = size / np.maximum(TIME, DT) * np.sin(omega * TIME) + size * omega * np.cos(omega * TIME)
    friction = np.zeros(N)
    for k in range(1, N):
        friction[k] = np.clip(friction[k - 1] + 1e5 * (x[k] - x[k - 1]), -60.0, 60.0)
    grown = TestRun("growing", TIME, x, v, friction + 20.0 * v, np.zeros(N))
    assert not any("offset" in note for note in data_notes([grown, *runs], np.zeros(len(runs) + 1)))


def test_a_force_that_a_device_holds_at_rest_is_no_offset():
    runs = [made(f"run{k}", 0.02, 0.5 + 0.1 * k, k) for k in range(4)]
    moving = np.arange(N) < N // 4
    one = replace(
        runs[0],
        displacement=np.where(moving, runs[0].displacement, runs[0].displacement[N // 4]),
        velocity=runs[0].velocity * moving,
        force=np.where(moving, runs[0].force, runs[0].force[N // 4 - 30 : N // 4].max()),
    )
    notes = data_notes([one, *runs[1:]], np.zeros(4))
    assert not any("offset" in note for note in notes), notes


@pytest.mark.parametrize("held", [True, False])
def test_a_deformation_that_is_held_is_not_clipped(held):
    """A relaxation test, and a transducer at its limit: behind it the motion goes on."""
    x = 0.01 * np.sin(2 * np.pi * 0.5 * TIME)
    true, recorded = (np.clip(x, -0.007, 0.007),) * 2 if held else (x, np.clip(x, -0.007, 0.007))
    rate = np.gradient(true, DT)
    relaxing = lfilter([1.0], [1, -np.exp(-DT / 0.15)], rate) * DT
    noise = np.random.default_rng(5).standard_normal(N)
    force = 2e4 * true + 1e4 * relaxing + noise
    run = TestRun("one", TIME, recorded, rate, force, np.zeros(N), velocity_measured=True)
    notes = data_notes([run], np.zeros(1))
    assert any("clipped" in note for note in notes) is not held, notes


@pytest.mark.parametrize("limit", [None, 0.9])
def test_the_flat_peaks_of_a_rounded_channel_are_not_clipped(limit):
    time = np.arange(0, 4, 0.002)
    force = 800 * np.sin(2 * np.pi * time) + 100 * np.cos(2 * np.pi * time)
    if limit:
        force = np.clip(force, -limit * 800, limit * 800)
    rounded = np.round(force * 4096 / 4000) * 4000 / 4096
    assert bool(clipped(rounded)) is bool(limit)


def test_a_ramp_is_not_coarsely_quantised():
    ramp = np.tile(np.r_[np.arange(50), np.arange(50, 0, -1)], 16) * 2e-3
    run = TestRun("ramp", TIME, ramp, np.gradient(ramp, DT), 1e4 * ramp, np.zeros(N))
    sine = 1e-3 * np.round(20 * np.sin(2 * np.pi * 0.5 * TIME))
    coarse = replace(run, displacement=sine, name="sine")
    assert [note for note in data_notes([run], np.zeros(1)) if "coarsely" in note] == []
    assert any("coarsely" in note for note in data_notes([coarse], np.zeros(1)))


@pytest.mark.parametrize("unit", [1.0, 1e3, 1e6])
def test_swapped_columns_are_refused(unit, runs):
    refuse_swapped(runs)
    x = runs[1].force / unit
    swapped = {"displacement": x, "velocity": np.gradient(x, DT)}
    swapped |= {"force": unit * runs[1].displacement}
    with pytest.raises(InputError, match="second: displacement and force look swapped"):
        fit(Campaign("one", "", one(lambda r: swapped)(runs)), "kelvin_voigt")


@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_units_that_are_wrong_are_no_swapped_columns(factor, runs):
    for names in (("force",), ("displacement", "velocity")):
        refuse_swapped(one(lambda r, n=names: {k: factor * getattr(r, k) for k in n})(runs))


def test_a_run_that_alone_makes_the_misfit_is_named(runs):
    right = [RunError(run, 0.98 * run.force) for run in runs]
    assert outlier_note(right) == ""
    turned = RunError(replace(runs[2], force=-runs[2].force), 0.98 * runs[2].force)
    note = outlier_note([*right[:2], turned, *right[3:]])
    assert note.startswith("third alone makes 100 % of the squared misfit: its error is 198 %")
    assert note.endswith("Check its signs, units and channels first, or leave it out")


@pytest.mark.parametrize(
    ("held_out", "advice"), [(True, "It was not fitted"), (False, "Compare its amplitude")]
)
def test_an_error_that_no_wrong_sign_makes_is_told_so(runs, held_out, advice):
    right = [RunError(run, 0.998 * run.force) for run in runs]
    worse = RunError(replace(runs[2], hold_out=held_out), 0.9 * runs[2].force)
    assert advice in outlier_note([*right[:2], worse, *right[3:]])


def test_a_fit_says_what_is_wrong_in_the_data(runs):
    turned = one(lambda r: {"force": -r.force})(runs)
    notes = fit(Campaign("one", "", turned), "kelvin_voigt", starts=2).notes
    assert "second: the loops run the wrong way round" in notes[0]


@pytest.mark.parametrize(("rate", "noted"), [(100, True), (1000, False)])
def test_a_motion_that_reaches_the_highest_frequencies_is_said(rate, noted):
    """Random motion of a power that falls from 2 Hz on, sampled slowly and fast."""
    n, random = 40 * rate, np.random.default_rng(0)
    frequency = np.fft.rfftfreq(n, 1 / rate)
    spectrum = random.standard_normal(frequency.size) + 1j * random.standard_normal(frequency.size)
    x = np.fft.irfft(spectrum / (1 + (frequency / 2) ** 2.5), n)
    x *= 5e-3 / np.std(x)
    time, still = np.arange(n) / rate, np.zeros(n)
    x += 1e-6 * random.standard_normal(n)
    v = np.gradient(x, 1 / rate)
    one = TestRun("random", time, x, v, 8e3 * x + 50.0 * v, still, acceleration=still)
    notes = " ".join(data_notes([one], np.zeros(1)))
    assert ("highest frequencies that 100 samples a second show" in notes) == noted
