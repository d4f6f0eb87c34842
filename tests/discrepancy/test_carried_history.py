"""One specimen in a series of tests: what it has been through goes on from run to run."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from isolation_sim.discrepancy.device.carried_history import (
    can_carry_history,
    carry_history,
    of_device,
)
from isolation_sim.discrepancy.device.causes import lacks_history
from isolation_sim.discrepancy.device.effect_evaluation import evaluate
from isolation_sim.discrepancy.device.model import Model, fit_model
from isolation_sim.discrepancy.device.observable_effects import observable_effects
from isolation_sim.discrepancy.diagnose import diagnose
from isolation_sim.effects import EFFECTS, effect
from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.law_fit import parameterise
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.identification.measured_runs import measured_runs
from isolation_sim.laws import LAWS
from isolation_sim.laws import law as published

K, C = 60e3, 900.0


def series(loss, keeps=True):
    """Sinusoids of several amplitudes; a spring and dashpot that wear by the path travelled."""
    rng = np.random.default_rng(3)
    runs, travel = [], 0.0
    for k, (amplitude, frequency) in enumerate(
        [(2e-3, 1.0), (6e-3, 0.5), (4e-3, 2.0), (2e-3, 3.0), (6e-3, 1.0), (4e-3, 0.5), (2e-3, 1.0)]
    ):
        time = np.arange(0.0, 8.0, 0.01)
        ramp = np.minimum(time * frequency, 1.0)
        x = amplitude * ramp * np.sin(2 * np.pi * frequency * time)
        v = np.gradient(x, 0.01)
        path = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(x)))]) + (travel if keeps else 0.0)
        travel += float(np.sum(np.abs(np.diff(x))))
        force = (K * x + C * v) * (1 - loss * (1 - np.exp(-path / 0.4)))
        force = force + 0.004 * np.std(force) * rng.standard_normal(len(x))
        runs.append(TestRun(f"run_{k}", time, x, v, force, np.zeros_like(x), k in (2, 5)))
    return Campaign("series", "made", tuple(runs))


def test_the_past_is_that_of_all_earlier_runs():
    data = measured_runs(series(0.0).runs)
    past = data.past
    assert [one[0] for one in past] == [0.0] * len(past)
    assert past.deformation == pytest.approx([0, 2e-3, 6e-3, 6e-3, 6e-3, 6e-3, 6e-3], rel=1e-2)
    assert np.all(np.diff(past.travel) > 0)
    # of a spring and a dashpot, the work that is not given back is that of the dashpot
    dissipated = [
        C * np.sum(data.v[run] ** 2) * dt for run, dt in zip(data.runs, data.dt, strict=True)
    ]
    assert past.dissipated[1:] == pytest.approx(np.cumsum(dissipated)[:-1], rel=0.05)
    assert np.all(past.work >= past.dissipated)
    # 8 s at the frequencies of the runs
    assert past.cycles == pytest.approx([0, 8, 12, 28, 52, 60, 64], abs=3)
    # runs that are held out have been made all the same
    fitted = data.without_held_out().past
    for some, every in zip(fitted, past, strict=True):
        assert some.tolist() == np.delete(every, [2, 5]).tolist()


def test_states_that_the_measured_history_tells_are_retained():
    names = {each.cause for forms in EFFECTS.values() for each in forms if can_carry_history(each)}
    assert names >= {
        "stress_softening", "cyclic_degradation", "magnetic_remanence", "self_heating"
    }  # fmt: skip
    data = measured_runs(series(0.0).runs)
    wear = effect("cyclic_degradation")
    numbers = np.array([0.3, 0.4])
    fresh, going_on = (
        evaluate(one, data, data.force, numbers)["factor"] for one in (wear, carry_history(wear))
    )
    first = data.starts[:-1]
    assert fresh[first] == pytest.approx(1.0)
    assert going_on[first] == pytest.approx(1 - 0.3 * (1 - np.exp(-data.past.travel / 0.4)))
    assert of_device(carry_history(wear)) is wear and of_device(wear) is wear


@pytest.mark.parametrize("keeps", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_wear_is_named_whether_the_specimen_is_the_same_or_new(keeps):
    diagnosis = diagnose(series(0.3, keeps), "kelvin_voigt", tiers="causes")
    (cause,) = diagnosis.causes
    assert cause.name == "cyclic_degradation" and cause.form.endswith("kept") == keeps
    assert diagnosis.verdict == "explained"
    assert cause.parameters["loss"].value == pytest.approx(0.3, rel=0.1)
    # the law that is written begins fresh
    assert [one.form for one in diagnosis.extended.law.effects] == [
        cause.form.removesuffix(", kept")
    ]


@pytest.mark.parametrize("remembers", [True, False])
def test_a_softening_that_no_run_shows_to_come_only_acts_like_one(remembers):
    """A device that is soft in its middle, tested at its largest deformation first, has no past."""
    runs, largest = [], 0.0
    for k, amplitude in enumerate([2e-3, 4e-3, 6e-3] if remembers else [6e-3, 4e-3, 2e-3]):
        t = np.arange(0.0, 4.0, 0.01)
        x, v = amplitude * np.sin(2 * np.pi * t), 2 * np.pi * amplitude * np.cos(2 * np.pi * t)
        seen = np.maximum(np.maximum.accumulate(np.abs(x)), largest) if remembers else 6e-3
        largest = max(largest, amplitude)
        force = (K * x + C * v) * (1 - 0.3 * np.tanh((seen - np.abs(x)) / 10e-3))
        force = force + 0.004 * np.std(force) * np.random.default_rng(k).standard_normal(len(x))
        runs.append(TestRun(f"run_{k}", t, x, v, force, np.zeros_like(x)))
    campaign = Campaign("soft", "made", tuple(runs))
    data = measured_runs(campaign.runs)
    law = Model(data, parameterise(campaign, LAWS["kelvin_voigt"], data))
    values = law.parameterisation.of(published("kelvin_voigt", {"k": K, "c": C}))
    soft = law.with_effects(carry_history(effect("stress_softening")))
    fitted = fit_model(soft, np.array([*values, 0.3, 10e-3]), 50)
    assert lacks_history(fitted, 0) == (not remembers)


def test_wear_by_cycles_is_told_from_wear_by_the_path():
    """Amplitudes differ; the cycles are counted at the reversals, and in steps."""
    rng = np.random.default_rng(5)
    runs, cycles = [], 0.0
    for k in range(10):
        amplitude, frequency = rng.uniform(2e-3, 10e-3), rng.uniform(0.3, 3.0)
        time = np.arange(0.0, 9.0 / frequency, 0.01)
        x = amplitude * np.sin(2 * np.pi * frequency * time)
        v = np.gradient(x, 0.01)
        turns = np.concatenate([[False], np.diff(np.sign(v)) != 0])
        count = cycles + 0.5 * np.cumsum(turns)
        cycles = count[-1]
        force = (K * x + C * v) / (1 + 0.1 * np.log(1 + count / 2))
        force = force + 0.004 * np.std(force) * rng.standard_normal(len(x))
        runs.append(TestRun(f"run_{k}", time, x, v, force, np.zeros_like(x), k in (3, 6)))
    diagnosis = diagnose(Campaign("cycles", "made", tuple(runs)), "kelvin_voigt", tiers="causes")
    (cause,) = diagnosis.causes
    assert cause.name == "cyclic_degradation" and cause.form == "cycles_logarithmic, kept"
    assert cause.parameters["loss"].value == pytest.approx(0.1, rel=0.1)
    assert cause.parameters["width"].value < 4e-3


def magnetised(remembers, keeps=True):
    """Runs of one spring and dashpot whose field remembers larger currents, by what it is told."""
    rng = np.random.default_rng(4)
    runs, before = [], 0.0
    for k, current in enumerate([0.0, 0.5, 2.0, 0.0, 1.0, 0.5, 2.0, 0.0, 1.0, 0.5]):
        time = np.arange(0.0, 4.0, 0.01)
        x = 4e-3 * np.minimum(time, 1.0) * np.sin(2 * np.pi * (1 + k % 3) * time)
        v = np.gradient(x, 0.01)
        field = remembers(current, before)
        before = max(before, current) if keeps else 0.0
        force = (K + 0.3 * K * field) * x + (C + 0.5 * C * field) * v
        force = force + 0.004 * np.std(force) * rng.standard_normal(len(x))
        runs.append(TestRun(f"run_{k}", time, x, v, force, np.full_like(x, current), k in (4, 7)))
    return Campaign("magnetised", "made", tuple(runs))


@pytest.mark.parametrize(
    ("form", "remembers"),
    [
        # dragged along 0.4 A behind the current, and left within 0.4 A of none
        pytest.param(
            "play, kept",
            lambda i, past: max(i - 0.4, min(max(past - 0.4, 0.0), 0.4)),
            marks=pytest.mark.slow,
        ),
        ("largest, kept", lambda i, past: i + 0.5 * max(past - i, 0.0)),
    ],
)
def test_a_field_that_the_currents_of_earlier_runs_have_left_is_named(form, remembers):
    diagnosis = diagnose(magnetised(remembers), "kelvin_voigt", tiers="causes")
    (cause,) = diagnosis.causes
    assert (cause.name, cause.form) == ("magnetic_remanence", form)
    assert diagnosis.verdict == "explained"


def test_a_field_that_is_new_in_each_run_asks_for_no_memory():
    new = magnetised(lambda i, past: i + 0.5 * max(past - i, 0.0), keeps=False)
    assert diagnose(new, "kelvin_voigt", tiers="causes").causes == ()


GAIN, COOLING = 0.03, 30.0
RESTS = (20.0, 600.0, 5.0, 60.0, 10.0, 10.0, 120.0, 5.0, 40.0)


@cache
def warming(rubber=0.0):
    """Runs of a spring and dashpot that its dissipation warms, and that cools in the rests.

    ``rubber`` is the part of the spring's stiffness that stays as it is, N/m.
    """
    rng, dt = np.random.default_rng(7), 0.02
    runs, starts, warmth = [], [], 0.0
    for k, rest in enumerate(RESTS):
        time = np.arange(0.0, 8.0, dt)
        w = 2 * np.pi * (1 + k % 3)
        x = (3e-3, 6e-3)[k % 2] * np.minimum(time, 1.0) * np.sin(w * time)
        v = np.gradient(x, dt)
        starts.append(warmth)
        force = np.empty_like(x)
        for i in range(len(x)):
            weak = ((K - rubber) * x[i] + C * v[i]) * np.exp(-max(warmth, 0.0))
            force[i] = rubber * x[i] + weak
            warmth += dt * (GAIN * weak * v[i] - warmth / COOLING)
        warmth = max(warmth, 0.0) * np.exp(-rest / COOLING)
        force = force + 0.004 * np.std(force) * rng.standard_normal(len(x))
        runs.append(TestRun(f"run_{k}", time, x, v, force, np.zeros_like(x), k in (4, 7)))
    return Campaign("warming", "made", tuple(runs)), np.array(starts)


def test_the_warmth_that_rests_have_left_follows_from_each_run():
    campaign, starts = warming()
    heating, numbers = carry_history(effect("self_heating")), np.array([GAIN, COOLING])
    every = measured_runs(campaign.runs)
    # of fewer runs, those between have warmed the device all the same
    for data, expected in ((every, starts), (every.without_held_out(), np.delete(starts, [4, 7]))):
        law = K * data.x + C * data.v
        factor = evaluate(heating, data, law, numbers)["factor"]
        assert law * factor == pytest.approx(data.force, abs=0.05 * np.std(data.force))
        computed = -np.log(factor[data.starts[:-1]])
        assert max(expected) > 0.1
        assert computed == pytest.approx(expected, abs=0.02 * max(expected))


def test_the_warmth_of_a_core_beside_rubber_follows_from_each_run():
    rubber = 0.9 * K
    campaign, starts = warming(rubber)
    core, numbers = carry_history(effect("self_heating", "core")), np.array([GAIN, COOLING, rubber])
    data = measured_runs(campaign.runs)
    law = K * data.x + C * data.v
    added = evaluate(core, data, law, numbers)["force"]
    assert law + added == pytest.approx(data.force, abs=0.05 * np.std(data.force))
    # what is left of the core's force tells the warmth, in the first half second of motion
    part, weak = law - rubber * data.x, law + added - rubber * data.x
    for run, expected in zip(data.runs, starts, strict=True):
        moving = slice(run.start + 5, run.start + 25)
        left = (weak[moving] @ part[moving]) / (part[moving] @ part[moving])
        assert -np.log(left) == pytest.approx(expected, abs=0.05 * max(starts))
    # neither a run without force nor a law that diverges in one ends the search
    law[data.runs[2]], law[data.runs[3]] = 0.0, np.nan
    assert np.isfinite(evaluate(core, data, law, numbers)["force"][data.runs[1]]).all()


@pytest.mark.parametrize("first", [0, 1])
def test_the_warmth_is_found_beside_what_other_effects_do(first):
    campaign, _ = warming()
    level, loss, half = 60.0, 0.3, 4e-3
    runs = []
    for run in campaign.runs:
        softer = 1 - loss * np.abs(run.displacement) / (half + np.abs(run.displacement))
        rubbing = level * np.tanh(run.velocity / 2e-3)
        runs.append(replace(run, force=run.force * softer + rubbing))
    data = measured_runs(runs)
    heating = carry_history(effect("self_heating"))
    others = effect("coulomb_friction"), effect("amplitude_softening", "instantaneous")
    numbers = (GAIN, COOLING), (level, 2e-3), (loss, half, 1.0)
    order = np.roll([0, 1, 2], first)
    effects = [(heating, *others)[k] for k in order]
    model = Model(data, parameterise(campaign, LAWS["kelvin_voigt"], data)).with_effects(*effects)
    values = np.concatenate([[K, C], *(numbers[k] for k in order)])
    for derivatives in (False, True):
        force, _ = model.forces(values, derivatives)
        assert force == pytest.approx(data.force, abs=0.05 * np.std(data.force))


def test_no_run_begins_warmer_than_the_one_before_has_ended():
    campaign, _ = warming()
    heating, numbers = carry_history(effect("self_heating")), np.array([GAIN, COOLING])
    data = measured_runs(campaign.runs)
    # a law that is too strong asks for warmth from the start
    law = 1.3 * (K * data.x + C * data.v)
    warmth = -np.log(evaluate(heating, data, law, numbers)["factor"])
    assert warmth[0] == 0
    assert np.all(warmth[data.starts[1:-1]] <= warmth[data.starts[1:-1] - 1] + 1e-3)


@pytest.mark.slow
@pytest.mark.usefixtures("few_effects", "few_laws")
def test_heating_is_named_although_the_rests_are_unknown():
    diagnosis = diagnose(warming()[0], "kelvin_voigt", tiers="causes")
    (cause,) = diagnosis.causes
    assert (cause.name, cause.form) == ("self_heating", "exponential, kept")
    assert cause.parameters["gain"].value == pytest.approx(GAIN, rel=0.15)
    assert "follows from the forces of the run" in cause.reason
    assert diagnosis.verdict == "explained"


@pytest.mark.parametrize(
    ("currents", "seen"),
    [
        ([(0, 0), (1, 1), (2, 2), (2, 2)], set()),
        ([(0, 0), (2, 2), (1, 1), (2, 2)], {"largest, kept", "play, kept"}),
        ([(0, 0), (1, 1), (2, 2), (0, 2)], {"fading", "largest", "play", "preisach", "settled"}),
    ],
)
def test_remanence_needs_a_current_that_changes(currents, seen):
    runs = []
    for run, (first, last) in zip(series(0.0).runs, currents, strict=False):
        current = np.linspace(first, last, len(run.time))
        runs.append(TestRun(run.name, run.time, run.displacement, run.velocity, run.force, current))
    effects = observable_effects(measured_runs(runs))
    remanence = {one.form for one in effects if one.cause == "magnetic_remanence"}
    assert seen <= remanence and (seen or not remanence)
    assert any(one.cause == "current_lag" for one in effects) == (currents[-1] == (0, 2))
    assert any(one.cause == "field_saturation" for one in effects)
