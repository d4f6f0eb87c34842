"""One specimen in a series of tests: what it has been through goes on from run to run."""

import numpy as np
import pytest

from isolation_sim.discrepancy.device.carried_history import (
    can_carry_history,
    carry_history,
    of_device,
)
from isolation_sim.discrepancy.device.effect_evaluation import evaluate
from isolation_sim.discrepancy.diagnose import diagnose
from isolation_sim.effects import EFFECTS, effect
from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.measured_runs import measured_runs
from isolation_sim.identification.run_table import TestRun

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
    dissipated = [C * np.sum(data.v[run] ** 2) * dt for run, dt in zip(data.runs, data.dt)]
    assert past.dissipated[1:] == pytest.approx(np.cumsum(dissipated)[:-1], rel=0.05)
    assert np.all(past.work >= past.dissipated)
    # runs that are held out have been made all the same
    fitted = data.without_held_out().past
    for some, every in zip(fitted, past, strict=True):
        assert some.tolist() == np.delete(every, [2, 5]).tolist()


def test_states_that_the_measured_history_tells_are_kept():
    names = {each.cause for forms in EFFECTS.values() for each in forms if can_carry_history(each)}
    assert names >= {"stress_softening", "cyclic_degradation", "magnetic_remanence"}
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


@pytest.mark.parametrize("keeps", [True, False])
def test_wear_is_named_whether_the_specimen_is_kept_or_new(keeps):
    found = diagnose(series(0.3, keeps), "kelvin_voigt", tiers="causes")
    (cause,) = found.causes
    assert cause.name == "cyclic_degradation" and cause.form.endswith("kept") == keeps
    assert found.verdict == "explained"
    assert cause.parameters["loss"].value == pytest.approx(0.3, rel=0.1)
    # the law that is written begins fresh
    assert [one.form for one in found.extended.law.effects] == [cause.form.removesuffix(", kept")]


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
        ("play, kept", lambda i, past: max(i - 0.4, min(max(past - 0.4, 0.0), 0.4))),
        ("largest, kept", lambda i, past: i + 0.5 * max(past - i, 0.0)),
    ],
)
def test_a_field_that_the_currents_of_earlier_runs_have_left_is_named(form, remembers):
    found = diagnose(magnetised(remembers), "kelvin_voigt", tiers="causes")
    (cause,) = found.causes
    assert (cause.name, cause.form) == ("magnetic_remanence", form)
    assert found.verdict == "explained"


def test_a_field_that_is_new_in_each_run_asks_for_no_memory():
    new = magnetised(lambda i, past: i + 0.5 * max(past - i, 0.0), keeps=False)
    assert diagnose(new, "kelvin_voigt", tiers="causes").causes == ()
